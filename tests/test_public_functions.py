"""One vocabulary: whatever takes a deck takes every form of it, and misuse is one sentence."""

import inspect
from typing import get_args

import numpy as np
import pytest
from tests.builders.quick_runs import coarse_pictures

import chladni
from chladni.dynamics.frf import FRF
from chladni.ema.setup import Sensor
from chladni.errors import ArgumentError, ChladniError
from chladni.geometry.formed_mesh import FormedMesh
from chladni.io.dyna import write_keyword
from chladni.io.nastran import write_assembly
from chladni.model.assembly import Assembly
from chladni_specimens.plates import plate

F = np.linspace(20.0, 200.0, 40)
T = 1e-3


class Reached(Exception):
    """The work that a call would begin with its case."""


@pytest.fixture(scope="module", autouse=True)
def _coarse_pictures():
    with coarse_pictures():
        yield


@pytest.fixture(scope="module")
def made():
    return plate(0.3, 0.22, 5, 4, T)


@pytest.fixture(scope="module")
def folder(made, tmp_path_factory):
    """A deck in millimetres and tonnes, its modes, and its sheet after forming."""
    folder = tmp_path_factory.mktemp("public")
    write_assembly(made, folder / "plate.bdf", "mm-t-s")
    shells = made.shells
    number = np.array([made.parts[p].id for p in shells.part])
    names = {p.id: p.name for p in made.parts}
    t = np.full(shells.nodes.shape, 0.9 * T)
    write_keyword(
        folder / "formed.k", FormedMesh(made.ids, made.points, shells.nodes, number, t, names)
    )
    model = chladni.load(made)
    modal = model.normal_modes(12)
    motion = model.motion(modal.shapes)
    chladni.exchange.write_shapes(
        folder / "modes.uff", modal.frequency, motion, made.ids, made.points
    )
    return folder


@pytest.fixture(scope="module")
def forms(made, folder):
    """Every form of one deck, and the keywords that go with it."""
    deck, units = folder / "plate.bdf", {"units": "mm-t-s"}
    return {
        "path": (deck, units),
        "text": (str(deck), units),
        "deck": (chladni.read_deck(deck), units),
        "model": (chladni.load(deck, "mm-t-s"), {}),
        "model and its units": (chladni.load(deck, "mm-t-s"), units),
        "Assembly": (made, {}),
        "model of an Assembly": (chladni.load(made), {}),
    }


@pytest.fixture(scope="module")
def recording(made):
    return chladni.load(made).frf(["7:+Z", "2:+Z"], "2:+Z", F)


@pytest.fixture
def stopped(monkeypatch):
    """Long work ends where it would begin, and hands out the case it was given."""

    def reached(case, *_, **__):
        raise Reached(case)

    monkeypatch.setattr("chladni.workflows.diagnose.diagnose_states", reached)
    monkeypatch.setattr("chladni.workflows.calibrate.diagnose_states", reached)
    monkeypatch.setattr("chladni_bench.bench_workflow._tested", reached)
    monkeypatch.setattr("chladni_contract.effect_check.ground_of", reached)


def case_of(call):
    """Points and thickness of the structure of the case that the call would work on."""
    with pytest.raises(Reached) as stop:
        call()
    made = getattr(stop.value.args[0], "assembly", stop.value.args[0])
    return np.r_[made.points.ravel(), made.thickness()]


