"""Modes of an article at the few points that matter, by our elements or by CalculiX."""

import hashlib
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from scipy.linalg import eigh

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.reduction import attachments, orthonormal, shifted
from chladni.fem.assemble import Structure, structure
from chladni.model.assembly import Assembly
from chladni.output import write_npz

from .calculix import calculix_modes

Solver = Literal["chladni", "calculix"]
ABOVE = 1.6  # our modes reach up to this many times the highest recorded frequency
BY_CALCULIX = 70  # modes CalculiX is asked for


@dataclass(frozen=True, eq=False)
class ArticleModes:
    """Modes of an article, rigid ones first, those above the band as a static complement.

    Attributes
    ----------
    frequency : (r,) Hz
    rows : (k,) int          rows of the article's points, increasing
    shapes : (k, 3, r)       motion of these points [1/√kg]
    loss : (r, r)            Φᵀ K_loss Φ of materials with losses [rad²/s²]
    """

    frequency: np.ndarray
    rows: np.ndarray
    shapes: np.ndarray
    loss: np.ndarray

    def at(self, rows: np.ndarray) -> np.ndarray:
        """Motion (..., 3, r) of these points."""
        return np.asarray(self.shapes[np.searchsorted(self.rows, rows)])


def article_modes(
    assembly: Assembly,
    rows: np.ndarray,
    loaded: np.ndarray,
    top: float,
    solver: Solver = "chladni",
    cache: Path | None = None,
    residual_bending: bool = True,
) -> ArticleModes:
    """Modes at some points.

    Parameters
    ----------
    rows : points whose motion is wanted
    loaded : points forces act on: ours are exact for static loads there
    top : highest frequency recorded [Hz]
    residual_bending : of our shells; False is another formulation
    """
    rows = np.unique(np.concatenate([rows.ravel(), loaded.ravel()]))
    if solver == "calculix":
        f, shapes = calculix_modes(assembly, BY_CALCULIX, rows, cache)
        f = np.where(f < 0.02, 0.0, f)  # rigid modes, their rounding
        return ArticleModes(f, rows, shapes, np.zeros((len(f), len(f))))
    mark = fingerprint((assembly, rows, loaded, top, residual_bending))
    kept = None if cache is None else cache / f"{mark}.npz"
    if kept is not None and kept.exists():
        with np.load(kept, allow_pickle=False) as held:
            return ArticleModes(*(held[f.name] for f in fields(ArticleModes)))
    found = _ours(structure(assembly, residual_bending=residual_bending), rows, loaded, top)
    if kept is not None:
        write_npz(kept, **{f.name: getattr(found, f.name) for f in fields(ArticleModes)})
    return found


def _ours(built: Structure, rows: np.ndarray, loaded: np.ndarray, top: float) -> ArticleModes:
    """Normal modes and static responses to forces at the loaded points, by Rayleigh and Ritz."""
    system = built.system
    X = built.assembly.points[built.assembly.rows(system.dofs[:, 0])]
    modes = normal_modes(system, band=ABOVE * top, points=X)
    translations = (6 * np.unique(loaded)[:, None] + np.arange(3)).ravel()
    extra = attachments(shifted(system, top / 4, X), built.T[translations])
    basis = orthonormal(system.M, [modes.shapes, extra], kept=len(modes))
    lam, Q = eigh(basis.T @ (system.K @ basis))
    shapes = basis @ Q
    moving = (built.T @ shapes).reshape(len(built.assembly.points), 6, -1)[rows, :3]
    f = np.sqrt(np.maximum(lam, 0.0)) / (2 * np.pi)
    return ArticleModes(f, rows, moving, shapes.T @ (built.loss @ shapes))


def fingerprint(value: Any) -> str:
    """Hash of a value's content: dataclasses and tuples field by field, arrays by their bytes."""
    digest = hashlib.sha256()
    _fed(digest, value)
    return digest.hexdigest()[:24]


def _fed(digest: Any, value: Any) -> None:
    if isinstance(value, np.ndarray):
        digest.update(
            f"{value.dtype}{value.shape}".encode() + np.ascontiguousarray(value).tobytes()
        )
    elif is_dataclass(value) and not isinstance(value, type):
        digest.update(type(value).__name__.encode())
        for field in fields(value):
            _fed(digest, getattr(value, field.name))
    elif isinstance(value, tuple | list):
        for item in value:
            _fed(digest, item)
    else:
        digest.update(repr(value).encode())
