"""Modes of an article at selected points, by our elements, by CalculiX or by Kratos."""

from collections.abc import Callable
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.linalg import eigh

from chladni.arrays import fingerprint
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.modes import rigid_modes
from chladni.dynamics.reduction import attachments, orthonormal, shifted
from chladni.fem.assemble import structure
from chladni.model.assembly import Assembly
from chladni.output import write_npz

from .calculix import calculix_modes
from .kratos import kratos_modes

Solver = Literal["chladni", "calculix", "kratos"]
ABOVE = 1.6  # our modes reach up to this many times the highest recorded frequency
BY_CALCULIX = 70  # number of modes that CalculiX computes
_KEPT = "rigid at 0 Hz"  # form of the cached modes; change the text with the form
RIGID = 0.02  # below it a frequency of CalculiX is rounding [Hz]


@dataclass(frozen=True, eq=False)
class ArticleModes:
    """Modes of an article, rigid ones first; modes above the band act as a static complement."""

    frequency: np.ndarray  # (r,) Hz: 0 for rigid modes
    rows: np.ndarray  # (k,) int: rows of the article's points, increasing
    shapes: np.ndarray  # (k, 3, r) motion of these points [1/√kg]
    loss: np.ndarray  # (r, r) Φᵀ K_loss Φ of materials with losses [rad²/s²]

    def at(self, rows: np.ndarray) -> np.ndarray:
        """Motion (..., 3, r) of these points."""
        return np.asarray(self.shapes[np.searchsorted(self.rows, rows)])


def article_modes(
    assembly: Assembly,
    rows: np.ndarray,
    loaded: np.ndarray,
    f_max: float,
    solver: Solver = "chladni",
    cache: Path | None = None,
    residual_bending: bool = True,
) -> ArticleModes:
    """Modes of an article at some points.

    Parameters
    ----------
    rows : points whose motion is needed
    loaded : points that forces act on: our modes are exact for static loads there
    f_max : highest frequency recorded [Hz]
    residual_bending : of our shells; False is another formulation, and triangles of Kratos
    """
    rows = np.unique(np.concatenate([rows.ravel(), loaded.ravel()]))
    job = (assembly, rows, loaded, f_max, residual_bending)
    if solver == "kratos":
        return _kept(job, cache, _by_kratos)
    ours = _kept(job, cache, _by_us)
    if solver == "chladni":
        return ours
    return _completed(*calculix_modes(assembly, BY_CALCULIX, rows, cache), ours, f_max)


Job = tuple[Assembly, np.ndarray, np.ndarray, float, bool]


def _kept(job: Job, cache: Path | None, solve: Callable[..., ArticleModes]) -> ArticleModes:
    """Modes, from the cache if it holds them."""
    mark = _KEPT if solve is _by_us else f"{_KEPT}, {solve.__name__}"
    kept = None if cache is None else cache / f"{fingerprint((job, mark))}.npz"
    if kept is not None and kept.exists():
        with np.load(kept, allow_pickle=False) as held:
            return ArticleModes(*(held[f.name] for f in fields(ArticleModes)))
    found = solve(*job)
    if kept is not None:
        write_npz(kept, **{f.name: getattr(found, f.name) for f in fields(ArticleModes)})
    return found


def _completed(
    frequency: np.ndarray, shapes: np.ndarray, ours: ArticleModes, f_max: float
) -> ArticleModes:
    """CalculiX' modes, completed by our own modes above them.

    Without these the flexibility of the higher modes at the shaker would be missing.
    """
    n = min(len(frequency), int((ours.frequency <= ABOVE * f_max).sum()))
    f = np.where(frequency < RIGID, 0.0, frequency)[:n]
    f = np.concatenate([f, ours.frequency[n:]])
    both = np.concatenate([shapes[..., :n], ours.shapes[..., n:]], axis=-1)
    return ArticleModes(f, ours.rows, both, np.zeros((len(f), len(f))))


def _by_kratos(
    assembly: Assembly, rows: np.ndarray, loaded: np.ndarray, f_max: float, quads: bool
) -> ArticleModes:
    """Modes and static responses by Kratos' elements alone."""
    f, shapes = kratos_modes(assembly, rows, loaded, ABOVE * f_max, not quads)
    return ArticleModes(f, rows, shapes, np.zeros((len(f), len(f))))


def _by_us(
    assembly: Assembly, rows: np.ndarray, loaded: np.ndarray, f_max: float, bending: bool
) -> ArticleModes:
    """Normal modes and static responses to forces at the loaded points, by Rayleigh and Ritz."""
    built = structure(assembly, residual_bending=bending)
    system = built.system
    modes = normal_modes(system, band=ABOVE * f_max)
    translations = (6 * np.unique(loaded)[:, None] + np.arange(3)).ravel()
    extra = attachments(shifted(system, f_max / 4), built.T[translations])
    basis = orthonormal(system.M, [modes.shapes, extra], kept=len(modes))
    lam, Q = eigh(basis.T @ (system.K @ basis))
    shapes = basis @ Q
    moving = (built.T @ shapes).reshape(len(built.assembly.points), 6, -1)[rows, :3]
    f = np.sqrt(np.maximum(lam, 0.0)) / (2 * np.pi)
    f[: int(rigid_modes(modes).sum())] = 0.0
    return ArticleModes(f, rows, moving, shapes.T @ (built.loss @ shapes))
