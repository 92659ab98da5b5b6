"""Faults of channels, from measured mode shapes and a model that has errors itself.

A measured shape mixes the model's shapes near it, and each channel has an error of its own:

    ψ_r ~ s_r N(0, Σ_m κ_rm² φ_m φ_mᵀ + σ² I),  κ_rm² = 1 / (1 + (ln(f_m / c f_r) / ε)²).

To first order, a change of the model mixes modes in inverse proportion to their distance. ε, σ and
the common factor c of the frequencies maximise the likelihood. The scale s_r is profiled:
ln L = Σ_r -n/2 ln(ψ_rᵀ C_r⁻¹ ψ_r) - ½ ln|C_r|. A fault of a channel changes ψ or the rows of Φ. It
is a wrong sign, gain, direction or place, or an exchange of two channels. It is named if ln L rises
by more than the number of trials explains.

A patch that the model lacks changes shapes about a sensor, as a move of the sensor does. Therefore
a wrong gain, place or direction is only a warning. It must fit better than a channel with its own
error τ² (C_r + τ² e_i e_iᵀ). A reversed sign and an exchange are faults.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..units import number
from .finding import Finding, Severity
from .odds import evidence_in_words

LEAST_CHANNELS, LEAST_MODES = 5, 4
MIX = (0.02, 0.06, 0.2)  # ε
ERROR = (0.03, 0.08, 0.2, 0.45)  # σ, of the rms of a shape
SHIFT = (-0.12, -0.06, 0.0, 0.06, 0.12)  # ln c
FINE = np.log(np.geomspace(0.15, 6.5, 61))
COARSE = np.log(np.geomspace(6.5, 1e4, 30)[1:])  # a dead channel shows less than the inverse
GAINS = np.concatenate([-COARSE[::-1], FINE, COARSE])
LEAST_GAIN = 0.18  # ln: 3 % is the tolerance of a sensor; no model knows a shape to much better
OWN = np.geomspace(0.05, 5.0, 9)  # τ, of the rms of a shape: an error of one channel alone
THRESHOLD = 30.0  # of ln L, after the price of the trials: physics left out reaches half of it
RARE = np.log(100.0)  # one recording in a hundred has a given fault
MIMICKED = 15.0  # of ln L, of what physics may mimic, over a channel that the model misjudges
_UNLESS = ", unless the model is wrong about the shapes there"
WORST, LIKELY = 3, 6  # channels for which other places are tried, mixtures they are tried in
COPY = 0.05  # of the power of two channels, their difference: they may be one
MOST_FAULTS = 3  # faults that are named one after another


@dataclass(frozen=True, eq=False)
class ModelShapes:
    """Shapes of the model at the channels, also for other directions and places."""

    values: np.ndarray  # (n, m) shapes at the outputs
    frequency: np.ndarray  # (m,) [Hz]
    # (n) -> (k, m), names: the same places along other directions
    turned: Callable[[int], tuple[np.ndarray, list[str]]] | None = None
    # (n) -> (k, m), names: other places along the channel's direction
    elsewhere: Callable[[int], tuple[np.ndarray, list[str]]] | None = None


@dataclass(frozen=True, eq=False)
class _Fault:
    """A hypothesis: gain over no fault, gain over a misjudged channel, and its finding."""

    gain: float
    over_misjudged: float
    finding: Finding


def shape_faults(
    labels: tuple[str, ...], psi: np.ndarray, frequency: np.ndarray, model: ModelShapes
) -> list[Finding]:
    """Find faults of channels and pairs, the surest first; each search excludes earlier ones.

    Parameters
    ----------
    psi : (n, r)         measured shapes, real, any scale
    frequency : (r,)     [Hz]
    """
    n, r = psi.shape
    if n < LEAST_CHANNELS or r < LEAST_MODES or model.values.shape[1] < LEAST_MODES:
        return []
    phi, at = model.values, np.arange(n)
    psi = psi / np.linalg.norm(psi, axis=0)
    found: list[Finding] = []
    for _ in range(MOST_FAULTS):
        best = _best(labels, psi, frequency, phi, model, at)
        if best is None:
            break
        found.append(best.finding)
        fine = np.array([label not in best.finding.channels for label in labels])
        if fine.sum() < LEAST_CHANNELS:
            break
        labels = tuple(label for label, f in zip(labels, fine, strict=True) if f)
        psi, phi, at = psi[fine], phi[fine], at[fine]
    return found


def _best(
    labels: tuple[str, ...],
    psi: np.ndarray,
    f: np.ndarray,
    phi: np.ndarray,
    model: ModelShapes,
    at: np.ndarray,
) -> _Fault | None:
    """Find the fault that raises ln L most; ε, σ and c are optimised for each.

    ``at`` (n,) are the positions of the channels in the model.
    """
    grid = [_Mixture.of(phi, model.frequency, f, e, s, c)
            for e in MIX for s in ERROR for c in SHIFT]  # fmt: skip
    null = max(g.likelihood(psi) for g in grid)
    misjudged = _misjudged(psi, grid)
    found = [
        _reversed(labels, psi, grid, null),
        _gains(labels, psi, grid, null, misjudged.max(axis=0)),
        _exchanges(labels, psi, grid, null),
    ]
    found += _other_rows(labels, psi, phi, model, at, grid, null, misjudged)
    best: dict[str, _Fault] = {}  # of each channel: what explains it less is not named instead
    for fault in sorted(found, key=lambda fault: fault.gain):
        best[fault.finding.channels[0]] = fault
    sure = [f for f in best.values() if f.gain > THRESHOLD and f.over_misjudged > MIMICKED]
    return max(sure, key=lambda fault: fault.gain, default=None)


def _misjudged(psi: np.ndarray, grid: list["_Mixture"]) -> np.ndarray:
    """Compute ln L with a larger model error at one channel, for each mixture (n_grid, n).

    The channel has its own τ², C_i = C + τ² e_i e_iᵀ: the effect of missing physics at a sensor. A
    fault that missing physics may imitate must fit better than this.
    """
    n, r = psi.shape
    L = np.full((len(grid), n), -np.inf)
    for k, g in enumerate(grid):
        pull = np.einsum("rij,jr->ir", g.inverse, psi)
        own = np.einsum("rii->ir", g.inverse)
        q0 = g.squares(psi)
        for tau2 in OWN**2 / n:
            more = 1 + tau2 * own
            q = np.maximum(q0 - tau2 * pull**2 / more, 1e-300)
            L[k] = np.maximum(L[k], g.total(q) - np.log(more).sum(axis=1) / 2)
    return np.asarray(L - np.log(max(r, 2)) / 2)


@dataclass(frozen=True, eq=False)
class _Mixture:
    """C_r⁻¹ (r, n, n) and ln|C_r| (r,) for one ε, σ and c."""

    inverse: np.ndarray
    log_det: np.ndarray
    mixing: np.ndarray  # κ² (r, m), of columns of unit norm
    norm: np.ndarray  # (m,)
    sigma2: float
    settings: tuple[float, float, float]

    @classmethod
    def of(
        cls, phi: np.ndarray, f_model: np.ndarray, f: np.ndarray, e: float, s: float, c: float
    ) -> "_Mixture":
        n = len(phi)
        norm = np.maximum(np.linalg.norm(phi, axis=0), 1e-300)
        far = (np.log(f_model / f[:, None]) - c) / e
        mixing = 1 / (1 + far**2)
        unit = phi / norm
        C = np.einsum("im,rm,jm->rij", unit, mixing, unit) + s**2 / n * np.eye(n)
        _, log_det = np.linalg.slogdet(C)
        return cls(np.linalg.inv(C), log_det, mixing, norm, s**2 / n, (e, s, c))

    def squares(self, psi: np.ndarray) -> np.ndarray:
        """ψᵀ C⁻¹ ψ (r,)."""
        return np.einsum("ir,rij,jr->r", psi, self.inverse, psi)

    def total(self, squares: np.ndarray) -> np.ndarray:
        """ln L of squares (..., r)."""
        n = self.inverse.shape[1]
        return (-n / 2 * np.log(squares) - self.log_det / 2).sum(axis=-1)

    def likelihood(self, psi: np.ndarray) -> float:
        """ln L."""
        return float(self.total(self.squares(psi)))


def _reversed(
    labels: tuple[str, ...], psi: np.ndarray, grid: list[_Mixture], null: float
) -> _Fault:
    """One channel times -1."""
    L = _of_factors(psi, grid, np.array([-1.0]), slice(None))[:, 0]
    i = int(L.argmax())
    return _scaled(labels, i, -1.0, float(L[i] - null - np.log(len(psi)) - RARE), np.inf)


def _gains(
    labels: tuple[str, ...],
    psi: np.ndarray,
    grid: list[_Mixture],
    null: float,
    misjudged: np.ndarray,
) -> _Fault:
    """One channel times a real factor g: the true motion is ψ_i / g."""
    n, r = psi.shape
    factors = np.concatenate([np.exp(GAINS), -np.exp(GAINS)])
    L = _of_factors(psi, grid, factors, slice(None))
    L[:, np.abs(np.log(np.abs(factors))) < LEAST_GAIN] = -np.inf
    k, at = (int(v) for v in np.unravel_index(L.argmax(), L.shape))
    price = np.log(n) + RARE + 0.5 * np.log(max(r, 2)) + 1.0
    step = float(np.diff(GAINS).max())
    near = factors[at] * np.exp(np.linspace(-step, step, 201))
    near = near[np.abs(np.log(np.abs(near))) >= LEAST_GAIN]
    closer = _of_factors(psi, grid, near, slice(k, k + 1))[0]
    best = int(closer.argmax())
    over = float(closer[best] - misjudged[k] - 1.0)
    return _scaled(labels, k, float(near[best]), float(closer[best] - null - price), over)


def _of_factors(
    psi: np.ndarray, grid: list[_Mixture], factors: np.ndarray, rows: slice
) -> np.ndarray:
    """Greatest ln L of some channels each times a factor (n_rows, n_factors)."""
    u, some = 1 / factors - 1, psi[rows]
    L = np.full((len(some), len(factors)), -np.inf)
    for g in grid:
        pull = np.einsum("rij,jr->ir", g.inverse, psi)[rows]
        own = np.einsum("rii->ir", g.inverse)[rows]
        q = (
            g.squares(psi)
            + 2 * u[None, :, None] * (some * pull)[:, None]
            + (u**2)[None, :, None] * (some**2 * own)[:, None]
        )
        L = np.maximum(L, g.total(q))
    return L - psi.shape[1] * np.log(np.abs(factors))


def _scaled(labels: tuple[str, ...], i: int, g: float, gain: float, over: float) -> _Fault:
    label = labels[i]
    if g == -1.0:
        kind, text = "reversed sign", f"output {label} has the wrong sign in every mode"
        mend = f"in sensors.csv reverse the direction of {label}"
    else:
        turned = " and has the wrong sign" if g < 0 else ""
        kind, text = (
            "wrong gain",
            f"output {label} is {number(abs(g), 3)} times as large as the shapes allow{turned}",
        )
        mend = f"in sensors.csv give {label} the gain {g:.3g}"
    unless = "" if g == -1.0 else _UNLESS
    text += f" ({evidence_in_words(gain)}){unless}."
    severity: Severity = "fault" if g == -1.0 else "warning"
    undo = ("reversed", label) if g == -1.0 else ()
    return _Fault(gain, over, Finding(kind, text, severity, (label,), mend, g, undo))


def _exchanges(
    labels: tuple[str, ...], psi: np.ndarray, grid: list[_Mixture], null: float
) -> _Fault:
    """Two channels under each other's label."""
    n = len(psi)
    pairs = np.array(list(combinations(range(n), 2)))
    i, j = pairs.T
    d = psi[j] - psi[i]  # (pairs, r): what the exchange adds to row i and takes from row j
    L = np.full(len(pairs), -np.inf)
    for g in grid:
        pull = np.einsum("rij,jr->ir", g.inverse, psi)
        own = np.einsum("rii->ir", g.inverse)
        tied = g.inverse[:, i, j].T
        q = g.squares(psi) + 2 * d * (pull[i] - pull[j]) + d**2 * (own[i] + own[j] - 2 * tied)
        L = np.maximum(L, g.total(q))
    k = int(L.argmax())
    gain = float(L[k] - null - np.log(len(pairs)) - RARE)
    a, b = (int(v) for v in pairs[k])
    names = (labels[a], labels[b])
    text = (
        f"outputs {names[0]} and {names[1]} are exchanged: each fits the other's place "
        f"({evidence_in_words(gain)})."
    )
    mend = f"in sensors.csv exchange the labels {names[0]} and {names[1]}"
    undo = ("exchanged", *names)
    found = Finding("swapped channels", text, "fault", names, mend, mend=undo)
    return _Fault(gain, np.inf, found)


