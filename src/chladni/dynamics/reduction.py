"""Galerkin bases that can carry the operators a search will try.

A basis of normal modes alone is blind to point springs, joints and stiff patches; static responses
to loads at those places (attachment modes) are added and everything is made M-orthonormal with a
relative cut.
Craig and Kurdila (2006), Fundamentals of Structural Dynamics, ch. 17.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy.sparse as sp

from ..dofs import label
from ..errors import ModelError
from ..sparse.factor import Factor, factorise
from ..sparse.multifrontal import NotDefinite
from .massless import stiffened
from .system import System

CUT = 1e-5  # relative length below which a vector adds nothing to a basis
MASSLESS = 1e-20  # of the heaviest dof moving as far: what rounding leaves of no mass at all
COLUMNS = 32  # of a block that are multiplied at once
ROWS = 4096  # of an operator that are multiplied at once, or the product is as large as a basis


def orthonormal(
    M: sp.csr_array, blocks: Sequence[np.ndarray], cut: float = CUT, kept: int = 0
) -> np.ndarray:
    """Φ with ΦᵀMΦ = I that spans the blocks, in their order (n, r).

    A vector whose M-norm falls below ``cut`` of what it was, once the earlier ones are taken out
    of it, is dropped.  The first ``kept`` columns are M-orthonormal already and stay as they are.
    """
    out = [blocks[0][:, :kept]]
    for block in (blocks[0][:, kept:], *blocks[1:]):
        out.append(beyond(M, out, block, cut))
    return np.hstack(out)


def beyond(
    M: sp.csr_array, known: Sequence[np.ndarray], block: np.ndarray, cut: float = CUT
) -> np.ndarray:
    """What a block (n, m) adds to M-orthonormal ones, M-orthonormal itself (n, k).

    What moves no mass (the spin of a straight row of bars) has no place among them.  The known ones
    are taken out before and after its own vectors are made unit ones: twice is enough (Giraud et
    al. 2005, Numerische Mathematik 101, 87-100), once leaves rounding of the large.
    """
    heavy = np.concatenate([(V * (M @ V)).sum(axis=0) for V in _some(block)])
    heaviest = float(M.diagonal().max(initial=0.0)) * (block**2).max(axis=0, initial=0.0)
    moves = heavy > MASSLESS * heaviest
    if not moves.any():
        return np.zeros((len(block), 0))
    V = block[:, moves] / np.sqrt(heavy[moves])
    _take_out(M, known, V)
    w, U = np.linalg.eigh(np.hstack([V.T @ (M @ some) for some in _some(V)]))
    keep = w > cut**2
    V = V @ (U[:, keep] / np.sqrt(w[keep]))
    _take_out(M, known, V)
    return V


def _take_out(M: sp.csr_array, known: Sequence[np.ndarray], V: np.ndarray) -> None:
    """Take from V, in place, what M-orthonormal blocks have of it."""
    for some in _some(V):
        MV = M @ some
        for Q in known:
            some -= Q @ (Q.T @ MV)


def _some(V: np.ndarray) -> Iterator[np.ndarray]:
    """A few columns at a time: products with all of them are as large as they are."""
    yield from (V[:, k : k + COLUMNS] for k in range(0, max(V.shape[1], 1), COLUMNS))


@dataclass(frozen=True, eq=False)
class Basis:
    """Φ (n, r) in blocks of columns, which every basis that grows from this one shares with it.

    Vectors of the structure are what a search has most of; every hypothesis has a few of its own.
    """

    blocks: tuple[np.ndarray, ...]

    @property
    def shape(self) -> tuple[int, int]:
        """(n, r)."""
        return len(self.blocks[0]), sum(block.shape[1] for block in self.blocks)

    def grown(self, block: np.ndarray) -> Self:
        """With more columns (n, k)."""
        return type(self)((*self.blocks, np.ascontiguousarray(block)))

    def padded(self, more: int) -> Self:
        """Over so many more dofs, which no vector moves."""
        return type(self)(tuple(np.pad(block, ((0, more), (0, 0))) for block in self.blocks))

    def at(self, dofs: np.ndarray) -> np.ndarray:
        """Φ at some dofs (k, r)."""
        return np.hstack([block[dofs] for block in self.blocks])

    def seen(self, rows: sp.csr_array) -> np.ndarray:
        """B Φ of rows over all dofs or the first of them (k, r)."""
        return np.hstack([rows @ block[: rows.shape[1]] for block in self.blocks])

    def combined(self, q: np.ndarray) -> np.ndarray:
        """Φ q (n, k)."""
        ends = np.cumsum([block.shape[1] for block in self.blocks])[:-1]
        return sum(V @ part for V, part in zip(self.blocks, np.split(q, ends), strict=True))

    def projected(self, F: np.ndarray) -> np.ndarray:
        """Φᵀ F of loads on all dofs or the first of them (r, k)."""
        return np.concatenate([block[: len(F)].T @ F for block in self.blocks])

    def reduced(self, A: sp.csr_array) -> np.ndarray:
        """Φᵀ A Φ of a symmetric operator (r, r), which costs what A has of rows with entries."""
        out = self._times(A, self)
        return (out + out.T) / 2

    def bordering(self, A: sp.csr_array) -> np.ndarray:
        """Φᵀ A V of the block V that came last (r, k)."""
        return self._times(A, type(self)(self.blocks[-1:]))

    def _times(self, A: sp.csr_array, right: Self) -> np.ndarray:
        busy = np.flatnonzero(np.diff(A.indptr))
        out = np.zeros((self.shape[1], right.shape[1]))
        for start in range(0, len(busy), ROWS):
            some = busy[start : start + ROWS]
            out += self.at(some).T @ right.seen(A[some])
        return out


def shifted(system: System, hertz: float, points: np.ndarray | None = None) -> Factor:
    """Factor of K + (2π f)² M, positive definite for a free structure too.

    The dofs of a node are kept together: to cut between them takes forty times as long to order.
    What can move without stiffness and without mass is held, as it is where modes are sought.

    Raises
    ------
    ModelError
        If something moves without stiffness and mass even so; the sentence says what.
    """
    mass = (2 * np.pi * hertz) ** 2 * system.M
    try:
        return factorise(sp.csc_array(system.K + mass), points, nodes=system.dofs[:, 0])
    except NotDefinite:
        held = stiffened(sp.csr_array(system.elastic))
    try:
        return factorise(sp.csc_array(held + mass), points, nodes=system.dofs[:, 0])
    except NotDefinite as error:
        point, component = system.dofs[error.row].tolist()
        raise ModelError(
            f"{label(point, component)} can move without stiffness and without mass, as a chain of "
            "bars without torsional inertia can turn; hold it or give it inertia"
        ) from error


def attachments(factor: Factor, rows: sp.csr_array) -> np.ndarray:
    """Static responses (K + σM)⁻¹ Bᵀ to unit loads along the rows of B (n, k)."""
    return factor.solve(rows.toarray().T)
