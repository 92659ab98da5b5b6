"""Loss factors of the parts, from the damping of the modes after the stiffness is calibrated.

A mode with the share s_pr of part p in its strain energy has 2 ζ_r = Σ_p s_pr η_p (Ungar and Kerwin
1962, J. Acoust. Soc. Am. 34, 954-957).  η_p ≥ 0 is a weighted least-squares fit.  The weights are
the scatter of damping among the modes of one structure.
"""

from collections.abc import Sequence

import numpy as np

from ..effects.identified_damping import SCATTER
from ..fem.modelled import Modelled
from ..inference.calibration_result import PartDamping
from ..inference.result import FrequencyRow
from .regions_to_free import ELSE, energy_shares

LEAST = 0.01  # share of strain energy in its best mode below which a part is left out


def damping_by_part(rows: Sequence[FrequencyRow], model: Modelled) -> tuple[PartDamping, ...]:
    """Fit the loss factor of every part to the identified damping of the paired modes.

    Parameters
    ----------
    rows : frequencies of the test and of the calibrated deck, with the damping of the test
    model : this deck

    Returns
    -------
    Nothing where there are fewer modes than parts.
    """
    paired = [(r.after_hz, r.damping) for r in rows if r.after_hz and r.damping and r.damping > 0]
    if not paired:
        return ()
    f, zeta = np.array(paired, dtype=float).T
    share = energy_shares(model, f)
    names = [*(part.name for part in model.assembly.parts), ELSE]
    kept = np.flatnonzero(share.max(axis=1) > LEAST)
    if len(kept) > len(f):
        return ()
    eta, sd = loss_factors(share[kept], zeta)
    return tuple(
        PartDamping(names[k], float(e), max(0.0, float(e - 1.96 * s)), float(e + 1.96 * s))
        for k, e, s in zip(kept, eta, sd, strict=True)
    )


def loss_factors(share: np.ndarray, zeta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Loss factors η (parts,) ≥ 0 and their standard deviations.

    Parameters
    ----------
    share : (parts, r)   of strain energy
    zeta : (r,)          damping ratios
    """
    from scipy.optimize import nnls

    J = (share / (2 * zeta)).T / SCATTER
    eta, _ = nnls(J, np.full(len(zeta), 1 / SCATTER))
    return eta, np.sqrt(np.diag(np.linalg.pinv(J.T @ J)))
