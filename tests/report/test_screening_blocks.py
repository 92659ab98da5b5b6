"""What several recordings have in common is told once."""

import json

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.ema.finding import Check, Finding, Screening, notes_of_all, of_all
from chladni.ema.setup import Recording
from chladni.output import plain
from chladni.report.blocks import Items, Table
from chladni.report.screening_blocks import lead_of, screening_json, screening_section
from chladni.report.typed_fields import made
from chladni.workflows.identify import _notes

TURNED = Finding("reversed sign", "power comes out.", channels=("1:+Z",), repair="turn it")
BENT = Finding("not linear", "levels differ.", "warning")


def recording(name, *findings, coherence="0.9"):
    return Screening(
        name, findings, (Check("coherence", coherence), Check("overload", "no time", None))
    )


FOUR = (
    recording("a", TURNED, BENT), recording("b", TURNED), recording("c", TURNED),
    recording("d", TURNED, coherence="0.8"),
)  # fmt: skip


def test_a_finding_of_all_is_one_sentence():
    said = of_all(FOUR)
    assert (
        said == "at fault: reversed sign (1:+Z) in all 4 recordings; to be checked: not linear in a"
    )
    assert lead_of(FOUR) == f"4 recordings; {said}"
    first, second = notes_of_all(FOUR)
    assert first.endswith("Repair: turn it. (all 4 recordings)")
    assert second.endswith("levels differ. (a)")


def test_a_screening_is_read_as_it_was_written():
    """A check that was not possible among them."""
    again = made(Screening, json.loads(json.dumps(plain(screening_json(FOUR[0])))))
    assert again.checks == FOUR[0].checks
    assert again.notes == FOUR[0].notes


def test_one_recording_is_not_named_in_its_notes():
    assert notes_of_all(FOUR[1:2]) == list(FOUR[1].notes)


def test_where_nothing_is_found_that_is_said():
    assert lead_of([recording(n) for n in "abc"]) == "3 recordings; no fault found"


def test_tables_hold_what_is_alike_once():
    said, found, looked = screening_section(*FOUR).blocks
    assert isinstance(said, Items)
    assert isinstance(found, Table)
    assert isinstance(looked, Table)
    assert [(row[0], row[1]) for row in found.rows] == [
        ("all 4 recordings", "reversed sign"), ("a", "not linear"),
    ]  # fmt: skip
    assert list(looked.rows) == [
        ("coherence", "0.9, 0.8", "in order", "all 4 recordings"),
        ("overload", "no time", "not possible", "all 4 recordings"),
    ]


def test_two_recordings_keep_tables_of_their_own():
    tables = [b for b in screening_section(*FOUR[:2]).blocks if isinstance(b, Table)]
    assert [t.caption for t in tables] == ["a", "a", "b", "b"]


def test_a_level_of_nothing_is_said():
    """Sweeps that are numbered from 0: the first of them is left out of what moves with level."""
    H = np.ones((3, 1, 1), complex)
    frf = FRF(H, np.array([1.0, 2.0, 3.0]), ("1:+Z",), ("1:+Z",), "accelerance")
    held = [Recording(f"sweep {k}", frf, level=float(k)) for k in range(3)]
    (said,) = (note for note in _notes(held, (), 1) if "levels" in note)
    assert said.startswith("sweep 0: ")
    assert not any("levels" in note for note in _notes(held[:1], (), 1))
