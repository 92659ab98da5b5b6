"""A model in a script: laws of plates hold between a model and its variants, decks follow."""

import numpy as np
import pytest
from tests.builders.quick_runs import coarse_pictures

import chladni
from chladni.errors import ChladniError
from chladni.io.nastran import write_assembly
from chladni.io.package_files import mesh_path
from chladni.units import UNITS
from chladni_specimens.plates import plate


@pytest.fixture(scope="module")
def deck(tmp_path_factory):
    path = tmp_path_factory.mktemp("deck") / "plate.bdf"
    return write_assembly(plate(0.3, 0.22, 6, 6, 1e-3), path, "mm-t-s")


@pytest.fixture(scope="module")
def model(deck):
    return chladni.load(str(deck), "mm-t-s")


def elastic(model, count=3):
    return model.modes(6 + count).frequency[6:]


def test_units_are_a_name_or_a_system(deck, model):
    again = chladni.load(deck, UNITS["mm-t-s"])
    np.testing.assert_array_equal(again.assembly.points, model.assembly.points)
    assert np.ptp(model.assembly.points, axis=0).max() == pytest.approx(0.3)
    with pytest.raises(ChladniError, match="mm-t-s, mm-kg-ms"):
        chladni.load(deck, "mm")


def test_variants_follow_the_laws_of_thin_plates(model):
    """f ~ sqrt(E), 1/sqrt(ρ), and t where a plate is thin."""
    E, rho = (getattr(model.assembly.parts[0].section.membrane, n) for n in ("E", "rho"))
    f = elastic(model)
    np.testing.assert_allclose(elastic(model.variant(E=4 * E)), 2 * f, rtol=1e-6)
    np.testing.assert_allclose(elastic(model.variant(rho=4 * rho)), f / 2, rtol=1e-6)
    np.testing.assert_allclose(elastic(model.variant(t=0.5e-3)), f / 2, rtol=1e-2)
    np.testing.assert_array_equal(elastic(model), f)


def test_a_variant_of_one_part_leaves_the_others(tmp_path):
    path = mesh_path("demo/deck.bdf")
    model = chladni.load(path, "mm-t-s").variant(t={"flanges": 2e-3})
    again = chladni.load(model.write(tmp_path / "new.bdf"), "mm-t-s")
    thickness = {p.name: p.section.thickness for p in again.assembly.parts}
    assert thickness == pytest.approx({"panel": 1e-3, "flanges": 2e-3})
    old, new = (p.read_text().splitlines() for p in (path, tmp_path / "new.bdf"))
    assert sum(a != b for a, b in zip(old, new, strict=True)) == 1


def test_response_of_the_script_is_that_of_the_workflow(model):
    f = np.linspace(20, 200, 40)
    ours = model.frf("7:+Z", ("2:+Z",), f, quantity="receptance")
    theirs = chladni.frf(model, ["7:+Z"], ["2:+Z"], f).frfs[0]
    np.testing.assert_array_equal(ours.values, theirs.values)
    omega = 2 * np.pi * f[:, None, None]
    np.testing.assert_allclose(model.frf("7:+Z", "2:+Z", f).values, -(omega**2) * ours.values)


def test_a_shape_is_drawn(model, tmp_path):
    with coarse_pictures():
        drawn, other = model.show(7), model.show(8)
    assert drawn.save(tmp_path / "seven.png").read_bytes() == drawn.png
    assert drawn.png.startswith(b"\x89PNG")
    assert drawn.png != other.png


@pytest.mark.parametrize(
    ("ask", "told"),
    [
        (lambda m: m.variant(thickness=1e-3), "'thickness'; there are E, rho"),
        (lambda m: m.variant(t={"roof": 1e-3}), "'roof'; there are"),
        (lambda m: m.variant(t=0.0), "cannot become 0"),
        (lambda m: m.variant(E1=1e9), "no part of the model has E1"),
        (lambda m: m.show(0), "no mode 0"),
        (lambda m: m.frf("9999:+Z", "2:+Z", np.array([10.0])), "9999"),
    ],
)
def test_what_is_not_there_is_told(model, ask, told):
    with pytest.raises(ChladniError, match=told):
        ask(model)
