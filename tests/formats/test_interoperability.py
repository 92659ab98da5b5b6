"""The page on other packages is true: its blocks run, and what goes out comes back as it was."""

import re
from importlib.util import find_spec
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.io.package_files import mesh_path
from chladni.view import probe

PAGE = Path(__file__).parents[2] / "docs/interoperability.md"
BLOCKS = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
OPTIONAL = ("xarray", "sdynpy", "pandas", "control")
OURS = {"numpy", "chladni", "pyuff", "pyvista", "gymnasium"}  # dependencies


def needs(block: str) -> list[str]:
    return [name for name in OPTIONAL if re.search(rf"import {name}\b|to_{name}\(", block)]


@pytest.fixture(scope="module")
def names(tmp_path_factory):
    """The names that the first block makes, in a folder of its own."""
    folder = tmp_path_factory.mktemp("page")
    up = np.array([0.0, 0.0, 1.0])
    held = {"deck": mesh_path("demo/deck.bdf")}
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        exec(BLOCKS[0], held)
        made = held["panel"].assembly
        at = dict(zip(made.ids.tolist(), made.points, strict=True))
        held["sensors"] = [
            chladni.Sensor(f"{k}:+Z", place=at[k], direction=up, role=role)
            for k, role in ((18, "output"), (20, "output"), (18, "input"))
        ]
        yield held


@pytest.mark.parametrize("block", BLOCKS[1:], ids=lambda b: b.strip().splitlines()[0][:40])
@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")
def test_a_block_of_the_page_runs(names, block):
    for package in needs(block):
        pytest.importorskip(package, reason=f"{package} is not installed", exc_type=ImportError)
    if "Plotter" in block and not probe.prepare():
        pytest.skip("VTK draws nothing on this machine")
    exec(block, names)


def test_every_block_of_another_package_is_known_as_such():
    """A block that imports something else would fail where that is not installed."""
    imported = {n for b in BLOCKS for n in re.findall(r"^(?:import|from) (\w+)", b, re.MULTILINE)}
    assert imported - OURS == {*OPTIONAL} - {"xarray"}


def test_scripts_are_short():
    assert max(len(block.splitlines()) for block in BLOCKS) <= 10


@pytest.mark.skipif(find_spec("control") is None, reason="control is not installed")
def test_state_space_of_control_answers_as_the_modes(names):
    """H(iω) of python-control is the modal sum."""
    import control

    panel, f = names["panel"], np.linspace(20, 60, 9)
    own = panel.state_space(["18:+Z", "20:-Z"], "18:+Z", modes=12, quantity="mobility")
    system = chladni.exchange.to_control(own)
    theirs = control.frequency_response(system, 2 * np.pi * f, squeeze=False)
    H = np.moveaxis(theirs.frdata, -1, 0)
    modal = panel.modes(12).modal.with_damping(0.01)
    phi = panel.directions(["18:+Z", "20:-Z"]) @ modal.shapes
    s, w = 2j * np.pi * f[:, None], 2 * np.pi * modal.frequency
    due = (s / (s**2 + 0.02 * w * s + w**2)) @ (phi * phi[0]).T
    np.testing.assert_allclose(H[:, :, 0], due, rtol=1e-6)
    back = chladni.exchange.from_control(system, "mobility")
    assert (back.outputs, back.inputs) == (own.outputs, own.inputs)
    np.testing.assert_array_equal(back.A, own.A)
