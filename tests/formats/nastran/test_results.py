"""Results of other solvers: punch files written here column by column, OP2 and OP4 of pyYeti."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.io.nastran import read_op2_modes, read_op4, read_punch_modes, read_punch_responses
from chladni.io.package_files import mesh_path
from chladni.io.tables.read_tables import read_recordings

rng = np.random.default_rng(5)


def numbered(lines):
    return "".join(f"{line:<72}{k + 1:8d}\n" for k, line in enumerate(lines))


def record(head, values):
    """One punched record: 18 columns, then three values a line."""
    rows = [values[k : k + 3] for k in range(0, len(values), 3)]
    marks = [f"{head}       G"] + ["-CONT-"] * (len(rows) - 1)
    pairs = zip(marks, rows, strict=True)
    return [f"{m:<18}" + "".join(f"{v:18.6E}" for v in row) for m, row in pairs]


HEAD = ["$TITLE   = PLATE", "$SUBTITLE=", "$LABEL   ="]


def modes_file(folder, eigenvalues, shapes, ids):
    lines = []
    for k, value in enumerate(eigenvalues):
        lines += [*HEAD, "$EIGENVECTOR", "$REAL OUTPUT", "$SUBCASE ID =           1",
                  f"$EIGENVALUE = {value:14.7E}  MODE = {k + 1:5d}"]  # fmt: skip
        for j, id in enumerate(ids):
            lines += record(f"{id:10d}", shapes[j, :, k])
    path = folder / "modes.pch"
    path.write_text(numbered(lines))
    return path


def test_eigenvectors(tmp_path):
    shapes, hertz = rng.normal(size=(4, 6, 4)), np.array([0.0, 12.5, 12.5, 80.0])  # a pair
    path = modes_file(tmp_path, [-1e-7, *(2 * np.pi * hertz[1:]) ** 2], shapes, [7, 11, 20, 90001])
    found = read_punch_modes(path)
    np.testing.assert_allclose(found.frequency, hertz, rtol=1e-6)
    assert found.ids.tolist() == [7, 11, 20, 90001]
    np.testing.assert_allclose(found.shapes, shapes, rtol=1e-5)
    (one,) = read_recordings(path)
    assert one.modal is not None
    np.testing.assert_allclose(one.modal.frequency, hertz[1:], rtol=1e-6)
    assert one.modal.dofs[2:5] == ("7:+Z", "11:+X", "11:+Y")
    np.testing.assert_allclose(one.modal.values, shapes[:, :3, 1:].reshape(12, 3), rtol=1e-5)


@pytest.mark.parametrize("polar", [False, True])
@pytest.mark.parametrize("by_point", [False, True])
def test_frequency_responses(tmp_path, polar, by_point):
    """Sorted by frequency (SORT1) or by point (SORT2), rectangular or polar: the same numbers."""
    H = rng.normal(size=(3, 2, 6)) + 1j * rng.normal(size=(3, 2, 6))
    f, ids = np.array([10.0, 20.0, 35.5]), [5, 8]
    style = "$MAGNITUDE-PHASE OUTPUT" if polar else "$REAL-IMAGINARY OUTPUT"
    parts = (np.abs, lambda z: np.degrees(np.angle(z)) % 360) if polar else (np.real, np.imag)
    over = [f"$FREQUENCY = {x:15.7E}" for x in f], [f"{id:10d}" for id in ids], H
    if by_point:
        over = ([f"$POINT ID = {id:11d}  IDENTIFIED BY FREQUENCY" for id in ids],
                [f"{x:10.4E}" for x in f], H.swapaxes(0, 1))  # fmt: skip
    lines = []
    for subcase in (1, 2):
        for key, rows in zip(over[0], over[2], strict=True):
            lines += [*HEAD, "$ACCELERATION", style, f"$SUBCASE ID = {subcase:11d}", key]
            for head, z in zip(over[1], rows, strict=True):
                lines += record(head, np.concatenate([part(z) for part in parts]))
    path = tmp_path / "frf.pch"
    path.write_text(numbered(lines))
    responses = read_punch_responses(path)
    assert [(r.kind, r.subcase) for r in responses] == [("acceleration", 1), ("acceleration", 2)]
    for r in responses:
        np.testing.assert_allclose(r.frequency, f, rtol=1e-4)
        assert r.ids.tolist() == ids
        np.testing.assert_allclose(r.values, H, rtol=1e-4, atol=1e-5)


@pytest.mark.parametrize(
    ("keep", "said"),
    [
        ([*range(20)], r"subcase 1: point 11 is missing in mode 2.* \(3 of 4 records\)"),
        ([*range(21)], r"modes.pch:21: the record of grid 11 has 3 values, but 6 are required"),
        ([*range(8), *range(9, 22)], r"modes.pch:8: the record of grid 7 has 3 values"),
        ([*range(9), *range(7, 22)], r"subcase 1: point 7 occurs twice in mode 1"),
    ],
)
def test_a_cut_or_doubled_punch_file_is_refused(tmp_path, keep, said):
    """Every mode holds every point once, with six components (MSC Nastran Reference Guide)."""
    path = modes_file(tmp_path, [4.0, 9.0], rng.normal(size=(2, 6, 2)), [7, 11])
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(lines[k] for k in keep))
    says(said, read_punch_modes, path)


def test_a_number_cut_in_its_digits_is_refused(tmp_path):
    path = modes_file(tmp_path, [4.0], rng.normal(size=(1, 6, 1)), [7])
    text = path.read_text()
    path.write_text(text[:-8])  # without the number of the last line: nothing of it is lost
    assert read_punch_modes(path).shapes.shape == (1, 6, 1)
    path.write_text(text[:-15])
    says(r"modes.pch:\d+: the line ends in a field", read_punch_modes, path)


def test_what_is_not_there(tmp_path):
    path = modes_file(tmp_path, [4.0], rng.normal(size=(1, 6, 1)), [7])
    says("has no frequency responses", read_punch_responses, path)
    path.write_text(path.read_text().replace("G  ", "G O", 1))
    says(r"modes.pch:\d+: .* not a record", read_punch_modes, path)
    path.write_text("GRID    1\n")
    says("has no eigenvectors", read_punch_modes, path)
    says("cannot be read", read_punch_modes, tmp_path / "none.pch")


def yeti_file(name):
    spec = importlib.util.find_spec("pyyeti")
    if spec is None:
        pytest.skip("pyYeti is not installed")
    path = Path(spec.origin).parent / "tests" / name
    if not path.exists():
        pytest.skip("pyYeti came without its test data")
    return path


def test_op2_eigenvectors_are_normalised_to_the_mass(monkeypatch):
    """A free structure has six frequencies of zero, and all its shapes are punched for all dofs.

    Tables of grids differ between MSC and NX; shapes carry their grids themselves.
    """
    op2 = pytest.importorskip("pyyeti.nastran.op2")
    for name in ("_rdop2bgpdt68", "_rdop2eqexin", "_rdop2uset", "_rdop2geom1cord2"):
        monkeypatch.setattr(op2.OP2, name, lambda self: 1 / 0)
    found = read_op2_modes(yeti_file("nastran_op2_data/rdop2gpwg_1.op2"))
    assert found.shapes.shape == (len(found.ids), 6, len(found.frequency))
    assert np.all(found.frequency[:6] < 1e-3)
    assert found.frequency[6] > 1
    assert np.all(np.isfinite(found.shapes))


@pytest.mark.parametrize(
    "name", ["nas2cam_extseout/nas2cam_notall6_nx2021.op2", "nastran_op2_data/tugd_2020_64bit.op2"]
)
def test_op2_without_eigenvectors_names_other_ways(name):
    said = r"has no real eigenvectors .*give the modes as a punch file .* universal file"
    says(said, read_op2_modes, yeti_file(name))


def test_op4_matrices():
    matrices = read_op4(yeti_file("nas2cam/with_se_nas2cam.op4"))
    assert matrices
    assert all(m.ndim == 2 for m in matrices.values())


def test_files_pyyeti_cannot_read(tmp_path):
    pytest.importorskip("pyyeti")
    path = tmp_path / "x.op2"
    path.write_bytes(b"not an op2 file at all, whatever its name says" * 4)
    says(r"cannot be read by pyYeti as OP2: .*; give the modes as", read_op2_modes, path)
    says("does not exist", read_op4, tmp_path / "none.op4")


def test_without_pyyeti(monkeypatch):
    monkeypatch.setitem(sys.modules, "pyyeti.nastran", None)
    says("pip install 'chladni", read_op2_modes, "x.op2")


def test_reference_meshes():
    assert mesh_path("README.md").name == "README.md"
    says(r"no reference mesh 'none.bdf'; there are README.md", mesh_path, "none.bdf")
