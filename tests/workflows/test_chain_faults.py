"""Errors of a whole recording: each named with the line that mends it, and nothing invented."""

import re
import shutil
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.builders.cases import NINE
from tests.builders.structures import stiffer

import chladni
from chladni.dynamics.frf import FRF
from chladni.ema.finding import Finding, Screening
from chladni.fem.modelled import modelled
from chladni.inference.chain_hypotheses import chain_faults, without_modes
from chladni.inference.smoothed_responses import Reading
from chladni.io.nastran import write_assembly
from chladni.model.point_masses import with_masses
from chladni.workflows.screening_of_case import RecordingAtFault, instead_of_effects, settled


@pytest.fixture(scope="module")
def model(sound):
    return modelled(sound.assembly, 800.0)


def with_frf(case, **change):
    first = case.recordings[0]
    return replace(case, recordings=(replace(first, frf=replace(first.frf, **change)),))


def elsewhere(case, grid):
    ins = case.inputs
    at = case.assembly.points[case.assembly.rows([grid])]
    return replace(case, inputs=replace(ins, grids=np.array([grid]), points=at))


def polar(case, phase):
    return np.abs(case.frfs[0].values) * np.exp(1j * phase)


def mirrored(case):
    """Sensors and force as if the deck ran the other way along X."""
    across = case.assembly.points[:, 0].max()
    flip, shift = np.array([-1, 1, 1]), np.array([across, 0, 0])
    images = [
        replace(at, grids=np.zeros(len(at.grids), int), points=shift + flip * at.points)
        for at in (case.outputs, case.inputs)
    ]
    return replace(case, outputs=images[0], inputs=images[1])


def two_forces(case):
    """Four of nine outputs from a run with the force elsewhere."""
    article = chladni.load(case.path.parent / "article.bdf", "SI")
    frf = case.frfs[0]
    other = chladni.frf(article, list(frf.outputs), ["46:+Z"], frf.frequency).frfs[0]
    values = frf.values.copy()
    values[:, 2:6] = other.to("accelerance").values[:, 2:6]
    return with_frf(case, values=values)


SPOILT = {  # how, and what is said: kind, line that mends it
    "labels": (
        lambda c: with_frf(c, values=np.roll(c.frfs[0].values, 1, axis=1)),
        "permuted labels", "2:+Z that of 47:+Z, 4:+Z that of 2:+Z",
    ),
    "radians": (
        lambda c: with_frf(c, frequency=2 * np.pi * c.frfs[0].frequency),
        "wrong unit of frequency", 'frequency_unit = "rad/s"',
    ),
    "conjugated": (
        lambda c: with_frf(c, values=c.frfs[0].values.conj()),
        "conjugated FRFs", "conjugated = true",
    ),
    "quantity": (
        lambda c: with_frf(c, quantity="mobility"), "wrong quantity", 'quantity = "accelerance"',
    ),
    "force": (lambda c: with_frf(c, values=-c.frfs[0].values), "reversed force", "reverse the"),
    "parts": (
        lambda c: with_frf(c, values=1j * c.frfs[0].values.conj()), "swapped parts", "exchange the",
    ),
    "phase": (
        lambda c: with_frf(c, values=polar(c, np.radians(np.angle(c.frfs[0].values)))),
        "phase in radians", "in degrees",
    ),
    "two forces": (lambda c: two_forces(c), "two forces mixed", "of their own"),
    "drive point": (lambda c: elsewhere(c, 46), "misplaced force", "input 2:+Z the grid 2,"),
}  # fmt: skip


def found_in(case, model):
    frf = case.frfs[0]
    lines = case.lines(frf.frequency)
    return chain_faults(Reading(frf, lines, model, case.outputs, case.inputs))


@pytest.mark.parametrize("spoilt", SPOILT)
def test_an_error_of_the_chain_is_named_with_its_line(sound, model, spoilt):
    change, kind, mend = SPOILT[spoilt]
    (finding,), check = found_in(change(sound), model)
    assert (finding.kind, finding.severity) == (kind, "fault")
    assert mend in finding.repair
    assert check.passed is False


