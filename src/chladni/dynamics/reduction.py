"""Galerkin bases that represent the operators tried in a search.

A basis of normal modes alone does not represent point springs, joints and stiff patches. Static
responses to loads at these places (attachment modes) are added. The result is made M-orthonormal
with a relative cut.
Craig and Kurdila (2006), Fundamentals of Structural Dynamics, ch. 17.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy.sparse as sp
from scipy.linalg import eigh

from ..dofs import label
from ..errors import ModelError
from ..sparse.factor import Factor, factorise
from ..sparse.multifrontal import NotDefinite
from .massless import stiffened
from .modes import ModalModel
from .system import System

CUT = 1e-5  # relative length below which a vector adds nothing to a basis
LITTLE = 0.01  # relative length below which rounding errors of a vector are removed once more
STEPS = 2  # of subspace iteration: the first smooths point loads, the second turns to the modes
MASSLESS = 1e-20  # of the heaviest dof with the largest motion: a smaller mass is rounding
COLUMNS = 32  # of a block that are multiplied at once
ROWS = 4096  # of an operator that are multiplied at once, to keep the product smaller than a basis


def orthonormal(
    M: sp.csr_array, blocks: Sequence[np.ndarray], cut: float = CUT, kept: int = 0
) -> np.ndarray:
    """Φ (n, r) with ΦᵀMΦ = I that spans the blocks, in their order.

    Each vector is made M-orthogonal to the previous ones. It is dropped if its M-norm falls below
    ``cut`` times the original. The first ``kept`` columns are already M-orthonormal and unchanged.
    """
    out = [blocks[0][:, :kept]]
    for block in (blocks[0][:, kept:], *blocks[1:]):
        out.append(beyond(M, out, block, cut))
    return np.hstack(out)


def beyond(
    M: sp.csr_array, known: Sequence[np.ndarray], block: np.ndarray, cut: float = CUT
) -> np.ndarray:
    """M-orthonormal vectors (n, k) that a block (n, m) adds to M-orthonormal ones.

    Motions without mass (the spin of a straight row of bars) are left out. The block is made
    orthogonal to the known vectors. Its own normalisation magnifies the rounding errors of vectors
    with little left, ``LITTLE`` of their length or less, so these are made orthogonal again. Two
    passes are enough (Giraud et al. 2005, Numerische Mathematik 101, 87-100).
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
    V = V @ (U[:, keep] / np.sqrt(w[keep]))  # the shortest come first
    _take_out(M, known, V[:, : int((w[keep] < LITTLE**2).sum())])
    return V


def _take_out(M: sp.csr_array, known: Sequence[np.ndarray], V: np.ndarray) -> None:
    """Make V M-orthogonal to M-orthonormal blocks, in place."""
    for some in _some(V):
        MV = M @ some
        for Q in known:
            some -= Q @ (Q.T @ MV)


def _some(V: np.ndarray) -> Iterator[np.ndarray]:
    """Yield a few columns at a time, because products with all of them need much memory."""
    yield from (V[:, k : k + COLUMNS] for k in range(0, max(V.shape[1], 1), COLUMNS))


@dataclass(frozen=True, eq=False)
class Basis:
    """Φ (n, r) in blocks of columns, which all bases grown from this one share.

    Most vectors of a search belong to the structure; every hypothesis adds only a few.
    """

    blocks: tuple[np.ndarray, ...]

    @property
    def shape(self) -> tuple[int, int]:
        """(n, r)."""
        return len(self.blocks[0]), sum(block.shape[1] for block in self.blocks)

    def grown(self, block: np.ndarray) -> Self:
        """Add columns (n, k)."""
        return type(self)((*self.blocks, np.ascontiguousarray(block)))

    def padded(self, more: int) -> Self:
        """Add dofs, with zero motion in every vector."""
        return type(self)(tuple(np.pad(block, ((0, more), (0, 0))) for block in self.blocks))

    def at(self, dofs: np.ndarray) -> np.ndarray:
        """Φ at some dofs (k, r)."""
        return np.hstack([block[dofs] for block in self.blocks])

    def seen(self, rows: sp.csr_array) -> np.ndarray:
        """B Φ (k, r) of rows B over all dofs, or over the first of them."""
        return np.hstack([rows @ block[: rows.shape[1]] for block in self.blocks])

    def combined(self, q: np.ndarray) -> np.ndarray:
        """Φ q (n, k)."""
        ends = np.cumsum([block.shape[1] for block in self.blocks])[:-1]
        return sum(V @ part for V, part in zip(self.blocks, np.split(q, ends), strict=True))

    def projected(self, F: np.ndarray) -> np.ndarray:
        """Φᵀ F (r, k) of loads F on all dofs, or on the first of them."""
        return np.concatenate([block[: len(F)].T @ F for block in self.blocks])

    def reduced(self, A: sp.csr_array) -> np.ndarray:
        """Φᵀ A Φ (r, r) of a symmetric operator; the cost is proportional to its nonempty rows."""
        out = self._times(A, self)
        return (out + out.T) / 2

    def bordering(self, A: sp.csr_array) -> np.ndarray:
        """Φᵀ A V (r, k) of the last block V."""
        return self._times(A, type(self)(self.blocks[-1:]))

    def _times(self, A: sp.csr_array, right: Self) -> np.ndarray:
        busy = np.flatnonzero(np.diff(A.indptr))
        out = np.zeros((self.shape[1], right.shape[1]))
        for start in range(0, len(busy), ROWS):
            some = busy[start : start + ROWS]
            out += self.at(some).T @ right.seen(A[some])
        return out


def shifted(system: System, hertz: float) -> Factor:
    """Factor of K + (2π f)² M, positive definite for a free structure too.

    The dofs of a node are kept together, because ordering them separately takes forty times as
    long. Motions without stiffness and mass are held, as in the computation of modes.

    Raises
    ------
    ModelError
        If a motion without stiffness and mass remains; the message names its dof.
    """
    mass = (2 * np.pi * hertz) ** 2 * system.M
    try:
        return factorise(sp.csc_array(system.K + mass), nodes=system.dofs[:, 0])
    except NotDefinite:
        held = stiffened(sp.csr_array(system.elastic))
    try:
        return factorise(sp.csc_array(held + mass), nodes=system.dofs[:, 0])
    except NotDefinite as error:
        point, component = system.dofs[error.row].tolist()
        raise ModelError(
            f"{label(point, component)} can move without stiffness and without mass, as a chain of "
            "bars without torsional inertia can turn; hold it or give it inertia"
        ) from error


def iterated(system: System, loads: np.ndarray, hertz: float, steps: int = STEPS) -> ModalModel:
    """Ritz modes (K + σM)⁻¹ [M (K + σM)⁻¹]ᵏ⁻¹ F of loads F (n, m), MΦ of nearby modes Φ.

    Subspace iteration (Bathe 2014, Finite Element Procedures, section 11.6). Frequencies lie above
    those of the system, by the square of what is wrong in the shapes. None is proved complete.
    """
    factor = shifted(system, hertz)
    X = factor.solve(loads)
    for _ in range(steps - 1):
        X = factor.solve(system.M @ X)
    V = orthonormal(system.M, [X])
    lam, q = eigh(V.T @ (system.elastic @ V))
    frequency = np.sqrt(np.maximum(lam, 0.0)) / (2 * np.pi)
    return ModalModel(frequency, np.zeros(len(lam)), V @ q, system.dofs)


def attachments(factor: Factor, rows: sp.csr_array) -> np.ndarray:
    """Static responses (K + σM)⁻¹ Bᵀ to unit loads along the rows of B (n, k)."""
    return factor.solve(rows.toarray().T)
