"""Test of identification on recordings with known poles: errors, coverage, invented poles.

Fifteen modes between 22 and 190 Hz have the damping of a bare car body part (0.4 to 1.3 %). There
are thirty outputs, one shaker and 900 lines at even steps of the logarithm. A suspension below the
band and six modes above it make the band's ends realistic, so no residual term is exact.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.ema.identification import Identified, identify
from chladni.ema.pole_fitting import PoleData, solved
from chladni.ema.pole_selection import Rule, uncertainty
from chladni.errors import LabelError

NOISE = 0.02
BAND = (20.0, 200.0)
INSIDE, CHANNELS, LINES = 15, 30, 900
TWO_SIGMA = 1.96
KINDS = {
    "share": "2 % of |H|, stated by the recording",
    "share, unsaid": "2 % of |H|, not stated",
    "floor": "2 % of the rms of each channel at every line, stated",
    "floor, unsaid": "2 % of the rms of each channel at every line, not stated",
}


@dataclass(frozen=True, eq=False)
class Known:
    """A structure with known poles (r,) [rad/s] and shapes (n, r), driven at the first output."""

    poles: np.ndarray
    shapes: np.ndarray

    def accelerance(self, f: np.ndarray) -> np.ndarray:
        """Accelerance -ω² Σ φ φ_d / (ω_r² - ω² + 2iζω_rω) (n_f, n)."""
        w, size = 2 * np.pi * f[:, None], np.abs(self.poles)
        h = -(w**2) / (size**2 - w**2 - 2j * self.poles.real * w)
        return h @ (self.shapes * self.shapes[0]).T

    @property
    def inside(self) -> np.ndarray:
        """Poles within the band."""
        f = np.abs(self.poles) / (2 * np.pi)
        return self.poles[(BAND[0] < f) & (f < BAND[1])]


def structure(seed: int, inside: int = INSIDE, channels: int = CHANNELS) -> Known:
    """A structure of random modal spacing and random shapes, all driven by the shaker."""
    rng = np.random.default_rng(seed)
    step = np.log(190 / 22) / (inside - 1)
    f = 22 * np.exp(step * (np.arange(inside) + rng.uniform(-0.35, 0.35, inside)))
    f = np.clip(f, 1.03 * BAND[0], 0.97 * BAND[1])
    f = np.concatenate([rng.uniform(1, 4, 3), f, 200 * np.cumprod(rng.uniform(1.06, 1.15, 6))])
    zeta = np.exp(rng.uniform(np.log(0.0037), np.log(0.0126), len(f)))
    shapes = rng.normal(size=(channels, len(f)))
    shapes[0] = np.where(rng.random(len(f)) < 0.5, -1, 1) * rng.uniform(0.3, 1.5, len(f))
    return Known(2 * np.pi * f * (-zeta + 1j * np.sqrt(1 - zeta**2)), shapes)


def recording(known: Known, kind: str, seed: int, lines: int = LINES) -> tuple[FRF, np.ndarray]:
    """An FRF with noise of a kind, and the true variance of every sample."""
    rng = np.random.default_rng([seed, *kind.encode()])
    f = np.geomspace(*BAND, lines)
    H = known.accelerance(f)[:, :, None]
    level = np.abs(H) if kind.startswith("share") else np.sqrt((np.abs(H) ** 2).mean(axis=0))
    sd = NOISE * np.broadcast_to(level, H.shape)
    hiss = rng.normal(size=(2, *H.shape)) / np.sqrt(2)
    labels = tuple(f"{k + 1}:+Z" for k in range(H.shape[1]))
    variance = None if kind.endswith("unsaid") else sd**2
    values = H + sd * (hiss[0] + 1j * hiss[1])
    return FRF(values, f, labels, labels[:1], "accelerance", variance=variance), sd**2


@dataclass(frozen=True, eq=False)
class Found:
    """Errors of one recording, mode by mode for modes that a recording can show."""

    # frequency, damping: (k,) relative errors of the modes found
    frequency: np.ndarray
    damping: np.ndarray
    # z_frequency, z_damping: (k,) the same over their stated standard deviations
    z_frequency: np.ndarray
    z_damping: np.ndarray
    bound: np.ndarray  # (k,) Cramér-Rao standard deviation of the frequency over the frequency
    # visible, missed: modes with significant χ² at the true poles; number of them not found
    visible: int
    missed: int
    invented: int  # poles called firm that are not modes


def held_against(known: Known, frf: FRF, variance: np.ndarray, found: Identified) -> Found:
    """Compare each pole with the nearest true one within its half bandwidth, nearest first."""
    due, (sd, pays) = known.inside, _cramer_rao(known, frf, variance)
    f, zeta = np.abs(due) / (2 * np.pi), -due.real / np.abs(due)
    gap = np.abs(found.poles[:, None] - due)
    partner = np.full(len(due), -1)
    while gap.size and (gap / np.abs(due.real)).min() < 1:
        i, j = np.unravel_index((gap / np.abs(due.real)).argmin(), gap.shape)
        partner[j] = i
        gap[i], gap[:, j] = np.inf, np.inf
    there = partner >= 0
    m = partner[there]
    df, dz = found.frequency[m] - f[there], found.damping[m] - zeta[there]
    stray = found.firm & found.inside & ~np.isin(np.arange(found.order), m)
    return Found(
        df / f[there],
        dz / zeta[there],
        df / found.frequency_sd[m],
        dz / found.damping_sd[m],
        (sd / f)[there],
        int(pays.sum()),
        int((pays & ~there).sum()),
        int(stray.sum()),
    )


def _cramer_rao(known: Known, frf: FRF, variance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least sd of the frequencies [Hz], and a mask of significant modes, at the true poles."""
    top = 2 * np.pi * BAND[1]
    w = np.sqrt(2 / variance[:, :, 0]) * top**2
    data = PoleData(2j * np.pi * frf.frequency / top, frf.values[:, :, 0] / top**2, w, 2)
    size = np.abs(known.poles) / (2 * np.pi)
    p = known.poles[(BAND[0] / 3 < size) & (size < 3 * BAND[1])] / top
    fit, slope = solved(data, p)
    sd, _ = uncertainty(p, slope, 1.0)
    inside = np.isin(p, known.inside / top)
    rule = Rule(w.shape[1], len(data.s))
    sure = sd < 0.5 * np.abs(p.real)
    return top * sd[inside] / (2 * np.pi), (sure & (fit.delta_chi2 > rule.price))[inside]


