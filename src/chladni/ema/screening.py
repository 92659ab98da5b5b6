"""Linearity of a structure, by recordings at several levels of excitation."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import gammaincc

from ..dynamics.frf import FRF
from ..errors import ShapeError, named
from .correlation import log10
from .finding import Check, Finding, probability
from .response_variance import moving_mean
from .setup import Recording


@dataclass(frozen=True, eq=False)
class Homogeneity:
    """Comparison of two levels of the same test."""

    ratio: float  # mean |H₂ - H₁|² / (σ₁² + σ₂²): 1 for a linear structure
    rms: float  # of log₁₀(H₂ / H₁), complex: the size of the difference
    channel: np.ndarray  # (n_out, n_in) ratio of each channel
    frequency: np.ndarray  # (n_f,) Hz, the common lines
    line: np.ndarray  # (n_f,) ratio about each line
    limit: float  # ratio that chance does not reach
    linear: bool
    p: float = float("nan")  # of so large a ratio by chance, N ratio being of a gamma distribution
    # outputs whose own ratio is beyond chance, the one first that moves most for its own response;
    # none where it is linear
    channels: tuple[str, ...] = ()
    # ((low, high), ...) runs of such lines [Hz], the worst first; none likewise
    bands: tuple[tuple[float, float], ...] = ()


_POOLED = 15  # lines over which a variance is taken: one of few averages is too uncertain alone
_ABOUT = 31  # lines by which a band is known
_NAMED = 4  # channels and bands, in words
_CHANCE = 0.1  # what the uncertain variances of five sweeps leave of the mean ratio, and more


def homogeneity(low: FRF, high: FRF, least: float = 0.01) -> Homogeneity:
    """Test whether the response is proportional to the level: |H₂ - H₁|² over the noise.

    Worden and Tomlinson (2001), Nonlinearity in Structural Dynamics, section 2.3 (homogeneity).
    The result is ``linear`` unless the ratio is beyond chance (1.1, or five standard deviations of
    a mean of exponential variates) *and* the responses differ by more than ``least`` in log₁₀.

    The second recording is interpolated to the lines of the first. Without a stated variance, the
    noise is the deviation from a parabola through five lines (`roughness`). Variances are means
    over 15 lines: the reciprocal of one that comes from ν averages is too large by ν/(ν - 1).
    """
    if (low.outputs, low.inputs, low.quantity) != (high.outputs, high.inputs, high.quantity):
        raise ShapeError("the two levels differ in labels or quantity; use FRF.sel first")
    first, last = (
        fold(a.frequency[k], b.frequency[k])
        for fold, a, b, k in ((max, low, high, 0), (min, low, high, -1))
    )
    at = (first <= low.frequency) & (low.frequency <= last) & (low.frequency > 0)
    if at.sum() < 5:
        raise ShapeError(
            f"the levels share {int(at.sum())} lines: {low.frequency[0]:g}-{low.frequency[-1]:g} "
            f"and {high.frequency[0]:g}-{high.frequency[-1]:g} Hz"
        )
    f = low.frequency[at]
    H1, H2 = low.values[at], _interpolated(f, high.frequency, high.values)
    noise = noise_of(low)[at] + _interpolated(f, high.frequency, noise_of(high)).real
    rounding = 1e-12 * np.abs(H1) ** 2 + 1e-300
    whitened = np.abs(H2 - H1) ** 2 / np.maximum(moving_mean(noise, _POOLED), rounding)
    delta = log10(H2 / H1)
    ratio, rms = float(whitened.mean()), float(np.sqrt((np.abs(delta) ** 2).mean()))
    limit = 1 + max(_CHANCE, 5 / np.sqrt(whitened.size))
    linear = bool(ratio <= limit or rms <= least)
    channel, line = whitened.mean(axis=0), moving_mean(whitened.mean(axis=(1, 2)), _ABOUT)
    moved = (np.abs(H2 - H1) ** 2 - noise).mean(axis=0)
    moved /= np.maximum((np.abs(H1) ** 2 + np.abs(H2) ** 2).mean(axis=0), 1e-300)
    beyond = _beyond(low.outputs, channel.max(axis=1), moved.max(axis=1), len(f))
    return Homogeneity(
        ratio=ratio,
        rms=rms,
        channel=channel,
        frequency=f,
        line=line,
        limit=float(limit),
        linear=linear,
        p=float(gammaincc(whitened.size, whitened.size * ratio)),
        channels=() if linear else beyond,
        bands=() if linear else _bands_beyond(f, line),
    )


def _beyond(
    outputs: Sequence[str], ratio: np.ndarray, moved: np.ndarray, lines: int
) -> tuple[str, ...]:
    """Outputs (n_out,) whose ratio chance does not reach, in the order of how far they move.

    A local force f adds -H_oc f to output o. Relative to the output's own response that is large
    where the force acts (o = c). Relative to the noise it is large at outputs of little noise.
    """
    limit = 1 + max(2 * _CHANCE, 5 / np.sqrt(lines))
    return tuple(outputs[k] for k in np.argsort(-moved, kind="stable") if ratio[k] > limit)


def runs(f: np.ndarray, lines: np.ndarray) -> tuple[tuple[float, float], ...]:
    """Runs of lines as bands [Hz]; single lines make none.

    >>> runs(np.arange(6.0), np.array([0, 1, 1, 0, 1, 1], bool))
    ((1.0, 2.0), (4.0, 5.0))
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], lines, [False]])))
    pairs = zip(edges[::2], edges[1::2] - 1, strict=True)
    return tuple((float(f[a]), float(f[b])) for a, b in pairs if b > a)


