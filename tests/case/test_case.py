"""A case is resolved once; whatever is wrong with it is said in one sentence."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.decks import flat_sheet

from chladni.case import load_case
from chladni.dynamics.frf import FRF
from chladni.errors import ChladniError
from chladni.io.tables.write_tables import write_csv, write_npz
from chladni.io.uff.read_uff import write_uff

CASE = """\
[model]
deck = "plate.bdf"
units = "mm-t-s"
damping = 0.01

[test]
recordings = ["a.npz"]
sensors = "sensors.csv"
mass = 1.413
mass_sd = 0.002
hangers = [1, 35]

[band]
fit = [10.0, 90.0]
exclude = [[23.0, 27.5]]

[held_out]
sensors = ["12:+Z"]
band = [70.0, 90.0]

[[parameter]]
name = "E of the sheet"
parts = ["sheet"]
field = "E"

[[parameter]]
field = "t"
"""
SENSORS = """\
label,grid,x,y,z,direction,role,mass,position_sd
1:+Z,8,,,,+Z,input,,
12:+Z,,0.25,0.1,0.002,,output,0.004,0.01
13:n,13,,,,,output,,
"""


def deck(held=False):
    """A flat steel plate of 24 quads in mm, t, s."""
    cards = [
        "SOL 103",
        "CEND",
        *["SPC = 1"] * held,
        "BEGIN BULK",
        "$ANSA_NAME_COMMENT;1;PSHELL;sheet;;NO;NO;NO;NO",
    ]
    cards += ["MAT1,1,210000.,,.3,7.85-9", "PSHELL,1,1,1.0,1,,1"]
    cards += flat_sheet(6, 4, 600.0, 300.0)
    return "\n".join([*cards, *["SPC1,1,123456,1,2"] * held, "ENDDATA"]) + "\n"


def a_frf(outputs=("12:+Z", "13:n", "14:-Z"), inputs=("1:+Z",)):
    rng = np.random.default_rng(0)
    f = np.arange(5.0, 100.5, 0.5)
    shape = (len(f), len(outputs), len(inputs))
    values = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    return FRF(values, f, outputs, inputs, "accelerance")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "plate.bdf").write_text(deck())
    (tmp_path / "case.toml").write_text(CASE)
    (tmp_path / "sensors.csv").write_text(SENSORS)
    write_npz(tmp_path / "a.npz", a_frf())
    return tmp_path


def test_everything_is_resolved(folder):
    case = load_case(folder)
    assert case.units.name == "mm-t-s"
    np.testing.assert_allclose(np.ptp(case.assembly.points, axis=0), [0.6, 0.3, 0.0])
    assert case.outputs.labels == ("12:+Z", "13:n", "14:-Z")
    np.testing.assert_array_equal(case.outputs.grids, [0, 13, 14])
    np.testing.assert_allclose(case.outputs.points[0], [0.25, 0.1, 0.002])
    np.testing.assert_allclose(np.abs(case.outputs.directions), [[0, 0, 1]] * 3, atol=1e-12)
    assert case.outputs.directions[2, 2] == -1
    np.testing.assert_array_equal(case.outputs.mass, [0.004, 0, 0])
    np.testing.assert_array_equal(case.outputs.sd, [0.01, 0, 0])
    np.testing.assert_array_equal(case.inputs.grids, [8])
    assert (case.band, case.exclude) == ((10.0, 90.0), ((23.0, 27.5),))
    assert (case.held_sensors, case.held_band) == (("12:+Z",), (70.0, 90.0))
    assert [(p.name, p.field, p.parts) for p in case.parameters][1] == ("t", "t", ())
    assert case.parameters[0].parts == (case.assembly.parts[0].name,)
    assert (case.setup.mass, case.setup.mass_sd, case.setup.hangers) == (1.413, 0.002, (1, 35))
    assert case.gain_known
    f = case.frfs[0].frequency
    np.testing.assert_array_equal(
        f[case.lines(f)], f[(f >= 10) & (f <= 90) & ((f < 23) | (f > 27.5))]
    )


def test_a_case_needs_little(folder):
    """The file itself may be named; sensors at grids, band, held-out and parameters may lack."""
    write_uff(folder / "b.uff", a_frf(("12:+Z", "13:-X")))
    text = '[model]\ndeck = "plate.bdf"\nunits = "SI"\n[test]\nrecordings = ["b.uff"]\n'
    (folder / "other.toml").write_text(text + 'gain = "unknown"\n')
    case = load_case(folder / "other.toml")
    np.testing.assert_array_equal(case.outputs.grids, [12, 13])
    np.testing.assert_array_equal(case.outputs.directions, [[0, 0, 1], [-1, 0, 0]])
    assert (case.band, case.held_sensors, case.parameters) == (None, None, ())
    assert not case.gain_known


def test_several_recordings_take_the_order_of_the_first(folder):
    H = a_frf()
    again = replace(H, values=1.01 * H.values)
    write_npz(folder / "b.npz", again.sel(H.outputs[::-1]))
    change(folder, '"a.npz"', '"a.npz", "b.npz"')
    first, second = load_case(folder).frfs
    assert first.outputs == second.outputs
    np.testing.assert_allclose(1.01 * first.values, second.values)


def test_the_base_moves_where_the_deck_holds_it(folder):
    H = a_frf(("12:+Z",), ("base:+Z",))
    change(folder, 'sensors = ["12:+Z"]', "")
    write_npz(folder / "a.npz", FRF(H.values, H.frequency, H.outputs, H.inputs, "transmissibility"))
    with pytest.raises(ChladniError, match=r"'base:\+Z': the base moves, but the deck has no"):
        load_case(folder)
    (folder / "plate.bdf").write_text(deck(held=True))
    case = load_case(folder)
    assert case.inputs.base.all()
    np.testing.assert_array_equal(case.inputs.directions, [[0, 0, 1]])


def test_directions_of_a_label_are_those_of_its_grid(folder):
    """A grid with a displacement frame turned by 90 degrees about Z: its X is the basic Y."""
    turned = deck().replace("GRID,20,,300.0,300.0,0.", "GRID,20,,300.0,300.0,0.,7")
    frame = "CORD2R,7,,0.,0.,0.,0.,0.,1.,+\n+,0.,1.,0.\nENDDATA"
    (folder / "plate.bdf").write_text(turned.replace("ENDDATA", frame))
    write_npz(folder / "a.npz", a_frf(("20:+X", "12:+Z", "19:+X")))
    case = load_case(folder)
    np.testing.assert_allclose(case.outputs.directions[[0, 2]], [[0, 1, 0], [1, 0, 0]], atol=1e-12)


def change(folder, old, new, name="case.toml"):
    text = (folder / name).read_text()
    assert old in text
    (folder / name).write_text(text.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"plate.bdf"', '"plat.bdf"', r"line 2: \[model\] deck: there is no file 'plat.bdf'; did"),
        ('"mm-t-s"', '"mm"', r"line 3: \[model\] units = 'mm'; .*there are SI, mm-t-s"),
        ("damping", "dampin", r"line 4: \[model\] dampin is unknown; did you mean 'damping'"),
        ("damping = 0.01", "damping = true", r"line 4: \[model\] damping = True is not a number"),
        ("damping = 0.01", "damping = 1.0", "line 4: .* between 0 and 0.5"),
        ("[band]", "[bend]", r"line 13: \[bend\] is unknown; did you mean \[band\]"),
        ('"a.npz"', "7", "line 7: .* contains 7; write a list of text"),
        ('["a.npz"]', '["b.npz"]', r"line 7: .*no file 'b.npz'; did you mean 'a.npz'\?"),
        ("mass = 1.413", 'mass = "1.4"', "line 9: .* is not a number"),
        ("mass = 1.413", "mass = -1", "line 9: .* must be at least"),
        ("[1, 35]", "[1, 36]", r"line 11: \[test\] hangers: the deck has no grid 36, the nearest"),
        ("[10.0, 90.0]", "[90.0, 10.0]", "line 14: .* first must be below the second"),
        ("[10.0, 90.0]", "[200.0, 300.0]", r"line 14: \[band\] fit .*a.npz, which covers 5 to 100"),
        ("[[23.0, 27.5]]", "[[23.0]]", r"line 15: .*write \[low, high\]"),
        ('["12:+Z"]', '["99:+Z"]', r"line 18: \[held_out\] sensors: no output '99:\+Z'; there"),
        ('["12:+Z"]', "3", "line 18: .* between 0 and 2"),
        ('["sheet"]', '["shet"]', r"line 23: \[parameter\] parts: did you mean 'sheet'\? no part"),
        ('field = "t"', 'field = "thickness"', "line 27: .* = 'thickness'; .*there are E, rho"),
        ('field = "t"', "", r"line 26: \[parameter\] needs a key field"),
        ('mass_sd = 0.002', 'quantity = "acceleration"', "did you mean 'accelerance'"),
        ('mass_sd = 0.002', 'gain = "free"', "there are known, unknown"),
        ("mass_sd = 0.002", "delay = 1e9", "line 10: .* delay = 1e.09; .* between -2 and 2"),
        ("mass_sd = 0.002", "mass_sd = 2", "line 10: .* mass_sd = 2; .* and 1.413"),
        ("mass_sd = 0.002", "direction_sd = 1e9", "line 10: .* between 0 and 90"),
        ("mass_sd = 0.002", "position_sd = 1", "line 10: .* between 0 and 0.6"),
        ("mass_sd = 0.002", "gain_sd = 7", "line 10: .* between 0 and 1"),
        ('field = "t"', 'field = "E"', r"line 27: .* frees the same numbers .* of line 21;"),
        ("fit = [", "fit = [[", "case.toml is not TOML: .*line 15"),
    ],
)  # fmt: skip
def test_faults_of_a_case(folder, old, new, said):
    change(folder, old, new)
    with pytest.raises(ChladniError, match=said) as error:
        load_case(folder)
    assert str(error.value).startswith("case.toml")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("outputs", "said"),
    [
        (("12:+Z", "99:+Z"), r"label '99:\+Z': the deck has no grid 99, the nearest ids"),
        (("12:+Z", "tip:+Z"), "'tip:.Z' names no grid; give its place in sensors.csv"),
        (("12:+Z", "14:up"), r"direction '14:up'; write \+X"),
    ],
)
def test_labels_without_a_place(folder, outputs, said):
    write_npz(folder / "a.npz", a_frf(outputs))
    with pytest.raises(ChladniError, match=said):
        load_case(folder)


def test_a_place_in_millimetres_is_noticed(folder):
    change(folder, "0.25,0.1,0.002", "250,100,2", "sensors.csv")
    with pytest.raises(ChladniError, match=r"^sensors.csv, line \d: .*269 m from .* metres"):
        load_case(folder)


def test_recordings_that_disagree_on_labels(folder):
    write_csv(folder / "b.csv", a_frf(("12:+Z", "15:+Z")))
    change(folder, '"a.npz"]', '"a.npz", "b.csv"]\nquantity = "accelerance"')
    with pytest.raises(ChladniError, match=r"a.npz and b.csv disagree on outputs: .*15:.Z"):
        load_case(folder)


def test_no_case_at_all(tmp_path):
    with pytest.raises(ChladniError, match=r"no case\.toml in the folder .*chladni init"):
        load_case(tmp_path)


def test_a_band_a_little_too_wide_is_cut_and_noted(folder):
    change(folder, "[10.0, 90.0]", "[1.0, 120.0]")
    case = load_case(folder)
    assert case.band == (5.0, 100.0)
    assert "cut to 5-100 Hz" in case.notes[0]
