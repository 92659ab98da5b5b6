"""Thickness predicted from curvature for parts without forming data, with its uncertainty.

Thinning 1 - t/t₀ is a linear function of the curvature at a place and around it. It is learned from
parts with mapped thickness. Pressing tools differ, so that parts differ more than places. Each part
has its own strength from a distribution whose standard deviation is learned too. Leave-one-part-out
errors give the accuracy on an unseen part.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import ModelError
from ..model.assembly import Assembly
from ..model.properties import ShellSection
from .curvature import part_curvature
from .thickness_mapping import shell_area

HALF = 25.0  # curvature at which the feature κ/(κ + HALF) is one half [1/m]
AROUND = 0.020  # radius of the neighbourhood [m]
FEATURES = ("one", "bent", "bent around")


@dataclass(frozen=True, eq=False)
class ThinningModel:
    """1 - t/t₀ = x·β (1 + e_part) + e_place."""

    beta: np.ndarray  # (3,) of FEATURES
    part_spread: float  # standard deviation of a part's strength, relative
    place_spread: float  # of a place within a part [-]
    left_out: dict[str, float]  # part -> rms error of t/t₀ predicted from all other parts
    trivial: dict[str, float]  # part -> rms error of t/t₀ for the gauge thickness


def gauge(assembly: Assembly) -> np.ndarray:
    """Thickness of the blank of every shell (n,), that of its section [m]."""
    out = []
    for part in assembly.parts:
        known = isinstance(part.section, ShellSection)
        out.append(part.section.thickness if known else np.nan)  # type: ignore[union-attr]
    return np.array(out, dtype=float)[assembly.shells.part]


def features(assembly: Assembly) -> np.ndarray:
    """1, κ/(κ + 25) of each shell, and its mean within 20 mm on the same part (n, 3)."""
    from scipy.spatial import cKDTree

    kappa = part_curvature(assembly).mean(axis=1)
    bent = kappa / (kappa + HALF)
    middle, area = assembly.points[assembly.shells.nodes].mean(axis=1), shell_area(assembly)
    around = np.zeros(len(bent))
    for part in np.unique(assembly.shells.part):
        rows = np.flatnonzero(assembly.shells.part == part)
        near = cKDTree(middle[rows]).query_ball_point(middle[rows], AROUND)
        around[rows] = [np.average(bent[rows][k], weights=area[rows][k]) for k in near]
    return np.column_stack([np.ones(len(bent)), bent, around])


def learn(assembly: Assembly, parts: tuple[str, ...] = ()) -> ThinningModel:
    """Fit the model to the parts of an assembly with mapped thickness."""
    X, y = features(assembly), 1 - assembly.thickness() / gauge(assembly)
    weight = shell_area(assembly)
    named = [assembly.part(p) for p in parts] or np.unique(assembly.shells.part).tolist()
    rows = {p: np.flatnonzero(assembly.shells.part == p) for p in named}
    rows = {p: r for p, r in rows.items() if np.abs(y[r]).max() > 1e-4}
    if len(rows) < 3:
        raise ModelError(
            f"{len(rows)} parts have mapped thickness; three or more are needed to learn from"
        )
    beta = _fit(X, y, weight, list(rows.values()))
    strength = np.array([_strength(X[r] @ beta, y[r], weight[r]) for r in rows.values()])
    within = np.concatenate(
        [y[r] - s * (X[r] @ beta) for r, s in zip(rows.values(), strength, strict=True)]
    )
    left_out, trivial = {}, {}
    for p, r in rows.items():
        others = [q for k, q in rows.items() if k != p]
        guess = np.clip(X[r] @ _fit(X, y, weight, others), 0, 0.5)
        name = assembly.parts[p].name
        left_out[name] = _rms(y[r] - guess, weight[r])
        trivial[name] = _rms(y[r], weight[r])
    every = np.concatenate(list(rows.values()))
    std = float(np.std(strength, ddof=1))
    return ThinningModel(beta, std, _rms(within, weight[every]), left_out, trivial)


def _rms(error: np.ndarray, weight: np.ndarray) -> float:
    return float(np.sqrt((weight * error**2).sum() / weight.sum()))


def _fit(X: np.ndarray, y: np.ndarray, weight: np.ndarray, rows: list[np.ndarray]) -> np.ndarray:
    """Weighted least squares with the same total weight for every part."""
    r = np.concatenate(rows)
    w = np.concatenate([weight[k] / weight[k].sum() for k in rows])
    root = np.sqrt(w)[:, None]
    return np.linalg.lstsq(root * X[r], root[:, 0] * y[r], rcond=1e-10)[0]


def _strength(guess: np.ndarray, y: np.ndarray, weight: np.ndarray) -> float:
    """Scale of the prediction that fits a part best."""
    return float((weight * guess * y).sum() / np.maximum((weight * guess**2).sum(), 1e-30))


def predict(assembly: Assembly, model: ThinningModel) -> tuple[np.ndarray, np.ndarray]:
    """Mean and standard deviation of every shell's thickness (n,) [m]: a prior for calibration."""
    thinning = np.clip(features(assembly) @ model.beta, 0, 0.5)
    t0 = gauge(assembly)
    sd = np.hypot(model.part_spread * thinning, model.place_spread)
    return t0 * (1 - thinning), t0 * sd
