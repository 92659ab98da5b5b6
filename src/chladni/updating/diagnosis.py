"""From a recording to the name of what the model left out.

1. null: ordinary parameters and scatter alone, from several starts;
2. scan: every candidate of the catalogue by fast re-analysis about two baselines, u = 0;
3. fits: the best places of every family, jointly with the ordinary parameters and the scatter;
4. evidence: Laplace, with 2 ln of the number of places tried; leaders restart the null;
5. verdict.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm, qmc

from ..effects import catalogue
from ..effects.effect import Effect, count
from ..effects.sensors import sensor_fault
from ..effects.thickness import ThicknessDistribution, thickness_distribution
from ..errors import ModelError
from .calibration import Fit, Weighing, fit
from .likelihood import LN10, Data, Poles, Responses
from .reduced import Reduced, State, evaluate
from ..effects.somewhere import Somewhere
from .scan import Baseline, baseline, direction_scores, point_scores, thickness_slopes
from .workbench import Workbench

THRESHOLD = 25.0  # gain in -2 ln evidence below which nothing is named (METHOD: null simulations)
CHANGED = 6.0  # gain that ordinary parameters must bring to be called calibrated

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Trial:
    """One hypothesis after its fit: the effect, the fit, the model it was fitted in."""

    effect: Effect
    fit: Fit
    model: Reduced

    @property
    def data(self) -> Data:
        """What was fitted."""
        return self.fit.data

    @property
    def S(self) -> float:
        """-2 ln evidence."""
        return self.fit.S


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found.

    Attributes
    ----------
    nominal, null : fits without, and with ordinary parameters free
    trials : best trial of every family, best first
    verdict : one of the public verdicts
    notes : what was done and why, one sentence each
    """

    nominal: Trial
    null: Trial
    trials: tuple[Trial, ...]
    verdict: str
    notes: tuple[str, ...] = ()

    @property
    def found(self) -> Trial | None:
        """The named effect, if any."""
        named = self.verdict in ("missing physics", "measurement fault")
        return self.trials[0] if named and self.trials else None

    def gain(self, trial: Trial) -> float:
        """How much better than the null, in -2 ln evidence."""
        return self.null.S - trial.S


@dataclass(frozen=True, eq=False)
class Search:
    """All that a diagnosis works with.

    Attributes
    ----------
    base : ordinary parameters and nuisances, free in every fit
    nuisance : the nuisances alone
    """

    bench: Workbench
    data: Data
    weighing: Weighing | None
    base: tuple[Effect, ...]
    nuisance: tuple[Effect, ...]
    setup: catalogue.Setup
    labels: tuple[str, ...] = ()

    def mean(self) -> np.ndarray:
        """Prior mean of the base parameters."""
        return np.array([p.mean for e in self.base for p in e.parameters])

    def trial(self, effect: Effect, start: np.ndarray, base: np.ndarray) -> Trial:
        """Fit one effect together with the base, from these starts."""
        model = self.bench.model
        if isinstance(effect, Somewhere):
            model = self.bench.with_attachments(effect.carried())
        else:
            for term in effect.terms(start):
                model = self.bench.with_attachments(term.rows)
        if any(change.field.startswith("Q") for change in effect.fields(start)):
            model = model.with_components()
        data = self.data.over(model)
        kept = self.without(effect)
        inside = np.concatenate([np.full(len(e.parameters), e in kept) for e in self.base])
        x0 = np.concatenate([base[inside.astype(bool)], start])
        return Trial(effect, _fit(model, [*kept, effect], data, self.weighing, x0), model)

    def without(self, effect: Effect) -> list[Effect]:
        """The base less what the effect makes superfluous."""
        return [e for e in self.base if e.text not in effect.replaces]


def _fit(
    model: Reduced, effects: Sequence[Effect], data: Data, weighing: Weighing | None, x: np.ndarray
) -> Fit:
    """A fit; for poles, the spread that no model reaches is found with it."""
    if isinstance(data, Poles):
        return _fit_poles(model, effects, data, weighing, x)
    return fit(model, effects, data, weighing, x)