SENSORS = [Sensor("7:+Z", 7), Sensor("2:+Z", 2, role="input")]
CALLS = {  # every public function that takes a deck: a number that it returns of the plate
    "modes": lambda s, r, d, **u: chladni.modes(s, 9, **u).frequency[6:],
    "frf": lambda s, r, d, **u: np.abs(chladni.frf(s, "7:+Z", "2:+Z", F, **u).frfs[0].values),
    "plan": lambda s, r, d, **u: chladni.plan(s, sensors=5, modes=3, **u).visible,
    "study": lambda s, r, d, **u: chladni.study(s, "t=90%:110%", samples=2, modes=2, **u).column(
        "f1_hz"
    ),
    "other_modes": lambda s, r, d, **u: chladni.other_modes(s, d / "modes.uff", **u).f_model,
    "map_formed": lambda s, r, d, **u: chladni.map_formed(
        s, d / "formed.k", "mm-t-s", **u
    ).after.thickness(),
    "check": lambda s, r, d, **u: chladni.check(s, r, **u).frequency,
    "correlate": lambda s, r, d, **u: chladni.correlate(s, r, **u).f_model,
    "diagnose": lambda s, r, d, **u: case_of(lambda: chladni.diagnose(s, r, **u)),
    "calibrate": lambda s, r, d, **u: case_of(lambda: chladni.calibrate(s, r, **u)),
    "virtual_test": lambda s, r, d, **u: case_of(
        lambda: chladni.virtual_test(s, sensors=SENSORS, **u)
    ),
    "check_effect": lambda s, r, d, **u: case_of(
        lambda: chladni.check_effect("point-mass", s, **u)
    ),
    "load": lambda s, r, d, **u: chladni.load(s, **u).assembly.points,
}


def classes(annotation):
    """All classes an annotation names."""
    inner = get_args(annotation)
    return {annotation}.union(*map(classes, inner)) if inner else {annotation}


def test_the_table_holds_every_function_that_takes_a_deck():
    functions = {n: getattr(chladni, n) for n in chladni.__all__ if n not in ("FRF", "exchange")}
    takes = {
        name
        for name, f in functions.items()
        if inspect.isfunction(f) and name not in ("make_case", "write_deck")  # of cards and words
        for p in inspect.signature(f).parameters.values()
        if p.name in ("source", "deck", "model") and "recording" not in name
        and ("Source" in str(p.annotation).split(" | ") or Assembly in classes(p.annotation))
    }  # fmt: skip
    assert takes == set(CALLS)


@pytest.mark.parametrize("name", CALLS)
def test_every_form_of_a_deck_gives_the_same(name, forms, recording, folder, stopped):
    found = {form: CALLS[name](s, recording, folder, **u) for form, (s, u) in forms.items()}
    for form, value in found.items():
        np.testing.assert_allclose(value, found["path"], rtol=1e-5, atol=1e-9, err_msg=form)


