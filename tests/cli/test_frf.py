"""``chladni frf`` and ``chladni modes`` on decks as they stand: subcases, requests, allowances."""

import json

import numpy as np
import pytest
from tests.builders.commands import ran, refused

import chladni
from chladni.io.nastran import write_assembly
from chladni.io.tables.read_tables import read_recordings
from chladni.io.uff.read_uff import read_uff
from chladni_specimens.plates import plate

TWO = """SOL 108
CEND
FREQ = 6
DLOAD = 5
SET 3 = 1, 9
DISP = 3
SUBCASE 1
SPC = 1
SUBCASE 2
SPC = 2
SUBCASE 7
SPC = 1
FREQ = 8
BEGIN BULK
GRID,1,,0.,0.,0.,,23456
GRID,2,,1.,0.,0.,,23456
CELAS2,1,4000.,1,1,2,1
CELAS2,2,1000.,2,1
CONM2,3,1,,0.1
CONM2,4,2,,0.5
SPC1,1,1,2
SPC1,2,6,2
RLOAD1,5,7,,,8
DAREA,7,1,1,3.0
TABLED1,8
,0.,1.,100.,1.,ENDT
FREQ1,6,5.,5.,3
FREQ,8,2.
ENDDATA
"""


def responses(folder, name="frf.npz"):
    with np.load(folder / name, allow_pickle=False) as held:
        names = held["outputs"].tolist(), held["inputs"].tolist()
        return held["frequency_hz"], *names, held["values"]


def two(folder, **changes):
    """The deck with some of its text replaced, and the folder of results."""
    text = TWO
    for old, new in changes.items():
        text = text.replace(old, new)
    (folder / "two.bdf").write_text(text)
    return folder / "two.bdf", folder / "out"


def stiffness(w, held):
    """Z of the two masses, the second of them held or not."""
    Z = np.array([[4000 - 0.1 * w**2, -4000], [-4000, 5000 - 0.5 * w**2]])
    return Z[:1, :1] if held else Z


def test_every_subcase_has_its_own_supports_and_frequencies(tmp_path):
    """u_1 = (Z⁻¹ p)_1 with the dofs that this subcase leaves free."""
    deck, out = two(tmp_path)
    ran("frf", deck, "--quantity", "receptance", "--out", out)
    f, outputs, inputs, H = responses(out)
    assert inputs == ["subcase 1", "subcase 2"]
    assert outputs == [f"1:+{c}" for c in ("X", "Y", "Z", "RX", "RY", "RZ")]
    for k, line in enumerate(f):
        for case, held in enumerate((True, False)):
            Z = stiffness(2 * np.pi * line, held)
            exact = np.linalg.solve(Z, [3.0, 0.0][: len(Z)])[0]
            np.testing.assert_allclose(H[k, 0, case], exact, rtol=1e-9)
    f, _, inputs, H = responses(out, "frf_2.npz")
    assert (f.tolist(), inputs) == ([2.0], ["subcase 7"])
    np.testing.assert_allclose(H[0, 0, 0], 3 / stiffness(4 * np.pi, True)[0, 0], rtol=1e-9)


@pytest.mark.parametrize(("subcase", "count"), [(1, 1), (2, 2)])
def test_modes_under_the_supports_of_a_subcase(tmp_path, subcase, count):
    deck, out = two(tmp_path)
    ran("modes", deck, "--subcase", subcase, "--out", out)
    f = json.loads((out / "modes.json").read_text())["frequency_hz"]
    assert len(f) == count
    for line in f:
        assert abs(np.linalg.det(stiffness(2 * np.pi * line, count == 1))) < 1e-3


def test_supports_are_those_of_the_subcase_that_seeks_modes(tmp_path):
    deck, out = two(tmp_path, **{"SUBCASE 2\n": "SUBCASE 2\nMETHOD = 4\n",
                                 "ENDDATA": "EIGRL,4,,,2\nENDDATA"})  # fmt: skip
    ran("modes", deck, "--out", out)
    assert len(json.loads((out / "modes.json").read_text())["frequency_hz"]) == 2


