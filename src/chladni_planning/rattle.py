"""Force at each shaker place at which two sheets first meet, from the gaps of the mesh.

Where sheets touch within the accuracy of the mesh, the gap lies between zero and the uncertainty of
its facets. The middle of that interval is used, so that such pairs take part in the veto. The gap
of sheets that certainly lie on each other is ``TAKE_UP``.
"""

from dataclasses import dataclass

import numpy as np

from chladni.geometry.clearance import Gaps, all_gaps
from chladni.model.assembly import Assembly

WITHIN = 0.010  # sheets farther apart than this do not meet [m]
TAKE_UP = 2e-5  # [m]: roughness and paint, of sheets that lie on each other


@dataclass(frozen=True, eq=False)
class Openings:
    """Places where two sheets may meet, for all pairs of parts."""

    pairs: tuple[tuple[str, str], ...]  # parts
    pair: np.ndarray  # (g,) int; position of the pair of each place
    points: np.ndarray  # (g, 3) [m]
    clearance: np.ndarray  # (g,) [m]; for touching places the middle of the possible interval
    known: np.ndarray  # (g,) bool; False where the sheets touch within the accuracy of the mesh
    motion: np.ndarray  # (g, r) opening in each mode [1/√kg]
    # pairs that touch away from joints within the mesh's accuracy
    touching: tuple[tuple[str, str], ...]


@dataclass(frozen=True, eq=False)
class Rattle:
    """First contact for each shaker candidate, at the resonance of least force."""

    force: np.ndarray  # (n,) amplitude at which the first place closes [N]; inf where none closes
    place: np.ndarray  # (n,) int; position among the openings; -1 where none closes
    mode: np.ndarray  # (n,) int; resonance at which it closes; -1 where none closes


def openings(assembly: Assembly, motion: np.ndarray) -> Openings:
    """Gaps away from joints.

    Parameters
    ----------
    motion : (n_points, 3, r)   shapes at all points, mass-normalised [1/√kg]
    """
    found = all_gaps(assembly, within=WITHIN)
    open_ = [g.free for g in found]
    r = motion.shape[2]
    return Openings(
        tuple(g.parts for g in found),
        np.concatenate([np.zeros(0, int), *(np.full(m.sum(), k) for k, m in enumerate(open_))]),
        _joined([assembly.points[g.rows[m]] for g, m in _zip(found, open_)], 3),
        np.concatenate([np.zeros(0), *(_likely(g)[m] for g, m in _zip(found, open_))]),
        np.concatenate([np.zeros(0, bool), *(~g.touching[m] for g, m in _zip(found, open_))]),
        _joined([g.relative_motion(motion)[m] for g, m in _zip(found, open_)], r),
        tuple(g.parts for g in found if (g.free & g.touching).any()),
    )


def _likely(g: Gaps) -> np.ndarray:
    """The clearance c; for touching sheets the middle of [c - u, c + u]; ``TAKE_UP`` or more."""
    least = np.maximum(g.clearance - g.uncertainty, 0.0)
    most = np.maximum(g.clearance + g.uncertainty, 2 * TAKE_UP)
    return np.where(g.touching, (least + most) / 2, np.maximum(g.clearance, TAKE_UP))


def _zip(found: tuple[Gaps, ...], masks: list[np.ndarray]) -> list[tuple[Gaps, np.ndarray]]:
    return list(zip(found, masks, strict=True))


def _joined(blocks: list[np.ndarray], columns: int) -> np.ndarray:
    return np.concatenate([np.zeros((0, columns)), *blocks])


def first_rattle(
    frequency: np.ndarray, damping: np.ndarray, phi: np.ndarray, gaps: Openings
) -> Rattle:
    """Force F = min c 2ζω² / |φ_ir ψ_gr| over gaps g and modes r, for each candidate i.

    The value is :func:`chladni_planning.rattle_margin` at one newton; gap and mode come with it.

    Parameters
    ----------
    phi : (n, r)   shapes at the candidates [1/√kg]
    """
    n, (g, r) = len(phi), gaps.motion.shape
    force, culprit = np.full(n, np.inf), np.full(n, -1)
    peak = 1 / (2 * np.asarray(damping) * (2 * np.pi * np.asarray(frequency)) ** 2)
    per_newton = np.abs(gaps.motion) * peak / gaps.clearance[:, None]  # (g, r)
    worst = per_newton.argmax(axis=0) if g else np.zeros(r, int)
    closing = np.abs(phi) * (per_newton[worst, np.arange(r)] if g else np.zeros(r))
    mode = closing.argmax(axis=1)
    most = closing[np.arange(n), mode]
    hit = most > 0
    force[hit], culprit[hit] = 1 / most[hit], worst[mode[hit]]
    return Rattle(force, culprit, np.where(hit, mode, -1))
