"""Tables: round trips to the last digit, in every form that programs write."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.io import savemat
from tests.builders.refusals import says

import chladni
from chladni.dynamics.frf import FRF
from chladni.ema.setup import PoleTable, Recording
from chladni.io.tables.csv_table import escaped, unescaped
from chladni.io.tables.read_tables import read_poles, read_recordings
from chladni.io.tables.sensor_table import read_sensors
from chladni.io.tables.write_tables import write_csv, write_npz, write_poles


@pytest.fixture
def H():
    rng = np.random.default_rng(1)
    f = np.geomspace(7.0, 300.0, 20)
    values = rng.normal(size=(20, 3, 2)) + 1j * rng.normal(size=(20, 3, 2))
    spread, gamma = rng.uniform(size=(2, 20, 3, 2))
    outputs, inputs = ("1:+Z", "4:-X", "7:n"), ("1:+Z", "base:+Z")
    return FRF(values, f, outputs, inputs, "mobility", spread, gamma)


FORMULAS = (
    "=cmd|' /C calc'!A0",
    "@SUM(1)",
    "+1+cmd",
    "-2+3",
    "\tx",
    "\r=1",
    " =1",
    "\uff1d1",
    "+Z",
)
CELLS = st.text(st.sampled_from("=+-@'\t\r\n ,\"\\x1b5c07aZ0\x1b\x9b\uff1d"), min_size=1)


@pytest.mark.parametrize("text", FORMULAS)
def test_no_cell_is_a_formula(text):
    """OWASP, CSV Injection: nothing begins with = + - @, a tab or a line end, behind blanks too."""
    assert str(escaped(text)).startswith("'")
    assert unescaped(str(escaped(text))) == text


@settings(max_examples=300)
@given(CELLS)
def test_an_escaped_cell_comes_back(text):
    cell = str(escaped(text))
    assert unescaped(cell) == text
    assert not re.search(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f]", cell)
    number = re.fullmatch(r"[-+][\d.]+(e[-+]?\d+)?", cell)
    assert number or not re.match(r"\s*[=+\-@\uff1d]|[\t\r\n]", cell)


@pytest.mark.parametrize("number", [-1.5, "-1.5", "+2e-3", "-.5", "1e5", 7, "-inf", "nan"])
def test_numbers_stay_numbers(number):
    assert escaped(number) == number


def test_labels_come_back_whatever_they_are(tmp_path, H):
    odd = ("=1+1", "-\x1b[31m", "\\x1b")
    write_csv(tmp_path / "a.csv", replace(H, outputs=odd))
    text = (tmp_path / "a.csv").read_text()
    assert "\x1b" not in text
    assert read_recordings(tmp_path / "a.csv", "mobility")[0].frf.outputs == odd


def test_every_table_is_written_by_one_function():
    """No other module makes rows of cells."""
    every = Path(chladni.__file__).parents[1].rglob("*.py")
    makers = [p.name for p in every if re.search(r"csv\.(Dict)?[wW]rit", p.read_text())]
    assert makers == ["csv_table.py"]


@pytest.mark.parametrize("ending", ["csv", "npz"])
def test_every_digit_comes_back(tmp_path, H, ending):
    path = tmp_path / f"a.{ending}"
    {"csv": write_csv, "npz": write_npz}[ending](path, H)
    (back,) = read_recordings(path, quantity="mobility")
    for name in ("values", "frequency", "variance", "coherence"):
        np.testing.assert_array_equal(getattr(back.frf, name), getattr(H, name))
    assert (back.frf.outputs, back.frf.inputs) == (H.outputs, H.inputs)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize(("outputs", "inputs"), [(3, 2), (3, 1), (1, 2), (1, 1)])
def test_a_mat_holds_frfs_by_the_names_of_npz(tmp_path, H, outputs, inputs):
    """MATLAB drops axes of length one at the end, and its texts are cells or rows of characters."""
    H = H.sel(H.outputs[:outputs], H.inputs[:inputs])
    held = {"frequency_hz": H.frequency[:, None], "values": H.values, "quantity": H.quantity,
            "coherence": H.coherence, "inputs": np.array(H.inputs, object),
            "outputs": np.array(H.outputs), "level": 2.5}  # fmt: skip
    savemat(tmp_path / "a.mat", held)
    (back,) = read_recordings(tmp_path / "a.mat")
    np.testing.assert_array_equal(back.frf.values, H.values)
    np.testing.assert_array_equal(back.frf.coherence, H.coherence)
    assert (back.frf.outputs, back.frf.inputs, back.level) == (H.outputs, H.inputs, 2.5)
    assert back.frf.quantity == "mobility"


@pytest.mark.parametrize(
    ("held", "said"),
    [
        ({"FRF": np.ones((3, 3, 9)), "frequencyBand": np.arange(9.0)},
         "unknown array FRF, frequencyBand.*of FRFs frequency_hz, values, outputs, inputs"),
        ({"frequency_hz": np.arange(9.0), "values": np.ones(9)}, "no array outputs, inputs"),
        ({"frequency_hz": np.arange(9.0), "values": np.ones((2, 9)), "outputs": ["1:+Z", "2:+Z"],
          "inputs": ["1:+Z"], "quantity": "mobility"}, r"values are \(2, 9\)"),
        ({"Signal": {"x_values": {"increment": 1.0}, "y_values": {"values": np.array([1j, 2.0])}}},
         "record 1 is complex, a function of frequency; export FRFs as a universal file"),
    ],
)  # fmt: skip
def test_a_mat_of_other_frfs_is_a_sentence(tmp_path, held, said):
    savemat(tmp_path / "a.mat", held)
    says(rf"a\.mat: .*{said}", read_recordings, tmp_path / "a.mat")


def test_order_of_rows_and_columns_is_free(tmp_path, H):
    write_csv(tmp_path / "a.csv", H)
    head, *rows = (tmp_path / "a.csv").read_text().splitlines()
    turned = [",".join(reversed(line.split(","))) for line in [head, *rows[::-1]]]
    (tmp_path / "b.csv").write_text("\ufeff" + "\n\n".join(turned), encoding="utf-8")
    back = read_recordings(tmp_path / "b.csv", "mobility")[0].frf
    again = back.sel(H.outputs, H.inputs)
    np.testing.assert_array_equal(again.values, H.values)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_tables_as_windows_programs_write_them(tmp_path, encoding, mark):
    """Code page, separator and decimal comma change nothing."""
    lines = ["frequency_hz,output,input,real,imag,article"]
    lines += [f"{f},1:+Z,2:+Z,{f},-1e-3,Tür µ" for f in (1.5, 2.25)]
    text = "\r\n".join(lines).replace(",", mark)
    text = text if mark == "," else text.replace(".", ",")
    (tmp_path / "a.csv").write_bytes(text.encode(encoding))
    (read,) = read_recordings(tmp_path / "a.csv", "accelerance")
    np.testing.assert_allclose(read.frf.values[:, 0, 0], np.array([1.5, 2.25]) - 1e-3j)
    assert read.article == "Tür µ"


@pytest.mark.parametrize("mark", [",", ";"])
def test_time_data_as_windows_programs_write_them(tmp_path, mark):
    rows = ["time_s,1:+Z [N],2:+Z [m/s²]", *(f"{k / 64},{k % 7}.5,{k % 5}.25" for k in range(64))]
    text = "\n".join(rows).replace(",", mark)
    text = text if mark == "," else text.replace(".", ",")
    (tmp_path / "a.csv").write_bytes(text.encode("cp1252"))
    (read,) = read_recordings(tmp_path / "a.csv")
    assert (read.time.rate, read.time.quantity) == (64.0, "accelerance")
    np.testing.assert_allclose(read.time.response[0, 0, :3], [0.25, 1.25, 2.25])


def test_levels_and_articles_are_recordings_of_their_own(tmp_path):
    """Each level may have its own frequencies, as a stepped sine has."""
    lines = ["frequency_hz,output,input,real,imag,level,article"]
    lines += [f"{f},1:+Z,2:+Z,{f},1,{a},{n}" for n in "AB" for a in (1, 2) for f in (a, a + 1.5)]
    (tmp_path / "a.csv").write_text("\n".join(lines))
    read = read_recordings(tmp_path / "a.csv", "accelerance")
    assert [(r.article, r.level) for r in read] == [("A", 1), ("A", 2), ("B", 1), ("B", 2)]
    np.testing.assert_array_equal(read[1].frf.frequency, [2.0, 3.5])
    assert read[3].name == "a.csv, article B, level 2"


def test_poles_come_back(tmp_path):
    nan = np.nan
    poles = PoleTable(
        np.array([10.1, 20.2, 9.9]), np.array([0.1, nan, nan]), np.array([nan, 0.01, nan]),
        np.array([1, 2, 1]), ("bare", "bare", "with mass"),
    )  # fmt: skip
    write_poles(tmp_path / "p.csv", poles)
    back = read_poles(tmp_path / "p.csv")
    for name in ("frequency", "frequency_sd", "damping", "mode"):
        np.testing.assert_array_equal(getattr(back, name), getattr(poles, name))
    assert back.states == ("bare", "with mass")
    np.testing.assert_array_equal(back.of("with mass").frequency, [9.9])
    assert read_recordings(tmp_path / "p.csv")[0].poles is not None


def test_sensors_of_every_kind(tmp_path):
    (tmp_path / "s.csv").write_text(
        "label,grid,x,y,z,direction,nx,ny,nz,role,mass,position_sd\n"
        "1:+Z,,0.1,0.2,0,,,,,input,,0.025\n"
        "2:-X,17,,,,,,,,,0.004,\n"
        "3:n,,,,,,,,,output,,\n"
        "4:+Z,,1,2,3,n,,,,,,\n"
        "5:+Z,,1,2,3,,0,3,4,,,\n"
        "base:+Z,,,,,,,,,input,,\n"
    )
    hit, left, normal, placed, tilted, base = read_sensors(tmp_path / "s.csv")
    assert (hit.role, hit.position_sd, hit.grid) == ("input", 0.025, None)
    np.testing.assert_array_equal(hit.place, [0.1, 0.2, 0.0])
    assert (left.grid, left.mass) == (17, 0.004)
    np.testing.assert_array_equal(left.direction, [-1, 0, 0])
    assert (normal.grid, normal.direction, placed.direction) == (3, None, None)
    np.testing.assert_allclose(tilted.direction, [0, 0.6, 0.8])
    assert (base.grid, base.place) == (None, None)


@pytest.mark.parametrize(("phase", "in_a_turn"), [("phase_deg", 360), ("phase_rad", 2 * np.pi)])
def test_magnitude_and_phase_are_real_and_imaginary_part(tmp_path, phase, in_a_turn):
    H = np.array([2.0 - 3j, -1e-3j, -4.0])
    turns = np.angle(H) / (2 * np.pi) + 1  # a phase may have been unwrapped
    rows = zip((1, 2, 3), np.abs(H).tolist(), (turns * in_a_turn).tolist(), strict=True)
    (tmp_path / "a.csv").write_text(
        f"{phase},frequency_hz,magnitude,output,input\n"
        + "".join(f"{angle},{f},{size},1:+Z,2:+Z\n" for f, size, angle in rows)
    )
    (read,) = read_recordings(tmp_path / "a.csv", "mobility")
    np.testing.assert_allclose(read.frf.values.ravel(), H, rtol=1e-12, atol=1e-12)


def test_the_quantity_must_be_known(tmp_path, H):
    write_csv(tmp_path / "a.csv", replace(H, variance=None))
    said = "does not say its quantity: one of receptance"
    says(said, read_recordings, tmp_path / "a.csv")
    said = r"end in .uff, .unv, .npz, .csv, .mat, .wav, .op2 or .pch, not '.txt'"
    says(said, read_recordings, tmp_path / "a.txt")


@pytest.mark.parametrize(
    ("word", "quantity"),
    [
        ("apparent-mass", "accelerance"),
        ("impedance", "mobility"),
        ("dynamic-stiffness", "receptance"),
    ],
)
def test_force_over_motion_is_turned_round(tmp_path, H, word, quantity):
    """H = 1/Z and, to first order, var H = var Z / |Z|⁴; of a file and of what is in memory."""
    write_csv(tmp_path / "a.csv", H)
    (read,) = read_recordings(tmp_path / "a.csv", word)
    frf = read.frf
    assert frf.quantity == quantity
    np.testing.assert_allclose(frf.values, 1 / H.values, rtol=1e-9)
    np.testing.assert_allclose(frf.variance, H.variance / np.abs(H.values) ** 4, rtol=1e-9)
    (held,) = [Recording("a", frf=H).reciprocal(word)]
    np.testing.assert_allclose(held.frf.values, 1 / H.values)
    zero = replace(H, values=np.where(np.arange(20)[:, None, None] == 3, 0, H.values))
    says("has no reciprocal", Recording("a", frf=zero).reciprocal, word)
