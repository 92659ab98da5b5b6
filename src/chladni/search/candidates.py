"""The most promising of every family of effects, and the services by which families find them."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from ..effects.effect import Effect, MatrixTerm, of
from ..effects.effect_context import EffectContext, ElementGrids
from ..effects.family import Family
from ..effects.joints import Connection
from ..effects.search_context import Candidate
from ..inference import scan as scans
from ..inference.hypothesis_fit import FAILED, HypothesisFit, UpdatingProblem
from ..inference.likelihood import Responses
from ..inference.pole_data import Poles
from ..parallel import in_parallel
from ..reduced.local_effect import LocalEffect
from ..reduced.reduced_model import Reduced, evaluate
from .fastener_scan import Loosened, LoosenedRow, fastener_scores, loosened_rows, singles
from .pole_starts import global_starts, squared_prior

APART = 1 / 6  # of the structure's size: effects nearer to each other are one
WIDE = (0.06, 0.02)  # scales of the poles at which starts are compared


def candidates(
    problem: UpdatingProblem, null: HypothesisFit, most: int | None = None
) -> list[Candidate]:
    """The most promising of every family, about the nominal and the calibrated model.

    With ``most``, so many of them alone: those that score best where they begin.
    """
    context = UpdatingContext(problem, null)
    every, _ = proposals(context)
    return every if most is None else _leading(context, every, most)


def proposals(context: "UpdatingContext") -> tuple[list[Candidate], dict[str, str]]:
    """The most promising of every family, and why a family failed numerically.

    A family that fails is lost, and no other.
    """
    problem, lost = context.problem, dict[str, str]()
    if context.scan is not None:  # most families read these: before they are tried in parallel
        _ = context.baselines, context.flexibility, context.loosened

    def proposed(family: Family) -> list[Candidate]:
        try:
            return family.proposed(context)
        except FAILED as error:
            lost[family.name] = str(error)
            return []

    every = [c for some in in_parallel(proposed, problem.families) for c in some]
    every = [c for c in every if not already_there(problem, c.effect, c.start)]
    return every, lost


def already_there(problem: UpdatingProblem, effect: Effect, x: np.ndarray) -> bool:
    """True if an effect at x is in every fit already: freed by the user, or found before."""
    found = [e for e, _ in problem.found]
    free = {e.text for e in problem.base if e not in found}
    return effect.text in free or repeats(problem, effect, x)


def repeats(problem: UpdatingProblem, effect: Effect, x: np.ndarray) -> bool:
    """True if an effect at x was found already, or acts at the place of a found effect.

    Two local effects at one place are one effect outside the catalogue. A patch with sharp edges,
    for example, was named as a thinning, a crack and a mass, and each improved the fit. Several
    flexible effects of one kind are excluded too: a rotor was named as two masses on springs.
    """
    if effect.traits.lone and any(other.name == effect.name for other, _ in problem.found):
        return True
    reach = APART * float(np.linalg.norm(np.ptp(problem.where.grids.point, axis=0)))
    mine = effect.location(x)
    for other, at in problem.found:
        its = other.location(at)
        if mine.point_m is not None and its.point_m is not None:
            if np.linalg.norm(np.subtract(mine.point_m, its.point_m)) < reach:
                return True
        elif other.name == effect.name and mine.channels == its.channels:
            whole = effect.traits.remakes_structure and set(effect.parts) & set(other.parts)
            if mine.channels or mine.text == its.text or whole:
                return True
    return False


def _leading(context: "UpdatingContext", every: list[Candidate], most: int) -> list[Candidate]:
    """Candidates with the best scores at their start, less the price of the places tried."""
    score = [
        float(context.scores(c.effect, [c.start]).min())
        + squared_prior(c.effect, c.start) + 2 * float(np.log(c.effect.trials_factor))
        for c in every
    ]  # fmt: skip
    return [every[k] for k in np.argsort(score, kind="stable")[:most]]


def unasked(problem: UpdatingProblem) -> tuple[str, ...]:
    """Effects not searched on a structure without shells, and why; empty if it has some."""
    names = ", ".join(family.name for family in problem.families if family.on_sheets)
    if problem.where.groups.sheet.any() or not names:
        return ()
    return (f"not searched, because they act on shells and the deck has none: {names}",)


@dataclass(frozen=True, eq=False)
class UpdatingContext:
    """An updating problem as families of effects see it.

    See :class:`..effects.search_context.SearchContext`. With ``about`` (n_base,) the last of the
    states that are changed is another than that of the null.
    """

    problem: UpdatingProblem
    null_fit: HypothesisFit  # the best without any effect
    about: np.ndarray | None = None
    # kept: models of effects with parts of their own, scores of joints and of lines of shells
    _components: dict[str, Reduced] = field(default_factory=dict)
    _loose: dict[tuple[tuple[int, ...], bytes], np.ndarray] = field(default_factory=dict)
    _bent: dict[tuple[int, bytes], np.ndarray] = field(default_factory=dict)

    @property
    def where(self) -> EffectContext:
        """The structure and its test."""
        return self.problem.where

    @property
    def labels(self) -> tuple[str, ...]:
        """Outputs of the test."""
        return self.problem.labels

    @cached_property
    def bases(self) -> tuple[np.ndarray, ...]:
        """Base parameters of the nominal and of the calibrated model, scatter idle in both.

        With effects in place the calibrated model is near enough, and stands for both.
        """
        nominal = self.problem.mean()
        if self.about is not None:
            return nominal, self.about
        base, found = self.problem.base, [e for e, _ in self.problem.found]
        kinds = [e.kind == "calibration" or e in found for e in base for _ in e.parameters]
        calibrated = np.where(kinds, self.null, nominal)
        try:
            evaluate(self.problem.reduced.model, base, calibrated, False)
        except FAILED:  # it is no structure
            calibrated = self.null
        return (calibrated,) if found else (nominal, calibrated)

    @property
    def null(self) -> np.ndarray:
        """Base parameters of the best fit without any effect."""
        return self.null_fit.fit.x

    @property
    def idle(self) -> float:
        """-2 ln evidence of that fit; inf if only poles are known."""
        return np.inf if self.scan is None else self.null_fit.neg2_log_evidence

    @cached_property
    def baselines(self) -> tuple[scans.Baseline, ...]:
        """The base effects linearised at each of ``bases``."""
        s, model = self.problem, self.problem.reduced.model
        return tuple(
            scans.baseline(model, s.base, s.data, s.mass_measurement, x) for x in self.bases
        )

    @property
    def weighs_more(self) -> float:
        """Weighed mass minus nominal mass [kg]; 0 if nothing was weighed."""
        weighed = self.problem.mass_measurement
        if weighed is None or self.scan is None:
            return 0.0
        return weighed.mass - self.baselines[0].state.weight

    @property
    def scan(self) -> Self | None:
        """Fast scores of responses; None where only natural frequencies are known."""
        return self if isinstance(self.problem.data, Responses) else None

    @property
    def data(self) -> Responses:
        """The fitted responses."""
        assert isinstance(self.problem.data, Responses)
        return self.problem.data

    @property
    def tells_places(self) -> bool:
        """True if the data tell neighbouring places apart: responses, or modes with shapes."""
        data = self.problem.data
        return isinstance(data, Responses) or data.shapes is not None

    @cached_property
    def loosened(self) -> tuple[Loosened, ...]:
        """Welds and fasteners with what the sheets give where they are loaded."""
        return singles(self.fastener_rows)

    @cached_property
    def fastener_rows(self) -> tuple[LoosenedRow, ...]:
        """Adjacent fasteners, any run of which may be loosened as one."""
        return loosened_rows(self.problem.reduced)

    @property
    def fasteners(self) -> tuple[tuple[Connection, np.ndarray], ...]:
        """Welds and fasteners of the structure; of each the share z/(w + z) of its rows (r,)."""
        return tuple((each.joint, each.share) for each in self.loosened)

    def scores(
        self, effect: Effect, starts: Sequence[np.ndarray], extended: bool = False, about: int = -1
    ) -> np.ndarray:
        """Score of an effect at each start about one of ``bases`` (n_ways, n_starts).

        Responses are scored once, with the base profiled out; poles at a wide and a narrow scale.
        """
        base, reduced, local = self.baselines[about], self.problem.reduced, None
        model = reduced.model
        if extended and self.scan is not None:
            local = LocalEffect.of(reduced, base.effects, effect, base.state, base.x, starts[0])
        if local is None:
            wider = extended or effect.release is not None
            model = (reduced.model_for if wider else model.split_for)(effect, starts[0])
            if "" not in model.linear:
                self._components[effect.text] = model  # every start of the effect is scored on it
        data = self.problem.data.rebased(model)
        ways = WIDE if isinstance(data, Poles) else (0.0,)
        out = np.full((len(ways), len(starts)), np.inf)
        for k, start in enumerate(starts):
            x = np.concatenate([base.x, start])
            try:
                if local is None:
                    state = evaluate(model, [*base.effects, effect], x, False)
                else:
                    state = local.added(base.state, base.x, start)
            except FAILED:
                continue
            if isinstance(data, Poles):
                each = (replace(data, scale=scale).scaled(state, False)[0] for scale in ways)
                out[:, k] = [r @ r + squared_prior(effect, start) for r in each]
            else:
                r, _ = data.scaled(state, False)
                out[0, k] = base.score(replace(base, state=state).with_mass(r[:, None], 0.0))[0]
        return out

    def own(self, effect: Effect, start: np.ndarray) -> tuple[float, np.ndarray]:
        """-2 ln evidence at the own optimum of an effect, and the optimum; inf without one."""
        if self.scan is None:
            return float(self.scores(effect, [start], True).min()), start
        bases = (self.null, self.bases[0]) if self.about is None else (self.about,)
        try:
            found = self.problem.own_optimum(effect, start, bases)
        except FAILED:
            return np.inf, start
        return found.neg2_log_evidence, found.fit.of(effect)

    def modal_operators(self, effect: Effect, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """λ (m,) of the calibrated model, and φᵀ A φ of the operators of an effect (k, m, m)."""
        base, model = self.baselines[-1], self.problem.reduced.model
        state = evaluate(model, base.effects, base.x, False)
        A = (model.operator(t.operator) for t in of(MatrixTerm, effect.terms(x)))
        return state.lam, np.array([state.phi.T @ a @ state.phi for a in A])

    def optima(self, effect: Effect) -> list[np.ndarray]:
        """Lowest minima of an effect over its whole prior, where poles alone are known."""
        return global_starts(self.problem, effect)

    # scores of many changes at once (:class:`..effects.search_context.ResponseScan`)

    @cached_property
    def flexibility(self) -> np.ndarray:
        """Static response of the places beyond the basis [m/N]."""
        return self.problem.reduced.flexibility(self.where.places)

    @cached_property
    def deviation(self) -> np.ndarray:
        """log10(H_model / H_test) of the best fit without any effect, on the lines in use."""
        data = self.data
        return data.deviation(self.null_fit.fit.state)[data.use.any(axis=1)]

    def _at(self, about: int) -> tuple[scans.Baseline, Reduced, Responses]:
        """The state that is changed, the model and the data of a scan."""
        return self.baselines[about], self.problem.reduced.model, self.data

    def point_scores(
        self, about: int, matrix: str, strengths: np.ndarray, places: ElementGrids | None = None
    ) -> np.ndarray:
        """Score of a mass ("M", kg) or spring ("K", N/m) at each place (n_places, n_strengths)."""
        rest = self.flexibility if places is None else self.problem.reduced.flexibility(places)
        places = self.where.places if places is None else places
        return scans.point_scores(*self._at(about), places, matrix, strengths, rest)

    def oscillator_scores(
        self, about: int, mass: float, hertz: np.ndarray, places: ElementGrids
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best mass [kg] of a lump on a spring, and the score with it (n_places, n_hertz)."""
        rest = self.problem.reduced.flexibility(places)
        return scans.oscillator_scores(*self._at(about), places, mass, hertz, rest)

    def spin_scores(
        self, about: int, places: ElementGrids, sd: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best angular momentum of a spinning part at each place (k, 3), and the score (k,)."""
        return scans.spin_scores(*self._at(about), self.where.rotations(places.grids), sd)

    def field_scores(
        self, about: int, field: str, change: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best amount of each change of ln t, E or rho (n_groups, k), and the score: (k,), (k,)."""
        slopes = scans.field_slopes(*self._at(about), field)
        return scans.direction_scores(self.baselines[about], slopes @ change)

    def effect_scores(
        self, about: int, effect: Effect, change: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best amount of each change of an effect from its nominal values, and the score."""
        slopes = scans.effect_slopes(*self._at(about), effect)
        return scans.direction_scores(self.baselines[about], slopes @ change)

    def bending_scores(
        self, about: int, sets: Sequence[np.ndarray]
    ) -> tuple[np.ndarray, np.ndarray]:
        """Best amount of bending stiffness each set of shells gains, and the score: (k,), (k,).

        Several families try the same lines of shells.
        """
        keys, known = [(about, each.tobytes()) for each in sets], self._bent
        fresh = {key: each for key, each in zip(keys, sets, strict=True) if key not in known}
        slopes = scans.bending_slopes(*self._at(about), list(fresh.values()))
        scores = scans.direction_scores(self.baselines[about], slopes)
        known |= zip(fresh, np.transpose(scores), strict=True)
        amount, score = np.array([known[key] for key in keys]).reshape(-1, 2).T
        return amount, score

    def fastener_scores(self, about: int, left: np.ndarray) -> np.ndarray:
        """Score of each fastener with some of its stiffness left (n, k)."""
        return self._loosened_once(about, self.loosened, left, (about,))

    def run_scores(
        self, about: int, row: int, first: int, last: int, left: np.ndarray
    ) -> np.ndarray:
        """Score of a run of a row with some of its stiffness left (k,)."""
        run = self.fastener_rows[row].run(first, last)
        return self._loosened_once(about, [run], left[None], (about, row, first, last))[0]

    def _loosened_once(
        self, about: int, joints: Sequence[Loosened], left: np.ndarray, which: tuple[int, ...]
    ) -> np.ndarray:
        """Scores (n, k) of the joints ``which``; several families try the same ones."""
        known, key = self._loose, (which, left.tobytes())
        if key not in known:
            base, reduced = self.baselines[about], self.problem.reduced
            known[key] = fastener_scores(base, reduced, self.data, joints, left)
        return known[key]