def test_a_mirrored_deck_is_named_where_the_structure_tells_left_from_right(sound):
    """The article of the recording, its mass in one corner; the deck without it is symmetric.

    It is nearly so, and the responses are alike. What is missing may be a mass: a warning at first.
    """
    deck = chladni.load(sound.path.parent / "article.bdf", "SI").assembly
    article = modelled(deck, 800.0)
    (finding,), _ = found_in(mirrored(sound), article)
    assert (finding.kind, finding.severity, finding.mend) == ("mirrored deck", "warning", ())
    assert finding.repair.startswith("reverse X of all places")
    assert finding.left is not None
    assert found_in(sound, article)[0] == []


def test_of_an_interpretation_and_physics_that_which_leaves_less_counts(sound, model):
    """The mirrored places leave 0 of Q with the deck of the article, and the deck without its mass
    leaves some: a fault. Places as declared leave 0 as well, and the warning is dropped."""
    deck = chladni.load(sound.path.parent / "article.bdf", "SI").assembly
    article, without = modelled(deck, 800.0), SimpleNamespace(effects=())
    case = mirrored(sound)
    screening = Screening("test", tuple(found_in(case, article)[0]))
    with pytest.raises(RecordingAtFault, match="mirrored deck") as fault:
        settled(case, screening, 0.0, article, without)
    assert fault.value.screening.faults[0].text.count("leaves") == 1
    assert settled(sound, screening, 0.0, article, without).findings == ()


@pytest.mark.parametrize("level", [1.0, 9.81, 0.1])
def test_physics_that_is_missing_is_no_error_of_the_chain(sound, model, level):
    """Nor is a wrong level, of which other checks speak."""
    findings, check = found_in(with_frf(sound, values=level * sound.frfs[0].values), model)
    assert findings == []
    assert check.passed


@pytest.mark.parametrize("factor", [0.7, 1.4])
def test_a_model_of_another_stiffness_is_no_error_of_the_chain(sound, factor):
    other = modelled(stiffer(sound.assembly, factor), 800.0)
    assert found_in(sound, other)[0] == []


def test_a_delay_is_not_taken_for_another_error(sound, model):
    """It is a hypothesis like the others, of the size that the recording alone says."""
    frf = sound.frfs[0]
    turn = np.exp(-2j * np.pi * frf.frequency * 1.5e-3)[:, None, None]
    late = Finding("delay", "late", "fault", (), "delay = 0.0015", 1.5e-3)
    spoilt = replace(frf, values=frf.values * turn)
    lines = sound.lines(frf.frequency)
    findings, _ = chain_faults(Reading(spoilt, lines, model, sound.outputs, sound.inputs), [late])
    assert findings == [late]


def test_no_reading_is_proposed_that_leaves_more_than_half_of_q(sound, model):
    """Phases may speak for another quantity; it is named where the model confirms it."""
    values = np.random.default_rng(1).permutation(sound.frfs[0].values)
    frf = replace(sound.frfs[0], values=values)
    words = (frf, sound.lines(frf.frequency), model, sound.outputs, sound.inputs)
    guess = Finding("wrong quantity", "a quarter turn", "fault", (), 'quantity = "receptance"')
    (found,), check = chain_faults(Reading(*words), [guess])
    assert (found.kind, found.severity, found.mend) == ("nothing fits", "warning", ())
    assert check.passed is False


def spoil_files(place, to, spoilt):
    """The same errors as a user has them, in the files of a case."""
    shutil.copytree(place, to)
    toml, held = (to / "case.toml").read_text(), dict(np.load(to / "frf.npz", allow_pickle=False))
    if spoilt == "radians":
        held["frequency_hz"] = held["frequency_hz"] * 2 * np.pi
    elif spoilt == "conjugated":
        held["values"] = held["values"].conj()
    elif spoilt == "grams":
        rows = [f"{g}:+Z,{g},+Z,output,5" for g in NINE]
        (to / "sensors.csv").write_text("\n".join(["label,grid,direction,role,mass", *rows, ""]))
        toml = toml.replace("[band]", 'sensors = "sensors.csv"\n[band]')
    elif spoilt == "pounds":
        line = next(line for line in toml.splitlines() if line.startswith("mass"))
        toml = toml.replace(line, f"mass = {2.20462 * float(line.split('=')[1]):.5f}")
    np.savez(to / "frf.npz", **held)
    (to / "case.toml").write_text(toml)
    return to


