"""Every weld loosened or removed, by exact re-analysis.

A joint adds bᵀ b to K, with its rows b. G is the receptance of the structure, and f the remaining
share of the joint. The receptance becomes (Woodbury)

    G' = G + (1 - f) G_ob (f + (1 - f) R)⁻¹ G_bi,   R = 1 - G_bb.

A weld is far stiffer than its sheets, so R is a small difference, of the order of 10^-3 to 10^-6.
The effect of its loss grows with 1/R, and modes alone are blind to it.  R therefore comes from
static responses P⁻¹ bᵀ of the whole structure, P = K + σM. The modes give its change along the
lines, all other modes to first order:

    R(s) = R_0 + (s² - σ) N_0 - Σ_r b φ_r φ_rᵀ bᵀ (d_r(s) - d_r(σ) + (s² - σ) d_r(σ)²),

N_0 = b P⁻¹ M P⁻¹ bᵀ, d_r(s) = 1/(λ_r + s²).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import numpy as np
import scipy.sparse as sp

from ..dynamics.modal_sum import modal_sum
from ..dynamics.reduction import attachments
from ..effects.joints import MOST_RUN, Connection, fasteners, joined, lines
from ..geometry.sampling import farthest_point_sample
from ..inference.likelihood import Responses
from ..inference.scan import Baseline
from ..reduced.reduced_model import State
from ..reduced.reduced_problem import ReducedProblem
from ..sparse.factor import Factor

MOST_FASTENERS = 400  # fasteners that are tried; of more, so many spread over the structure
AT_ONCE = 24  # of them are solved for together
LEAST_CHANGE = 1e-9  # of R: rounding of the solves
_KNOWN: WeakKeyDictionary[Factor, tuple["LoosenedRow", ...]] = WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Loosened:
    """A fastener, R_0 = 1 - b P⁻¹ bᵀ of its rows and N_0 = b P⁻¹ M P⁻¹ bᵀ (r, r)."""

    joint: Connection
    R: np.ndarray
    N: np.ndarray

    @property
    def share(self) -> np.ndarray:
        """Share z/(w + z) of the sheets in the stiffness of both, along its directions (r,)."""
        return np.asarray(np.linalg.eigvalsh(self.R))


@dataclass(frozen=True, eq=False)
class LoosenedRow:
    """Adjacent fasteners of one line, loosened together."""

    positions: tuple[int, ...]  # among all that are tried
    joints: tuple[Connection, ...]
    whole: Loosened

    def __len__(self) -> int:
        return len(self.joints)

    def run(self, first: int, last: int) -> Loosened:
        """The fasteners from one to another as one."""
        ends = np.cumsum([0, *(j.rows.shape[0] for j in self.joints)])
        some = np.s_[ends[first] : ends[last + 1]]
        joints = self.joints[first : last + 1]
        joint = joints[0] if len(joints) == 1 else joined(joints)
        return Loosened(joint, _rest(self.whole.R[some, some]), self.whole.N[some, some])


def loosened_rows(reduced: ReducedProblem) -> tuple[LoosenedRow, ...]:
    """Every fastener of the structure with what the sheets give where it is loaded, by lines.

    Long lines are divided so that every run of ``MOST_RUN`` fasteners lies in one row. They are
    those of the structure as given: the rounds of a search share them, whatever was found.
    """
    if reduced.factor not in _KNOWN:
        _KNOWN[reduced.factor] = tuple(_solved(reduced))
    return _KNOWN[reduced.factor]


def _solved(reduced: ReducedProblem) -> Iterator[LoosenedRow]:
    """The rows of :func:`loosened_rows`, several solved for together."""
    joints = fasteners(reduced.structure)
    if len(joints) > MOST_FASTENERS:
        spread = farthest_point_sample(np.array([j.point for j in joints]), MOST_FASTENERS)
        joints = [joints[k] for k in spread]
    rows = [
        line[begin : begin + AT_ONCE]
        for line in lines(joints)
        for begin in range(0, max(1, len(line) - MOST_RUN + 1), AT_ONCE - MOST_RUN + 1)
    ]
    for some in batched(rows):
        every = [tuple(joints[k] for k in at) for at in some]
        for at, row, whole in zip(some, every, together(reduced, every), strict=True):
            yield LoosenedRow(at, row, whole)


def batched(rows: Sequence[tuple[int, ...]]) -> list[list[tuple[int, ...]]]:
    """Rows in groups of about ``AT_ONCE`` fasteners, which are solved for together."""
    out: list[list[tuple[int, ...]]] = []
    for row in rows:
        if not out or sum(map(len, out[-1])) + len(row) > AT_ONCE:
            out.append([])
        out[-1].append(row)
    return out


def singles(rows: Sequence[LoosenedRow]) -> tuple[Loosened, ...]:
    """Every fastener alone, in the order of their positions."""
    found = {k: (row, n) for row in rows for n, k in enumerate(row.positions)}
    return tuple(row.run(n, n) for row, n in (found[k] for k in sorted(found)))


def together(reduced: ReducedProblem, rows: Sequence[Sequence[Connection]]) -> list[Loosened]:
    """The fasteners of each row as one, with what the sheets give between them as well."""
    every, M = [joined(row) for row in rows], reduced.structure.system.M
    static = attachments(reduced.factor, sp.csr_array(sp.vstack([one.rows for one in every])))
    out, ends = [], np.cumsum([one.rows.shape[0] for one in every])
    for one, own in zip(every, np.split(static, ends[:-1], axis=1), strict=True):
        flexibility = one.rows @ own
        rest = _rest(np.eye(len(flexibility)) - flexibility)
        out.append(Loosened(one, rest, own.T @ (M @ own)))
    return out


def _rest(R: np.ndarray) -> np.ndarray:
    """1 - b P⁻¹ bᵀ, symmetric, between ``LEAST_CHANGE`` and one."""
    w, V = np.linalg.eigh((R + R.T) / 2)
    return (V * np.clip(w, LEAST_CHANGE, 1.0)) @ V.T


def fastener_scores(
    base: Baseline, reduced: ReducedProblem, data: Responses, joints: Sequence[Loosened],
    left: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Score of each fastener with each share f of its stiffness left (n, k)."""
    state, out = base.state, np.empty(left.shape)
    for j, one in enumerate(joints):
        H = loosened_receptance(state, reduced, data, one, left[j])
        r = data.stacked(data.deviation(state, H) / data.std())
        out[j] = base.score(base.with_mass(r, 0.0))
    return out


def loosened_receptance(
    state: State, reduced: ReducedProblem, data: Responses, one: Loosened, left: np.ndarray
) -> np.ndarray:
    """G' on the lines with shares ``left`` (k,) of a joint left (k, n_f, n_out, n_in)."""
    phi_o, phi_i, d = data.modal(state)
    sigma = (2 * np.pi * reduced.hertz) ** 2
    beyond, still = data.s**2 - sigma, 1 / (state.lam + sigma)
    follow = d - still + beyond[:, None] * still**2
    b = reduced.model.rows(one.joint.rows, keep=False) @ state.phi
    G = data.receptance(state, phi_o, phi_i, d)
    G_ob = state.between(data.s, d, phi_o, b)
    G_bi = state.between(data.s, d, b, phi_i)
    R = one.R + beyond[:, None, None] * one.N
    R = R - modal_sum(b, follow, b)
    return np.array(
        [G + (1 - f) * (G_ob @ np.linalg.solve(f * np.eye(len(b)) + (1 - f) * R, G_bi))
         for f in left]
    )  # fmt: skip
