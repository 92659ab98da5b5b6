"""Test of the scatter of modal damping, which changes of stiffness and mass cannot explain.

Modal damping of one structure scatters about its median.  The standard deviation of ln ζ is 0.22 to
0.41 for three plates of spruce, and 0.31 to 0.37 for the three tailgates of Echaniz Granado (2015,
"Model calibration of a vehicle tailgate using frequency response functions", table 6). Foam, a
joint that slips or another rubbing part damps some modes many times as much. A test on that scatter
detects them even where the model fits frequencies and shapes.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..effects.identified_damping import SCATTER, TAILS, IdentifiedDamping, paired_with
from ..ema.identification import Identified
from ..reduced.reduced_model import State
from .result import FitStatistic

LOG_SD = 0.3  # prior sd of ln of the standard deviation of ln ζ, about its median SCATTER
FEWEST = 5  # modes below which the scatter is not tested
UNSURE = 0.3  # sd of ln ζ from the identification above which a mode is left out
STRONG = 0.02  # of the median share of χ²: a weaker pole may be spurious
DRAWS = 4000
STEEP = np.geomspace(0.3, 300, 13)  # times the damping that all modes share, of the largest share
LEAST_LEFT = 0.1  # of a damping ratio remains at least when an effect's dissipation is removed


@dataclass(frozen=True, eq=False)
class ModalDamping(IdentifiedDamping):
    """Identified damping of the modes that are compared, and tests of its scatter."""

    def beyond(self, state: State) -> Self:
        """Damping without the dissipation ζ_e of the effects of a state: ζ ζ_0 / (ζ_0 + ζ_e).

        ζ_0 is the median of ζ - ζ_e.
        """
        if state.dissipated is None:
            return self
        f = np.sqrt(np.maximum(state.lam, 0)) / (2 * np.pi)
        more = paired_with(self.frequency, f)[0] @ state.dissipated.ratio
        usual = float(np.median(np.maximum(self.ratio - more, LEAST_LEFT * self.ratio)))
        return replace(self, ratio=self.ratio * usual / (usual + more))

    def tested(self) -> tuple[float, FitStatistic]:
        """P-value of damping so uneven above its median, and its statistic.

        The smaller of two p-values: of the rms of the excess of ln ζ over its median, and of the
        largest excess.
        """
        rng = np.random.default_rng(20250104)
        scatter = SCATTER * np.exp(LOG_SD * rng.normal(size=(DRAWS, 1)))
        own = _statistics(np.hypot(scatter, self.sd) * rng.normal(size=(DRAWS, len(self.ratio))))
        seen = _statistics(np.log(self.ratio)[None])[0]
        p = (1 + (own >= seen).sum(axis=0)) / (1 + DRAWS)
        return float(p.min()), FitStatistic.of("uneven damping", seen[0], own[:, 0])

    def following(self, share: np.ndarray) -> tuple[float, FitStatistic]:
        """P-value that damping follows a share (n,) of the modes by scatter alone; its statistic.

        The curves are ln(ζ_0 + c share), c in ``STEEP``.  The statistic is the largest Student's t
        of ln ζ along one of them, the scatter being that of the rest with ``TAILS`` more modes of
        usual scatter.  A mean and a trend over ln f, as materials and air have it, are taken off.
        """
        f = np.log(self.frequency)
        common, _ = np.linalg.qr(np.column_stack([np.ones_like(f), f]))
        curve = np.log1p(STEEP[:, None] * share / max(float(share.max()), 1e-300))
        curve = curve - curve @ common @ common.T
        curve /= np.maximum(np.linalg.norm(curve, axis=1, keepdims=True), 1e-9)

        def steepest(y: np.ndarray) -> np.ndarray:
            y = y - y @ common @ common.T
            along = y @ curve.T
            left = (y**2).sum(axis=1, keepdims=True) - along**2 + TAILS * SCATTER**2
            return np.asarray((along / np.sqrt(left / (len(f) - 3 + TAILS))).max(axis=1))

        rng = np.random.default_rng(20250105)
        scatter = SCATTER * np.exp(LOG_SD * rng.normal(size=(DRAWS, 1)))
        own = steepest(np.hypot(scatter, self.sd) * rng.normal(size=(DRAWS, len(f))))
        seen = float(steepest(np.log(self.ratio)[None])[0])
        median, low, high = np.quantile(own, (0.5, 0.005, 0.995))
        each = np.exp(np.array([seen, median, low, high]) - median)
        row = FitStatistic("damping where it is compliant", *map(float, each))
        return float((1 + (own >= seen).sum()) / (1 + DRAWS)), row

    def said(self) -> tuple[str, tuple[float, ...]]:
        """Sentence on the modes that stand out, and their frequencies [Hz]."""
        excess = np.log(self.ratio) - np.median(np.log(self.ratio))
        out = np.flatnonzero(excess > 3 * SCATTER)
        out = out if len(out) else np.array([int(np.argmax(excess))])
        usual = float(np.median(self.ratio))
        least, most = self.ratio[out].min(), self.ratio[out].max()
        span = (
            f"{100 * most:.1f} %" if len(out) == 1 else f"{100 * least:.1f} % to {100 * most:.1f} %"
        )
        what = (
            f"{len(out)} of {len(self.ratio)} modes have a damping of {span}, the others about "
            f"{100 * usual:.1f} %: stiffness and mass cannot explain this dissipation"
        )
        return what, tuple(float(f) for f in self.frequency[out])


def _statistics(log_ratio: np.ndarray) -> np.ndarray:
    """Rms and largest excess over the median of each row (k, 2)."""
    excess = np.maximum(log_ratio - np.median(log_ratio, axis=1, keepdims=True), 0)
    return np.stack([np.sqrt((excess**2).mean(axis=1)), excess.max(axis=1)], axis=1)


def modal_damping(identified: Identified, low: float, high: float) -> ModalDamping:
    """Damping of the strong, well-identified modes between two frequencies [Hz]."""
    f, share = identified.frequency, identified.relative_delta_chi2
    keep = (f >= low) & (f <= high) & (identified.damping > 0)
    if keep.any():
        keep &= share > STRONG * np.median(share[keep])
    sd = identified.damping_sd / np.where(keep, identified.damping, 1.0)
    return ModalDamping(f, identified.damping, sd).of(keep & (sd < UNSURE))
