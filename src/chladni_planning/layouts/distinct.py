"""Layouts with distinct modes: exchange under a ceiling of the AutoMAC.

A large determinant makes shapes independent, not orthogonal.  Two modes may still have similar
shapes at the sensors (AutoMAC 0.3), and a slightly wrong model then pairs them wrongly.
"""

from dataclasses import dataclass

import numpy as np

from .exchange import BETTER, _joinable, _regular
from .information import Candidates, candidates, changed, positions_of, value
from .layout_rules import Rules

WORTH = 30.0  # nats of log det that an excess of 1 over the ceiling costs


def likeness(F: np.ndarray) -> np.ndarray:
    """AutoMAC F_rs² / (F_rr F_ss) off the diagonal from the Gram matrix F = ΦᵀΦ (..., p, p).

    Allemang (2003), Sound and Vibration 37(8), 14-21. The diagonal is 0.
    """
    size = np.einsum("...rr->...r", F)
    out = F**2 / np.maximum(size[..., :, None] * size[..., None, :], 1e-300)
    out[..., np.arange(F.shape[-1]), np.arange(F.shape[-1])] = 0.0
    return out


def excess(F: np.ndarray, ceiling: float) -> np.ndarray:
    """Σ_{r<s} max(0, AutoMAC_rs - ceiling), mean over the draws of F (d, ..., p, p)."""
    over = np.maximum(likeness(F) - ceiling, 0.0).mean(axis=0)
    return over.sum(axis=(-2, -1)) / 2


def distinct(
    phi: np.ndarray | Candidates,
    layout: np.ndarray,
    *,
    ceiling: float = 0.15,
    rules: Rules | None = None,
    shapes: np.ndarray | Candidates | None = None,
    max_rounds: int = 30,
) -> np.ndarray:
    """A layout (increasing) after exchange for log det F - 30 excess of the AutoMAC over a ceiling.

    One sensor after the other moves to its best place until a round moves none (coordinate
    exchange, Meyer and Nachtsheim 1995, Technometrics 37(1), 60-69). Where the ceiling cannot be
    met some excess is left. Noise does not enter the AutoMAC, nor does it where modes are paired.

    Parameters
    ----------
    phi : see :func:`candidates`; several draws are judged by their mean
    layout : positions or mask of the sensors to start from
    rules : fixed, forbidden, near, regions
    shapes : as phi, of the AutoMAC, where phi is weighted
    """
    c = candidates(phi)
    kept = np.sort(positions_of(layout, len(c)))
    checked = (rules or Rules()).checked(len(c), len(kept))
    checked.obeyed(kept)
    pairs = _Pairs.of(c if shapes is None else candidates(shapes))
    now = value("D", _regular(c, kept)) - WORTH * pairs.alone(kept, ceiling)
    for _ in range(max_rounds):
        before = now
        for i in kept[~checked.fixed[kept]].tolist():
            rest = kept[kept != i]
            held = np.zeros(len(c), bool)
            held[kept] = True
            others = np.flatnonzero(_joinable(checked, held, i))
            if not len(others):
                continue
            after = _joined(c, rest, others) - WORTH * pairs.excess(rest, others, ceiling)
            if after.max() > now + BETTER:
                j = int(np.argmax(after >= after.max() - BETTER))
                now, kept = float(after[j]), np.sort(np.r_[rest, others[j]])
        if now <= before:
            break
    return kept


def _joined(c: Candidates, rest: np.ndarray, others: np.ndarray) -> np.ndarray:
    """log det F of the rest with each of the others (m,)."""
    U = c.joining(rest, others)
    return changed("D", _regular(c, rest), U, np.ones(U.shape[2]))


@dataclass(frozen=True, eq=False)
class _Pairs:
    """Shares of candidates in the Gram matrix: above the diagonal (d, n, q), on it (d, n, p).

    ``first``, ``second`` (q,) are the modes of each pair.
    """

    off: np.ndarray
    on: np.ndarray
    first: np.ndarray
    second: np.ndarray

    @classmethod
    def of(cls, c: Candidates) -> "_Pairs":
        first, second = np.triu_indices(c.unknowns, 1)
        A = c.rows
        off = np.einsum("dikq,dikq->diq", A[..., first], A[..., second])
        return cls(off, np.einsum("dikp,dikp->dip", A, A), first, second)

    def alone(self, kept: np.ndarray, ceiling: float) -> float:
        """Excess of a layout over the ceiling."""
        return float(self.excess(kept[:-1], kept[-1:], ceiling)[0])

    def excess(self, rest: np.ndarray, others: np.ndarray, ceiling: float) -> np.ndarray:
        """Excess of the rest with each of the others (m,)."""
        off = self.off[:, rest].sum(axis=1)[:, None] + self.off[:, others]
        on = self.on[:, rest].sum(axis=1)[:, None] + self.on[:, others]
        size = np.maximum(on[..., self.first] * on[..., self.second], 1e-300)
        over = np.maximum(off**2 / size - ceiling, 0.0)
        return over.sum(axis=-1).mean(axis=0)