def table(
    seeds: Sequence[int], kinds: Sequence[str], say: Callable[[str], None]
) -> dict[str, list[Found]]:
    """Results of every kind of noise over all seeds; each is reported when it is done.

    Raises
    ------
    LabelError
        If a kind is unknown.
    """
    if unknown := sorted(set(kinds) - set(KINDS)):
        raise LabelError(f"no noise {unknown}; there are {', '.join(map(repr, KINDS))}")
    tally: dict[str, list[Found]] = {}
    for kind in kinds:
        for seed in seeds:
            known = structure(seed)
            frf, variance = recording(known, kind, seed)
            tally.setdefault(kind, []).append(held_against(known, frf, variance, identify(frf)))
        say(f"{kind} ({KINDS[kind]}): {summary(tally[kind])}")
    return tally


def summary(found: Sequence[Found]) -> str:
    """Errors in per cent, coverage of the 95 % intervals, missed and invented poles in words."""
    joined = {
        name: np.concatenate([getattr(one, name) for one in found])
        for name in ("frequency", "damping", "z_frequency", "z_damping", "bound")
    }
    f, z = (100 * np.abs(joined[name]) for name in ("frequency", "damping"))
    covered = [
        100 * (np.abs(joined[f"z_{n}"]) < TWO_SIGMA).mean() for n in ("frequency", "damping")
    ]
    count = {n: sum(getattr(o, n) for o in found) for n in ("visible", "missed", "invented")}
    excess = np.sqrt((joined["frequency"] ** 2).mean() / (joined["bound"] ** 2).mean())
    return (
        f"{len(found)} recordings, {count['visible']} modes to be seen, {count['missed']} missed, "
        f"{count['invented']} invented; "
        f"frequency off by {f.mean():.2g} % (95 of 100 below {np.quantile(f, 0.95):.2g}, worst "
        f"{f.max():.2g}), {excess:.2f} times the Cramér-Rao bound; damping off by {z.mean():.2g} % "
        f"({np.quantile(z, 0.95):.2g}, {z.max():.2g}); intervals of 95 % cover {covered[0]:.1f} % "
        f"of the frequencies, {covered[1]:.1f} % of the damping ratios"
    )