def _bands_beyond(f: np.ndarray, line: np.ndarray) -> tuple[tuple[float, float], ...]:
    """Runs of lines whose ratio chance does not reach, the worst first [Hz]."""
    found = runs(f, line > 1 + 5 / np.sqrt(min(_ABOUT, len(f))))
    worst = [float(line[(f >= a) & (f <= b)].max()) for a, b in found]
    return tuple(found[k] for k in np.argsort(-np.array(worst), kind="stable"))


def levels_checked(
    recording: Recording, others: Sequence[Recording]
) -> tuple[list[Finding], list[Check]]:
    """Compare recordings of the same channels with this one: other levels and repeats."""
    found: list[Finding] = []
    said: dict[str, list[str]] = {"homogeneity": [], "repeatability": []}
    odd: set[str] = set()
    for other in others:
        if (compared := _compared(recording, other)) is None:
            continue
        name = "homogeneity" if recording.level != other.level else "repeatability"
        size, p = f"{compared.ratio:.{0 if compared.ratio > 99 else 2}f}", probability(compared.p)
        text = f"{size} times the noise, {p}, rms {compared.rms:.2g}"
        said[name].append(f"{other.name}: {text} decades")
        if compared.linear or name == "repeatability":
            continue
        odd.add(name)
        sentence = (
            f"levels {recording.level:g} and {other.level:g} do not give the same FRFs: their "
            f"difference is {size} times their noise ({p}, {compared.rms:.2g} decades rms), "
            f"{_worst(compared)}: not linear."
        )
        mend = "choose one level by use in case.toml; the result is valid for that level"
        worst = compared.channels[:_NAMED]
        found.append(Finding("not linear", sentence, "warning", worst, mend, compared.ratio))
    needs = {"homogeneity": "needs two levels", "repeatability": "needs a second recording"}
    checks = [
        Check(name, "; ".join(lines) or needs[name], name not in odd if lines else None)
        for name, lines in said.items()
    ]
    return found, checks


def _worst(h: Homogeneity) -> str:
    """Channels and bands in which two levels differ most, in words."""
    said = f"largest near {h.frequency[h.line.argmax()]:.4g} Hz"
    if h.channels:
        said += f", at {named(h.channels, _NAMED)} (the first moves most)"
    if h.bands:
        bands = ", ".join(f"{a:.4g} to {b:.4g} Hz" for a, b in h.bands[:_NAMED])
        said += f", in {bands}"
    return said


def _compared(one: Recording, other: Recording) -> Homogeneity | None:
    """Return their homogeneity, or None if articles, channels or lines differ."""
    a, b = one.frf, other.frf
    if a is None or b is None or one.article != other.article or other is one:
        return None
    if (one.level is None) != (other.level is None):
        return None
    try:
        return homogeneity(a, b)
    except ShapeError:
        return None


def _interpolated(f: np.ndarray, grid: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values at f, linear between the lines of grid (n_f, ...)."""
    k = np.clip(np.searchsorted(grid, f, side="right") - 1, 0, len(grid) - 2)
    t = ((f - grid[k]) / (grid[k + 1] - grid[k])).reshape(-1, *[1] * (values.ndim - 1))
    return (1 - t) * values[k] + t * values[k + 1]


def noise_of(frf: FRF) -> np.ndarray:
    """Variance of every sample: the recording's own, else from its roughness (n_f, n_out, n_in)."""
    return roughness(frf) if frf.variance is None else frf.variance


def roughness(frf: FRF) -> np.ndarray:
    """Variance of a sample by its deviation from a parabola through five neighbouring lines.

    The residual of the middle of five against the least-squares parabola has variance 18/35 σ²
    on an even grid; medians over 21 lines keep resonances out.
    """
    from scipy.ndimage import median_filter

    n = len(frf.frequency)
    if n < 5:
        raise ShapeError(f"{n} lines are too few to estimate the noise")
    weights = np.array([-3, 12, 17, 12, -3]) / 35
    smooth = sum(w * frf.values[k : n - 4 + k] for k, w in enumerate(weights))
    power = np.abs(frf.values[2 : n - 2] - smooth) ** 2 * 35 / 18
    width = min(21, n - 4)
    inner = median_filter(power, size=(width, 1, 1), mode="reflect") / np.log(2)
    return np.pad(inner, ((2, 2), (0, 0), (0, 0)), mode="edge")
