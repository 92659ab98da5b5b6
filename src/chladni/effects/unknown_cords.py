"""Cords whose places the test does not state: springs to ground spread as the mass is.

A rigid motion on cords at f_s responds 1 / (1 - (f_s / f)²) times as much as a free one. At four
times f_s this is still 7 % more. Cords change bounce and tilt differently, and their places are
unknown. Here springs are spread in proportion to the mass. Others are spread as the mass times the
square of the distance from the centre along either other axis. Every rigid motion of a direction
has its own frequency then.
"""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from ..fem.assemble import Structure, over_all_motions
from .effect import Effect, MatrixTerm, Parameter, Traits

SD = 1.0  # of ln of each stiffness
TILTING = 0.3  # of the springs in proportion to the mass: median of those that hold the ends


@dataclass(frozen=True, eq=False)
class UnknownCords(Effect):
    """Springs to ground along one axis, each of three distributions with its own size."""

    name = "unknown-cords"
    claim = "the article hangs on cords that neither deck nor test states"
    kind = "nuisance"
    traits = Traits(writable=False)

    operators: tuple[sp.csr_array, ...] = field(kw_only=True)  # (n, n) [kg], ω² times them is K

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """ω_k² A_k of each distribution."""
        each = zip(self.parameters, self.operators, x.tolist(), np.eye(len(x)), strict=True)
        return tuple(MatrixTerm("K", A, p.value(v), p.slope(v) * unit) for p, A, v, unit in each)


def unknown_cords(built: Structure, slow: np.ndarray, directions: np.ndarray) -> list[UnknownCords]:
    """Cords along every axis along which something is measured or driven.

    Parameters
    ----------
    slow : (k,)            frequencies of the modes on the cords [Hz]; without any there are none
    directions : (m, 3)    of sensors and forces
    """
    if not len(slow):
        return []
    made = built.assembly
    M = over_all_motions(made, stiff=False)[0]
    typical = float(np.exp(np.log(2 * np.pi * slow).mean())) ** 2
    out = []
    for axis in np.unique(np.abs(directions).argmax(axis=1)).tolist():
        along = np.zeros((len(made.points), 6))
        along[:, axis] = 1.0
        mass = (M @ along.ravel()).reshape(-1, 6)[:, axis]
        away = made.points - mass @ made.points / mass.sum()
        far = mass @ away**2 / mass.sum()
        rows = built.along(made.ids, np.tile(np.eye(3)[axis], (len(made.ids), 1)))
        others = [k for k in range(3) if k != axis and far[k] > 1e-9 * far.max()]
        weights = [mass, *(mass * away[:, k] ** 2 / far[k] for k in others)]
        operators = tuple(sp.csr_array(rows.T @ sp.diags_array(w) @ rows) for w in weights)
        sizes = (typical, *(TILTING * typical for _ in others))
        name = "xyz"[axis]
        unknown = tuple(Parameter("ω²", "1/s²", 0.0, SD, scale=size) for size in sizes)
        out.append(UnknownCords(unknown, f"along {name}", operators=operators))
    return out
