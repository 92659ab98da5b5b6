"""How evenly the modes are damped: what no change of stiffness or mass can explain.

Modal damping of one structure scatters about its median: by 0.31 to 0.37 in ln for the three
tailgates of Echaniz Granado (2015, "Model calibration of a vehicle tailgate using frequency
response functions", table 6), by 0.22 to 0.41 for three plates of spruce. Foam, a joint that slips
or another rubbing part damps some modes many times as much. A test on that scatter sees them where
frequencies and shapes are met.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..effects.identified_damping import SCATTER, IdentifiedDamping, paired_with
from ..ema.identification import Identified
from .reduced_model import State
from .result import FitStatistic

LOG_SD = 0.3  # prior sd of ln of the standard deviation of ln ζ, about its median SCATTER
FEWEST = 5  # modes below which a scatter says nothing
UNSURE = 0.3  # sd of ln ζ from the identification above which a mode has no say
STRONG = 0.02  # of the median share of χ²: a weaker pole may be the identification's own clutter
DRAWS = 4000
LEAST_LEFT = 0.1  # of a damping ratio is left at least, whatever a named effect takes of it


@dataclass(frozen=True, eq=False)
class ModalDamping(IdentifiedDamping):
    """Identified damping of the modes that are compared, and whether it is uneven."""

    def beyond(self, state: State) -> Self:
        """What is left of it beside what the effects of a state dissipate: ζ ζ_0 / (ζ_0 + ζ_e).

        ζ_0 is the median of ζ - ζ_e.
        """
        if state.dissipated is None:
            return self
        f = np.sqrt(np.maximum(state.lam, 0)) / (2 * np.pi)
        more = paired_with(self.frequency, f)[0] @ state.dissipated.ratio
        usual = float(np.median(np.maximum(self.ratio - more, LEAST_LEFT * self.ratio)))
        return replace(self, ratio=self.ratio * usual / (usual + more))

    def tested(self) -> tuple[float, FitStatistic]:
        """Chance that one structure is damped as unevenly upwards as this, and its statistic.

        The smaller of two chances: of the rms of what lies above the median of ln ζ, and of the
        largest of it.
        """
        rng = np.random.default_rng(20250104)
        scatter = SCATTER * np.exp(LOG_SD * rng.normal(size=(DRAWS, 1)))
        own = _statistics(np.hypot(scatter, self.sd) * rng.normal(size=(DRAWS, len(self.ratio))))
        seen = _statistics(np.log(self.ratio)[None])[0]
        p = (1 + (own >= seen).sum(axis=0)) / (1 + DRAWS)
        median, low, high = np.quantile(own[:, 0], (0.5, 0.005, 0.995))
        row = FitStatistic("uneven damping", float(seen[0]), float(median), float(low), float(high))
        return float(p.min()), row

    def following(self, share: np.ndarray) -> tuple[float, FitStatistic]:
        """Chance that damping follows a share (n,) of the modes by scatter alone; its statistic.

        exp of the component of ln ζ along the share, which is of unit norm and mean zero: by what
        factor those modes are damped more that have more of it.
        """
        along = share - share.mean()
        along = along / max(float(np.linalg.norm(along)), 1e-300)
        rng = np.random.default_rng(20250105)
        scatter = SCATTER * np.exp(LOG_SD * rng.normal(size=(DRAWS, 1)))
        drawn = np.hypot(scatter, self.sd) * rng.normal(size=(DRAWS, len(share)))
        own, seen = np.exp(drawn @ along), float(np.exp(np.log(self.ratio) @ along))
        median, low, high = np.quantile(own, (0.5, 0.005, 0.995))
        row = FitStatistic("damping where it gives", seen, float(median), float(low), float(high))
        return float((1 + (own >= seen).sum()) / (1 + DRAWS)), row

    def said(self) -> tuple[str, str, tuple[float, ...]]:
        """What stands out, where, and at which frequencies [Hz]."""
        excess = np.log(self.ratio) - np.median(np.log(self.ratio))
        out = np.flatnonzero(excess > 3 * SCATTER)
        out = out if len(out) else np.array([int(np.argmax(excess))])
        usual = float(np.median(self.ratio))
        least, most = self.ratio[out].min(), self.ratio[out].max()
        span = f"{most:.1%}" if len(out) == 1 else f"{least:.1%} to {most:.1%}"
        what = (
            f"{len(out)} of {len(self.ratio)} modes are damped by {span}, the others by about "
            f"{usual:.1%}: something dissipates that stiffness and mass cannot explain"
        )
        modes = tuple(float(f) for f in self.frequency[out])
        return what, "near " + ", ".join(f"{f:.4g}" for f in modes[:8]) + " Hz", modes


def _statistics(log_ratio: np.ndarray) -> np.ndarray:
    """Rms of what lies above the median, and the largest of it, of each row (k, 2)."""
    excess = np.maximum(log_ratio - np.median(log_ratio, axis=1, keepdims=True), 0)
    return np.stack([np.sqrt((excess**2).mean(axis=1)), excess.max(axis=1)], axis=1)


def modal_damping(identified: Identified, low: float, high: float) -> ModalDamping:
    """Damping of the modes between two frequencies [Hz] that stand out and are surely known."""
    f, share = identified.frequency, identified.relative_delta_chi2
    keep = (f >= low) & (f <= high) & (identified.damping > 0)
    if keep.any():
        keep &= share > STRONG * np.median(share[keep])
    sd = identified.damping_sd / np.where(keep, identified.damping, 1.0)
    return ModalDamping(f, identified.damping, sd).of(keep & (sd < UNSURE))
