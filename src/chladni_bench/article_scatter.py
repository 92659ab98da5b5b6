"""How much articles of one drawing differ: fitted to three tailgates, drawn for any article.

Echaniz Granado (2015), tables 4, 5 and 6: three tailgates weighed, fourteen modes identified.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from .bench_article import BenchArticle

WEIGHTS = np.array([10.508, 10.523, 10.508])  # [kg]
FREQUENCIES = 0.1 * np.array(
    [
        [282, 561, 779, 913, 973, 1181, 1355, 1421, 1557, 1594, 1717, 1811, 1863, 1916],
        [282, 564, 785, 917, 983, 1195, 1365, 1397, 1535, 1594, 1721, 1841, 1868, 1924],
        [282, 565, 794, 925, 986, 1207, 1387, 1428, 1559, 1579, 1734, 1815, 1858, 1923],
    ]
)  # [Hz]
DAMPING = 1e-4 * np.array(
    [
        [114, 82, 64, 37, 81, 71, 71, 74, 90, 126, 110, 77, 56, 60],
        [121, 89, 55, 68, 74, 63, 76, 77, 89, 123, 99, 49, 47, 50],
        [103, 104, 63, 53, 85, 63, 84, 109, 92, 126, 110, 46, 39, 56],
    ]
)  # fmt: skip
BETWEEN = 0.5  # scatter between two modes over that of one, 0.7/√2: Soize's matrix, thinned


@dataclass(frozen=True)
class Scatter:
    """Standard deviations of natural logarithms."""

    # whole, mode: of frequencies: what all modes of an article share, and of each for itself
    whole: float
    mode: float
    weight: float  # of the mass
    damping: float  # median of the damping ratios [-]
    damping_of_modes: float  # between the modes of a structure, the same in all articles
    # damping_whole, damping_mode: between articles, as for frequencies
    damping_whole: float
    damping_mode: float


def components(x: np.ndarray) -> tuple[float, float, float]:
    """x (articles, modes) = μ + mode + article + rest: standard deviations (mode, article, rest).

    By the mean squares of a two-way table without repeats (Searle, Casella and McCulloch 1992,
    Variance Components, section 4.6); what comes out negative is zero.
    """
    a, r = x.shape
    of_mode, of_article = x.mean(axis=0), x.mean(axis=1)
    rest = x - of_mode - of_article[:, None] + x.mean()
    e = (rest**2).sum() / ((a - 1) * (r - 1))
    modes = of_mode.var(ddof=1) - e / a
    articles = of_article.var(ddof=1) - e / r
    return tuple(float(np.sqrt(max(v, 0.0))) for v in (modes, articles, e))  # type: ignore[return-value]


def fitted() -> Scatter:
    """The scatter of the thesis' tables."""
    _, whole, mode = components(np.log(FREQUENCIES))
    of_modes, damping_whole, damping_mode = components(np.log(DAMPING))
    return Scatter(
        whole, mode, float(np.log(WEIGHTS).std(ddof=1)), float(np.median(DAMPING)), of_modes,
        damping_whole, damping_mode,
    )  # fmt: skip


def drawn_damping(s: Scatter, r: int, rng: np.random.Generator) -> np.ndarray:
    """Damping ratios of the modes of a structure, before its articles differ (r,)."""
    return s.damping * np.exp(s.damping_of_modes * rng.normal(size=r))


def drawn_article(
    nominal: BenchArticle, s: Scatter, name: str, within: float, rng: np.random.Generator
) -> BenchArticle:
    """Another article with modes, damping and weight of its own (:func:`scattered_article`)."""
    other = scattered_article(nominal, s, name, within, rng)
    return replace(other, weight=nominal.weight * float(np.exp(s.weight * rng.normal())))


def scattered_article(
    article: BenchArticle, s: Scatter, name: str, within: float, rng: np.random.Generator
) -> BenchArticle:
    """Another article: K̂ = Ω (I + G) Ω, G symmetric and random, and damping of its own.

    The diagonal of G scatters frequencies as in the tables. Its other entries mix shapes, most of
    all shapes of close frequencies (Soize 2000, Probabilistic Engineering Mechanics 15).

    Parameters
    ----------
    within : modes up to there differ [Hz]; those above stand for the static rest
    """
    r = len(article.frequency)
    mine = np.flatnonzero(article.elastic & (article.frequency <= within))
    n = len(mine)
    G = rng.normal(size=(n, n)) * BETWEEN * 2 * s.mode
    G = np.triu(G, 1) + np.triu(G, 1).T
    G[np.arange(n), np.arange(n)] = 2 * (s.whole * rng.normal() + s.mode * rng.normal(size=n))
    omega = article.frequency[mine]
    lam, turn = eigh(omega[:, None] * (np.eye(n) + G) * omega)
    Q, f, zeta = np.eye(r), article.frequency.copy(), article.damping.copy()
    Q[np.ix_(mine, mine)] = turn
    f[mine] = np.sqrt(lam)
    away = s.damping_whole * rng.normal() + s.damping_mode * rng.normal(size=n)
    zeta[mine] = article.damping[mine] * np.exp(away)
    return article.turned(f, zeta, Q, name)