def test_a_card_is_left_out_on_request_only(tmp_path):
    deck, out = two(tmp_path, ENDDATA="CSEAM,77,1\nENDDATA")
    said = refused("modes", deck, "--out", out)
    assert "CSEAM" in said
    assert "--allow CSEAM" in said
    ran("modes", deck, "--allow", "CSEAM", "--out", out)


def test_what_modes_do_not_need_does_not_stop_them(tmp_path):
    """A load that cannot be understood, a reduction that is passed over and said to be."""
    more = "DLOAD,50,1.,1.,51\nTLOAD1,51,7,,,8\nASET1,1,1\nPELAST,9,3\nENDDATA"
    deck, out = two(tmp_path, ENDDATA=more)
    ran("modes", deck, "--out", out)
    page = (out / "report.html").read_text()
    assert "ASET1 (static reduction) is left out" in page
    assert "PELAST (stiffness that follows the frequency) is left out" in page
    assert "no RLOAD1 or RLOAD2 51" in refused("frf", deck, "--out", tmp_path / "frf")


@pytest.fixture
def deck(tmp_path):
    write_assembly(plate(0.3, 0.22, 5, 5, 1e-3), tmp_path / "plate.bdf")
    return tmp_path / "plate.bdf"


def test_every_format_holds_the_same_responses(deck, tmp_path):
    """NPZ, CSV and universal file are read as one FRF; the JSON says its levels and peaks."""
    ends = ("--input", "1:+Z", "--output", "9:+Z", "--output", "25:+Z")
    out = tmp_path / "out"
    ran("frf", deck, *ends, "--band", "5:90", "--lines", 80, "--units", "SI", "--out", out)
    first, table, universal = read = [
        read_recordings(out / f"frf.{ending}", quantity)[0].frf
        for ending, quantity in (("npz", None), ("csv", "accelerance"), ("uff", None))
    ]
    for other in (table, universal):
        np.testing.assert_allclose(other.values, first.values, rtol=1e-11)
        np.testing.assert_allclose(other.frequency, first.frequency, rtol=1e-7)
    assert len({(one.outputs, one.inputs, one.quantity) for one in read}) == 1
    assert set(read_uff(out / "frf.uff").nodes) == {1, 9, 25}
    told = json.loads((out / "frf.json").read_text())
    assert told["unit"] == "m/s²/N"
    size = np.abs(first.values[:, 1, 0])
    assert told["channels"][1]["peak"] == pytest.approx(size.max())
    assert told["channels"][1]["rms"] == pytest.approx(np.sqrt((size**2).mean()))


def test_no_unit_is_claimed_that_is_not_known(deck, tmp_path):
    """A universal file says its units, so that there is none of a bare deck."""
    out = tmp_path / "out"
    ran("frf", deck, "--input", "1:+Z", "--output", "9:+Z", "--out", out)
    assert not (out / "frf.uff").exists()
    assert json.loads((out / "frf.json").read_text())["unit"] is None
    assert "needs the unit system" in (out / "report.html").read_text(encoding="utf-8")
    ran("modes", deck, "--count", 8, "--out", tmp_path / "modes")
    assert not (tmp_path / "modes/modes.unv").exists()


def test_shapes_as_a_universal_file(deck, tmp_path):
    """Dataset 55 read back: frequencies and, to six digits, the shapes of the model."""
    ran("modes", deck, "--count", 9, "--units", "SI", "--out", tmp_path / "out")
    read = read_uff(tmp_path / "out/modes.unv")
    model = chladni.load(deck, "SI")
    modal = model.modes(9)
    motion = model.motion(modal.shapes)
    np.testing.assert_allclose(read.shapes.frequency[6:], modal.frequency[6:], rtol=1e-5)
    labels = {dof: k for k, dof in enumerate(read.shapes.dofs)}
    rows = [[labels[f"{i}:+{c}"] for c in "XYZ"] for i in model.assembly.ids]
    found = read.shapes.values[np.array(rows)]
    np.testing.assert_allclose(found, motion, atol=1e-5 * np.abs(motion).max())
    np.testing.assert_allclose([read.nodes[i] for i in model.assembly.ids], model.assembly.points)
