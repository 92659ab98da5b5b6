"""Forecasts of sensors, drives, a known mass, lines above the band and a weighing.

Every explanation predicts the data of a further measurement with its own unknowns: its parameters
and errors of form, as the recording left them (linear about its fit).  Errors of form beyond the
first order are noise, as in a fit: near a zero of H the linear prediction says nothing.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from ..effects.effect import Effect
from ..effects.effect_context import ElementGrids
from ..errors import ModelError
from ..inference.discrepancy import Form, form
from ..inference.expected_information import OpenQuantity, Predicted, Rivals
from ..inference.hypothesis_fit import HypothesisFit, UpdatingProblem
from ..inference.likelihood import LN10, Responses
from ..inference.map_fit import prior_residuals
from ..reduced.reduced_model import Reduced, State, evaluate
from .next_measurement import FurtherPlaces, FurtherTest, Outlook

COSTS = {"sensor": 1.0, "drive": 2.0, "mass": 2.0, "band": 1.5, "weighing": 0.5}
LINES = 24  # of a recording at which a new channel is forecast
FEW = 4  # every so many of them, where all channels are forecast
PLACES = 40  # grids at which sensors are tried
MASSES = 8  # grids at which a known mass and a drive are tried
SHARE = 0.02  # of the mass of the structure: the mass that is put on
WEIGHED = 1e-3  # [kg] standard deviation of a good weighing
GAIN = 0.01  # relative standard deviation of the gain of a sensor or gauge
UNSEEN = 0.01  # of the noise: mean variance of the predictions that may be left out
MOST_FORMS = 400  # entries of the errors of form
ABOVE = 1.25  # times the highest line: reach of a wider band


@dataclass(frozen=True, eq=False)
class Rival:
    """An explanation with its own model, and what the recording left unknown of it.

    The unknowns u are the parameters, in the order of the fit, and the entries of the errors of
    form of size 1.
    """

    problem: UpdatingProblem
    hypothesis: HypothesisFit

    @property
    def data(self) -> Responses:
        """The fitted responses."""
        assert isinstance(self.hypothesis.data, Responses)
        return self.hypothesis.data

    @property
    def model(self) -> Reduced:
        """The reduced model of the fit."""
        return self.hypothesis.model

    @cached_property
    def state(self) -> State:
        """The state of the fit, with slopes."""
        return evaluate(self.model, self.hypothesis.fit.effects, self.hypothesis.fit.x)

    @cached_property
    def form(self) -> Form:
        """Errors of form in the modes of the state."""
        return form(self.state, float(self.data.s.imag.max()))

    @cached_property
    def strong(self) -> np.ndarray:
        """The ``MOST_FORMS`` entries of the errors of form that move the recording most."""
        moved = (self.data.form_slopes(self.state, self.form) ** 2).sum(axis=0)
        return np.argsort(-moved)[:MOST_FORMS]

    def slopes(self, data: Responses, state: State) -> np.ndarray:
        """∂r/∂u of the residuals of some data (n, n_u), in units of their noise."""
        error = self.data.error
        size = 0.0 if error is None else error.delta
        J = data.scaled(state, True)[1]
        return np.hstack([J, size * data.form_slopes(state, self.form)[:, self.strong]])

    @cached_property
    def posterior(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean of u about the fit (n_u,), and a root L of its covariance L Lᵀ (n_u, n_u)."""
        fit, plain = self.hypothesis.fit, replace(self.data, error=None)
        A = self.slopes(plain, self.state)
        r = plain.scaled(self.state, False)[0]
        r0, J0 = prior_residuals(fit.effects, self.problem.mass_measurement, fit.x, self.state)
        P = A.T @ A
        n = len(fit.x)
        P[:n, :n] += J0.T @ J0
        P[n:, n:] += np.eye(len(P) - n)
        g = A.T @ r
        g[:n] += J0.T @ r0
        lam, U = np.linalg.eigh(P)
        L = U / np.sqrt(np.maximum(lam, 1e-12 * lam[-1]))
        return -(L @ (L.T @ g)), L

    def predicted(self, data: Responses, state: State) -> tuple[np.ndarray, np.ndarray]:
        """Mean (n,) and factor F (n, n_u) of the residuals of data that are not yet measured."""
        mean, L = self.posterior
        A = self.slopes(data, state)
        return data.scaled(state, False)[0] + A @ mean, A @ L

    def weight(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean (1,) and factor (1, n_u) of the mass, in units of a good weighing."""
        mean, L = self.posterior
        dm = np.zeros(len(mean))
        dm[: len(self.state.dweight)] = self.state.dweight / WEIGHED
        return np.array([self.state.weight / WEIGHED + dm @ mean]), dm[None] @ L

    def with_mass(self, places: ElementGrids, k: int, kilogram: float) -> State | None:
        """The state with a mass on the k-th grid, with slopes; None where it is no structure."""
        b = self.model.rows(places.rows[[k]], keep=False)
        loaded = replace(self.model, M0=self.model.M0 + kilogram * b.T @ b)
        try:
            return evaluate(loaded, self.hypothesis.fit.effects, self.hypothesis.fit.x)
        except ModelError:
            return None


def outlook(
    problem: UpdatingProblem, hypotheses: Sequence[HypothesisFit], names: Sequence[str],
    probability: np.ndarray, kinds: Collection[str] = tuple(COSTS),
    allowed: FurtherPlaces | None = None,
) -> Outlook | None:  # fmt: skip
    """Forecast every candidate measurement under each hypothesis; None without responses.

    One hypothesis alone has its least known quantity forecast.
    """
    if not hypotheses or not isinstance(problem.data, Responses):
        return None
    rivals = [Rival(problem, h) for h in hypotheses]
    found = list(measurements(problem, rivals, kinds, allowed))
    kept = _kept([seen for _, seen in found])
    seen = tuple(
        Predicted(np.stack([mean for mean, _ in each]),
                  tuple(F @ V for (_, F), V in zip(each, kept, strict=True))).short
        for _, each in found
    )  # fmt: skip
    known = Rivals(np.asarray(probability) / np.sum(probability))
    unknown = _unknown(rivals[0], kept[0], seen) if len(rivals) == 1 else None
    return Outlook(tuple(names), known, tuple(c for c, _ in found), seen, unknown)


def _unknown(rival: Rival, kept: np.ndarray, seen: Sequence[Predicted]) -> OpenQuantity:
    """The parameter whose value would take most variance from the predictions.

    That is Σ |F a|²/|a|² over the candidates.  Only the parameters of a named effect count; without
    one, E, rho and t.
    """
    fit, own, L = rival.hypothesis.fit, rival.hypothesis.effects, rival.posterior[1]
    own = own if any(e.parameters for e in own) else fit.effects
    wanted = [e in own and (e.kind != "nuisance") for e in fit.effects for _ in e.parameters]
    names = [quantity_of(e, p.name, fit.of(e)) for e in fit.effects for p in e.parameters]
    along = L[: len(names)] @ kept
    total = (L[: len(names)] ** 2).sum(axis=1)
    taken = sum(
        ((s.factors[0] @ along.T) ** 2).sum(axis=0) / max(len(s.factors[0]), 1) for s in seen
    )
    k = int(np.argmax(np.where(wanted, taken / total, -1.0)))
    return OpenQuantity(names[k], along[k], float(max(total[k] - along[k] @ along[k], 0.0)))


def quantity_of(effect: Effect, parameter: str, x: np.ndarray) -> str:
    """A parameter and where it acts at x; the text of a calibration effect begins with its own."""
    found = effect.location(x)
    text = effect.text or effect.name
    text = text if found.point_m is None else found.text
    if parameter in ("along", "across"):  # of a place on a sheet
        return f"the place of {effect.name} {text}"
    return text if text.startswith(f"{parameter} of ") else f"{parameter} {text}".strip()


Seen = list[tuple[np.ndarray, np.ndarray]]  # of each rival: mean and factor


def measurements(
    problem: UpdatingProblem, rivals: Sequence[Rival], kinds: Collection[str] = tuple(COSTS),
    allowed: FurtherPlaces | None = None,
) -> Iterator[tuple[FurtherTest, Seen]]:  # fmt: skip
    """Every candidate of some kinds, with its prediction under each rival."""
    data, places = rivals[0].data, problem.reduced.candidates
    price = dict[int, float]()
    if allowed is not None:
        every = problem.reduced.grids
        places = every.only(np.isin(every.grids, allowed.grids))
        price = dict(zip(allowed.grids.tolist(), allowed.cost.tolist(), strict=True))
    places = places.only(places.spread(PLACES))
    few = places.only(places.spread(MASSES))
    lines = data.s[np.unique(np.linspace(0, len(data.s) - 1, LINES).astype(int))]
    if "sensor" in kinds and allowed is not None and allowed.fixed.labels:
        fixed = allowed.fixed
        sensors = _new(rivals, lines, fixed.rows(problem.reduced.structure), data.inputs)
        for k, label in enumerate(fixed.labels):
            test = _at("sensor", f"a sensor at {label}", label, fixed.points[k])
            yield replace(test, fixed=True), [each.alone(2, k) for each in sensors]
    if "sensor" in kinds:
        sensors = _new(rivals, lines, places.rows, data.inputs)
        for k in range(len(places)):
            test = _placed("sensor", "a sensor at", places, k)
            test = replace(test, cost=test.cost * price.get(int(places.grids[k]), 1.0))
            yield test, [each.alone(2, k) for each in sensors]
    if "drive" in kinds and not np.any(data.direct):
        drives = _new(rivals, lines[::FEW], data.outputs, few.rows)
        for k in range(len(few)):
            yield _placed("drive", "a drive at", few, k), [each.alone(3, k) for each in drives]
    heavy = SHARE * problem.setup.weight
    for k in range(len(few) if "mass" in kinds else 0):
        states = [s for r in rivals if (s := r.with_mass(few, k, heavy)) is not None]
        if len(states) == len(rivals):
            test = _placed("mass", f"{1e3 * heavy:.3g} g put on at", few, k, heavy)
            loaded = _new(rivals, lines[::FEW], data.outputs, data.inputs, states)
            yield test, [each.seen for each in loaded]
    if "band" in kinds:
        top, ratio = float(data.s.imag.max()), data.s[-1].real / data.s[-1].imag
        wider = np.linspace(top, ABOVE * top, LINES // FEW + 1)[1:] * (ratio + 1j)
        hertz, cost = ABOVE * top / (2 * np.pi), COSTS["band"]
        test = FurtherTest("band", f"lines up to {hertz:.4g} Hz", cost=cost, amount=hertz)
        yield test, [each.seen for each in _new(rivals, wider, data.outputs, data.inputs)]
    if "weighing" in kinds:
        what = f"a weighing to {1e3 * WEIGHED:.2g} g"
        yield FurtherTest("weighing", what, cost=COSTS["weighing"]), [r.weight() for r in rivals]


def _placed(kind: str, what: str, places: ElementGrids, k: int, amount: float = 0.0) -> FurtherTest:
    """A candidate at the k-th grid, along the normal of its surface."""
    label = f"{places.grids[k]}:n"
    return _at(kind, f"{what} {label}", label, places.point[k], amount)


def _at(kind: str, what: str, label: str, point: np.ndarray, amount: float = 0.0) -> FurtherTest:
    x, y, z = point.tolist()
    return FurtherTest(kind, what, label, (x, y, z), COSTS[kind], amount)


@dataclass(frozen=True, eq=False)
class NewChannels:
    """Responses of several channels under one rival, in units of their noise."""

    mean: np.ndarray  # (2, n_f, n_out, n_in), real and imaginary part
    factor: np.ndarray  # (2, n_f, n_out, n_in, n_u)
    gain: np.ndarray  # (n_f, n_out, n_in), an error of gain of one standard deviation, real part

    @property
    def seen(self) -> tuple[np.ndarray, np.ndarray]:
        """Mean (n,) and factor (n, n_u) of channels of known gain."""
        return self.mean.ravel(), self.factor.reshape(self.mean.size, -1)

    def alone(self, axis: int, k: int) -> tuple[np.ndarray, np.ndarray]:
        """Mean and factor of the k-th output (axis 2) or input (3), with a gain of its own."""
        mean, F = self.mean.take([k], axis), self.factor.take([k], axis)
        gain = self.gain.take([k], axis - 1)
        v = np.stack([gain, np.zeros_like(gain)]).ravel()
        size = np.sqrt(v @ v)
        v, less = v / size, 1 - 1 / np.sqrt(1 + size**2)  # C^-½ of C = I + v vᵀ
        mean, F = mean.ravel(), F.reshape(mean.size, -1)
        return mean - less * (v @ mean) * v, F - less * np.outer(v, v @ F)


def _new(
    rivals: Sequence[Rival], lines: np.ndarray, outputs: Any, inputs: Any,
    states: Sequence[State] | None = None,
) -> list[NewChannels]:  # fmt: skip
    """Responses on some lines under each rival in a state, compared with those of the first."""
    states, out = [r.state for r in rivals] if states is None else states, []
    given, about = _responses(rivals[0], lines, outputs, inputs), elsewhere(states[0])
    values = given.model(about)
    given = replace(given, values=values, level=np.abs(values).max(axis=0))
    given, shape = replace(given, bent=given.curvature(about)), (2, *values.shape)
    gain = GAIN / LN10 / given.std()
    for rival, state in zip(rivals, states, strict=True):
        a, b = (rival.model.rows(at, keep=False) for at in (outputs, inputs))
        mean, F = rival.predicted(replace(given, a=a, b=b), elsewhere(state))
        out.append(NewChannels(mean.reshape(shape), F.reshape(*shape, -1), gain))
    return out


def elsewhere(state: State) -> State:
    """The state without what effects do to the shapes and gains of the measured places alone."""
    return replace(state, moved=None, dmoved={}, offset=None, doffset=None)


def _responses(rival: Rival, lines: np.ndarray, outputs: Any, inputs: Any) -> Responses:
    """Responses of a rival at some dofs on some lines, of which no value is known yet."""
    data = rival.data
    n = (len(lines), outputs.shape[0], inputs.shape[0])
    noise = None if data.noise is None else np.full(n, float(np.median(data.noise)))
    return replace(
        data, values=np.ones(n, complex), s=lines, outputs=outputs, inputs=inputs,
        use=np.ones(n[:2], bool), a=rival.model.rows(outputs, keep=False),
        b=rival.model.rows(inputs, keep=False), noise=noise, spread=None,
        level=None, bent=None, error=None, about=None, direct=0.0, sensors=None, known=None,
    )  # fmt: skip


def _kept(every: Sequence[Seen]) -> list[np.ndarray]:
    """Directions (n_u, k) of each rival's unknowns that the measurements can see."""
    out = []
    for j in range(len(every[0])):
        G = sum(F.T @ F / len(F) for F in (seen[j][1] for seen in every)) / len(every)
        lam, U = np.linalg.eigh(G)
        out.append(U[:, np.cumsum(np.maximum(lam, 0.0)) > UNSEEN])
    return out
