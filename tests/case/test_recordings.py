"""Of several recordings one is compared; what is not used is named."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.case import load_case
from chladni.case.recordings import compared_first, deviation, notes_of, without_dead_channels
from chladni.case.request import Stated
from chladni.case.sensor_places import places
from chladni.dynamics.frf import FRF
from chladni.ema.setup import PoleTable, Recording, Shapes, TestSetup
from chladni.errors import ChladniError, LabelError
from chladni.io.nastran import assembly, read_deck
from chladni.units import UNITS

from .test_case import a_frf, deck


def stated(**words):
    return Stated(words, dict.fromkeys(("use", "recordings"), "here"))


def placed(made, labels, recorded, notes):
    with_frf = replace(recorded, frf=a_frf(labels))
    return places("here", TestSetup(), made, [with_frf], "output", notes)


def poles(*states):
    n = len(states)
    nothing = np.full(n, np.nan)
    return PoleTable(np.arange(1.0, n + 1), nothing, nothing, np.arange(n), states)


FIRST = Recording("a.csv, level 2", frf=a_frf(), level=2.0)
SECOND = Recording("b.npz", frf=a_frf(), article="B")
TABLE = Recording("p.csv", poles=poles("bare", "loaded", "bare"))


def test_the_first_with_responses_is_compared():
    assert compared_first(stated(), [TABLE, FIRST, SECOND])[0] is FIRST


@pytest.mark.parametrize("name", ["b.npz", "B"])
def test_the_one_that_is_named_is_compared(name):
    assert compared_first(stated(use=name), [FIRST, SECOND])[0] is SECOND


def test_a_state_is_named():
    first = compared_first(stated(use="loaded"), [FIRST, TABLE])[0]
    assert first.poles.states == ("loaded", "bare")
    assert first.poles.of("loaded").frequency.tolist() == [2.0]
    assert any("'loaded' are compared; not used: 'bare'" in n for n in notes_of([first]))


def test_a_name_nobody_has_is_refused_with_those_there_are():
    with pytest.raises(ChladniError, match=r"no recording is so named; there are .*b.npz, B"):
        compared_first(stated(use="c.npz"), [FIRST, SECOND])


def test_the_others_are_measured_against_it():
    """Twice the response is log10(2) decades away on every line."""
    a = a_frf()
    double = FRF(2 * a.values, a.frequency, a.outputs, a.inputs, "accelerance")
    assert deviation(a, double) == pytest.approx(np.log10(2))
    said = notes_of([FIRST, Recording("d.npz", frf=double)])
    assert any("d.npz (repeat; 0.3 decades rms apart)" in note for note in said)


def test_what_else_a_file_holds_is_named():
    extra = Recording(
        "t.uff",
        frf=a_frf(),
        shapes=Shapes(np.ones(1), np.ones(1), np.ones((1, 1)), ("1:+Z",)),
    )
    said = " ".join(notes_of([extra]))
    assert "1 mode shapes are not used" in said


def test_dead_channels_are_left_out_and_named():
    frf = a_frf()
    values = frf.values.copy()
    values[:, 1] = 0
    dead = Recording("a.npz", frf=FRF(values, frf.frequency, frf.outputs, frf.inputs, "mobility"))
    kept = without_dead_channels(dead)
    assert kept.frf.outputs == (frf.outputs[0], frf.outputs[2])
    assert frf.outputs[1] in kept.notes[0]


def test_nodes_and_axes_of_a_recording_are_used(tmp_path):
    """A turned node measures along its own axes; a node that is no grid sits where it is."""
    (tmp_path / "plate.bdf").write_text(deck())
    made = assembly(read_deck(tmp_path / "plate.bdf"), UNITS["mm-t-s"])
    turned = np.array([[0.0, 1, 0], [-1, 0, 0], [0, 0, 1]])
    recorded = Recording(
        "a.uff",
        nodes={12: made.points[made.rows([12])[0]], 900: np.array([0.22, 0.11, 0.0])},
        axes={12: turned},
    )
    notes: list[str] = []
    found = placed(made, ("12:+X", "900:+Z"), recorded, notes)
    np.testing.assert_allclose(found.directions, [[0, 1, 0], [0, 0, 1]], atol=1e-12)
    np.testing.assert_array_equal(found.grids, [12, 0])
    np.testing.assert_allclose(found.points[1], [0.22, 0.11, 0.0])
    assert any("nodes 900" in n for n in notes)
    assert any("nodes 12" in n for n in notes)


@pytest.mark.parametrize("factor", [1.0, 1e3])
def test_places_count_where_numbers_coincide_by_chance(tmp_path, factor):
    """In metres or in millimetres."""
    (tmp_path / "plate.bdf").write_text(deck())
    made = assembly(read_deck(tmp_path / "plate.bdf"), UNITS["mm-t-s"])
    notes: list[str] = []
    labels, there = ("1:+Z", "2:+Z", "3:+Z"), made.points[made.rows([12, 30, 34])]
    nodes = dict(zip((1, 2, 3), factor * there, strict=True))
    found = placed(made, labels, Recording("a.uff", nodes=nodes), notes)
    np.testing.assert_allclose(found.points, there, atol=1e-9)
    assert any("3 of 3 differ): the places were used" in n for n in notes)
    assert any("read in mm, which fits the deck" in n for n in notes) == (factor != 1)


@pytest.mark.parametrize("nodes", [{}, {k: np.zeros(3) for k in (1, 2, 3)}])
def test_labels_that_count_are_channels(tmp_path, nodes):
    """Unless coordinates say that they are grids; those that a lab leaves at zero say nothing."""
    (tmp_path / "plate.bdf").write_text(deck())
    made = assembly(read_deck(tmp_path / "plate.bdf"), UNITS["mm-t-s"])
    labels, recorded = ("1:+Z", "2:+Z", "3:+Z"), Recording("a.uff", nodes=nodes)
    with pytest.raises(LabelError, match="taken as channel numbers"):
        placed(made, labels, recorded, [])
    known = dict(zip((1, 2, 3), made.points[made.rows([1, 2, 3])], strict=True))
    recorded = replace(recorded, nodes=known)
    found = placed(made, labels, recorded, [])
    assert found.grids.tolist() == [1, 2, 3]
    some = ("1:+Z", "3:+Z", "4:+Z")
    found = placed(made, some, Recording("a.npz"), [])
    assert found.grids.tolist() == [1, 3, 4]


@pytest.mark.parametrize(
    ("inputs", "quantity", "said"),
    [
        (("1:+Z",), "transmissibility", "its input must be base"),
        (("base:+Z",), "accelerance", "the quantity of a moving base is"),
        (("base:+Z", "1:+Z"), "transmissibility", "cannot both be inputs"),
    ],
)
def test_base_and_quantity_belong_together(tmp_path, inputs, quantity, said):
    from chladni.io.tables.write_tables import write_npz

    (tmp_path / "plate.bdf").write_text(deck(held=True))
    H = a_frf(("12:+Z",), inputs)
    write_npz(tmp_path / "a.npz", FRF(H.values, H.frequency, H.outputs, inputs, quantity))
    (tmp_path / "case.toml").write_text(
        '[model]\ndeck = "plate.bdf"\nunits = "mm-t-s"\n[test]\nrecordings = ["a.npz"]\n'
    )
    with pytest.raises(ChladniError, match=said):
        load_case(tmp_path)