MENDED = {  # what is said, and the change of case.toml that it asks for
    "radians": ('frequency_unit = "rad/s"', ("[band]", 'frequency_unit = "rad/s"\n[band]')),
    "conjugated": ("conjugated = true", ("[band]", "conjugated = true\n[band]")),
    "grams": ("write 0.005 for 5 g", None),
    "pounds": ("[test]: mass = 0.", None),
}


@pytest.mark.parametrize("spoilt", MENDED)
def test_check_says_it_and_the_line_mends_it(place, tmp_path, spoilt):
    said, change = MENDED[spoilt]
    case = spoil_files(place, tmp_path / "case", spoilt)
    faults = chladni.check(chladni.load_case(case)).faults
    assert any(said in f"{f.text}; {f.remedy}" for f in faults)
    if change is not None:
        toml = (case / "case.toml").read_text()
        (case / "case.toml").write_text(toml.replace(*change))
        assert not chladni.check(chladni.load_case(case)).faults


@pytest.mark.parametrize("spoilt", ["radians", "grams"])
def test_a_diagnosis_of_it_is_a_fault_of_the_measurement(place, tmp_path, spoilt):
    """An error that the model shows, and one that the case shows by itself."""
    case = spoil_files(place, tmp_path / "case", spoilt)
    result = chladni.diagnose(chladni.load_case(case))
    assert result.verdict == "measurement fault"
    assert any(MENDED[spoilt][0] in note for note in result.notes)


def test_one_wrong_direction_is_named_with_its_line(sound):
    """The response of the model along it is nothing, which no gain makes up for."""
    ways = sound.outputs.directions.copy()
    ways[sound.outputs.labels.index("24:+Z")] = 1, 0, 0
    turned = replace(sound, outputs=replace(sound.outputs, directions=ways))
    (found,) = chladni.check(turned).findings
    assert re.search(r"sensor 24:\+Z .*declared along X.* along \+Z it would", found.text)


def test_sensors_that_are_heavy_in_earnest_are_no_mistake(sound, tmp_path):
    """A sensor of a sixth of the plate, on the article as in the model."""
    grid, kg = 24, 0.03
    heavy = replace(sound, sensor_masses=((grid, kg),))
    write_assembly(with_masses(sound.assembly, (grid,), kg), tmp_path / "article.bdf")
    article = chladni.load(tmp_path / "article.bdf", "SI")
    frf = chladni.frf(article, list(sound.outputs.labels), ["2:+Z"], sound.frfs[0].frequency)
    heavy = with_frf(heavy, values=frf.frfs[0].to("accelerance").values)
    assert not [f for f in chladni.check(heavy).findings if "sensors weigh" in f.text]


def test_a_verdict_without_a_cause_says_what_looks_wrong():
    """A warning stops no diagnosis; where nothing explains the data it is the first suspect."""
    turned = Screening("a.uff", (Finding("turned sensor", "...", "warning", ("7:+Z",)),))
    (said,) = instead_of_effects("not in catalogue", turned)
    assert "turned sensor" in said
    assert "7:+Z" in said
    assert instead_of_effects("missing physics", turned) == ()
    assert instead_of_effects("not in catalogue", Screening("a.uff")) == ()


def test_a_response_without_a_mode_tells_nothing_of_its_unit():
    """A power of frequency explains it as well as any unit."""
    f = np.linspace(20, 200, 200)
    every, names = np.ones(200, bool), (("1:+Z",), ("1:+Z",), "accelerance")
    rigid = FRF(3e-4 * f[:, None, None] ** 2 + 0j, f, *names)
    assert without_modes(rigid, every) == pytest.approx(0.0, abs=1e-12)
    peak = FRF(1 / (100**2 - f**2 + 2j * f)[:, None, None], f, *names)
    assert without_modes(peak, every) > 0.1
