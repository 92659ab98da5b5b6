"""What loading the package may load: a script that only wants numbers pays for numbers."""

import subprocess
import sys

import pytest

HEAVY = {
    "pyvista",
    "vtkmodules",
    "trimesh",
    "meshio",
    "gymnasium",
    "matplotlib",
    "pyuff",
    "jinja2",
    "distributed",
    "SALib",
    "xarray",
    "pandas",
    "plotly",
    "dask",
    "control",
    "sdynpy",
    "emcee",
}


def loaded_by(code):
    code = f"import sys; {code}; print(*{{m.split('.')[0] for m in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.split())


@pytest.mark.parametrize(
    "code", ["import chladni", "from chladni.cli.app import application; application()"]
)
def test_import_is_light(code):
    """Neither the package nor its command line loads graphics, learning or file libraries."""
    assert not loaded_by(code) & HEAVY


def test_the_package_loads_none_that_builds_on_it():
    """The names that it holds of them are loaded at their first use."""
    built = {"chladni_planning", "chladni_bench", "chladni_studies", "chladni_specimens"}
    assert not loaded_by("import chladni") & (built | {"chladni_evidence", "chladni_envs"})
    assert loaded_by("import chladni; chladni.study") & built == {"chladni_studies"}


def test_nothing_is_printed():
    done = subprocess.run([sys.executable, "-c", "import chladni"], capture_output=True, check=True)
    assert done.stdout == done.stderr == b""