SCALES = np.geomspace(0.003, 0.2, 25)
WIDE = (0.06, 0.02)  # scales at which starts are compared
SCALE_SD = 0.5  # of ln(scale) about its prior median


def _fit_poles(
    model: Reduced, effects: Sequence[Effect], data: Poles, weighing: Weighing | None, x: np.ndarray
) -> Fit:
    """Alternate the fit with the most probable scale of what no model reaches."""
    options = []
    for road in ROADS:
        there = x
        for scale in road:
            there = fit(model, effects, replace(data, scale=scale), weighing, there, max_steps=8).x
        options.append(_settled(model, effects, data, weighing, there))
    return min(options, key=lambda f: f.S)


ROADS = ((0.08, 0.04, 0.02), (0.03, 0.015))  # scales on which the pairing settles


def _settled(
    model: Reduced, effects: Sequence[Effect], data: Poles, weighing: Weighing | None, x: np.ndarray
) -> Fit:
    """Scale and parameters in turn until the evidence stays."""
    best = None
    for _ in range(4):
        scale = _likely_scale(replace(data, scale=SCALES[0]), evaluate(model, effects, x, False))
        now = fit(model, effects, replace(data, scale=scale), weighing, x)
        var = data.sd[data.use] ** 2 + scale**2
        now = replace(now, S=now.S + float(np.log(var).sum()) + _scale_prior(scale, data.scale))
        if best is not None and now.S > best.S - 0.05:
            break
        best, x = now, now.x
    return best if best is not None else now


def _likely_scale(data: Poles, state: State) -> float:
    """The scale at which the pairing as a whole is most probable."""

    def cost(scale: float) -> float:
        wider = replace(data, scale=scale)
        r, _ = wider.residual(state, False)
        return float(r @ r + 2 * np.log(wider.spread()[data.use]).sum()) + _scale_prior(scale)

    return float(min(SCALES, key=cost))


def _scale_prior(scale: float, median: float = 0.006) -> float:
    return float((np.log(scale / median) / SCALE_SD) ** 2)


def diagnose(search: Search, progress: Progress = lambda text, share: None) -> Diagnosis:
    """Name the missing physics, or say that none is missing."""
    progress("calibration without new physics", 0.05)
    nominal = _base_trial(search, search.nuisance, _nominal_starts(search))
    null = _base_trial(search, search.base, _null_starts(search))
    progress("scan of the catalogue", 0.2)
    candidates = _candidates(search, null)
    trials = []
    for k, (effect, start, base) in enumerate(candidates):
        progress(f"trying {effect.name} {effect.text}", 0.3 + 0.5 * k / len(candidates))
        trials.append(search.trial(effect, start, base))
    trials = _by_family(trials)
    progress("closing in on the place", 0.8)
    trials = _by_family([*trials, *(t for lead in trials[:3] for t in _closer(search, lead))])
    null = _restarted(search, null, trials)
    progress("verdict", 0.95)
    return Diagnosis(nominal, null, tuple(trials), verdict(nominal, null, trials))


def verdict(nominal: Trial, null: Trial, trials: Sequence[Trial]) -> str:
    """The public verdict."""
    best = trials[0] if trials else None
    if best is not None and null.S - best.S > THRESHOLD:
        return "measurement fault" if best.effect.kind == "test" else "missing physics"
    return "calibration only" if nominal.S - null.S > CHANGED else "nothing missing"


def _base_trial(search: Search, effects: Sequence[Effect], starts: list[np.ndarray]) -> Trial:
    """Best fit of these effects alone over several starts."""
    model = search.bench.model
    fits = [_fit(model, effects, search.data, search.weighing, x) for x in starts]
    return Trial(Effect(), min(fits, key=lambda f: f.S), model)


def _nominal_starts(search: Search) -> list[np.ndarray]:
    return [np.array([p.mean for e in search.nuisance for p in e.parameters])]


def _null_starts(search: Search) -> list[np.ndarray]:
    """The prior mean; where modes must be paired, also softer and stiffer by up to a third."""
    mean = search.mean()
    if isinstance(search.data, Responses):
        return [mean]
    stiff = np.array([p.name == "E" for e in search.base for p in e.parameters], dtype=float)
    return [mean + shift * stiff for shift in (0.0, -0.35, 0.35, -0.7, 0.7)]


