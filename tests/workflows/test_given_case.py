"""A case of arguments asks what the case of a file asks, and refuses in one sentence."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.case.schema import ARGUMENTS, SCHEMA
from chladni.errors import ChladniError
from chladni.search.preparation import prepare
from chladni.workflows.given_case import given_case
from chladni.workflows.question_of_case import question_of

FILE_ALONE = {"deck", "outside", "recordings"}


def arrays(value, at="") -> dict[str, np.ndarray]:
    """Every array and number that a question or a case holds, by its path."""
    if isinstance(value, np.ndarray | int | float | str | None.__class__):
        return {at: np.asarray(value)}
    if isinstance(value, tuple | list):
        return {k: v for i, x in enumerate(value) for k, v in arrays(x, f"{at}/{i}").items()}
    held = value if isinstance(value, dict) else getattr(value, "__dict__", {})
    return {k: v for n, x in held.items() for k, v in arrays(x, f"{at}/{n}").items()}


def same_question_of(one, other):
    a, b = arrays(question_of(one)), arrays(question_of(other))
    assert a.keys() == b.keys()
    for name in a:
        np.testing.assert_array_equal(a[name], b[name], err_msg=name)


def test_every_word_of_a_case_is_an_argument():
    """A word that a file may hold, a program may say."""
    once = {k.argument for k in SCHEMA if k.section not in ("recording", "plan", "parameter")}
    assert set(ARGUMENTS) == once - FILE_ALONE | {"parameters"}


def test_arguments_ask_what_the_file_asks(case, folder):
    asked = given_case(
        folder / "plate.bdf",
        folder / "frf.npz",
        {"units": "SI", "damping": 0.01, "mass": case.setup.mass, "band": (20.0, 170.0)},
    )
    same_question_of(case, asked)
    assert [n.replace(str(folder) + "/", "") for n in asked.notes] == list(case.notes)


def test_units_of_a_deck_are_guessed_as_init_guesses_them(case, folder):
    """The materials say them, for a path and for a deck that was read; a note says why."""
    for deck in (folder / "plate.bdf", case.deck):
        asked = given_case(deck, folder / "frf.npz", {"damping": 0.01})
        assert asked.units.name == "SI"
        assert asked.notes[0].startswith("units = SI: ")


def test_arrays_ask_what_the_file_asks(case, folder):
    """FRF and places in memory, a model that was loaded: the same numbers by another way in."""
    model, frf = chladni.load(folder / "plate.bdf", "SI"), case.frfs[0]
    names = [f"s{k}" for k in range(len(frf.outputs))]
    named = replace(frf, outputs=tuple(names), inputs=("shaker",))
    at = dict(zip(model.assembly.ids.tolist(), model.assembly.points, strict=True))
    up = np.array([0.0, 0.0, 1.0])
    sensors = [
        chladni.Sensor(name, int(label.partition(":")[0]), direction=up)
        for name, label in zip(names, frf.outputs, strict=True)
    ]
    sensors.append(chladni.Sensor("shaker", 2, direction=up, role="input"))
    words = {"damping": 0.01, "mass": case.setup.mass, "band": np.array([20.0, 170.0])}
    asked = given_case(model, named, {**words, "sensors": sensors})
    for ours, theirs in ((case.outputs, asked.outputs), (case.inputs, asked.inputs)):
        np.testing.assert_array_equal(ours.grids, theirs.grids)
        np.testing.assert_array_equal(ours.directions, theirs.directions)
    np.testing.assert_array_equal(asked.frfs[0].values, frf.values)
    assert asked.band == case.band
    placed = [chladni.Sensor("s0", place=at[2] + [1e-4, 0, 0], direction=up), *sensors[1:]]
    moved = given_case(model, named, {**words, "sensors": placed})
    assert moved.outputs.grids[0] == 0, "a place on a shell"


def test_a_variant_is_diagnosed_against_its_own_deck(case, folder):
    """A model with other numbers is fitted as it is; what is written is edits of its deck."""
    thick = chladni.load(folder / "plate.bdf", "SI").variant(t=1.1e-3)
    asked = given_case(thick, folder / "frf.npz")
    np.testing.assert_allclose(asked.assembly.shells.thickness, 1.1e-3)
    np.testing.assert_allclose(asked.as_deck.shells.thickness, 1.0e-3)
    plain = given_case(chladni.load(folder / "plate.bdf", "SI"), folder / "frf.npz")
    assert plain.assembly is plain.as_deck


def test_only_the_effects_asked_for_are_tried(case):
    tried = prepare(question_of(replace(case, effects=("crack", "point-mass")))).problem.families
    assert {f.name for f in tried} == {"crack", "point-mass"}
    assert len(prepare(question_of(case)).problem.families) > 20


def test_repeated_words_are_dicts(folder):
    asked = given_case(
        folder / "plate.bdf",
        [folder / "frf.npz", {"file": str(folder / "frf.npz"), "article": "B"}],
        {"units": "SI", "parameters": [{"field": "E", "sd": 0.03}], "exclude": [(30.0, 31.0)]},
    )
    assert asked.recordings[0].article == "B"
    assert [(p.field, p.sd) for p in asked.parameters] == [("E", 0.03)]
    assert asked.exclude == ((30.0, 31.0),)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"unit": "SI"}, "no argument 'unit'; did you mean 'units'"),
        ({"units": "mm"}, "argument units = 'mm'; .* SI, mm-t-s"),
        ({"units": "SI", "band": (50, 20)}, "argument band .* the first must be below the second"),
        (
            {"units": "SI", "effects": ["point-mas"]},
            "argument effects .* did you mean 'point-mass'",
        ),
        ({"units": "SI", "effects": []}, "argument effects is empty"),
        ({"units": "SI", "sensors": ["2:+Z"]}, "argument sensors .* chladni.Sensor"),
        ({"units": "SI", "sensors": "no.csv"}, "argument sensors: there is no file 'no.csv'"),
        ({"units": "SI", "held_out_sensors": ["9:+Z"]}, "argument held_out_sensors: no output"),
        ({"units": "SI", "quantity": "speed"}, "argument quantity = 'speed'; .* mobility"),
        ({"units": "SI", "parameters": [{"feld": "E"}]}, "argument parameters, number 1: feld"),
    ],
)
def test_a_wrong_argument_is_named(folder, words, said):
    with pytest.raises(ChladniError, match=said):
        chladni.diagnose(folder / "plate.bdf", folder / "frf.npz", **words)


def test_what_cannot_go_together_is_named(folder, case):
    with pytest.raises(ChladniError, match="says everything itself; leave out recording, mass"):
        chladni.calibrate(folder, folder / "frf.npz", mass=1.0)
    with pytest.raises(ChladniError, match=r"argument recording: there is no file '.*nothing.uff'"):
        chladni.diagnose(folder / "plate.bdf", folder / "nothing.uff", units="SI")
    with pytest.raises(ChladniError, match=r"did you mean 'frf.npz'. there are frf.npz$"):
        chladni.diagnose(folder / "plate.bdf", folder / "fr.npz", units="SI")
    with pytest.raises(
        ChladniError, match=r"recording of diagnose\(\) is \[1\.0\]; it takes a path"
    ):
        chladni.diagnose(folder / "plate.bdf", [1.0], units="SI")
    with pytest.raises(ChladniError, match="loaded in SI"):
        chladni.check(chladni.load(folder / "plate.bdf", "SI"), units="mm-t-s")
    with pytest.raises(ChladniError, match="no file or folder"):
        chladni.diagnose(Path("nowhere.bdf"), case.frfs[0])
    with pytest.raises(
        ChladniError, match=r"has no recording .* give it as the argument recording"
    ):
        chladni.diagnose(folder / "plate.bdf", units="SI")
