"""Errors of a whole recording, each tried against the responses of the model.

Both sides are smoothed along frequency by the same Gaussian weights. A peak is then as high as the
area below it, so that damping hardly matters, and no mode need be identified. A hypothesis changes
how the numbers are read: another quantity, another unit of frequency, the other sign of time, other
labels, another place of the force. It is scored by

Q = median over channels of mean over lines |log10(H_model / g H_test)|²,

phase wrapped, g the median level, least over a common factor of the model's frequencies. Physics
that the model lacks hardly changes under any of them; the one error that there is takes most of Q.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ..dynamics.frf import FRF
from ..dynamics.modal_sum import modal_sum
from ..ema.chain_checks import LEAST_MODES, QUANTITIES
from ..ema.correlation import wrapped
from ..ema.finding import Check, Finding
from ..ema.identification import DERIVATIVES
from ..ema.shape_faults import LEAST_CHANNELS, SHIFT
from ..errors import named as listed
from ..fem.locate import rows_of
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import Modelled, node_points
from ..geometry.sampling import farthest_point_sample
from ..units import HERTZ

WIDTH = 0.06  # of a frequency: standard deviation of the smoothing
LEAST_LINES, MOST_LINES = 20, 4000  # of the recording, of the model
DAMPING = 0.01  # of the model; the smoothing is several times as wide
RIGID = 1e-3  # of the highest frequency: below are rigid motions
REACH = 2.0  # times the highest line: modes the model must have
EXPLAINED = 1 / 2  # of Q as declared, and of ``CHANCE``: what an error that is named may leave
PLACES = 400  # where the force may act
LN10 = np.log(10.0)
FLAT = 1e-3  # of that Q: responses that vary by 7 % about a power of frequency show no mode
TINY = 1e-9  # Q of a recording that is the model's own
SURE = ("wrong quantity", "delay")  # where the recording alone says so, whatever the model says
CHANCE = (np.pi / LN10) ** 2 / 3  # Q of responses of one size whose phases have nothing in common


@dataclass(frozen=True)
class Hypothesis:
    """One way of reading a recording: its Q, its share of Q as declared, and what it would mean."""

    Q: float
    share: float
    finding: Finding


@dataclass(frozen=True, eq=False)
class Smoothed:
    """A recording on a few wide lines, and the model that is to answer likewise.

    Attributes
    ----------
    f : (n_f,)                      lines on which the model is evaluated [Hz]
    weights : (n_s, n_f)            of the smoothing
    log_test : (n_s, n_out, n_in)   log10 of the smoothed recording, less its level
    level : median of log10 |H|
    phi_o, drive : (n_out, r), (n_in, r)   shapes at outputs, loads of the inputs
    omega : (r,)                    [rad/s], 0 of rigid motions
    direct : (n_out, n_in)          what a moving base carries along
    power : derivatives of the quantity
    """

    f: np.ndarray
    weights: np.ndarray
    log_test: np.ndarray
    level: float
    phi_o: np.ndarray
    drive: np.ndarray
    omega: np.ndarray
    direct: np.ndarray
    power: int

    def answers(
        self,
        power: int | None = None,
        scale: float = 1.0,
        delay: float = 0.0,
        drive: np.ndarray | None = None,
    ) -> Iterator[np.ndarray]:
        """Σ_r φ_or φ_ir s^k e^(-sτ) / (ω_r² + 2 ζ ω_r s + s²), smoothed (n_s, n_out, n_in).

        Lines are times ``scale``; the model's frequencies are shifted by each ``SHIFT``.
        """
        k, load = self.power if power is None else power, self.drive if drive is None else drive
        direct = self.direct if drive is None else 0.0
        for shift in SHIFT:
            s = 2j * np.pi * self.f[:, None] * scale / np.exp(shift)
            above = s**k * np.exp(-s * delay)
            D = self.weights @ (above / (self.omega**2 + 2 * DAMPING * self.omega * s + s**2))
            yield modal_sum(self.phi_o, D, load) + direct

    def as_declared(self) -> tuple[float, float]:
        """Q, and how many times as large the recording is as the model."""
        scored = [(self.score(H), float(np.median(_log10(H).real))) for H in self.answers()]
        Q, level = min(scored)
        return Q, float(10 ** (self.level - level))

    def score(self, H: np.ndarray, inputs: slice = slice(None)) -> float:
        """Q of responses (n_s, n_out, n_in)."""
        Q = np.median(_squares(_logarithm(H) - self.log_test[:, :, inputs]))
        return float(np.maximum(Q, TINY))


def _log10(H: np.ndarray) -> np.ndarray:
    return np.asarray(np.log(np.where(H == 0, 1e-300, H)) / LN10)


def _logarithm(H: np.ndarray) -> np.ndarray:
    """Log10 of responses, less the median of its real part."""
    x = _log10(H)
    return np.asarray(x - np.median(x.real))


def _squares(delta: np.ndarray) -> np.ndarray:
    """Mean square over lines of log10 ratios (n_s, ...), phase wrapped."""
    return np.asarray((np.abs(wrapped(delta)) ** 2).mean(axis=0))


def smoothed(
    frf: FRF, lines: np.ndarray, model: Modelled, outputs: MeasuredDofs, inputs: MeasuredDofs
) -> Smoothed | None:
    """A recording and a model on wide lines; None where lines or modes are too few.

    Parameters
    ----------
    lines : (n_f,) bool   those to look at
    """
    k = lines & (frf.frequency > 0) & np.isfinite(frf.values).all(axis=(1, 2))
    f, H = frf.frequency[k], frf.values[k]
    if len(f) < LEAST_LINES or f[-1] < f[0] * (1 + WIDTH) ** 3 or not len(model.modes):
        return None
    log_test = _log10(np.einsum("sf,foi->soi", _weights(f, f), H))
    level = float(np.median(log_test.real))
    some = f[:: -(-len(f) // MOST_LINES)]
    built, modes = model.structure, model.modes
    omega = 2 * np.pi * modes.frequency
    return Smoothed(
        some, _weights(f, some), log_test - level, level,
        outputs.rows(built) @ modes.shapes, inputs.loads(built) @ modes.shapes,
        np.where(modes.frequency < RIGID * f[-1], 0.0, omega),
        outputs.moved_with_base(inputs), DERIVATIVES[frf.quantity],
    )  # fmt: skip


def _weights(every: np.ndarray, f: np.ndarray) -> np.ndarray:
    """Gaussian weights on lines f (n_s, n_f), of unit sum, about centres one width apart."""
    centre = np.exp(np.arange(np.log(every[0]) + WIDTH, np.log(every[-1]), WIDTH))[:, None]
    weights = np.exp(-0.5 * ((f - centre) / (WIDTH * centre)) ** 2) * np.gradient(f)
    return np.asarray(weights / weights.sum(axis=1, keepdims=True))


def chain_faults(
    frf: FRF,
    lines: np.ndarray,
    model: Modelled,
    outputs: MeasuredDofs,
    inputs: MeasuredDofs,
    before: Sequence[Finding] = (),
) -> tuple[list[Finding], Check]:
    """The error of a whole recording that explains most of how far it is from the model.

    Named is the best one, where it :func:`explains` Q as declared.

    Parameters
    ----------
    lines : (n_f,) bool   of the recording, those to look at
    model : of the deck as it was tested, a little beyond the band at least
    before : what the recording says of itself. A delay is one more hypothesis; that the quantity is
        wrong is known from phases, which one it is only from the model.
    """
    name = "the chain against the model"
    seen = smoothed(frf, lines, model, outputs, inputs)
    if seen is None:
        return [], Check(name, "too few lines or modes", None)
    declared, _ = seen.as_declared()
    tried = other_readings(frf, seen, declared, model, outputs, inputs, before)
    best = min(tried, key=lambda h: h.share)
    among = [h for h in tried if h.finding.kind in {f.kind for f in before if f.kind in SURE}]
    said = (
        f"Q {declared:.2g} as declared, {best.Q:.2g} for the best of {len(tried)} other "
        "interpretations"
    )
    better = explains(best.Q, best.Q / best.share) and without_modes(frf, lines) > FLAT
    named = [best] if better else among
    findings = [h.finding for h in sorted(named, key=lambda h: h.share)[:1]]
    return findings, Check(name, said, not findings)


def without_modes(frf: FRF, lines: np.ndarray) -> float:
    """Q of the recording against a power of frequency, another one for each channel.

    Below all modes a structure is rigid, and interpretations cannot be distinguished.
    """
    k = lines & (frf.frequency > 0)
    H, f = frf.values[k].reshape(k.sum(), -1), frf.frequency[k]
    x, level = np.stack([np.ones(len(f)), np.log(f)], axis=1), _log10(np.abs(H))
    return float(np.median(_squares(level - x @ np.linalg.lstsq(x, level, rcond=None)[0])))


def explains(Q: float, declared: float) -> bool:
    """True if an error leaves so little of Q as declared that it is named.

    Much is left of responses that are not those of the model, whichever way they are read.
    """
    return Q < EXPLAINED * min(declared, CHANCE)


def other_readings(
    frf: FRF,
    seen: Smoothed,
    declared: float,
    model: Modelled,
    outputs: MeasuredDofs,
    inputs: MeasuredDofs,
    before: Sequence[Finding] = (),
) -> list[Hypothesis]:
    """Every error that is tried, ``declared`` being Q without any."""
    tried = [*_read_otherwise(frf, seen, declared, model, outputs, inputs)]
    for late in (f for f in before if f.kind == "delay"):
        Q = min(map(seen.score, seen.answers(delay=late.value)))
        tried.append(Hypothesis(Q, Q / declared, late))
    inside = (seen.omega > 0) & (seen.omega <= 2 * np.pi * seen.f[-1])
    if len(outputs.labels) >= LEAST_CHANNELS and inside.sum() >= LEAST_MODES:
        tried += _relabelled(seen, declared, outputs.labels)
        tried += _driven_elsewhere(seen, model, inputs)
    return tried


def _read_otherwise(
    frf: FRF,
    seen: Smoothed,
    declared: float,
    model: Modelled,
    outputs: MeasuredDofs,
    inputs: MeasuredDofs,
) -> Iterator[Hypothesis]:
    """Another quantity, sign, direction of time or unit of frequency."""

    def of(Q: float, kind: str, text: str, mend: str) -> Hypothesis:
        said = (
            f"{text}: with this interpretation Q against the model is {Q:.2g}, as declared "
            f"{declared:.2g}."
        )
        return Hypothesis(Q, Q / declared, Finding(kind, said, "fault", (), mend))

    for other in (q for q in QUANTITIES if frf.quantity in QUANTITIES and q != frf.quantity):
        Q = min(map(seen.score, seen.answers(DERIVATIVES[other])))
        mend = f'in case.toml, [test]: quantity = "{other}"'
        yield of(Q, "wrong quantity", f"the declared {frf.quantity} is {other}", mend)
    Q = min(seen.score(-H) for H in seen.answers())
    mend = f"in sensors.csv reverse the direction of input {inputs.labels[0]}"
    text = "the force gauge (or every sensor) is reversed"
    yield of(Q, "reversed force", text, mend)
    Q = min(seen.score(H.conj()) for H in seen.answers())
    text = "the FRFs are conjugated: their phase has the wrong sign (exp(-iωt) for exp(iωt))"
    yield of(Q, "conjugated FRFs", text, "in case.toml, [test]: conjugated = true")
    for unit, scale in HERTZ.items():
        reached = (frf.frequency > 0) & (REACH * scale * frf.frequency <= model.band)
        if scale == 1 or (all_lines := smoothed(frf, reached, model, outputs, inputs)) is None:
            continue
        Q = min(map(all_lines.score, all_lines.answers(scale=scale)))
        mend = f'in case.toml, [test]: frequency_unit = "{unit}"'
        yield of(Q, "wrong unit of frequency", f"the declared Hz are {unit}", mend)


def _relabelled(seen: Smoothed, declared: float, labels: tuple[str, ...]) -> list[Hypothesis]:
    """The outputs under each other's labels, as many as it takes; of two, shapes tell better."""
    from scipy.optimize import linear_sum_assignment

    best: tuple[float, np.ndarray] = (np.inf, np.arange(len(labels)))
    for H in seen.answers():
        log_H = _logarithm(H)
        apart = np.stack(
            [_squares(log_H - seen.log_test[:, [k]]).mean(axis=1) for k in range(len(labels))]
        )  # (output as labelled, place in the model)
        _, place = linear_sum_assignment(apart)
        Q = float(np.median(apart[np.arange(len(labels)), place]))
        if Q < best[0]:
            best = (Q, place)
    Q, place = best
    moved = np.flatnonzero(place != np.arange(len(labels)))
    if len(moved) <= 2:
        return []
    rows = [f"{labels[k]} that of {labels[place[k]]}" for k in moved]
    text = (
        f"{len(moved)} of {len(labels)} outputs have exchanged labels: after the exchange Q "
        f"against the model is {Q:.2g}, as declared {declared:.2g}."
    )
    mend = f"in sensors.csv give each the grid and direction of the other: {listed(rows, 6)}"
    channels = tuple(labels[k] for k in moved)
    return [Hypothesis(Q, Q / declared, Finding("permuted labels", text, "fault", channels, mend))]


