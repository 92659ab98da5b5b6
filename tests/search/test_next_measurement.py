"""What a further measurement would show, under each of several explanations."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.commands import ran, refused
from tests.search.test_several import HERE, THERE, lump, null_of, problem_of

from chladni.fem.energy import mass_properties
from chladni.fem.measured_dofs import MeasuredDofs
from chladni.inference.likelihood import LN10
from chladni.output import run_folder, write_npz
from chladni.reduced.reduced_model import evaluate
from chladni.search import measurement_forecasts
from chladni.search.decide import open_explanations
from chladni.search.decision_in_words import BEYOND
from chladni.search.hypotheses import ALONE
from chladni.search.measurement_forecasts import (
    GAIN,
    Rival,
    _new,
    _responses,
    outlook,
    quantity_of,
)
from chladni.search.next_measurement import (
    FurtherPlaces,
    advised,
    arrays_of,
    read_outlook,
    with_common_candidates,
)


@pytest.fixture(scope="module", autouse=True)
def few():
    """A sample of places and lines."""
    with pytest.MonkeyPatch.context() as patch:
        for name, n in (("PLACES", 12), ("MASSES", 3), ("LINES", 16)):
            patch.setattr(measurement_forecasts, name, n)
        yield


@pytest.fixture(scope="module")
def problem(reduced):
    """A plate with a lump."""
    weight = 0.03 * mass_properties(reduced.structure.assembly)[0]
    return problem_of(reduced, [lump(reduced, HERE, 1.0)], weight)


@pytest.fixture(scope="module")
def tied(reduced, problem):
    """The lump at its place, and at another one."""
    base = null_of(problem).fit.x
    out = []
    for where in (HERE, THERE):
        of, x = lump(reduced, where, 1.0)
        out.append(problem.fitted_with(of(problem.where), x, base))
    return out


@pytest.fixture(scope="module")
def found(problem, tied):
    return outlook(problem, tied, ("here", "there"), np.ones(2))


def test_candidates_of_every_kind_are_predicted(found):
    kinds = {c.kind for c in found.candidates}
    assert kinds == {"sensor", "drive", "mass", "band", "weighing"}
    assert len(found.seen) == len(found.candidates)
    for each in found.seen:
        assert np.isfinite(each.mean).all()
        assert {len(F) for F in each.factors} == {each.mean.shape[1]}


def test_prediction_is_linear_about_the_fit(problem, tied):
    """A step of each parameter moves the prediction as its slope says; so it does the mass."""
    rival, data = Rival(problem, tied[0]), tied[0].data
    fit, row = tied[0].fit, problem.reduced.grids.rows[[7]]
    given = _responses(rival, data.s[::4], row, data.inputs)
    given = replace(given, values=given.model(rival.state))
    J = rival.slopes(given, rival.state)[:, : len(fit.x)]
    h = 1e-3 * np.sqrt(np.diag(fit.covariance))
    for k in range(len(fit.x)):
        step = h[k] * (np.arange(len(fit.x)) == k)
        moved = [
            given.scaled(evaluate(rival.model, fit.effects, fit.x + sign * step, False), False)[0]
            for sign in (1, -1)
        ]
        due = (moved[0] - moved[1]) / (2 * h[k])
        assert_allclose(J[:, k], due, atol=1e-3 * max(np.abs(due).max(), 1.0))


def test_what_was_measured_tells_less_a_second_time(problem, tied, reduced):
    """The posterior knows it: its variance at the sensors is below that of the prior."""
    rival, data = Rival(problem, tied[0]), tied[0].data
    _, L = rival.posterior
    given = _responses(rival, data.s[data.use.any(axis=1)], data.outputs, data.inputs)
    given = replace(given, values=given.model(rival.state))
    A = rival.slopes(given, rival.state)
    prior = np.array([p.sd for e in tied[0].fit.effects for p in e.parameters])
    before = np.concatenate([prior, np.ones(A.shape[1] - len(prior))])
    assert ((A @ L) ** 2).sum() < 0.5 * ((A * before) ** 2).sum()
    assert ((A @ L) ** 2).sum(axis=1).max() < 2.0  # about what its own noise leaves


def test_terms_of_second_order_are_noise_as_in_a_fit(tied, problem):
    """Near a zero of H the first order says nothing: a fit counts the rest, and so do forecasts."""
    rival, data = Rival(problem, tied[0]), tied[0].data
    (new,) = _new([rival], data.s, data.outputs, data.inputs)
    values = data.model(rival.state)
    plain = replace(data, values=values, level=np.abs(values).max(axis=0), bent=None)
    bent = data.allowing_errors(rival.state).bent
    assert bent.max() > 2 * data.sigma_model
    assert_allclose(GAIN / LN10 / new.gain, np.hypot(plain.std(), bent), rtol=1e-6)


def test_a_sensor_sees_no_difference_between_twins(problem, tied):
    """Two rivals that are one predict the same, so that nothing tells them apart."""
    twins = outlook(problem, [tied[0], tied[0]], ("a", "b"), np.ones(2))
    for each in twins.seen[::10]:
        assert_allclose(twins.rivals.forecast(each).information, 0.0, atol=1e-6)


def test_the_best_measurements_settle_what_is_tied(found):
    """Two lumps far apart: what tells most is better than weighing, and enough to settle it."""
    every = [found.information([k]) for k in range(len(found.candidates))]
    weighing = next(k for k, c in enumerate(found.candidates) if c.kind == "weighing")
    best = advised([found], 2)
    assert best[0].bits * np.log(2) > 10 * max(every[weighing], 1e-6)
    assert best[-1].settles > 0.8


def test_a_mass_put_on_is_that_of_the_changed_structure(problem, tied):
    """Frequencies fall, as M grows; the prediction is that of the loaded model."""
    rival, places = Rival(problem, tied[0]), problem.reduced.candidates
    loaded = rival.with_mass(places, 3, 0.05)
    assert (loaded.lam[6:] <= rival.state.lam[6:] * (1 + 1e-9)).all()
    data = tied[0].data
    (new,) = _new([rival, rival], data.s[:4], data.outputs, data.inputs, [rival.state, loaded])[1:]
    mean, F = new.seen
    assert np.abs(mean).max() > 1.0
    assert F.shape[0] == len(mean)


@pytest.mark.parametrize(
    ("one_of", "due"),
    [
        ((), []),
        (("crack",), []),
        (("crack", "point-mass"), ["crack", "point-mass"]),
        ((ALONE, "point-mass"), ["point-mass", ALONE]),
        (("point-mass", BEYOND), ["point-mass", BEYOND]),
        ((ALONE, "crack", BEYOND), ["crack", f"{ALONE} or {BEYOND}"]),
    ],
)
def test_calibration_stands_for_what_the_catalogue_lacks(one_of, due):
    """Of explanations with a model there are two at least, or nothing is to be told apart."""

    def named(name):
        return SimpleNamespace(name=name, whole=name)

    order = [named("crack"), named("point-mass")]
    case, decision = SimpleNamespace(null=named("")), SimpleNamespace(one_of=one_of, order=order)
    found = SimpleNamespace(verdict="not in catalogue")
    fits, names, probability = open_explanations(case, decision, found)
    assert names == due
    assert fits == ["" if ALONE in n or BEYOND in n else n for n in due]
    assert_allclose(probability, 1 / len(due) if due else [])


@pytest.mark.parametrize(
    ("verdict", "one_of", "due"),
    [
        ("missing physics", (), ["crack"]),
        ("calibration only", (), [""]),
        ("measurement fault", (), []),
        ("missing physics", ("crack",), []),
    ],
)
def test_the_only_explanation_stands_alone(verdict, one_of, due):
    """The named effect, or calibration; a fault or half of a tie is no explanation."""
    crack, null = SimpleNamespace(name="crack"), SimpleNamespace(name="")
    named = verdict == "missing physics"
    found = SimpleNamespace(verdict=verdict, found=crack if named else None, null=null)
    case, decision = SimpleNamespace(null=null), SimpleNamespace(one_of=one_of, order=[])
    fits, names, probability = open_explanations(case, decision, found)
    assert names == due
    assert [f.name for f in fits] == due
    assert len(probability) == len(due)


def test_an_outlook_is_read_as_it_was_written(found, tmp_path):
    """The advice is that of the diagnosis; kinds and dofs that cannot be measured are left out."""
    write_npz(tmp_path / "outlook.npz", **arrays_of(found))
    again = read_outlook(tmp_path)
    assert again.names == found.names
    assert [m.what for m in advised([again])] == [m.what for m in advised([found])]
    assert_allclose(*([m.bits for m in advised([o])] for o in (again, found)), rtol=1e-4)
    first, *_ = advised([again])
    (other, *_) = advised([again], without=[first.kind])
    assert other.kind != first.kind
    assert [m.bits for m in advised([again])] == sorted(m.bits for m in advised([again]))


def test_the_command_prints_the_advice_and_writes_its_files(found, tmp_path):
    (tmp_path / "run").mkdir()
    write_npz(tmp_path / "run" / "outlook.npz", **arrays_of(found))
    out = tmp_path / "out"
    assert "here, there" in ran("next", tmp_path / "run", "--out", out).stdout
    best = json.loads((out / "next.json").read_text())["measurements"]
    assert [m["what"] for m in best] == [m.what for m in advised([found])]
    sensors = [m["label"] for m in best if m["kind"] == "sensor"]
    assert (out / "sensors.csv").read_text().split() == ["label", *sensors]


def test_of_one_explanation_the_least_known_quantity_is_narrowed(problem, tied, tmp_path):
    """The list narrows its interval step by step, and is read as it was written."""
    one = outlook(problem, tied[:1], ("here",), np.ones(1))
    own = [p.name for p in tied[0].effect.parameters]
    assert one.unknown.name.split()[0] in own
    best = advised([one])
    left = [m.narrows for m in best]
    assert left == sorted(left, reverse=True)
    assert 0 < left[-1] < left[0] < 1
    assert_allclose(best[-1].bits, -np.log2(left[-1]))
    write_npz(tmp_path / "outlook.npz", **arrays_of(one))
    assert_allclose([m.narrows for m in advised([read_outlook(tmp_path)])], left, rtol=1e-4)


def test_nothing_is_advised_where_no_interval_shrinks(problem, tied, tmp_path):
    """All but a millionth of the variance is what no measurement sees: 7e-7 bits are left."""
    one = outlook(problem, tied[:1], ("here",), np.ones(1), ("sensor",))
    a = one.unknown.along
    known = replace(one, unknown=replace(one.unknown, rest=1e6 * float(a @ a)))
    assert max(known.information([k]) for k in range(len(known.candidates))) > 0
    assert advised([known]) == ()
    write_npz(tmp_path / "outlook.npz", **arrays_of(known))
    said = ran("next", tmp_path).stdout
    assert f"none of the candidates narrows the interval of {one.unknown.name}" in said
    assert "nothing is tied" in ran("next", tmp_path, "--out", tmp_path / "out").stdout


@pytest.mark.parametrize(
    ("parameter", "text", "said"),
    [
        ("t", "t of UPRIGHT", "t of UPRIGHT"),
        ("M", "near grid 18", "M near grid 18"),
        ("reach", "weld-patch of panel", "reach weld-patch of panel"),
        ("k", "", "k suspension"),
    ],
)
def test_a_quantity_is_named_once(parameter, text, said):
    nowhere = SimpleNamespace(point_m=None, text="")
    effect = SimpleNamespace(text=text, name="suspension", location=lambda x: nowhere)
    assert quantity_of(effect, parameter, np.zeros(1)) == said


def test_a_quantity_is_named_where_its_effect_was_found():
    """A fit moves an effect from the place where it began."""
    found = SimpleNamespace(point_m=(0.0, 0.3, 0.0), text="near grid 18")
    effect = SimpleNamespace(text="at grid 58", name="point-mass", location=lambda x: found)
    assert quantity_of(effect, "M", np.zeros(3)) == "M near grid 18"
    assert quantity_of(effect, "across", np.zeros(3)) == "the place of point-mass near grid 18"


def test_a_mean_over_cases_is_advised(found):
    """Two equal cases are as one; candidates that only one of them has are left out."""
    less = replace(found, candidates=found.candidates[1:], seen=found.seen[1:])
    both = with_common_candidates([found, less])
    assert [o.candidates for o in both] == [less.candidates, less.candidates]
    assert advised(both) == advised([less])
    assert with_common_candidates([]) == ()  # a planned test that settles every article


def test_places_that_are_allowed_are_the_candidates(problem, tied, tmp_path):
    """Sensors, drives and masses are at them, at their cost; fixed sensors are always first."""
    every = problem.reduced.grids
    cheap, dear, fixed = every.grids[:8], every.grids[8:14], every.grids[-1]
    held = MeasuredDofs(
        (f"{fixed}:-Z",), np.array([fixed]), every.point[-1:], -every.normal[-1:], np.zeros(1),
        np.zeros(1),
    )  # fmt: skip
    grids, cost = np.concatenate([cheap, dear]), np.repeat([1.0, 50.0], [8, 6])
    allowed = FurtherPlaces(grids, cost, held)
    known = outlook(problem, tied, ("here", "there"), np.ones(2), allowed=allowed)
    placed = [c for c in known.candidates if c.label and not c.fixed]
    assert {int(c.label.partition(":")[0]) for c in placed} <= set(grids.tolist())
    sensors = [c for c in placed if c.kind == "sensor"]
    assert {c.cost for c in sensors} == {1.0, 50.0}
    write_npz(tmp_path / "outlook.npz", **arrays_of(known))
    for found in (known, read_outlook(tmp_path)):
        first, *more = advised([found], 3)
        assert first.label == f"{fixed}:-Z"
        bought = [c.cost for c in found.candidates for m in more if c.what == m.what]
        assert max(bought, default=0.0) < 50
    assert advised([known], without=[f"{fixed}:-Z"])[0].label != f"{fixed}:-Z"


def test_a_fixed_sensor_is_forecast_in_its_own_direction(problem, tied):
    """Against its normal it tells what the sensor along it does."""
    every = problem.reduced.grids
    at = MeasuredDofs(
        ("x",), every.grids[[5]], every.point[[5]], -every.normal[[5]], np.zeros(1), np.zeros(1)
    )
    known = outlook(problem, tied, ("here", "there"), np.ones(2), ("sensor",),
                    FurtherPlaces(every.grids[[5]], np.ones(1), at))  # fmt: skip
    assert [c.fixed for c in known.candidates] == [True, False]
    assert_allclose(known.information([0]), known.information([1]), rtol=0.05)


def test_a_calibration_has_no_next_measurement(tmp_path):
    with run_folder(tmp_path / "calib", "calibrate"):
        pass
    said = refused("next", tmp_path / "calib", "--out", tmp_path / "out")
    assert "calib is a calibration; next needs the folder of a diagnosis" in said


@pytest.mark.parametrize(
    ("made", "words", "why"),
    [
        (b"", (), "is no outlook"),
        (None, (), "there is no outlook.npz; a diagnosis of responses writes it"),
        (True, ("--without", "laser"), "laser: this is no candidate; kinds are band, drive, mass"),
    ],
)
def test_what_no_outlook_can_answer_is_one_sentence(found, tmp_path, made, words, why):
    if made is True:
        write_npz(tmp_path / "outlook.npz", **arrays_of(found))
    elif made is not None:
        (tmp_path / "outlook.npz").write_bytes(made)
    assert why in refused("next", tmp_path, *words, "--out", tmp_path / "out")
