"""Packages that add effects, installed for a test as pip would: a folder and its entry points."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from chladni.effects import registry
from chladni.effects.family import Family
from chladni.model.added_points import next_id, with_points
from chladni.model.assembly import Assembly, RigidBody
from chladni.model.properties import Isotropic
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.forms.mesh_pieces import of_pieces, rectangle, stops
from chladni_specimens.joints.bolts import screw
from chladni_specimens.joints.builders import adhesive_bead, spot_welds
from chladni_specimens.plates import STEEL


def write_package(folder: Path, name: str, entries: dict[str, str]) -> None:
    """What pip leaves of a package that has these entry points."""
    info = folder / f"{name}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    lines = [f"{key} = {value}" for key, value in entries.items()]
    (info / "entry_points.txt").write_text("\n".join([f"[{registry.GROUP}]", *lines, ""]))


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """Installs a package of a name with entry points, and source where given, for one test."""

    def install(name, entries, **modules):
        write_package(tmp_path, name, entries)
        for module, text in modules.items():
            (tmp_path / f"{module}.py").write_text(text)
        monkeypatch.syspath_prepend(str(tmp_path))
        registry._installed.cache_clear()

    yield install
    registry._installed.cache_clear()


EXAMPLES = {  # file of an example package: its effect
    "edge_mass": "edge-mass",
    "corner_feet": "corner-feet",
    "wedged_sheet": "wedged-sheet",
    "slipping_bolts": "slipping-bolts",
    "stringer": "stringer",
}
PAGE = Path(__file__).parents[2] / "docs" / "extending.md"


def source_of(module: str) -> str:
    """The one file of an example; that of the stringer stands on the page on extensions."""
    if module != "stringer":
        return (Path(__file__).parent / "examples" / f"{module}.py").read_text(encoding="utf-8")
    page = PAGE.read_text(encoding="utf-8")
    return page[page.index("```python\n") + len("```python\n") :].partition("```\n")[0]


@contextmanager
def example(module: str, folder: Path) -> Iterator[Family]:
    """An example package, installed: its one file and one entry point."""
    name = EXAMPLES[module]
    write_package(folder, f"example-{name}", {name: f"{module}:FAMILY"})
    (folder / f"{module}.py").write_text(source_of(module), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        registry._installed.cache_clear()
        yield registry.family(name)
    registry._installed.cache_clear()
    sys.modules.pop(module, None)


@pytest.fixture(scope="module")
def example_edge_mass(tmp_path_factory):
    """A mass along an edge."""
    with example("edge_mass", tmp_path_factory.mktemp("site")) as family:
        yield family


@pytest.fixture(scope="module", params=EXAMPLES)
def example_family(request, tmp_path_factory):
    """Each of the example packages."""
    with example(request.param, tmp_path_factory.mktemp("site")) as family:
        yield family


JOINTED_TOP = 300.0  # Hz; six flexible modes of the two plates lie below
SEALANT = Isotropic(6e6, 0.4, 1000.0, id=2)
HIGH = 1.2e-3  # of the upper plate above the lower one [m]


@pytest.fixture(scope="session")
def jointed():
    """Builds two plates joined in every way, of elements of a size."""
    return jointed_plates


@pytest.fixture(scope="session")
def tied():
    """Builds the same two plates with a rigid element beside their joints."""
    return lambda h=0.05: rigidly_tied(jointed_plates(h), (0.27, 0.16, HIGH / 2))


@pytest.fixture(scope="session")
def deck():
    """The two plates, for files that have no deck of their own."""
    return jointed_plates()


@pytest.fixture(scope="session")
def reduced(deck):
    """That deck made ready up to ``JOINTED_TOP``."""
    return reduced_problem(deck, JOINTED_TOP)


def jointed_plates(h: float = 0.05) -> Assembly:
    """A plate over another: three welds, a screw and a sealed edge hold them; they almost touch.

    400 x 300 mm of 1.5 mm below, 360 x 260 mm of 1 mm above.
    """
    pieces = [
        rectangle("lower", (0, 0, 0), stops([0.0, 0.4], h), stops([0.0, 0.3], h)),
        rectangle("upper", (0.02, 0.02, HIGH), stops([0.0, 0.36], h), stops([0.0, 0.26], h)),
    ]
    made = of_pieces(pieces, {"lower": (1.5e-3, STEEL), "upper": (1e-3, STEEL)})
    places = np.array([(0.05, y, HIGH / 2) for y in (0.06, 0.15, 0.24)])
    made = spot_welds(made, places, ("lower", "upper"))[0]
    made = screw(made, np.array([0.2, 0.05, HIGH / 2]), ("lower", "upper"))[0]
    line = np.array([(0.12, 0.27, HIGH / 2), (0.37, 0.27, HIGH / 2), (0.37, 0.03, HIGH / 2)])
    return adhesive_bead(
        made, line, ("lower", "upper"), height=0.15e-3, pitch=0.97 * h, material=SEALANT
    )[0]


def rigidly_tied(made: Assembly, place: tuple[float, float, float]) -> Assembly:
    """Four grids of either plate next to a place follow a point there."""
    made, at = with_points(made, np.array([place]))
    rows: list[int] = []
    for part in (0, 1):
        own = np.unique(made.shells.nodes[made.shells.part == part])
        rows += own[np.argsort(np.linalg.norm(made.points[own] - place, axis=1))[:4]].tolist()
    body = RigidBody(next_id(made), int(at[0]), tuple(rows), ((1, 2, 3, 4, 5, 6),) * len(rows))
    return replace(made, rigid=(*made.rigid, body))
