"""Every weld loosened or taken out, by exact re-analysis.

With w = bᵀ b in K for the rows b of a joint and G the receptance of the structure, what is left of
the joint being the share f, the receptance becomes (Woodbury)

    G' = G + (1 - f) G_ob (f + (1 - f) R)⁻¹ G_bi,   R = 1 - G_bb.

A weld is far stiffer than its sheets, so that R is the small difference of ones: of the order of
10^-3 to 10^-6, and what its loss does goes with 1/R.  Modes alone are blind to it.  R is therefore
taken from static responses of the whole structure and only followed along the lines by the modes:
R(s) = R_0 - Σ_r b φ_r φ_rᵀ bᵀ (1/(λ_r + s²) - 1/(λ_r + σ)).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..dynamics.reduction import attachments
from ..effects.joints import Joint, fasteners
from ..geometry.sampling import farthest_point_sample
from .likelihood import Responses
from .reduced_problem import ReducedProblem
from .scan import Baseline, _residuals

MOST = 400  # fasteners that are tried; of more, so many spread over the structure
AT_ONCE = 24  # of them are solved for together
LEAST = 1e-9  # of R: rounding of the solves


@dataclass(frozen=True, eq=False)
class Loosened:
    """A fastener, and R_0 = 1 - b (K + σM)⁻¹ bᵀ of its rows (r, r)."""

    joint: Joint
    R: np.ndarray

    @property
    def share(self) -> np.ndarray:
        """Share z/(w + z) of the sheets in the stiffness of both, along its directions (r,)."""
        return np.asarray(np.linalg.eigvalsh(self.R))


def loosened(reduced: ReducedProblem) -> tuple[Loosened, ...]:
    """Every fastener of the structure with what the sheets give where it is loaded."""
    joints = fasteners(reduced.structure)
    if len(joints) > MOST:
        spread = farthest_point_sample(np.array([j.point for j in joints]), MOST)
        joints = [joints[k] for k in spread]
    out: list[Loosened] = []
    for k in range(0, len(joints), AT_ONCE):
        some = joints[k : k + AT_ONCE]
        rows = sp.csr_array(sp.vstack([j.rows for j in some]))
        static, start = attachments(reduced.factor, rows), 0
        for joint in some:
            stop = start + joint.rows.shape[0]
            out.append(Loosened(joint, _rest(joint.rows @ static[:, start:stop])))
            start = stop
    return tuple(out)


def _rest(flexibility: np.ndarray) -> np.ndarray:
    """1 - b P⁻¹ bᵀ, symmetric, between ``LEAST`` and one."""
    w, V = np.linalg.eigh(np.eye(len(flexibility)) - (flexibility + flexibility.T) / 2)
    return np.asarray((V * np.clip(w, LEAST, 1.0)) @ V.T)


def fastener_scores(
    base: Baseline, reduced: ReducedProblem, data: Responses, joints: Sequence[Loosened],
    left: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Score of each fastener with each share of its stiffness left (n, k).

    Parameters
    ----------
    left : (n, k)   f
    """
    model, state = reduced.model, base.state
    phi_o, phi_i, d = data.modal(state)
    follow = d - 1 / (state.lam + (2 * np.pi * reduced.hertz) ** 2)
    H = np.einsum("or,fr,ir->foi", phi_o, d, phi_i, optimize=True)
    out = np.empty(left.shape)
    for j, one in enumerate(joints):
        b = model.rows(one.joint.rows, keep=False) @ state.phi
        G_ob = np.einsum("or,fr,br->fob", phi_o, d, b, optimize=True)
        G_bi = np.einsum("br,fr,ir->fbi", b, d, phi_i, optimize=True)
        R = one.R - np.einsum("br,fr,cr->fbc", b, follow, b, optimize=True)
        for k, f in enumerate(left[j]):
            change = (1 - f) * (G_ob @ np.linalg.solve(f * np.eye(len(b)) + (1 - f) * R, G_bi))
            r = _residuals(data, state, (H + change)[None])
            out[j, k] = base.score(base.with_mass(r, 0.0))[0]
    return out
