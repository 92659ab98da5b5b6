"""A modal model as a recording: shapes in correlate, check, init and diagnose."""

from pathlib import Path

import numpy as np
import pytest
from tests.builders.tube_frames import frame_deck, recorded_shapes

import chladni
from chladni.case import load_case
from chladni.dynamics.modes import rigid_modes
from chladni.ema.setup import Recording, Shapes
from chladni.errors import FileError
from chladni.fem.modelled import modelled
from chladni.io.tables.read_tables import read_recordings
from chladni.report.mesh_drawings import mesh_of, shape_pairs
from chladni.view.surface import surface
from chladni.workflows.case_draft import draft, sensors_text
from chladni.workflows.correlate import NEAR, on_whole_mesh
from chladni.workflows.states import each_state, states_compared

CASE = '[model]\ndeck = "frame.bdf"\nunits = "mm-t-s"\n[test]\nrecordings = [{}]\n'


def folder_of(folder: Path, *names: str) -> Path:
    """A case of the frame with these recordings."""
    frame_deck(folder / "frame.bdf")
    (folder / "case.toml").write_text(CASE.format(", ".join(f'"{n}"' for n in names)))
    return folder


@pytest.fixture(scope="module")
def frame(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = folder_of(tmp_path_factory.mktemp("frame"), "shapes.unv")
    recorded_shapes(folder / "frame.bdf", folder / "shapes.unv", 1)
    return folder


def as_table(path: Path, unv: Path, some: slice = slice(None), factor: complex = 1.0) -> Path:
    """The shapes of a universal file as CSV, at some channels."""
    shapes = read_recordings(unv)[0].shapes
    lines = ["label,mode,frequency_hz,damping,real,imag"]
    for label, row in zip(shapes.dofs[some], shapes.values[some] * factor, strict=True):
        lines += [f"{label},{k + 1},{f},{z},{v.real},{v.imag}" for k, (f, z, v) in enumerate(
            zip(shapes.frequency, shapes.damping, row, strict=True))]  # fmt: skip
    path.write_text("\n".join([*lines, ""]))
    return path


def test_correlate_compares_shapes(frame: Path) -> None:
    """Partners by shape, ΦᵀMΨ near one for them, and the test's motion on the whole frame."""
    found = chladni.correlate(frame)
    p = found.pairs
    assert len(p) == 10
    assert p.mac.min() > 0.98
    across = found.cross_orthogonality
    assert across is not None
    assert np.abs(across[p.model, p.test]).min() > 0.99
    np.testing.assert_allclose(np.linalg.norm(across, axis=0), 1)
    assert found.expanded is not None
    assert found.shapes is not None
    for k, j in enumerate(p.test):
        a, b = found.expanded[:, :, j].ravel(), found.shapes.motion[:, :, k].ravel()
        assert (a @ b) ** 2 / (a @ a) / (b @ b) > 0.98


def test_the_page_moves_the_test_on_the_whole_frame(frame: Path) -> None:
    """Beside its sensors alone, and the way its partner moves; MAC is that of both."""
    found = chladni.correlate(frame)
    case, p = found.origin, found.pairs
    assert found.mac is not None
    (drawing,) = shape_pairs(mesh_of(surface(case.assembly), case.assembly), found.shapes,
                             found.sensors, found.mac.T, found.expanded)  # fmt: skip
    data = drawing.content.data
    assert list(data["sides"]) == ["expanded", "test", "model"]
    assert data["mac"]["expanded|model"] == data["mac"]["test|model"]
    assert data["rows"][int(p.test[0])] == [p.test[0], p.test[0], p.model[0]]
    for i, j in zip(p.model, p.test, strict=True):
        test, model = (data["sides"][name][k] for name, k in (("expanded", j), ("model", i)))
        assert np.sum(np.array(test["motion"]) * np.array(model["motion"])) > 0
        assert np.sum(np.array(test["sensors"]) * np.array(model["sensors"])) > 0


def test_shapes_at_outputs_move_the_whole_mesh(frame: Path) -> None:
    """A mixture of the model's modes is recovered from its motion at the outputs, sign and all.

    Fewer outputs than modes cannot tell them apart.
    """
    case = load_case(frame)
    model = modelled(case.tested(case.assembly), 300.0)
    modes = model.modes.sel(np.flatnonzero(~rigid_modes(model.modes))[:4])
    due = model.structure.T @ (modes.shapes @ np.array([1.0, 0.5, -0.3, 0.2]))
    whole = due.reshape(len(case.assembly.points), 6)[:, :3]
    psi = (case.outputs.rows(model.structure) @ modes.shapes) @ np.array(
        [[1.0], [0.5], [-0.3], [0.2]]
    )
    outputs, f_max = case.outputs.labels, float(modes.frequency[-1]) / NEAR
    found = on_whole_mesh(case, outputs, psi, 1.001 * f_max)
    np.testing.assert_allclose(found[:, :, 0], whole / np.abs(whole).max(), atol=1e-6)
    assert on_whole_mesh(case, outputs[:2], psi[:2], f_max) is None


def test_formats_and_set_ups_agree(frame: Path, tmp_path: Path) -> None:
    """CSV, NPZ and MAT hold the same modes as the universal file; two set-ups become one test."""
    from scipy.io import savemat

    unv = frame / "shapes.unv"
    shapes = read_recordings(unv)[0].shapes
    arrays = {"frequency_hz": shapes.frequency, "shapes": shapes.values,
              "outputs": np.array(shapes.dofs)}  # fmt: skip
    np.savez(tmp_path / "a.npz", **arrays)
    savemat(tmp_path / "a.mat", {**arrays, "outputs": np.array(shapes.dofs, dtype=object)})
    as_table(tmp_path / "a.csv", unv)
    for name in ("a.npz", "a.mat", "a.csv"):
        (one,) = read_recordings(tmp_path / name)
        assert one.modal is not None
        assert one.modal.dofs == shapes.dofs
        np.testing.assert_allclose(one.modal.values, shapes.values)
        np.testing.assert_allclose(one.poles.frequency, shapes.frequency)
    case = folder_of(tmp_path, "one.csv", "other.csv")
    as_table(case / "one.csv", unv, slice(0, 30))
    as_table(case / "other.csv", unv, slice(24, None), factor=-3j)
    found = chladni.correlate(case)
    np.testing.assert_allclose(found.pairs.mac, chladni.correlate(frame).pairs.mac, atol=1e-6)
    assert any("merged as 2 set-ups" in note for note in found.notes)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("label,mode,frequency_hz,real\n1:+Z,1,10,1\n2:+Z,2,12,1\n", "has 0 lines of mode"),
        ("label,mode,frequency_hz,real\n1:+Z,1,10,0\n2:+Z,1,10,0\n", "a shape is zero"),
        ("label,mode,frequency_hz,real\n1:+Z,1,0,1\n2:+Z,1,0,1\n", "no natural frequencies"),
    ],
)
def test_refused_tables(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "a.csv").write_text(text)
    with pytest.raises(FileError, match=said):
        read_recordings(tmp_path / "a.csv")