MODEL = {  # misuse of a model, as a user types it
    "modes(0)": lambda p: p.modes(0),
    "modes(-1)": lambda p: p.modes(-1),
    "modes(None)": lambda p: p.modes(None),
    "modes(2.5)": lambda p: p.modes(2.5),
    "modes('3')": lambda p: p.modes("3"),
    "modes(n=3)": lambda p: p.modes(n=3),
    "modes of other units": lambda p: chladni.modes(p, units="SI"),
    "no output": lambda p: p.frf([], "2:+Z", F),
    "no input": lambda p: p.frf("7:+Z", [], F),
    "output None": lambda p: p.frf(None, "2:+Z", F),
    "label without component": lambda p: p.frf("7", "2:+Z", F),
    "label of no grid": lambda p: p.frf("999:+Z", "2:+Z", F),
    "label a number": lambda p: p.frf(7, 2, F),
    "no frequency": lambda p: p.frf("7:+Z", "2:+Z", []),
    "frequency None": lambda p: p.frf("7:+Z", "2:+Z", None),
    "frequency as text": lambda p: p.frf("7:+Z", "2:+Z", "10"),
    "negative frequency": lambda p: p.frf("7:+Z", "2:+Z", -F),
    "not-a-number": lambda p: p.frf("7:+Z", "2:+Z", [np.nan]),
    "falling frequency": lambda p: p.frf("7:+Z", "2:+Z", [100.0, 50.0]),
    "table of frequencies": lambda p: p.frf("7:+Z", "2:+Z", np.ones((2, 2))),
    "negative damping": lambda p: p.frf("7:+Z", "2:+Z", F, damping=-1),
    "damping None": lambda p: p.frf("7:+Z", "2:+Z", F, damping=None),
    "no quantity": lambda p: p.frf("7:+Z", "2:+Z", F, quantity="force"),
    "swapped band": lambda p: p.frf("7:+Z", "2:+Z", F).sel(band=(100, 50)),
    "state space of no mode": lambda p: p.state_space("7:+Z", "2:+Z", 0),
    "state space of no output": lambda p: p.state_space([], "2:+Z"),
    "show(0)": lambda p: p.show(0),
    "show(None)": lambda p: p.show(None),
    "write(None)": lambda p: p.write(None),
    "variant(t=None)": lambda p: p.variant(t=None),
    "variant(t='1')": lambda p: p.variant(t="1"),
    "variant(t=[])": lambda p: p.variant(t=[]),
    "variant(t={})": lambda p: p.variant(t={}),
    "variant of a part to None": lambda p: p.variant(t={"plate": None}),
    "plot(None)": lambda p: p.modes(8).plot(None),
    "save(None)": lambda p: p.modes(8).save(None),
}
NOTHING = {"None": None, "[]": [], "{}": {}, "3": 3}
FUNCTIONS = {
    **{
        f"{name}({said})": lambda p, call=call, it=it: call(it, (), p.source.parent)
        for name, call in CALLS.items()
        for said, it in NOTHING.items()
        if (name, said) != ("check_effect", "None")  # which takes a plate of its own
    },
    "load(folder)": lambda p: chladni.load(p.source.parent),
    "load('')": lambda p: chladni.load(""),
    "load, units 3": lambda p: chladni.load(p.source, 3),
    "load, allow None": lambda p: chladni.load(p.source, allow=None),
    "load, allow as text": lambda p: chladni.load(p.source, allow="CWELD"),
    "load, no subcase": lambda p: chladni.load(p.source, subcase=9),
    "read_deck(None)": lambda p: chladni.read_deck(None),
    "load_case(None)": lambda p: chladni.load_case(None),
    "load_recordings(None)": lambda p: chladni.load_recordings(None),
    "read_diagnosis(None)": lambda p: chladni.read_diagnosis(None),
    "plan, no sensor": lambda p: chladni.plan(p, sensors=0),
    "plan, negative draws": lambda p: chladni.plan(p, draws=-1),
    "plan, sensors None": lambda p: chladni.plan(p, sensors=None),
    "plan, no such setting": lambda p: chladni.plan(p, sensor=5),
    "plan, settings a dict": lambda p: chladni.plan(p, {"sensors": 5}),
    "study, nothing varied": lambda p: chladni.study(p, []),
    "study, vary None": lambda p: chladni.study(p, None),
    "study, vary numbers": lambda p: chladni.study(p, [1]),
    "study, no worker": lambda p: chladni.study(p, "t=90%:110%", workers=0),
    "study, no sample": lambda p: chladni.study(p, "t=90%:110%", samples=0),
    "study, samples None": lambda p: chladni.study(p, "t=90%:110%", samples=None),
    "study, swapped band": lambda p: chladni.study(p, "t=90%:110%", band=(200, 20)),
    "study, zero band": lambda p: chladni.study(p, "t=90%:110%", band=(0, 0)),
    "identify(None)": lambda p: chladni.identify(None),
    "identify([])": lambda p: chladni.identify([]),
    "identify a model": lambda p: chladni.identify(p),
    "identify texts": lambda p: chladni.identify(["x.uff"]),
    "evaluate a model": lambda p: chladni.evaluate_recordings(p),
    "evaluate, settings a dict": lambda p: chladni.evaluate_recordings([], {"lines": 3}),
    "estimate in no band": lambda p: chladni.EstimateSettings(band=(9, 3)),
    "poles as a number": lambda p: chladni.PoleChoice(drop=50.0),
    "mac(None)": lambda p: chladni.mac(None, None),
    "map_formed, no file": lambda p: chladni.map_formed(p, None),
    "to_xarray(None)": lambda p: chladni.to_xarray(None),
    "FRF of no frequency": lambda p: FRF(np.ones((1, 1, 1)), None, ("7:+Z",), ("2:+Z",)),
}
RECORDED = {
    "identify, swapped band": lambda p, r: chladni.identify(r, band=(200, 20)),
    "identify, zero band": lambda p, r: chladni.identify(r, band=(0, 0)),
    "identify, a number for a band": lambda p, r: chladni.identify(r, band=50),
    "identify, half a band": lambda p, r: chladni.identify(r, band=(None, 100)),
    "identify, another band": lambda p, r: chladni.identify(r, band=(1000, 2000)),
    "identify, no average": lambda p, r: chladni.identify(r, averages=0),
    "identify, choice None": lambda p, r: chladni.identify(r, choice=None),
    "correlate, None": lambda p, r: chladni.correlate(p, None),
    "correlate, [None]": lambda p, r: chladni.correlate(p, [None]),
    "correlate, swapped band": lambda p, r: chladni.correlate(p, r, band=(200, 20)),
    "correlate, half a band": lambda p, r: chladni.correlate(p, r, band=5),
    "correlate, no such word": lambda p, r: chladni.correlate(p, r, sensor=3),
    "correlate, sensors a number": lambda p, r: chladni.correlate(p, r, sensors=3),
    "correlate, parameters numbers": lambda p, r: chladni.correlate(p, r, parameters=[3]),
    "correlate, wrong label": lambda p, r: chladni.correlate(p, r, held_out_sensors=["9:+Q"]),
    "correlate, mass as text": lambda p, r: chladni.correlate(p, r, mass="2"),
}