Candidate = tuple[Effect, np.ndarray, np.ndarray]  # effect, its start, start of the base


def _candidates(search: Search, null: Trial) -> list[Candidate]:
    """The most promising of every family, scanned about the nominal and the calibrated model."""
    fresh = search.mean()
    calibrated = fresh.copy()
    ordinary = np.concatenate([np.full(len(e.parameters), e.kind == "ordinary") for e in search.base])
    calibrated[ordinary.astype(bool)] = null.fit.x[ordinary.astype(bool)]
    bases = [
        baseline(search.bench.model, search.base, search.data, search.weighing, x)
        for x in (fresh, calibrated)
    ]
    out = _listed(search, bases)
    if isinstance(search.data, Responses):
        out += _points(search, bases, search.data) + _thin(search, bases)
        out += _faults(search, null, search.data)
    else:
        out += _points_by_trial(search, bases) + _thin_by_trial(search, bases)
    return out


def _scores(
    search: Search, base: Baseline, effect: Effect, starts: list[np.ndarray]
) -> np.ndarray:
    """Score of an effect at each start about a baseline (n_ways, n_starts).

    Responses are scored once, with the base profiled out; poles at a wide and at a narrow scale.
    """
    model = search.bench.model
    if any(change.field.startswith("Q") for change in effect.fields(starts[0])):
        model = model.with_components()
    data = search.data
    wide = [replace(data, scale=scale) for scale in WIDE] if isinstance(data, Poles) else []
    out = np.full((max(1, len(wide)), len(starts)), np.inf)
    mean, sd = (np.array([getattr(p, q) for p in effect.parameters]) for q in ("mean", "sd"))
    for k, start in enumerate(starts):
        try:
            state = evaluate(model, [*base.effects, effect], np.concatenate([base.x, start]), False)
        except ModelError:
            continue
        for way, poles in enumerate(wide):
            r, _ = poles.residual(state, False)
            out[way, k] = r @ r + (((start - mean) / sd) ** 2).sum()
        if not wide:
            r, _ = data.residual(state, False)
            out[0, k] = base.score(replace(base, state=state).with_mass(r[:, None], 0.0))[0]
    return out


def _draws(effect: Effect, n: int) -> list[np.ndarray]:
    """Sobol points of an effect's prior."""
    u = qmc.Sobol(len(effect.parameters), seed=1).random(n)
    mean, sd = (np.array([getattr(p, q) for p in effect.parameters]) for q in ("mean", "sd"))
    return list(mean + sd * norm.ppf(np.clip(u, 1e-3, 1 - 1e-3)))


def _listed(search: Search, bases: list[Baseline]) -> list[Candidate]:
    """Effects without an unknown place: the best start of each."""
    bench, setup = search.bench, search.setup
    effects = [
        *catalogue.grains(bench.sheet),
        *catalogue.sensor_mass(bench.sheet, setup),
        *catalogue.suspension(bench.sheet, setup, bench.grids),
    ]
    out: list[Candidate] = []
    for effect in effects:
        base, starts = bases[-1], effect.starts()
        several = 1
        if isinstance(search.data, Poles) and len(effect.parameters) > 2:
            starts, several = [*starts, *_draws(effect, 2048)], 6  # pairing makes many valleys
        for scores in _scores(search, base, effect, starts):
            out += [(effect, starts[k], base.x) for k in np.argsort(scores)[:several]]
    return out


def _points(search: Search, bases: list[Baseline], data: Responses) -> list[Candidate]:
    """Masses and springs: the two best places of each about each baseline."""
    bench, setup = search.bench, search.setup
    spots = bench.candidates
    rest = bench.flexibility(spots)
    mass = 0.03 * setup.weight * np.exp(np.linspace(-3.0, 1.5, 7))
    spring = catalogue.stiffness_scale(setup) * np.exp(np.linspace(-4.5, 4.5, 9))
    out: list[Candidate] = []
    for matrix, strengths in (("M", mass), ("K", spring)):
        chosen: list[int] = []
        for base in bases:
            score = point_scores(base, bench.model, data, spots, matrix, strengths, rest)
            for k in _distinct(score.min(axis=1), spots.point, chosen, 2):
                chosen.append(k)
                c = strengths[int(np.argmin(score[k]))]
                effect = _at(search, matrix, bench.grids, bench.grids.position(spots.grids[k]))
                start = np.array([np.log(c / effect.parameters[0].scale), 0.0, 0.0])
                out.append((effect, start, base.x))
    return out