def test_init_and_check_place_the_sensors(frame: Path) -> None:
    """Nodes of dataset 2411 are grids of the deck."""
    made = draft(frame / "frame.bdf", [frame / "shapes.unv"], "mm-t-s")
    assert {d.matched_by for d in made.dofs} == {"grid"}
    assert sensors_text(made).count("\n") == 1 + 57
    assert not chladni.check(frame).faults
    found = chladni.check(frame, mesh=True)
    assert found.converged.shape == found.frequency.shape
    assert 0 < np.abs(found.converged / found.frequency - 1).max() < 0.02


def test_gains_and_excluded_sensors(frame: Path, tmp_path: Path) -> None:
    """A gain divides the row of a shape; use = no leaves it out."""
    case = folder_of(tmp_path, "shapes.unv")
    (case / "shapes.unv").write_bytes((frame / "shapes.unv").read_bytes())
    (case / "sensors.csv").write_text("label,gain,use\n10:+Z,2,\n14:+X,,no\n")
    with (case / "case.toml").open("a") as file:
        file.write('sensors = "sensors.csv"\n')
    modal, plain = chladni.load_case(case).recordings[0].modal, read_recordings(
        frame / "shapes.unv")[0].shapes  # fmt: skip
    assert modal is not None
    assert "14:+X" not in modal.dofs
    row, old = modal.dofs.index("10:+Z"), plain.dofs.index("10:+Z")
    np.testing.assert_allclose(2 * modal.values[row], plain.values[old])


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_lump_that_frequencies_do_not_show_is_named(tmp_path: Path, seed: int) -> None:
    """60 g of 1.8 kg, not weighed: density takes it in frequencies alone, shapes name it."""
    case = folder_of(tmp_path, "shapes.unv")
    lump = recorded_shapes(case / "frame.bdf", case / "shapes.unv", seed)
    poles = read_recordings(case / "shapes.unv")[0].poles
    found = chladni.diagnose(case)
    assert found.verdict == "missing physics"
    (effect,) = found.effects
    assert effect.name == "point-mass"
    assert np.linalg.norm(np.subtract(effect.where.point_m, lump.place)) < 0.05
    assert effect.parameters[0].value == pytest.approx(lump.mass, rel=0.15)
    lines = [f"{k + 1},{f}" for k, f in enumerate(poles.frequency)]
    (case / "poles.csv").write_text("\n".join(["mode,frequency_hz", *lines, ""]))
    (case / "case.toml").write_text(CASE.format('"poles.csv"'))
    assert not chladni.diagnose(case).effects


