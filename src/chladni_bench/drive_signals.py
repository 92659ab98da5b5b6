"""Excitation signals of a block: pink bursts, odd multisines, blows of a hammer.

Signals are sums of the block's spectral lines, so they are exact on any finer time grid (no images,
no aliasing).
"""

from typing import Literal

import numpy as np

Kind = Literal["burst-random", "stepped-sine", "multisine", "hammer"]

ON = 0.6  # of a block a burst lasts; the rest is silent (Echaniz Granado 2015, section 4.2.5.2)
FADE = 0.02  # of a block the burst takes to rise and to fall
BLOW = 0.8  # width of a blow times the highest frequency: its spectrum has fallen 6 dB there
UNEVEN = 0.2  # standard deviation of ln of a blow's size
LEAD = 0.01  # of a block before the blow


def pink_lines(n: int, rate: float, band: tuple[float, float]) -> np.ndarray:
    """Amplitudes 1/√f at the lines of a block of n samples within a band, else zero (n/2 + 1,)."""
    f = np.fft.rfftfreq(n, 1 / rate)
    inside = (f >= band[0]) & (f <= band[1])
    return np.where(inside, 1 / np.sqrt(np.maximum(f, f[1])), 0.0)


def pink_rms(f: np.ndarray, H: np.ndarray) -> np.ndarray:
    """Rms of what H (n_f, ...) answers to pink noise of rms 1 over the band of f (n_f,) [Hz]."""
    density = 1 / f / np.trapezoid(1 / f, f)
    power = density.reshape(-1, *[1] * (H.ndim - 1)) * np.abs(H) ** 2
    return np.sqrt(np.trapezoid(power, f, axis=0))


def _in_time(lines: np.ndarray, n: int, finer: int) -> np.ndarray:
    """n · finer samples of a block whose spectrum over n samples is ``lines``."""
    spectrum = np.zeros(n * finer // 2 + 1, complex)
    spectrum[: len(lines)] = lines
    return np.fft.irfft(spectrum, n * finer)


def burst(
    n: int, rate: float, band: tuple[float, float], rng: np.random.Generator, finer: int = 1
) -> np.ndarray:
    """A burst of pink noise of rms 1 while it lasts, then silence (n · finer,).

    Parameters
    ----------
    n, rate : samples of a block and per second
    band : of the noise [Hz]
    finer : samples for every one of them
    """
    lines = pink_lines(n, rate, band) * (rng.normal(size=(2, n // 2 + 1)).T @ [1.0, 1j])
    x = _in_time(lines, n, finer)
    t = np.arange(n * finer) / (n * finer)
    edge = np.clip(np.minimum(t, ON - t) / FADE, 0.0, 1.0)
    return x / x.std() * (0.5 - 0.5 * np.cos(np.pi * edge))


def multisine(
    n: int, rate: float, band: tuple[float, float], rng: np.random.Generator, finer: int = 1
) -> np.ndarray:
    """A period of odd lines with random phases and 1/√f amplitudes, rms 1 (n · finer,).

    The response at even lines is then even distortion (Pintelon and Schoukens 2012, section 3.2).
    """
    odd = np.arange(n // 2 + 1) % 2 == 1
    phases = np.exp(2j * np.pi * rng.uniform(size=n // 2 + 1))
    x = _in_time(pink_lines(n, rate, band) * odd * phases, n, finer)
    return x / x.std()


def blow(n: int, rate: float, f_max: float, rng: np.random.Generator, finer: int = 1) -> np.ndarray:
    """A half sine of about 1 N, 0.8 / f_max long, at the beginning of a block (n · finer,)."""
    h, width = 1 / (rate * finer), BLOW / f_max
    t = np.arange(n * finer) * h - LEAD * n / rate
    size = np.exp(UNEVEN * rng.normal())
    inside = (t > 0) & (t < width)
    return np.where(inside, size * np.sin(np.pi * np.clip(t, 0, width) / width), 0.0)
