"""Noise of frequency responses, as stated by a recording or estimated from its scatter."""

import numpy as np

from ..dynamics.frf import FRF

SHARE, LEAST = 0.01, 1e-3  # of |H|, of its rms: assumed where nothing is stated
RESOLVED = 1e-5  # of its rms: what accelerometers and converters resolve, whatever scatters less
_SMOOTH = 9  # lines over which the coherence is smoothed
_POINTS, _DEGREE = 5, 3  # a cubic through five lines is the local smooth course
_WEAK = 0.25  # share of the lines, the faintest, that show the additive noise
_FEW = 24  # lines below which scatter says nothing
_MEDIAN = np.log(2.0)  # median of |z|² over its mean, z complex Gaussian
_PRECISE = 1e-7  # of |H|: what is left below is rounding


def frf_variance(frf: FRF, averages: int = 1) -> np.ndarray:
    """Variance E|ΔH|² of every sample (n_f, n_out, n_in).

    The first source is the variance of the recording. The second is the coherence:
    (1-γ²)/(γ² n)|H|² (Bendat and Piersol 2010, eq. 9.81), smoothed over nine lines, and 1 % of |H|
    for errors that no coherence shows. The last is 1 % of |H| and the scatter of the faint lines of
    each channel. It is at least 0.001 % of the rms, or 0.1 % if lines are too few to show it.
    A larger value would hide accurate faint lines: springs to ground act where accelerances are a
    thousandth of their peaks.
    """
    H = np.abs(frf.values)
    rms = np.sqrt((H**2).mean(axis=0))
    if frf.variance is not None:
        return frf.variance + (1e-4 * H) ** 2 + (1e-6 * rms) ** 2
    if frf.coherence is not None:
        gamma = np.clip(frf.coherence, 1e-3, 1.0)
        ratio = moving_mean((1 - gamma) / gamma, _SMOOTH) / averages
        return (ratio + SHARE**2) * H**2 + (1e-4 * rms) ** 2
    least = RESOLVED if len(H) >= _FEW else LEAST
    return (SHARE * H) ** 2 + np.maximum(faint_scatter(frf), least * np.nan_to_num(rms)) ** 2


def noise_source(frf: FRF, averages: int = 1) -> str:
    """Describe in words the source of the noise in :func:`frf_variance`."""
    if frf.variance is not None:
        return "the variance stated by the recording (averages, repeats or dwells)"
    if frf.coherence is not None:
        return f"the coherence with {averages} assumed averages, and 1 % of |H|"
    return (
        "1 % of |H| and the scatter of each channel's weak lines about their neighbours are "
        "assumed, because the recording states no noise"
    )


def faint_scatter(frf: FRF) -> np.ndarray:
    """Standard deviation of the additive noise by channel (n_out, n_in), from faint lines.

    Five neighbours have one combination of unit norm that vanishes for every cubic in ω. Its
    variance is that of the noise. Between resonances the response is nearly a cubic. Therefore its
    median square over the faintest quarter of the lines shows the noise alone; 0 for few lines.
    """
    H, f = frf.values, frf.frequency
    if len(f) < _FEW:
        return np.zeros(H.shape[1:])
    window = np.arange(len(f) - _POINTS + 1)[:, None] + np.arange(_POINTS)
    x = f[window] - f[window].mean(axis=1, keepdims=True)
    x = x / np.abs(x).max(axis=1, keepdims=True)
    Q, _ = np.linalg.qr(x[:, :, None] ** np.arange(_DEGREE + 1), mode="complete")
    left = np.zeros((len(window), *H.shape[1:]), complex)
    for k in range(_POINTS):
        left += Q[:, k, -1, None, None] * H[k : k + len(window)]
    size = np.abs(H[_POINTS // 2 : _POINTS // 2 + len(window)])
    return np.sqrt(_median_square(np.abs(left) ** 2, size, faint=True))


def left_variance(rest: np.ndarray, H: np.ndarray, used: np.ndarray) -> np.ndarray:
    """a²|H|² + b² by channel from the residual of a fit H (n_f, n_c), see `left_scatter`.

    H is the fit, not the sample: weights that depend on the noise would bias the estimate.
    """
    a2, b2 = left_scatter(rest, H, used)
    return a2 * np.abs(H) ** 2 + b2


def left_scatter(
    rest: np.ndarray, H: np.ndarray, used: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """a² and b² (n_c,): noise as a share of the response H and additive, by the residual of a fit.

    b is from the faintest lines, a from the strongest; ``used`` marks the samples that count.
    """
    size = np.where(used, np.abs(H), np.nan)
    square = np.where(used, np.abs(rest) ** 2, np.nan)
    b2 = _median_square(square, size, faint=True)
    over = np.maximum(square - _MEDIAN * b2, 0) / np.maximum(size, 1e-300) ** 2
    return np.maximum(_median_square(over, size, faint=False), _PRECISE**2), b2


def _median_square(square: np.ndarray, size: np.ndarray, faint: bool) -> np.ndarray:
    """E z² from the median over the faintest, or strongest, lines of each channel."""
    order = np.argsort(np.where(np.isfinite(size), size, np.inf if faint else -np.inf), axis=0)
    n = max(1, int(_WEAK * len(size)))
    picked = np.take_along_axis(square, order[:n] if faint else order[-n:], axis=0)
    held = np.isfinite(picked)
    alone = np.where(held.any(axis=0), 0.0, 1.0)  # a dead channel has no scatter
    picked = np.where(alone > 0, 0.0, picked)
    return np.nanmedian(picked, axis=0) / _MEDIAN


def moving_mean(x: np.ndarray, lines: int) -> np.ndarray:
    """Moving mean over a number of lines (n_f, ...); the ends are repeated."""
    from scipy.ndimage import uniform_filter1d

    return np.asarray(uniform_filter1d(x, min(lines, len(x)), axis=0, mode="nearest"))