@pytest.mark.slow
def test_nothing_is_named_without_a_lump(tmp_path: Path) -> None:
    case = folder_of(tmp_path, "shapes.unv")
    recorded_shapes(case / "frame.bdf", case / "shapes.unv", 11, mass=0.0)
    found = chladni.diagnose(case)
    assert not found.effects
    assert found.verdict in ("nothing missing", "calibration only")


def test_states_of_modal_models(frame: Path, tmp_path: Path) -> None:
    """Two files with states are two states of one object, at the dofs of the first."""
    case = folder_of(tmp_path, "one.csv", "other.csv")
    unv = frame / "shapes.unv"
    as_table(case / "one.csv", unv, slice(0, 30))
    as_table(case / "other.csv", unv)
    with (case / "case.toml").open("a") as file:
        file.write('[[recording]]\nfile = "other.csv"\nstate = "with a bracket"\n')
    read = chladni.load_case(case)
    assert states_compared(read) == ("", "with a bracket")
    one, other = each_state(read)
    assert one.recordings[0].modal is not None
    assert other.recordings[0].modal is not None
    assert other.recordings[0].modal.dofs == one.recordings[0].modal.dofs == read.outputs.labels
    assert not [note for note in read.notes if "not used" in note]


def test_of_many_nodes_an_even_sample_is_compared(frame: Path, tmp_path: Path) -> None:
    """A file of results moves every grid; of 400 nodes a quarter is enough, from end to end."""
    shapes = read_recordings(frame / "shapes.unv")[0].shapes
    r = len(shapes.frequency)
    values = np.random.default_rng(0).normal(size=(800, r))
    dofs = tuple(f"{k}:{c}" for k in range(1, 401) for c in ("+X", "+Z"))
    one = Shapes(shapes.frequency, shapes.damping, values, dofs)
    found = Recording("many", poles=one.poles(), shapes=one).modal
    assert found is not None
    assert len(found.dofs) == 200
    assert (found.dofs[0], found.dofs[-1]) == ("1:+X", "400:+Z")
