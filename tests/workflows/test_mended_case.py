"""Faults of a recording that are beyond doubt are undone, and the diagnosis goes on."""

from dataclasses import replace

import numpy as np
import pytest
from tests.workflows.test_chain_faults import SPOILT as OF_CHAIN
from tests.workflows.test_chain_faults import with_frf

import chladni
from chladni.ema.frf_maps import mapped
from chladni.report.diagnosis_json import diagnosis_json, from_json
from chladni.workflows.mended_case import undone
from chladni.workflows.screening_of_case import screened_unprepared, unmendable
from chladni.workflows.sign_of_gain import with_sign_of_gain


@pytest.fixture(scope="module")
def sound(sound):
    """A plate whose article carries a mass that the deck lacks; that alone is tried."""
    return replace(sound, effects=("point-mass",))


MENDABLE = {
    "reversed force", "conjugated FRFs", "wrong quantity", "swapped parts", "phase in radians"
}  # fmt: skip
SPOILT = {kind: change for change, kind, _ in OF_CHAIN.values() if kind in MENDABLE} | {
    "wrong units": lambda c: with_frf(c, values=c.frfs[0].values / 9.80665),
    "swapped channels": lambda c: with_frf(
        c, values=mapped(c.frfs[0], ("exchanged", "7:+Z", "43:+Z")).values
    ),
}


def few_lines(case, kind):
    """The case in a narrow band where a recording is nonsense: its poles take long to be none."""
    return replace(case, band=(20.0, 80.0)) if "phase" in kind else case


@pytest.mark.parametrize("kind", SPOILT)
def test_the_recording_is_what_it_was_before_the_fault(sound, kind):
    spoilt = few_lines(SPOILT[kind](sound), kind)
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
    lost = few_lines(with_frf(sound, values=np.abs(sound.frfs[0].values) + 0j), "no phase")
    screening = screened_unprepared(lost)
    assert "no phase" in {f.kind for f in screening.faults}
    assert undone(lost, screening, ()) is None


def test_a_diagnosis_goes_on_and_says_so(sound):
    """Name and size are those of the article; JSON, notes and deck say the fault."""
    found = chladni.diagnose(replace(SPOILT["swapped parts"](sound), band=(20.0, 170.0)))
    (effect,) = found.effects
    mass = next(p for p in effect.parameters if p.name == "M")
    assert (effect.name, mass.value) == ("point-mass", pytest.approx(0.02, rel=0.02))
    assert not found.distrust
    assert found.notes[0].startswith("Mended: ")
    assert "This was undone before the fit" in found.notes[0]
    (mended,) = (f for f in found.screening.findings if f.severity == "mended")
    assert mended.kind == "swapped parts"
    assert not found.screening.faults
    assert from_json(diagnosis_json(found)).screening == found.screening
    comments = [getattr(c, "comment", "") for c in found.models.final.changes]
    assert any(c.startswith("Recording mended: ") for c in comments)


def without_output(case, label):
    kept = [k for k, name in enumerate(case.outputs.labels) if name != label]
    labels = tuple(case.outputs.labels[k] for k in kept)
    arrays = {n: getattr(case.outputs, n)[kept]
              for n in ("grids", "points", "directions", "sd", "mass")}  # fmt: skip
    (recording,) = case.recordings
    fewer = replace(recording, frf=recording.frf.sel(outputs=list(labels)))
    return replace(
        case, outputs=replace(case.outputs, labels=labels, **arrays), recordings=(fewer,)
    )


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("drive_point", [True, False])
def test_an_unknown_gain_has_a_sign_of_its_own(sound, sign, drive_point):
    """A passive drive point decides it, elsewhere the model does; it is no fault."""
    case = replace(sound, gain_known=False)
    if not drive_point:
        case = without_output(case, "2:+Z")
    true = case.frfs[0].values
    case = with_frf(case, values=0.3 * sign * true)
    np.testing.assert_allclose(with_sign_of_gain(case).frfs[0].values, 0.3 * true)
    assert not screened_unprepared(case).faults
