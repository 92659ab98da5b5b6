"""Shape functions, quadrature and internal strains of hexahedron, wedge, tetrahedron and pyramid.

Each may have nodes on its edges. A family is a set of monomials and the places of its nodes. Its
shape functions are the combinations of the monomials that are 1 at one node and 0 at the others.

Sources: Zienkiewicz, Taylor, The Finite Element Method 1 (serendipity functions); Bedrosian, Int.
J. Num. Meth. Eng. 35 (1992) 95-108 (rational functions of the pyramid); Andelfinger, Ramm, Int. J.
Num. Meth. Eng. 36 (1993) 1311-1337 (the 21 internal strains of the hexahedron).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

_CUBE = np.array(
    [
        [-1, -1, -1],
        [1, -1, -1],
        [1, 1, -1],
        [-1, 1, -1],
        [-1, -1, 1],
        [1, -1, 1],
        [1, 1, 1],
        [-1, 1, 1],
    ],
    dtype=float,
)
_PRISM = np.array([[0, 0, -1], [1, 0, -1], [0, 1, -1], [0, 0, 1], [1, 0, 1], [0, 1, 1]], float)
_TETRA = np.vstack([np.zeros(3), np.eye(3)])
_PYRAMID = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0], [0, 0, 1]], float)
_RING = ((0, 1), (1, 2), (2, 3), (3, 0))
EDGES = {  # ends of the edges in Nastran's order of mid-side nodes, by the number of corners
    8: (*_RING, *((k, k + 4) for k in range(4)), *((a + 4, b + 4) for a, b in _RING)),
    6: ((0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3)),
    5: (*_RING, *((k, 4) for k in range(4))),
    4: ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)),
}
CORNERS = {n + more: n for n, edges in EDGES.items() for more in (0, len(edges))}  # by all nodes
Rule = tuple[np.ndarray, np.ndarray]  # points (g, 3) and weights (g,)


@dataclass(frozen=True, eq=False)
class ShapeFamily:
    """One kind of element: monomials ξ^a η^b ζ^c / (1 - ζ)^d, nodes and quadrature."""

    powers: np.ndarray  # (k, 4) a, b, c, d
    nodes: np.ndarray  # (k, 3)
    rule: Rule  # of the stiffness
    mass_rule: Rule
    centre: np.ndarray
    enhanced: Callable[[np.ndarray], np.ndarray] | None = None
    shear_rule: Rule | None = None  # of the energy of shear, where it has a rule of its own
    combine: np.ndarray = field(init=False)  # (k, k) of the monomials to N

    def __post_init__(self) -> None:
        at_nodes = np.array([self._monomials(xi) for xi in self.nodes])
        object.__setattr__(self, "combine", np.linalg.inv(at_nodes))

    def values(self, xi: np.ndarray) -> np.ndarray:
        """N(ξ) (k,)."""
        return np.asarray(self._monomials(xi) @ self.combine)

    def gradients(self, xi: np.ndarray) -> np.ndarray:
        """dN/dξ (3, k)."""
        x = _with_inverse(xi)
        power = x**self.powers
        slope = self.powers * x ** np.maximum(self.powers - 1, 0)
        slope[:, 3] *= x[3] ** 2
        rest = [np.delete(power, k, axis=1).prod(axis=1) for k in range(4)]
        d = [slope[:, k] * rest[k] for k in range(4)]
        return np.stack([d[0], d[1], d[2] + d[3]]) @ self.combine

    def _monomials(self, xi: np.ndarray) -> np.ndarray:
        return np.asarray((_with_inverse(xi) ** self.powers).prod(axis=1))


def _with_inverse(xi: np.ndarray) -> np.ndarray:
    """(ξ, η, ζ, 1/(1 - ζ)); the last is 0 at an apex, where ξη/(1 - ζ) vanishes."""
    return np.append(xi, 0.0 if xi[2] == 1 else 1 / (1 - xi[2]))


def _hexa_enhanced(xi: np.ndarray) -> np.ndarray:
    """Strains (6, 21) along the element's axes, the nine of incompatible modes first.

    εξ gains ξ, then ξη and ξζ; γξη gains ξ and η, then ξζ and ηζ; the others follow cyclically.
    """
    cycle = ((0, 1, 2), (1, 2, 0), (2, 0, 1))
    linear = [(i, xi[i]) for i in range(3)]
    linear += [(3 + i, xi[k]) for i, j, _ in cycle for k in (i, j)]
    bilinear = [(i, xi[i] * xi[k]) for i, *others in cycle for k in others]
    bilinear += [(3 + i, xi[k] * xi[h]) for i, j, h in cycle for k in (i, j)]
    M = np.zeros((6, 21))
    for column, (row, value) in enumerate(linear + bilinear):
        M[row, column] = value
    return M


def _wedge_enhanced(xi: np.ndarray) -> np.ndarray:
    """Strains (6, 3): of one in-plane bubble Q = a² + ab + b² along ξ and along η, and εζ = ζ.

    a and b are ξ and η from the centroid; Q does not depend on the first corner.
    """
    a, b = xi[:2] - 1 / 3
    M = np.zeros((6, 3))
    M[0, 0] = M[3, 1] = 2 * a + b
    M[1, 1] = M[3, 0] = a + 2 * b
    M[2, 2] = xi[2]
    return M


def _powers(degree: int, allowed: Callable[[int, int, int], bool]) -> np.ndarray:
    """Exponents (k, 4) of the monomials in ξ, η, ζ up to ``degree`` in each that are allowed."""
    found = [e for e in product(range(degree + 1), repeat=3) if allowed(*e)]
    return np.array([(*e, 0) for e in found])


def _rational(*exponents: tuple[int, int]) -> np.ndarray:
    """Exponents of ξ^a η^b / (1 - ζ)."""
    return np.array([(a, b, 0, 1) for a, b in exponents])


def _line(n: int, alpha: int) -> tuple[np.ndarray, np.ndarray]:
    """Gauss-Jacobi rule of ∫ f(u) (1 - u)^alpha du over 0 to 1.

    Nodes are the eigenvalues of the tridiagonal matrix of the recurrence (Golub and Welsch 1969,
    Math. Comp. 23, 221-230).
    """
    k = np.arange(1.0, n)
    s = 2 * np.arange(n) + alpha
    a = -(alpha**2) / np.maximum(s * (s + 2), 1)
    b = 2 * k * (k + alpha) / (2 * k + alpha) / np.sqrt((2 * k + alpha) ** 2 - 1)
    t, V = np.linalg.eigh(np.diag(a) + np.diag(b, 1) + np.diag(b, -1))
    return (1 + t) / 2, V[0] ** 2 / (alpha + 1)


def _along(plane: Rule, n: int) -> Rule:
    """A rule of a triangle (g, 2) times n Gauss points of -1 to 1."""
    z, w = np.polynomial.legendre.leggauss(n)
    points = np.array([[*ab, zeta] for zeta in z for ab in plane[0]])
    return points, np.outer(w, plane[1]).ravel()


def _square(n: int) -> Rule:
    a, w = np.polynomial.legendre.leggauss(n)
    return np.array(list(product(a, repeat=2))), np.outer(w, w).ravel()


def _cube(n: int) -> Rule:
    return _along(_square(n), n)


def _tetra(n: int) -> Rule:
    """Conical product rule, exact to degree 2n - 1 (Stroud 1971)."""
    (u, a), (v, b), (w, c) = (_line(n, alpha) for alpha in (2, 1, 0))
    at = np.array(list(product(range(n), repeat=3))).T
    x, y, z = u[at[0]], v[at[1]], w[at[2]]
    points = np.stack([x, y * (1 - x), z * (1 - x) * (1 - y)], axis=1)
    return points, a[at[0]] * b[at[1]] * c[at[2]]


def _pyramid(n: int) -> Rule:
    """Gauss points of the base, drawn together towards the apex."""
    (z, c), (points, w) = _line(n, 2), _cube(n)
    below = np.repeat(z, n * n)
    base = points[:, :2] * (1 - below)[:, None]
    plane = w[: n * n] / w[: n * n].sum() * 4
    return np.column_stack([base, below]), np.outer(c, plane).ravel()


def _radon() -> Rule:
    """Seven points of a triangle, exact to degree 5 (Radon 1948)."""
    root = np.sqrt(15)
    points, weights = [[1 / 3, 1 / 3]], [9 / 80]
    for a, w in (((6 - root) / 21, 155 - root), ((6 + root) / 21, 155 + root)):
        points += [[a, a], [1 - 2 * a, a], [a, 1 - 2 * a]]
        weights += 3 * [w / 2400]
    return np.array(points), np.array(weights)


_EDGE_MIDDLES = np.array([[0.5, 0], [0.5, 0.5], [0, 0.5]]), np.full(3, 1 / 6)  # exact to degree 2
_PRISM_6, _PRISM_21 = _along(_EDGE_MIDDLES, 2), _along(_radon(), 3)
_FOUR = (5 + 3 * np.sqrt(5)) / 20 * np.eye(4)[:, 1:] + (5 - np.sqrt(5)) / 20 * (
    1 - np.eye(4)[:, 1:]
)
_TETRA_4 = _FOUR, np.full(4, 1 / 24)
_TETRA_5 = (  # exact to degree 3, as curved edges need; it is Nastran's
    np.vstack([np.full(3, 1 / 4), 1 / 6 + np.vstack([np.zeros(3), np.eye(3)]) / 3]),
    np.array([-2 / 15, *[3 / 40] * 4]),
)
_TETRA_1 = np.full((1, 3), 0.25), np.array([1 / 6])
_TRILINEAR = _powers(1, lambda a, b, c: True)
_SERENDIPITY = _powers(2, lambda a, b, c: a // 2 + b // 2 + c // 2 < 2)
_BILINEAR = _powers(1, lambda a, b, c: a + b < 2)
_BIQUADRATIC = _powers(2, lambda a, b, c: a + b < 3 and (c < 2 or a + b < 2))
_LINEAR = _powers(1, lambda a, b, c: a + b + c < 2)
_QUADRATIC = _powers(2, lambda a, b, c: a + b + c < 3)
_RATIONAL_5 = np.vstack([_LINEAR, _rational((1, 1))])
_RATIONAL_13 = np.vstack([_QUADRATIC, _rational((1, 1), (2, 1), (1, 2))])


def _family(
    corners: np.ndarray,
    powers: np.ndarray,
    rule: Rule,
    mass_rule: Rule,
    enhanced: Callable[[np.ndarray], np.ndarray] | None = None,
    shear_rule: Rule | None = None,
) -> tuple[int, ShapeFamily]:
    """(number of nodes, family); with a node on each edge where there are monomials enough."""
    middles = corners[np.array(EDGES[len(corners)])].mean(axis=1)
    nodes = np.vstack([corners, middles])[: len(powers)]
    centre = corners.mean(axis=0)
    return len(nodes), ShapeFamily(powers, nodes, rule, mass_rule, centre, enhanced, shear_rule)


FAMILIES = dict(
    (
        _family(_CUBE, _TRILINEAR, _cube(2), _cube(2), _hexa_enhanced),
        _family(_CUBE, _SERENDIPITY, _cube(3), _cube(3), None, _cube(2)),
        _family(_PRISM, _BILINEAR, _PRISM_6, _PRISM_6, _wedge_enhanced),
        _family(_PRISM, _BIQUADRATIC, _PRISM_21, _PRISM_21, None, _PRISM_6),
        _family(_TETRA, _LINEAR, _TETRA_1, _TETRA_4),
        _family(_TETRA, _QUADRATIC, _TETRA_5, _tetra(3)),
        _family(_PYRAMID, _RATIONAL_5, _pyramid(2), _pyramid(2)),
        _family(_PYRAMID, _RATIONAL_13, _pyramid(3), _pyramid(3)),
    )
)


_SQUARE = np.array([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]], float)
_FACE = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]], float)


def _surface(corners: np.ndarray, powers: np.ndarray, plane: Rule) -> ShapeFamily:
    """A face with a node on each edge, ζ = 0."""
    nodes = np.vstack([corners, (corners + np.roll(corners, -1, axis=0)) / 2])
    rule = np.column_stack([plane[0], np.zeros(len(plane[0]))]), plane[1]
    return ShapeFamily(powers, nodes, rule, rule, corners.mean(axis=0))


SURFACES = {  # of shells with nodes on their edges
    8: _surface(_SQUARE, _powers(2, lambda a, b, c: c == 0 and a // 2 + b // 2 < 2), _square(3)),
    6: _surface(_FACE, _powers(2, lambda a, b, c: c == 0 and a + b < 3), _radon()),
}


def with_middles(
    X: np.ndarray, edges: Sequence[tuple[int, int]] | None = None
) -> tuple[np.ndarray, np.ndarray | None]:
    """Places (m, k, 3) and motions T (m, k, k) of all nodes, those of straight edges between ends.

    A mid-side node that an element lacks repeats the first end of its edge. Its motion u = T u is
    the mean of the ends', which takes its quadratic term out of the shape functions. None: no
    element lacks one. ``edges`` are those of a shell.
    """
    m, k, _ = X.shape
    n = CORNERS[k] if edges is None else k - len(edges)
    if k == n:
        return X, None
    first, second = np.array(EDGES[n] if edges is None else edges).T
    of, edge = np.nonzero((X[:, n:] == X[:, first]).all(axis=2))
    if not len(of):
        return X, None
    T = np.tile(np.eye(k), (m, 1, 1))
    T[of, n + edge] = 0.0
    T[of, n + edge, first[edge]] = T[of, n + edge, second[edge]] = 0.5
    return T @ X, T


def jacobians(X: np.ndarray) -> np.ndarray:
    """Det J (m, g) [m³] of solids (m, k, 3) at their integration points, then at their centre.

    The order of the nodes may be of either hand; det J then has either sign at all points.
    """
    family, (X, _) = FAMILIES[X.shape[1]], with_middles(X)
    points = (*family.rule[0], *family.mass_rule[0], family.centre)
    return np.stack([np.linalg.det(family.gradients(xi) @ X) for xi in points], axis=1)
