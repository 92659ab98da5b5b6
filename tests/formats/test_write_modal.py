"""Identified modes for other programs: read back, they are the identified model."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from tests.builders.refusals import says

from chladni.ema.identification import evaluate, identify
from chladni.ema.shapes import shapes
from chladni.io.tables.write_modal import write_shape_table, write_state_space
from chladni_evidence.identification_evidence import recording, structure


@pytest.fixture(scope="module")
def identified():
    return identify(recording(structure(6, 6, 4), "share", 6, lines=400)[0])


@pytest.mark.parametrize("kind", [".npz", ".mat"])
def test_the_state_space_responds_as_the_identified_model(identified, tmp_path: Path, kind) -> None:
    """D + C (iω - A)⁻¹ B by plain algebra on the arrays of the file."""
    path = write_state_space(tmp_path / f"s{kind}", identified)
    held = np.load(path) if kind == ".npz" else loadmat(path, squeeze_me=True)
    A, D = held["A"], held["D"].reshape(4, 1)
    B, C = held["B"].reshape(len(A), 1), held["C"]
    f = np.array([30.0, 75.0, 150.0])
    H = [C @ np.linalg.solve(2j * np.pi * x * np.eye(len(A)) - A, B) + D for x in f]
    due = evaluate(identified, 2j * np.pi * f)
    np.testing.assert_allclose(H, due, atol=2e-3 * np.abs(due).max())
    assert [str(x) for x in held["outputs"]] == list(identified.outputs)
    assert not list(tmp_path.glob(".part-*"))


def test_no_other_format(identified, tmp_path: Path) -> None:
    says(r"\.npz or \.mat", write_state_space, tmp_path / "s.txt", identified)


def test_shapes_as_a_table(identified, tmp_path: Path) -> None:
    path = write_shape_table(tmp_path / "shapes.csv", identified)
    rows = [line.split(",") for line in path.read_text().splitlines()]
    assert rows[0] == ["label", "mode", "frequency_hz", "real", "imag", "real_sd", "imag_sd"]
    psi = np.array([float(r[3]) + 1j * float(r[4]) for r in rows[1:]]).reshape(identified.order, 4)
    np.testing.assert_array_equal(psi.T, shapes(identified).values)
