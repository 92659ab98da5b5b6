"""What a command or a script may load: whoever wants numbers pays for numbers."""

import subprocess
import sys

import pytest

from chladni.cli.app import BUILT_IN
from chladni.io.nastran import write_assembly
from chladni_specimens.plates import plate

HEAVY = {
    "pyvista", "vtkmodules", "trimesh", "meshio", "gymnasium", "matplotlib", "pyuff", "jinja2",
    "distributed", "SALib", "xarray", "pandas", "plotly", "dask", "control", "sdynpy", "emcee",
    "scipy.stats", "scipy.signal", "scipy.optimize", "scipy.spatial",
}  # fmt: skip
OURS = {"planning", "bench", "studies", "specimens", "contract", "evidence", "envs"}
MOST = {  # modules of ours and of SciPy that a command loads for its --help, a tenth to spare
    "": (20, 0),
    "check": (430, 207),
    "calibrate": (410, 207),
    "convert": (170, 180),
    "correlate": (375, 207),
    "demo": (410, 207),
    "diagnose": (410, 207),
    "frf": (290, 207),
    "identify": (315, 207),
    "init": (430, 207),  # it asks what check asks, and check what diagnose asks
    "map": (265, 180),
    "modes": (145, 180),
    "render": (140, 180),
    "next": (270, 207),
    "report": (270, 207),
    "index": (270, 207),
    "compare": (270, 207),
    "test": (335, 207),
    "bench": (415, 207),
    "blind": (470, 207),
    "check-effect": (470, 207),
    "plan": (390, 207),
    "specimen": (165, 180),
    "study": (385, 207),
}


def loaded_by(code):
    code = f"import sys\ntry:\n {code}\nexcept SystemExit: pass\nprint('loaded', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split()[1:])


def command(*words):
    """Code that runs a command line in its own process."""
    line = f"sys.argv = {['chladni', *map(str, words)]}; from chladni.__main__ import main; main()"
    return loaded_by(line)


def roots(loaded):
    return {name.split(".")[0] for name in loaded}


def counts(loaded):
    """Modules of ours and of SciPy."""
    ours = sum(name.split(".")[0].split("_")[0] == "chladni" for name in loaded)
    return ours, sum(name.split(".")[0] == "scipy" for name in loaded)


def test_the_package_loads_no_library():
    """Names are loaded at their first use, with all that they need and nothing else."""
    assert not {m for m in roots(loaded_by("import chladni")) if m.startswith("scipy")}
    few = loaded_by("import chladni; chladni.modes; chladni.read_deck")
    assert not (few | roots(few)) & HEAVY
    assert "chladni.case.load" not in few
    built = {f"chladni_{name}" for name in OURS}
    assert not roots(few) & built
    assert roots(loaded_by("import chladni; chladni.study")) & built == {"chladni_studies"}


QUICK = ("", "modes", "diagnose", "blind")  # of every size; all others with `-m slow`


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * (n not in QUICK)) for n in MOST]
)
def test_a_command_loads_its_own_modules(name):
    """No graphics, no statistics, no other command; the bounds are counts, none is a time."""
    loaded = command(*([name] if name else []), "--help")
    assert not (loaded | roots(loaded)) & HEAVY
    assert all(n <= most for n, most in zip(counts(loaded), MOST[name], strict=True)), counts(
        loaded
    )
    others = {f"chladni.cli.{other}" for other in BUILT_IN} - {f"chladni.cli.{name}"}
    assert not loaded & others


def test_every_command_has_its_bound():
    from chladni.cli.app import commands

    assert set(MOST) == {"", *commands()}


def test_modes_need_no_renderer(tmp_path):
    """The page draws the shapes itself; the picture of a few hundred shells would be painted."""
    deck = write_assembly(plate(0.3, 0.2, 6, 4, 1e-3), tmp_path / "plate.bdf", "mm-t-s")
    words = ("modes", deck, "--units", "mm-t-s", "--out", tmp_path / "out")
    assert "pyvista" not in command(*words, "--pictures")
    assert (tmp_path / "out" / "modes.png").is_file()
    loaded = command(*words)
    assert not loaded & {
        "matplotlib",
        "pyvista",
        "scipy.stats",
        "scipy.signal",
        "scipy.optimize",
        "chladni.search",
    }
    assert counts(loaded)[0] <= MOST["modes"][0] + 60


def test_nothing_is_printed():
    done = subprocess.run([sys.executable, "-c", "import chladni"], capture_output=True, check=True)
    assert done.stdout == done.stderr == b""


def test_every_name_can_be_starred():
    loaded_by("from chladni import *; assert callable(modes) and exchange.write_uff")
