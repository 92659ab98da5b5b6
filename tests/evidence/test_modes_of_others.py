"""Decks and modes of objects of others: what no single effect explains bears no name.

The READMEs beside the recordings say what is known. Nothing of it is in the cases.
"""

import json
import shutil

import pytest
from tests.builders.commands import ran

WITH_SHAPES = {"pcb_clamped": "recording.unv", "u_beam_shell": "recording.uff"}


def answer(recordings, folder, name):
    """The answer to a copy of a case, which must end with exit 3; of ``NAME shapes`` with these."""
    name, _, shapes = name.partition(" ")
    case = folder / name
    shutil.copytree(recordings / name, case)
    if shapes:
        both = case / "deck.bdf", case / WITH_SHAPES[name]
        case = folder / "case"
        ran("init", *both, "--out", case)
    said = ran("diagnose", case, "--out", folder / "out", code=3).output
    return json.loads((folder / "out" / "diagnosis.json").read_text()), said.splitlines()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "before", "after", "among"),
    [
        # two masses and a stiffening layer are left out
        ("garteur_bare", 10.0, 7.6, ()),
        # orthotropic, in a frame that is not rigid
        ("pcb_clamped", 7.0, 7.1, ("orthotropic-material",)),
        ("pcb_clamped shapes", None, None, ()),
        # corners with 0.3 of the bending stiffness
        ("u_beam_shell", 7.2, 3.9, ("an effect outside the catalogue (softer folds)",)),
        ("u_beam_shell shapes", 7.2, 3.8, ("an effect outside the catalogue (softer folds)",)),
        ("u_beam", 8.7, 5.4, ()),
    ],
)
def test_physics_is_missing_and_no_effect_is_named(
    recordings, tmp_path, name, before, after, among
):
    d, said = answer(recordings, tmp_path, name)
    assert not d["effects"]
    assert any("physics is missing" in why for why in d["distrust"])
    assert set(among) <= {each for group in d["one_of"] for each in group}
    rms = d["frequency_rms_percent"]
    if before is not None:
        assert rms["before"] == pytest.approx(before, abs=0.1)
        assert rms["after"] == pytest.approx(after, abs=0.1)
    assert any(line.startswith("No ") and "effect" in line for line in said)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "after", "values"),
    [
        # least squares with these parameters: 2.5 % and 2.2 %
        ("pcb_ortho", 2.6, (24.9e9, 34.7e9, 4.9e9)),
        ("u_beam_corner", 2.2, (69.8e9, 23.3e9)),
    ],
)
def test_freed_parameters_reach_what_least_squares_reaches(
    recordings, tmp_path, name, after, values
):
    d, _ = answer(recordings, tmp_path, name)
    assert not d["effects"]
    assert d["frequency_rms_percent"]["after"] == pytest.approx(after, abs=0.1)
    written = [c["written_value"] for c in d["calibrated"]]
    for due in values:
        assert min(abs(value / due - 1) for value in written) < 0.02
