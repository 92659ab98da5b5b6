"""Nodes, elements, sets and surfaces of an input file, in numbers that are unique in the deck."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from ...errors import did_you_mean
from .element_types import faces_of, nodes_of
from .keywords import Keyword

Face = tuple[list[int], list[int]]  # corners, nodes on edges


@dataclass(eq=False)
class NumberedItems:
    """Nodes, or elements: their numbers in the deck by instance and number, and their sets."""

    noun: str  # in sentences
    ids: dict[tuple[str, int], int] = field(default_factory=dict)
    sets: dict[str, list[int]] = field(default_factory=dict)
    _shifts: dict[str, int] = field(default_factory=dict)
    _largest: int = 0

    def add(self, key: Keyword, number: int) -> int:
        """The number in the deck: its own in the first instance, a larger one in others."""
        if key.scope not in self._shifts:
            unit = 10 ** (len(str(self._largest)) - 1)
            self._shifts[key.scope] = -(-self._largest // unit) * unit if self._shifts else 0
        id = self.ids[key.scope, number] = number + self._shifts[key.scope]
        self._largest = max(self._largest, id)
        return id

    def own_set(self, key: Keyword, name: str) -> list[int]:
        """The set of this name, which may still grow."""
        return self.sets.setdefault(full_name(key.scope, name), [])

    def gather(self, key: Keyword, name: str) -> None:
        """Add the data lines of a set: numbers, names of sets, or first, last and step."""
        own = self.own_set(key, name)
        scope = key.words.get("INSTANCE", key.scope).lower()
        for row, cells in enumerate(key.rows):
            if "GENERATE" in key.words:
                first, last, step = (int(key.real(row, k, 1.0)) for k in range(3))
                run = ((scope, n) for n in range(first, last + 1, max(step, 1)))
                own += [self.ids[one] for one in run if one in self.ids]
            else:
                own += [id for cell in cells if cell for id in self.pick(key, cell, row)]

    def pick(self, key: Keyword, word: str, row: int = -1) -> list[int]:
        """The items that a number or the name of a set stands for."""
        scope, name = key.words.get("INSTANCE", key.scope).lower(), word.strip("\"'").lower()
        head, dot, rest = name.rpartition(".")
        if dot and head in self._shifts:
            scope, name = head, rest
        if name.isdecimal():
            if (id := self.ids.get((scope, int(name)))) is None:
                raise key.fault(f"there is no {self.noun} {word}", row)
            return [id]
        found = self.sets.get(full_name(scope, name), self.sets.get(name))
        if found is None:
            hint = did_you_mean(name, self.sets).strip()
            raise key.fault(f"there is no {self.noun} set {word!r}; {hint}".rstrip("; "), row)
        return found


def full_name(scope: str, name: str) -> str:
    """Name of a set or surface within an instance, in lower case."""
    return f"{scope}.{name}".lower() if scope else name.lower()


@dataclass(eq=False)
class AbaqusMesh:
    """Nodes and elements of all instances."""

    nodes: NumberedItems = field(default_factory=lambda: NumberedItems("node"))
    elements: NumberedItems = field(default_factory=lambda: NumberedItems("element"))
    places: dict[int, np.ndarray] = field(default_factory=dict)  # by node
    shapes: dict[int, tuple[str, list[int]]] = field(default_factory=dict)  # type and nodes
    surfaces: dict[str, list[Keyword]] = field(default_factory=dict)

    def read(self, key: Keyword) -> bool:
        """Take in a keyword; False where it is of another kind."""
        if key.name == "NODE":
            self._read_nodes(key)
        elif key.name == "ELEMENT":
            self._read_elements(key)
        elif key.name == "NSET" and key.words.get("ELSET"):
            ids = self.elements.pick(key, key.words["ELSET"])
            every = (n for id in ids for n in self.shapes[id][1])
            self.nodes.own_set(key, key.word("NSET")).extend(dict.fromkeys(every))
        elif key.name == "NSET":
            self.nodes.gather(key, key.word("NSET"))
        elif key.name == "ELSET":
            self.elements.gather(key, key.word("ELSET"))
        elif key.name == "SURFACE":
            self.surfaces.setdefault(full_name(key.scope, key.word("NAME")), []).append(key)
        elif key.name in ("NGEN", "NFILL", "ELGEN", "NCOPY", "ELCOPY"):
            raise key.fault("generated meshes are not read; write the nodes and elements out")
        else:
            return False
        return True

    def _read_nodes(self, key: Keyword) -> None:
        if key.words.get("SYSTEM", "R").upper() != "R":
            raise key.fault("SYSTEM is not R; write the nodes in rectangular coordinates")
        own = self.nodes.own_set(key, key.words["NSET"]) if key.words.get("NSET") else []
        for row in range(len(key.rows)):
            id = self.nodes.add(key, int(key.real(row, 0)))
            x = np.array([key.real(row, k, 0.0) for k in (1, 2, 3)])
            self.places[id] = x if key.place is None else key.place.moved(x[None])[0]
            own.append(id)

    def _read_elements(self, key: Keyword) -> None:
        """An element goes on in the next line until it has its nodes."""
        kind = key.word("TYPE").upper()
        own = self.elements.own_set(key, key.words["ELSET"]) if key.words.get("ELSET") else []
        size, cells = nodes_of(kind), list[tuple[int, str]]()
        for row, line in enumerate(key.rows):
            cells += [(row, cell) for cell in line if cell]
            size = size or len(cells) - 1
            while len(cells) > size:
                (at, number), *rest = cells[: size + 1]
                cells = cells[size + 1 :]
                if not number.isdecimal():
                    raise key.fault(f"{number!r} is not the number of an element", at)
                id = self.elements.add(key, int(number))
                self.shapes[id] = (kind, [self.nodes.pick(key, w, r)[0] for r, w in rest])
                own.append(id)
        if cells:
            raise key.fault(f"an element of the type {kind} has {size} nodes", cells[0][0])

    def faces(self, key: Keyword, name: str) -> list[Face] | None:
        """Faces of a surface of elements, single nodes as corners of one of nodes; None: unknown.

        A face between two elements of the surface is inside of it.
        """
        full = next(
            (f for f in (full_name(key.scope, name), name.lower()) if f in self.surfaces), ""
        )
        if not full:
            return None
        found = [face for one in self.surfaces[full] for face in self._faces_of(one)]
        count = Counter(tuple(sorted(corners)) for corners, _ in found)
        return [face for face in found if count[tuple(sorted(face[0]))] == 1 or len(face[0]) == 1]

    def group(self, key: Keyword, name: str, row: int = -1) -> list[int]:
        """All nodes of a surface, of a set of nodes, or the one with this number."""
        faces = self.faces(key, name)
        found = (
            self.nodes.pick(key, name, row)
            if faces is None
            else [n for f in faces for n in f[0] + f[1]]
        )
        return list(dict.fromkeys(found))

    def _faces_of(self, key: Keyword) -> Iterator[Face]:
        by_nodes = key.words.get("TYPE", "ELEMENT").upper() == "NODE"
        for row, cells in enumerate(key.rows):
            if by_nodes:
                yield from (([n], []) for n in self.nodes.pick(key, cells[0], row))
                continue
            for id in self.elements.pick(key, cells[0], row):
                kind, nodes = self.shapes[id]
                for corners, middle in faces_of(kind, key.cell(row, 1).upper()):
                    yield [nodes[k] for k in corners], [nodes[k] for k in middle]
