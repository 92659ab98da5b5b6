"""FRFs go to xarray and come back, and a slice of the one is a part of the other."""

import sys

import numpy as np
import pytest
from tests.builders.refusals import says

import chladni
from chladni import exchange
from chladni.dofs import parse
from chladni.dynamics.frf import FRF
from chladni.dynamics.statespace import StateSpace

rng = np.random.default_rng(3)
H = rng.normal(size=(5, 3, 2)) + 1j * rng.normal(size=(5, 3, 2))
RECORDED = FRF(
    H, np.linspace(10, 20, 5), ("1:+Z", "2:n", "7:-X"), ("1:+Z", "9:+Y"), "mobility",
    variance=np.abs(H) ** 2, coherence=rng.uniform(size=H.shape),
)  # fmt: skip


def test_there_and_back():
    data = chladni.to_xarray(RECORDED)
    again = chladni.from_xarray(data.transpose("input", "frequency", "output"))
    for name in ("values", "frequency", "variance", "coherence"):
        np.testing.assert_array_equal(getattr(again, name), getattr(RECORDED, name))
    assert (again.outputs, again.inputs) == (RECORDED.outputs, RECORDED.inputs)
    assert again.quantity == "mobility"
    assert data["H"].attrs["units"] == "m/s/N"


def test_a_slice_by_label_is_a_part():
    data = chladni.to_xarray(RECORDED).sel(output=["2:n"], frequency=slice(12, 18))
    part = RECORDED.sel(["2:n"], band=(12, 18))
    np.testing.assert_array_equal(chladni.from_xarray(data).values, part.values)


def test_what_is_missing_is_told():
    data = chladni.to_xarray(RECORDED)
    says("no H", chladni.from_xarray, data.rename(H="G"))
    says("quantity", chladni.from_xarray, data.assign_attrs(quantity=None))
    says("no quantity 'force'", chladni.from_xarray, data, "force")
    says("no damping", exchange.from_xarray, exchange.to_xarray(MODES).drop_vars("damping"))


MODES = chladni.ModalModel(
    np.array([12.0, 15.0]), np.array([0.01, 0.02]), rng.normal(size=(3, 2)),
    np.array([[1, 3], [2, 1], [7, 5]]),
)  # fmt: skip


def same_modes(one, other):
    for name in ("frequency", "damping", "shapes", "dofs"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_modes_there_and_back():
    data = exchange.to_xarray(MODES)
    same_modes(exchange.from_xarray(data.transpose("mode", "dof")), MODES)
    assert data["shapes"].sel(dof="7:+RY", mode=2) == MODES.shapes[2, 1]


COORDINATE = [("node", "uint64"), ("direction", "int8")]


def functions(frf, comment="mobility"):
    """Functions as SDynPy keeps them: a structured array, outputs by inputs."""
    shape = len(frf.outputs), len(frf.inputs)
    n = len(frf.frequency)
    kind = [("abscissa", float, n), ("ordinate", complex, n), ("coordinate", COORDINATE, 2),
            ("comment1", "<U80")]  # fmt: skip
    out = np.zeros(shape, kind)
    out["abscissa"], out["comment1"] = frf.frequency, comment
    for i, output in enumerate(frf.outputs):
        for j, input in enumerate(frf.inputs):
            ends = [parse(text) for text in (output, input)]
            out["coordinate"][i, j] = [(p, sign * c) for p, c, sign in ends]
            out["ordinate"][i, j] = frf.values[:, i, j]
    return out


def test_functions_of_sdynpy_in_any_order():
    frf = RECORDED.sel(["1:+Z", "7:-X"])
    found = exchange.from_sdynpy(functions(frf))
    assert (found.outputs, found.inputs, found.quantity) == (frf.outputs, frf.inputs, "mobility")
    np.testing.assert_array_equal(found.values, frf.values)
    listed = functions(frf).ravel()[[3, 0, 2, 1]]
    again = exchange.from_sdynpy(listed).sel(frf.outputs, frf.inputs)
    np.testing.assert_array_equal(again.values, frf.values)


def test_functions_that_are_no_matrix_are_refused():
    made = functions(RECORDED.sel(["1:+Z", "7:-X"])).ravel()
    for wrong, said in (
        (made[:3], "3 functions fill no matrix of 2 outputs and 2 inputs"),
        (functions(RECORDED.sel(["1:+Z"]), "a note"), "give quantity, one of receptance"),
        (made[["abscissa", "comment1"]], "no ordinate, coordinate"),
    ):
        says(said, exchange.from_sdynpy, wrong)
    made["abscissa"][1] += 1.0
    says("lines of their own", exchange.from_sdynpy, made)


def test_shapes_of_sdynpy_are_scaled_to_unit_modal_mass():
    """φ/√m, by rising frequency."""
    kind = [("frequency", float), ("damping", float), ("coordinate", COORDINATE, 3),
            ("shape_matrix", float, 3), ("modal_mass", float)]  # fmt: skip
    out = np.zeros(2, kind)
    for row, k in enumerate((1, 0)):
        at = [(int(p), -int(c)) for p, c in MODES.dofs]
        out[row] = (MODES.frequency[k], MODES.damping[k], at, -2 * MODES.shapes[:, k], 4.0)
    same_modes(exchange.from_sdynpy(out), MODES)


def test_tables_of_pyfbs_there_and_back():
    pytest.importorskip("pandas")
    up, place = np.array([0.0, 0.6, 0.8]), np.array([0.1, 0.2, 0.3])
    sensors = [chladni.Sensor("2:n", place=place, direction=up)]
    Y, f, channels, impacts = exchange.to_pyfbs(RECORDED, sensors)
    assert list(channels["Quantity"]) == ["Velocity"] * 3
    np.testing.assert_array_equal(channels.loc[2, ["Direction_1", "Direction_3"]], [-1.0, 0.0])
    frf, (back,) = exchange.from_pyfbs(Y, f, channels, impacts)
    np.testing.assert_array_equal(frf.values, RECORDED.values)
    assert (frf.outputs, frf.inputs, frf.quantity) == (
        RECORDED.outputs, RECORDED.inputs, "mobility",
    )  # fmt: skip
    assert back.label == "2:n"
    np.testing.assert_allclose(back.place, place)
    np.testing.assert_allclose(back.direction, up)
    fewer = channels.drop(columns="Position_2")
    says("outputs has no Position_2", exchange.from_pyfbs, Y, f, fewer, impacts)
    channels.loc[1, "Name"] = "1:+Z"
    says("two rows with the name '1:", exchange.from_pyfbs, Y, f, channels, impacts)


def test_a_package_that_is_missing_is_named(monkeypatch):
    for module in ("xarray", "sdynpy", "control", "pandas"):
        monkeypatch.setitem(sys.modules, module, None)
    system = StateSpace(np.eye(1), np.eye(1), np.eye(1), np.eye(1), ("1:+Z",), ("1:+Z",))
    for module, convert, given in (
        ("xarray", exchange.to_xarray, MODES), ("sdynpy", exchange.to_sdynpy, MODES),
        ("control", exchange.to_control, system), ("pandas", exchange.to_pyfbs, RECORDED),
    ):  # fmt: skip
        says(f"{module} cannot be imported .*; pip install", convert, given)