def _at(search: Search, matrix: str, spots: catalogue.Places, k: int) -> Effect:
    sheet, setup, tried = search.bench.sheet, search.setup, len(search.bench.candidates)
    make = catalogue.point_mass if matrix == "M" else catalogue.extra_support
    return make(sheet, setup, spots, k, tried)


def _distinct(score: np.ndarray, point: np.ndarray, taken: list[int], wanted: int) -> list[int]:
    """The best positions, none within a sixth of the structure's size of another one chosen."""
    reach = np.linalg.norm(np.ptp(point, axis=0)) / 6
    out: list[int] = []
    for k in np.argsort(score):
        if all(np.linalg.norm(point[k] - point[j]) > reach for j in [*taken, *out]):
            out.append(int(k))
        if len(out) == wanted:
            break
    return out


RADII = (0.1, 0.18, 0.3)  # of the square root of the part's area


def _thin(search: Search, bases: list[Baseline]) -> list[Candidate]:
    """Local thinning: its slope at every group and radius, the two best places per baseline."""
    sheet = search.bench.sheet
    shapes = [
        (k, g, np.array([-2.0, np.log(radius), *_flat(sheet, k, g)]))
        for k in np.unique(sheet.part)
        for g in np.flatnonzero(sheet.part == k)
        for radius in RADII
    ]
    effects = [thickness_distribution(sheet, int(k), x, len(sheet)) for k, _, x in shapes]
    bumps = np.stack(
        [e.fields(x)[0].value for e, (_, _, x) in zip(effects, shapes, strict=True)], axis=1
    )
    out: list[Candidate] = []
    taken: list[int] = []
    where = sheet.centre[[g for _, g, _ in shapes]]
    for base in bases:
        slopes = thickness_slopes(base, search.bench.model, search.data)
        amount, score = direction_scores(base, slopes @ bumps)
        score = np.where(amount > 0.05, score, np.inf)
        for k in _distinct(score, where, taken, 2):
            if np.isfinite(score[k]):
                taken.append(k)
                alpha = np.clip(amount[k] * 0.6 / (1 + np.exp(2.0)), 0.02, 0.4)
                start = np.array([np.log(alpha / (0.6 - alpha)), *shapes[k][2][1:]])
                out.append((effects[k], start, base.x))
    return out


def _flat(sheet, part: int, g: int) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Place of a group in the part's own plane, in units of its size (2,)."""
    effect = thickness_distribution(sheet, int(part), np.zeros(4), 1)
    return np.asarray((sheet.centre[g] - effect.origin) @ effect.plane.T / effect.size)


def _faults(search: Search, null: Trial, data: Responses) -> list[Candidate]:
    """The three channels whose level or sign departs most from the calibrated model."""
    delta = data.deviation(null.fit.state)
    lines = data.use.any(axis=1)
    out = []
    n = data.values.shape[1]
    for i in range(n):
        d = delta[lines, i].ravel()
        flipped = np.mean(np.abs(d.imag)) > np.pi / 2 / LN10
        start = float(np.clip(-np.median(d.real) * LN10, -2.5, 2.5))
        left = d + (start + (1j * np.pi if flipped else 0)) / LN10
        gain = np.mean(np.abs(d) ** 2) - np.mean(
            np.abs(left.real + 1j * ((left.imag * LN10 + np.pi) % (2 * np.pi) - np.pi) / LN10) ** 2
        )
        out.append((gain, i, -1 if flipped else 1, start))
    best = sorted(out, reverse=True)[:2]
    return [
        (sensor_fault(search.labels[i], i, n, sign, start), np.array([start]), null.fit.x)
        for _, i, sign, start in best
    ]