def _driven_elsewhere(seen: Smoothed, model: Modelled, inputs: MeasuredDofs) -> list[Hypothesis]:
    """Each force at other grids, along the direction it is said to have."""
    if inputs.base.any():
        return []
    built, points = model.structure, node_points(model.structure)
    pick = farthest_point_sample(points, min(PLACES, len(points)))
    grids, at = built.system.dofs[pick, 0], points[pick]
    out = []
    for j, label in enumerate(inputs.labels):
        one = slice(j, j + 1)
        ways = np.tile(inputs.directions[j], (len(pick), 1))
        drive = rows_of(built, grids, at, ways) @ model.modes.shapes
        declared = min(seen.score(H[:, :, one], one) for H in seen.answers())
        Q = np.full(len(pick), np.inf)
        for H in seen.answers(drive=drive):
            log_H = _log10(H)
            log_H = log_H - np.median(log_H.real, axis=(0, 1))
            Q = np.minimum(Q, np.median(_squares(log_H - seen.log_test[:, :, one]), axis=0))
        k = int(Q.argmin())
        off = float(np.linalg.norm(at[k] - inputs.points[j]))
        text = (
            f"the force {label} acts near grid {grids[k]}, {off:.3g} m from the declared place: "
            f"there Q against the model is {Q[k]:.2g}, as declared {declared:.2g}."
        )
        mend = f"in sensors.csv give input {label} the grid {grids[k]}, or its true place"
        found = Finding("misplaced force", text, "fault", (label,), mend, float(grids[k]))
        out.append(Hypothesis(float(Q[k]), float(Q[k] / declared), found))
    return out
