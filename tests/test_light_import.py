"""What loading the package may load: a script that only wants numbers pays for numbers."""

import subprocess
import sys
from functools import cache

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


@cache
def loaded_by(code):
    """The packages that some code loads; it prints nothing."""
    code = f"import sys; {code}; print(*{{m.split('.')[0] for m in sys.modules}})"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    (line,) = done.stdout.splitlines()
    assert done.stderr == ""
    return set(line.split())


@pytest.mark.parametrize(
    "code", ["import chladni", "from chladni.cli.app import application; application()"]
)
def test_import_is_light_and_prints_nothing(code):
    """Neither the package nor its command line loads graphics, learning or file libraries."""
    assert not loaded_by(code) & HEAVY


def test_the_package_loads_none_that_builds_on_it():
    """The names that it holds of them are loaded at their first use."""
    built = {"chladni_planning", "chladni_bench", "chladni_studies", "chladni_specimens"}
    assert not loaded_by("import chladni") & (built | {"chladni_evidence", "chladni_envs"})
    assert loaded_by("import chladni; chladni.study") & built == {"chladni_studies"}