def _points_by_trial(search: Search, bases: list[Baseline]) -> list[Candidate]:
    """Masses and springs where only poles are known: a coarse spread of places, each evaluated."""
    spots = search.bench.candidates
    some = catalogue.spread(spots.point, 40)
    out: list[Candidate] = []
    for matrix in "MK":
        grids = search.bench.grids
        effects = [_at(search, matrix, grids, grids.position(spots.grids[k])) for k in some]
        out += _best_of(search, bases, effects, spots.point[some])
    return out


def _thin_by_trial(search: Search, bases: list[Baseline]) -> list[Candidate]:
    sheet = search.bench.sheet
    some = catalogue.spread(sheet.centre, 30)
    effects: list[Effect] = []
    for g in some:
        k = int(sheet.part[g])
        x = np.array([-1.0, np.log(0.18), *_flat(sheet, k, int(g))])
        effects.append(thickness_distribution(sheet, k, x, len(sheet)))
    return _best_of(search, bases, effects, sheet.centre[some])


def _best_of(
    search: Search, bases: list[Baseline], effects: list[Effect], point: np.ndarray
) -> list[Candidate]:
    """The two best places about the calibrated baseline."""
    base = bases[-1]
    options = [_best_start(search, base, e) for e in effects]
    best = _distinct(np.array([score for score, _ in options]), point, [], 2)
    return [(effects[k], options[k][1], base.x) for k in best]


def _best_start(search: Search, base: Baseline, effect: Effect) -> tuple[float, np.ndarray]:
    starts = effect.starts()
    scores = _scores(search, base, effect, starts)[0]
    return float(scores.min()), starts[int(np.argmin(scores))]


def _by_family(trials: list[Trial]) -> list[Trial]:
    """The best trial of every family, best first."""
    best: dict[str, Trial] = {}
    for t in trials:
        if t.effect.name not in best or t.S < best[t.effect.name].S:
            best[t.effect.name] = t
    return sorted(best.values(), key=lambda t: t.S)


def _closer(search: Search, lead: Trial) -> list[Trial]:
    """The leader begun anew from the grid it moved to, while it moves."""
    out: list[Trial] = []
    grids = search.bench.grids
    for _ in range(3):
        effect, x = lead.effect, lead.fit.of(lead.effect)
        if not isinstance(effect, Somewhere) or np.abs(x[1:]).max() < 0.75:
            break
        new = _at(search, "M" if effect.matrix == "M" else "K", grids, grids.position(effect.nearest(x)))
        start = np.array([x[0], 0.0, 0.0])
        trial = search.trial(new, start, _fresh(search, lead))
        out.append(trial)
        if trial.S > lead.S - 1:
            break
        lead = trial
    return out


def _fresh(search: Search, lead: Trial) -> np.ndarray:
    """Base parameters with the leader's ordinary ones and no scatter."""
    x, at = search.mean(), 0
    kept = search.without(lead.effect)
    for e in search.base:
        if e in kept and e.kind == "ordinary":
            x[at : at + len(e.parameters)] = lead.fit.of(e)
        at += len(e.parameters)
    return x


def _restarted(search: Search, null: Trial, trials: list[Trial]) -> Trial:
    """The null again, from the base parameters of the leaders: it must not lose by a bad start."""
    starts = []
    for lead in trials[:2]:
        kept = search.without(lead.effect)
        x = search.mean()
        at = 0
        for e in search.base:
            n = len(e.parameters)
            if e in kept:
                x[at : at + n] = lead.fit.of(e)
            at += n
        starts.append(x)
    again = _base_trial(search, search.base, starts) if starts else null
    return again if again.S < null.S else null


def deck_state(trial: Trial, gradient: bool = False) -> np.ndarray:
    """x of a trial with every nuisance at its prior mean: what can be written into a deck."""
    x = trial.fit.x.copy()
    at = 0
    for e in trial.fit.effects:
        n = len(e.parameters)
        if e.kind == "nuisance" and e.name != "gain":
            x[at : at + n] = [p.mean for p in e.parameters]
        at += n
    return x


__all__ = [
    "Diagnosis", "Search", "ThicknessDistribution", "Trial", "count", "deck_state", "diagnose",
    "verdict",
]  # fmt: skip
