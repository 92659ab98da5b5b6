"""Draw the place and size of a hidden local force, with a visible effect at the test's level."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from .bench_article import BenchArticle
from .bench_recording import BenchTest
from .bench_rig import BenchRig
from .benched_article import with_site
from .drive_signals import pink_rms
from .local_forces import Clearance, CubicSpring, JenkinsSlider, LocalForce

STRONG = 0.2  # stiffness of the site over m ω_1²: what would be a firm support if it were linear
CLOSES = 1.5  # rms displacements at which a gap closes: one sample in fifteen is beyond it
SLIPS = 0.7  # rms displacements at which friction slips


def _clearance(k: float, rms: float) -> LocalForce:
    return Clearance(gap=CLOSES * rms, k=k)


def _cubic(k: float, rms: float) -> LocalForce:
    return CubicSpring(k3=k / rms**2, reach=3 * rms)


def _friction(k: float, rms: float) -> LocalForce:
    return JenkinsSlider(k=k, limit=SLIPS * k * rms)


LOCAL = {"clearance": _clearance, "cubic-spring": _cubic, "friction": _friction}


def local_site(
    rig: BenchRig, names: Sequence[str], test: BenchTest, rng: np.random.Generator
) -> tuple[BenchArticle, list[dict[str, Any]]]:
    """Add local forces to ground at random sensors; return the article and their description.

    Their size follows the rms displacement that the test causes there. It is that of pink noise
    at the test's level, or of a sine of its force at the frequency of largest motion.
    """
    truth, article = [], rig.article
    order = rng.permutation(len(article.outputs))
    first = article.frequency[article.elastic].min()
    k = STRONG * article.weight * (2 * np.pi * first) ** 2
    rms = _rms(rig, test)
    for at, name in zip(order, names, strict=False):
        law = LOCAL[name](k, float(rms[at]))
        article = with_site(article, article.outputs[at], law)
        said = {"at": article.output_labels[at], "rms_m": float(rms[at])}
        truth.append({"name": name, **said, **vars(law)})
    return article, truth


def _rms(rig: BenchRig, test: BenchTest) -> np.ndarray:
    """Return the rms displacement at every sensor (n_out,) [m]."""
    f = np.geomspace(*test.band, 3000)
    s = 2j * np.pi * f
    H = rig.measured.response(s)[:, :, 0]
    x = np.abs(H[:, 1:] / (s**2)[:, None])
    if test.excitation == "stepped-sine":
        return test.level * (x / np.abs(H[:, :1])).max(axis=0) / np.sqrt(2)
    return test.level * pink_rms(f, x)
