"""Triaxial sensors on a flat sheet: what they measure along it says nothing of the model."""

from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.errors import LabelError
from chladni.workflows.silent_channels import without_silent

ALONG = [2, 5]  # outputs that lie along the sheet


def along(case, level):
    """The case with two outputs along the sheet, of a level beside what others measure."""
    out, first = case.outputs, case.recordings[0]
    directions, values = out.directions.copy(), first.frf.values.copy()
    directions[ALONG] = [1.0, 0.0, 0.0]
    values[:, ALONG] *= level
    frf = replace(first.frf, values=values)
    return replace(
        case, outputs=replace(out, directions=directions), recordings=(replace(first, frf=frf),)
    )


def test_weak_channels_that_no_drive_moves_are_left_out_and_named(sound):
    case = without_silent(along(sound, 0.02))
    gone = [sound.outputs.labels[k] for k in ALONG]
    assert [o for o in sound.outputs.labels if o not in case.outputs.labels] == gone
    assert case.frfs[0].outputs == case.outputs.labels
    assert np.array_equal(case.frfs[0].values, np.delete(sound.frfs[0].values, ALONG, axis=1))
    assert all(label in case.notes[-1] for label in gone)
    assert "left out" in case.notes[-1]


def test_channels_as_strong_as_others_have_a_wrong_direction(sound):
    case = along(sound, 1.0)
    assert without_silent(case) is case
    with pytest.raises(LabelError, match=r"sensors .* along \+Z it would"):
        chladni.correlate(case)


def test_weak_channels_across_the_sheet_stay(sound):
    quiet = along(sound, 0.02)
    assert without_silent(replace(quiet, outputs=sound.outputs)).outputs is sound.outputs


def test_all_commands_compare_the_channels_that_are_left(sound):
    case = along(sound, 0.02)
    assert any("left out" in f.text for f in chladni.check(case).findings)
    found = chladni.correlate(case)
    assert len(found.sensors) == len(sound.outputs.labels) - len(ALONG)
    assert any("left out" in note for note in found.notes)
