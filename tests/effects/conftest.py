"""Packages that add effects, installed for a test as pip would: a folder and its entry points."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path

import pytest

from chladni.effects import registry
from chladni.effects.family import Family
from chladni.reduced.reduced_problem import reduced_problem
from chladni_contract.effect_ground import GROUNDS
from chladni_specimens import jointed_plates, tied_plates


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


@pytest.fixture(scope="session")
def grounds():
    """The structures on which families are tried, by name, each prepared once."""
    return cache(lambda name: GROUNDS[name]())


@pytest.fixture(scope="session")
def jointed():
    """Builds two plates joined in every way, of elements of a size."""
    return jointed_plates


@pytest.fixture(scope="session")
def tied():
    """Builds the same two plates with a rigid element beside their joints."""
    return tied_plates


@pytest.fixture(scope="session")
def deck():
    """The two plates, for files that have no deck of their own."""
    return jointed_plates()


@pytest.fixture(scope="session")
def reduced(deck):
    """That deck made ready up to ``JOINTED_TOP``."""
    return reduced_problem(deck, JOINTED_TOP)