def _other_rows(
    labels: tuple[str, ...],
    psi: np.ndarray,
    phi: np.ndarray,
    model: ModelShapes,
    at: np.ndarray,
    grid: list[_Mixture],
    null: float,
    misjudged: np.ndarray,
) -> list[_Fault]:
    """Try the worst channels along other directions, at other places, and as copies of others."""
    first = max(grid, key=lambda g: g.likelihood(psi))
    pull = np.einsum("rij,jr->ir", first.inverse, psi)
    odd = (pull**2 / np.einsum("rii->ir", first.inverse) / first.squares(psi)).sum(axis=1)
    out = []
    for i in np.argsort(-odd)[:WORST]:
        likely = np.argsort(-misjudged[:, i])[:LIKELY]  # by the other channels
        near = [grid[k] for k in likely] + grid[:: max(1, len(grid) // 12)]
        own = float(misjudged[:, i].max())
        gap = ((psi - psi[i]) ** 2).sum(axis=1) / ((psi**2).sum(axis=1) + (psi[i] ** 2).sum())
        others = np.flatnonzero((gap < COPY) & (np.arange(len(psi)) != i))  # nearly the same motion
        tried = [("copy", (phi[others], [labels[k] for k in others]))]
        tried += [("turned", model.turned(int(at[i])))] if model.turned else []
        tried += [("elsewhere", model.elsewhere(int(at[i])))] if model.elsewhere else []
        for kind, (values, names) in tried:
            if len(names):
                words = (labels, psi, phi, int(i), kind, values, names, near, null, own)
                out.append(_replaced(*words))
    return out


def _replaced(
    labels: tuple[str, ...],
    psi: np.ndarray,
    phi: np.ndarray,
    i: int,
    kind: str,
    rows: np.ndarray,
    names: list[str],
    grid: list[_Mixture],
    null: float,
    misjudged: float,
) -> _Fault:
    """Replace row i of the model by each of others (k, m); other channels predict its motion."""
    n = len(psi)
    keep = np.arange(n) != i
    L = np.full(len(rows), -np.inf)
    for g in grid:
        unit, other = phi[keep] / g.norm, rows / g.norm
        C = np.einsum("im,rm,jm->rij", unit, g.mixing, unit) + g.sigma2 * np.eye(n - 1)
        cross = np.einsum("km,rm,jm->rkj", other, g.mixing, unit)
        inverse = np.linalg.inv(C)
        _, log_det = np.linalg.slogdet(C)
        held = np.einsum("rij,jr->ri", inverse, psi[keep])
        rest = np.einsum("ir,ri->r", psi[keep], held)
        mean = np.einsum("rkj,rj->rk", cross, held)
        v = np.einsum("km,rm->rk", other**2, g.mixing) + g.sigma2
        v = v - np.einsum("rki,rij,rkj->rk", cross, inverse, cross, optimize=True)
        v = np.maximum(v, 0.5 * g.sigma2)
        q = rest[:, None] + (psi[i][:, None] - mean) ** 2 / v
        L = np.maximum(L, (-n / 2 * np.log(q) - (log_det[:, None] + np.log(v)) / 2).sum(axis=0))
    k = int(L.argmax())
    gain = float(L[k] - null - np.log(n * len(rows)) - RARE)
    label = labels[i]
    if kind == "copy":
        text = (
            f"output {label} shows the motion of {names[k]} ({evidence_in_words(gain)}), as if "
            f"both were at one place{_UNLESS}."
        )
        mend = f'in sensors.csv give {label} the cell use = "no"'
        both = (label, names[k])
        finding = Finding("duplicated channels", text, "warning", both, mend)
    elif kind == "turned":
        text = f"output {label} points along {names[k]} ({evidence_in_words(gain)}){_UNLESS}."
        mend = f"in sensors.csv give {label} the direction {names[k]}"
        finding = Finding("turned sensor", text, "warning", (label,), mend)
    else:
        text = f"output {label} seems to be near {names[k]} ({evidence_in_words(gain)}){_UNLESS}."
        mend = f"check the place of {label} and correct it in sensors.csv"
        finding = Finding("misplaced sensor", text, "warning", (label,), mend)
    return _Fault(gain, float(L[k] - misjudged - np.log(len(rows))), finding)
