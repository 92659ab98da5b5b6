"""Faults of a recording that are beyond doubt are undone, and the diagnosis goes on."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.cases import write_case
from tests.workflows.test_chain_faults import SENSORS, polar, with_frf

import chladni
from chladni.ema.frf_maps import mapped
from chladni.report.diagnosis_json import diagnosis_json, from_json
from chladni.workflows.mended_case import undone
from chladni.workflows.screening_of_case import screened_unprepared, unmendable
from chladni.workflows.sign_of_gain import with_sign_of_gain


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A plate whose article carries a mass that the deck lacks."""
    folder = tmp_path_factory.mktemp("mended")
    write_case(folder, 6, SENSORS, np.linspace(15, 250, 500), 240.0)
    toml = folder / "case.toml"
    toml.write_text(toml.read_text() + '[search]\neffects = ["point-mass"]\n')
    return chladni.load_case(folder)


SPOILT = {
    "reversed force": lambda c: with_frf(c, values=-c.frfs[0].values),
    "conjugated FRFs": lambda c: with_frf(c, values=c.frfs[0].values.conj()),
    "wrong quantity": lambda c: with_frf(c, quantity="mobility"),
    "swapped parts": lambda c: with_frf(c, values=1j * c.frfs[0].values.conj()),
    "phase in radians": lambda c: with_frf(
        c, values=polar(c, np.radians(np.angle(c.frfs[0].values)))
    ),
    "wrong units": lambda c: with_frf(c, values=c.frfs[0].values / 9.80665),
    "swapped channels": lambda c: with_frf(
        c, values=mapped(c.frfs[0], ("exchanged", "7:+Z", "43:+Z")).values
    ),
}


@pytest.mark.parametrize("kind", SPOILT)
def test_the_recording_is_what_it_was_before_the_fault(sound, kind):
    spoilt = SPOILT[kind](sound)
    screening = screened_unprepared(spoilt)
    assert unmendable(screening)
    assert [f.kind for f in screening.faults if f.mend] == [kind]
    mended = undone(spoilt, screening, ())
    assert mended is not None
    (frf,) = mended.frfs
    assert frf.quantity == "accelerance"
    np.testing.assert_allclose(frf.values, sound.frfs[0].values, rtol=1e-6)
    assert undone(spoilt, screening, screening.faults) is None  # a fault that comes back is none


def test_a_fault_that_no_map_undoes_stops_the_diagnosis(sound):
    """The phase of magnitudes is nowhere in the file."""
    lost = with_frf(sound, values=np.abs(sound.frfs[0].values) + 0j)
    screening = screened_unprepared(lost)
    assert "no phase" in {f.kind for f in screening.faults}
    assert undone(lost, screening, ()) is None


def test_a_diagnosis_goes_on_as_with_the_sound_recording_and_says_so(sound):
    """Name, size and deck are those of the sound recording; JSON, notes and deck say the fault."""
    good, found = (chladni.diagnose(c) for c in (sound, SPOILT["swapped parts"](sound)))
    assert [e.name for e in found.effects] == [e.name for e in good.effects] == ["point-mass"]
    sizes = [[p.value for p in r.effects[0].parameters] for r in (found, good)]
    np.testing.assert_allclose(*sizes, rtol=1e-3)
    assert found.distrust == good.distrust
    assert found.notes[0].startswith("Mended: ")
    assert "This was undone before the fit" in found.notes[0]
    (mended,) = (f for f in found.screening.findings if f.severity == "mended")
    assert mended.kind == "swapped parts"
    assert not found.screening.faults
    assert from_json(diagnosis_json(found)).screening == found.screening
    comments = [getattr(c, "comment", "") for c in found.models.final.changes]
    assert any(c.startswith("Recording mended: ") for c in comments)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("drive_point", [True, False])
def test_an_unknown_gain_has_a_sign_of_its_own(sound, sign, drive_point):
    """A passive drive point decides it, elsewhere the model does; it is no fault."""
    case = replace(sound, gain_known=False)
    if not drive_point:
        labels = [label for label in sound.frfs[0].outputs if label != "2:+Z"]
        frf = sound.frfs[0].sel(outputs=labels)
        at = [sound.outputs.labels.index(label) for label in labels]
        outputs = replace(
            sound.outputs,
            labels=tuple(labels),
            **{
                n: getattr(sound.outputs, n)[at]
                for n in ("grids", "points", "directions", "sd", "mass")
            },
        )
        case = replace(case, outputs=outputs, recordings=(replace(case.recordings[0], frf=frf),))
    true = case.frfs[0].values
    case = with_frf(case, values=0.3 * sign * true)
    np.testing.assert_allclose(with_sign_of_gain(case).frfs[0].values, 0.3 * true)
    assert not screened_unprepared(case).faults
