"""Largest matching near a start: Edmonds' blossom algorithm on a patch of the graph.

Edmonds, Paths, trees, and flowers, Canad. J. Math. 17 (1965) 449-467. In the mesher the vertices
are triangles and a matched edge is a quadrilateral; the search stops after `reach` vertices,
which keeps it local and its cost constant.
"""

from collections import deque
from dataclasses import dataclass, field


@dataclass
class _Search:
    """Alternating tree from one unmatched vertex."""

    root: int
    near: list[list[int]]
    mate: dict[int, int]
    parent: dict[int, int] = field(default_factory=dict)
    base: dict[int, int] = field(default_factory=dict)
    even: set[int] = field(default_factory=set)
    queue: deque[int] = field(default_factory=deque)

    def base_of(self, v: int) -> int:
        return self.base.get(v, v)

    def reach_even(self, v: int) -> None:
        if v not in self.even:
            self.even.add(v)
            self.queue.append(v)

    def common(self, a: int, b: int) -> int:
        """Lowest vertex of the tree above both a and b."""
        above = set()
        while True:
            a = self.base_of(a)
            above.add(a)
            if a == self.root:
                break
            a = self.parent[self.mate[a]]
        while self.base_of(b) not in above:
            b = self.parent[self.mate[self.base_of(b)]]
        return self.base_of(b)

    def mark(self, v: int, stem: int, child: int, flower: set[int]) -> None:
        """Walk from v down to the stem and let both directions of the cycle lead back."""
        while self.base_of(v) != stem:
            flower |= {self.base_of(v), self.base_of(self.mate[v])}
            self.parent[v] = child
            child = self.mate[v]
            v = self.parent[child]

    def shrink(self, v: int, u: int) -> None:
        """Contract the odd cycle closed by the edge v-u."""
        stem, flower = self.common(v, u), set[int]()
        self.mark(v, stem, u, flower)
        self.mark(u, stem, v, flower)
        for w in {self.root, *self.even, *self.parent}:
            if self.base_of(w) in flower:
                self.base[w] = stem
                self.reach_even(w)

    def run(self, reach: int) -> int | None:
        """The unmatched vertex at the other end of an augmenting path, or None."""
        self.reach_even(self.root)
        while self.queue and len(self.parent) < reach:
            v = self.queue.popleft()
            for u in self.near[v]:
                if self.base_of(u) == self.base_of(v) or self.mate.get(v) == u:
                    continue
                if u in self.even:
                    self.shrink(v, u)
                elif u not in self.parent:
                    self.parent[u] = v
                    if u not in self.mate:
                        return u
                    self.reach_even(self.mate[u])
        return None


def augment(root: int, near: list[list[int]], mate: dict[int, int], reach: int = 400) -> bool:
    """Match the unmatched `root` with another unmatched vertex by flipping one augmenting path.

    >>> mate = {1: 2, 2: 1}
    >>> augment(0, [[1], [0, 2], [1, 3], [2]], mate), mate
    (True, {1: 0, 2: 3, 3: 2, 0: 1})
    """
    search = _Search(root, near, mate)
    end = search.run(reach)
    if end is None:
        return False
    v: int | None = end
    while v is not None:
        before = search.parent[v]
        following = mate.get(before)
        mate[v], mate[before] = before, v
        v = following
    return True
