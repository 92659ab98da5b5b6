"""The room of a test: sound and floor excite the article during the recording.

A few independent sources act on the whole article at once. Their response is coherent from channel
to channel and rises at resonances, unlike noise of sensors and converters. The gauge measures it
too (Bendat and Piersol 2010, section 9.2: noise that passes through the system).
"""

import numpy as np

from .bench_article import BenchArticle
from .pole_model import PoleModel

SOURCES = 4
SEED = 20150301  # the room is the same for every article and every test
LINES = 2000  # over which the motion of an article at rest is summed


def room_loads(article: BenchArticle) -> np.ndarray:
    """Forces of the sources on the modes (r, SOURCES), each with weights of its own everywhere."""
    rows = np.concatenate([article.outputs, article.hangers.reshape(-1, article.outputs.shape[1])])
    weights = np.random.default_rng(SEED).normal(size=(len(rows), SOURCES))
    return rows.T @ weights / np.sqrt(len(rows))


def room_density(room: PoleModel, rms: float, band: tuple[float, float]) -> float:
    """Density of every source [N/√Hz] at which the median accelerometer moves by ``rms`` [m/s²].

    Parameters
    ----------
    room : force first, then accelerations, of the sources
    band : over which it is taken [Hz]
    """
    f = np.linspace(*band, LINES)
    power = (np.abs(room.response(2j * np.pi * f)[:, 1:]) ** 2).sum(axis=2)
    moved = np.sqrt(np.trapezoid(power, f, axis=0))
    return float(rms / np.median(moved))


def room_samples(density: float, rate: float, n: int, rng: np.random.Generator) -> np.ndarray:
    """White noise of every source (SOURCES, n) [N], sampled at a rate."""
    return density * np.sqrt(rate / 2) * rng.normal(size=(SOURCES, n))
