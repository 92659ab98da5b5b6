"""FRFs go to xarray and come back, and a slice of the one is a part of the other."""

import numpy as np
import pytest

import chladni
from chladni.dynamics.frf import FRF
from chladni.errors import ChladniError

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
    with pytest.raises(ChladniError, match="no H"):
        chladni.from_xarray(data.rename(H="G"))
    with pytest.raises(ChladniError, match="quantity"):
        chladni.from_xarray(data.assign_attrs(quantity=None))
    with pytest.raises(ChladniError, match="no quantity 'force'"):
        chladni.from_xarray(data, "force")
