"""The most promising of every family of effects, by fast scans about two baselines."""

from dataclasses import replace

import numpy as np

from ..effects import catalogue
from ..effects.effect import Effect
from ..effects.sensor_fault import sensor_fault
from ..effects.thickness_distribution import thickness_distribution
from ..errors import ModelError
from .hypothesis_fit import Search, Trial
from .likelihood import LN10, Poles, Responses
from .pole_starts import global_starts
from .reduced_model import evaluate
from .scan import Baseline, baseline, direction_scores, point_scores, thickness_slopes

WIDE = (0.06, 0.02)  # scales of the poles at which starts are compared

Candidate = tuple[Effect, np.ndarray, np.ndarray]  # effect, its start, start of the base


def candidates(search: Search, null: Trial) -> list[Candidate]:
    """The most promising of every family, scanned about the nominal and the calibrated model."""
    fresh = search.mean()
    calibrated = fresh.copy()
    ordinary = np.concatenate(
        [np.full(len(e.parameters), e.kind == "ordinary") for e in search.base]
    )
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


def _scores(search: Search, base: Baseline, effect: Effect, starts: list[np.ndarray]) -> np.ndarray:
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
        base = bases[-1]
        if isinstance(search.data, Poles) and len(effect.parameters) > 2:
            out += [(effect, x, search.mean()) for x in global_starts(search, effect)]
            continue
        starts = effect.starts()
        for scores in _scores(search, base, effect, starts):
            out.append((effect, starts[int(np.argmin(scores))], base.x))
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
                effect = point_effect(
                    search, matrix, bench.grids, bench.grids.position(spots.grids[k])
                )
                start = np.array([np.log(c / effect.parameters[0].scale), 0.0, 0.0])
                out.append((effect, start, base.x))
    return out


def point_effect(search: Search, matrix: str, spots: catalogue.Places, k: int) -> Effect:
    """A mass ("M") or a spring to ground ("K") near one of the places."""
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
    count = len(set(sheet.connected.tolist()))
    tried = [thickness_distribution(sheet, g, count) for g in range(len(sheet))]
    effects = [e for e in tried for _ in RADII]
    starts = [np.array([-2.0, np.log(radius), 0.0, 0.0]) for _ in tried for radius in RADII]
    bumps = np.stack([e.fields(x)[0].value for e, x in zip(effects, starts, strict=True)], axis=1)
    out: list[Candidate] = []
    taken: list[int] = []
    where = np.repeat(sheet.centre, len(RADII), axis=0)
    for base in bases:
        slopes = thickness_slopes(base, search.bench.model, search.data)
        amount, score = direction_scores(base, slopes @ bumps)
        score = np.where(amount > 0.05, score, np.inf)
        for k in _distinct(score, where, taken, 2):
            if np.isfinite(score[k]):
                taken.append(k)
                alpha = np.clip(amount[k] * 0.6 / (1 + np.exp(2.0)), 0.02, 0.4)
                start = np.array([np.log(alpha / (0.6 - alpha)), *starts[k][1:]])
                out.append((effects[k], start, base.x))
    return out


def _faults(search: Search, null: Trial, data: Responses) -> list[Candidate]:
    """The two channels whose level or sign departs most from the calibrated model.

    Each begins from that model and from the nominal one: a wrong channel bends the calibration.
    """
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
        (sensor_fault(search.labels[i], i, n, sign, start), np.array([start]), base)
        for _, i, sign, start in best
        for base in (null.fit.x, search.mean())
    ]


def _points_by_trial(search: Search, bases: list[Baseline]) -> list[Candidate]:
    """Masses and springs where only poles are known: a coarse spread of places, each evaluated."""
    spots = search.bench.candidates
    some = catalogue.spread(spots.point, 40)
    out: list[Candidate] = []
    for matrix in "MK":
        grids = search.bench.grids
        effects = [
            point_effect(search, matrix, grids, grids.position(spots.grids[k])) for k in some
        ]
        out += _best_of(search, bases, effects, spots.point[some])
    return out


def _thin_by_trial(search: Search, bases: list[Baseline]) -> list[Candidate]:
    sheet = search.bench.sheet
    some = catalogue.spread(sheet.centre, 30)
    count = len(set(sheet.connected.tolist()))
    effects: list[Effect] = [thickness_distribution(sheet, int(g), count) for g in some]
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
