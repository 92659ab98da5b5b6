"""Data that are not fitted: samples that choose a name, and samples that only report its gain.

Every third held-out sensor reports, the others choose.  In the held-out band every third of the
fitted sensors reports, too.  No choice of a name uses a sample that reports.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..inference.hypothesis_fit import UpdatingProblem
from ..inference.likelihood import LN10, Responses
from ..inference.map_fit import fit
from .question import HeldOut, Question

SAME_PLACE = 1e-6  # [m]: a sensor nearer to a shaker counts as at its place
THIRD = 3  # one output of so many reports: a name needs evidence more than its report needs samples
Band = tuple[float, float]  # [Hz]


@dataclass(frozen=True, eq=False)
class HeldOutChoice:
    """Sensors and a band that are not fitted."""

    sensors: np.ndarray  # (n_out,) bool: outputs that are held out
    band: Band  # held out; empty where both ends are equal
    fitted: Band
    reach: Band  # all that is compared

    def training(self, f: np.ndarray) -> np.ndarray:
        """Lines and channels that are fitted (n_f, n_out), at frequencies f [Hz] (n_f,)."""
        return np.outer(_inside(f, self.fitted), ~self.sensors)

    def samples(self, data: Responses) -> HeldOut:
        """The samples of some data that choose and that report."""
        f = data.s.imag / (2 * np.pi)
        everywhere, above = (_inside(f, band)[:, None] for band in (self.reach, self.band))
        held = ((self.sensors & everywhere) | above) & ~data.use
        return HeldOut(held & ~self.reporting, held & self.reporting)

    @property
    def reporting(self) -> np.ndarray:
        """Outputs whose held-out samples report (n_out,) bool; those of all others choose."""
        groups = np.flatnonzero(self.sensors), np.flatnonzero(~self.sensors)
        return np.isin(np.arange(len(self.sensors)), np.concatenate([g[::THIRD] for g in groups]))

    def in_words(self, labels: Sequence[str], reporting: bool) -> str:
        """The data that report, or that choose, in words: sensors, a band, or nothing."""
        of = self.reporting == reporting
        names = [n for n, h in zip(labels, self.sensors & of, strict=True) if h]
        sensors = "sensor" if len(names) == 1 else "sensors"
        said = [f"{len(names)} {sensors} ({', '.join(names[:8])})"] if names else []
        (low, high), others = self.band, int((of & ~self.sensors).sum())
        if high > low and others:
            said += [f"band {low:g}-{high:g} Hz of {others} other{'s' * (others > 1)}"]
        return ", ".join(said) or "nothing"

    def without_faults(self, problem: UpdatingProblem) -> "HeldOutChoice":
        """The choice without sensors whose level is an outlier: a fault is found only if fitted.

        Outliers are judged by their median level against a calibrated model without effects.
        Nothing else of the held-out data enters the choice.
        """
        data, held = problem.data, self.sensors
        assert isinstance(data, Responses)
        model, weighed = problem.reduced.model, problem.mass_measurement
        rough = fit(model, problem.base, data, weighed, problem.mean(), max_steps=8)
        lines = data.use.any(axis=1)
        delta = data.deviation(rough.state)[lines].reshape(lines.sum(), len(held), -1)
        level = np.median(delta.real, axis=(0, 2))
        turned = np.median(np.abs(delta.imag), axis=(0, 2)) > np.pi / 2 / LN10
        spread = max(0.02, 1.5 * float(np.median(np.abs(level - np.median(level)))))
        odd = (np.abs(level - np.median(level)) > 4 * spread) | turned
        if not np.any(odd & held):
            return self
        calm = np.flatnonzero(~odd & ~held)[: int((odd & held).sum())]
        out = held & ~odd
        out[calm] = True
        return replace(self, sensors=out)


def of_poles(held: np.ndarray) -> HeldOut:
    """Held-out natural frequencies (n,): from the highest on, every third reports."""
    reporting = np.isin(np.arange(len(held)), np.flatnonzero(held)[::-1][::THIRD])
    return HeldOut(held & ~reporting, reporting)


def held_out_sensors(question: Question) -> np.ndarray:
    """Outputs that are held out (n_out,) bool: the named ones, or a fixed selection of a fifth."""
    labels = question.outputs.labels
    wanted = question.held_sensors
    if isinstance(wanted, tuple):
        return np.array([label in wanted for label in labels])
    away = question.outputs.points[:, None] - question.inputs.points[None]
    driven = (np.linalg.norm(away, axis=2) < SAME_PLACE).any(axis=1)  # a moving base has no place
    count = min(len(labels) // 5 if wanted is None else wanted, max(len(labels) - 2, 0))
    order = np.random.default_rng(20250101).permutation(len(labels))
    chosen = [k for k in order if not driven[k]][:count]
    return np.isin(np.arange(len(labels)), chosen)


def upper_part(low: float, high: float) -> Band:
    """The uppermost fifth of a band, held out where the user names none."""
    return high - 0.2 * (high - low), high


def _inside(f: np.ndarray, band: Band) -> np.ndarray:
    return np.asarray((f >= band[0]) & (f <= band[1]))