def one_sentence(call):
    with pytest.raises(ChladniError) as error:
        call()
    text = str(error.value)
    assert 15 < len(text) < 600
    assert "\n" not in text


@pytest.mark.parametrize("what", MODEL | FUNCTIONS)
def test_misuse_is_one_sentence(what, forms):
    one_sentence(lambda: (MODEL | FUNCTIONS)[what](forms["model"][0]))


@pytest.mark.parametrize("what", RECORDED)
def test_misuse_with_a_recording_is_one_sentence(what, forms, recording):
    one_sentence(lambda: RECORDED[what](forms["model"][0], recording))


def test_the_sentence_names_argument_function_and_what_is_due(forms):
    with pytest.raises(ArgumentError, match=r"count of modes\(\) is None; it takes a whole number"):
        chladni.modes(forms["model"][0], None)
    with pytest.raises(ArgumentError, match="did you mean 'units'"):
        chladni.modes(forms["path"][0], unit="SI")
    with pytest.raises(ArgumentError, match=r"a model is no int; give the path .* or an Assembly"):
        chladni.modes(3)


@pytest.mark.parametrize(
    ("field", "value", "due"),
    [("t", 2.0, "0.001"), ("E", 2.1e5, "2.1e+11"), ("rho", 7.85e-9, "7850")],
)
def test_a_variant_in_other_units_is_refused(forms, field, value, due):
    """2 mm, 210 GPa and 7850 kg/m3 in mm-t-s: the values of a deck, given to a model in SI."""
    with pytest.raises(ChladniError, match=f"the deck's own {due.replace('+', '.')}.*SI"):
        forms["model"][0].variant(**{field: value})


def test_a_ratio_of_contraction_stays_below_a_half(forms):
    with pytest.raises(ChladniError, match=r"materials have less than 0\.5"):
        forms["model"][0].variant(nu=0.6)


def test_a_plan_says_which_units_it_took(forms, folder):
    """Without units the materials show them; lengths are then metres, as in a deck that says so."""
    deck = folder / "plate.bdf"
    known = chladni.plan(deck, sensors=5, modes=3, units="mm-t-s")
    guessed = chladni.plan(deck, sensors=5, modes=3)
    np.testing.assert_array_equal(guessed.mounts.points, known.mounts.points)
    assert known.notes == ()
    assert guessed.notes[0].startswith("units = mm-t-s: in mm-t-s the deck is 0.372 m across")
    with pytest.raises(ChladniError, match="load it with units = mm-t-s"):
        chladni.plan(chladni.load(folder / "plate.bdf"), sensors=5, modes=3)


def test_a_study_writes_its_table(forms, tmp_path):
    out = tmp_path / "study"
    found = chladni.study(forms["model"][0], "t=90%:110%", samples=3, modes=2, out=out)
    lines = (out / "samples.csv").read_text().splitlines()
    assert lines[0].split(",")[:4] == ["sample", "status", "why", "seconds"]
    assert len(lines) == 1 + len(found.rows)
    found.save(out)
    assert (out / "report.html").is_file()


def test_an_assembly_is_written_as_a_deck(made, tmp_path):
    again = chladni.load(chladni.load(made).write(tmp_path / "made.bdf"), "SI").assembly
    np.testing.assert_allclose(again.points, made.points, atol=1e-9)
