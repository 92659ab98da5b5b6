"""Packages that add effects, installed for a test as pip would: a folder and its entry points."""

import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.effects import registry
from chladni.effects.effect import Effect
from chladni.effects.effect_context import EffectContext, Setup
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.model.assembly import Assembly
from chladni.reduced.reduced_model import Reduced, evaluate
from chladni.reduced.reduced_problem import ReducedProblem, reduced_problem
from chladni_contract.effect_ground import GROUNDS
from chladni_specimens import jointed_plates, plate, tied_plates


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
def installed_examples(folder: Path, modules: Iterable[str] = EXAMPLES) -> Iterator[None]:
    """Example packages, installed: one file and one entry point each."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        for module in modules:
            name = EXAMPLES[module]
            write_package(folder, f"example_{module}", {name: f"{module}:FAMILY"})
            (folder / f"{module}.py").write_text(source_of(module), encoding="utf-8")
        registry._installed.cache_clear()
        yield
    registry._installed.cache_clear()
    for module in modules:
        sys.modules.pop(module, None)


@pytest.fixture(scope="module", params=EXAMPLES)
def example_family(request, tmp_path_factory):
    """Each of the example packages."""
    with installed_examples(tmp_path_factory.mktemp("site"), (request.param,)):
        yield registry.family(EXAMPLES[request.param])


FLEXIBLE = slice(6, 12)  # of a free structure


def full(made: Assembly, count: int = 14) -> np.ndarray:
    """Natural frequencies of a structure as a whole [Hz]."""
    return normal_modes(structure(made).system, count).frequency


def hertz(ground: ReducedProblem | Reduced, effect: Effect, x: np.ndarray) -> np.ndarray:
    """Natural frequencies of a reduced model with an effect [Hz]; a problem makes its own model."""
    x = np.asarray(x, float)
    model = ground if isinstance(ground, Reduced) else ground.model_for(effect, x)
    lam = evaluate(model, [effect], x, False).lam
    return np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)


def context_of(ground: ReducedProblem, f_max: float, **test: Any) -> EffectContext:
    """The structure and a test, as effects see them."""
    mass = mass_properties(ground.structure.assembly)[0]
    setup = Setup(**{"sensors": (), "hangers": (), **test}, weight=mass, f_max=f_max)
    return EffectContext(ground.groups, ground.grids, ground.candidates, setup)


@pytest.fixture(scope="session")
def of_plate():
    """A free plate of 400 x 300 x 1.5 mm of 8 x 6 elements, made ready up to 300 Hz."""
    return reduced_problem(plate(0.4, 0.3, 8, 6, 1.5e-3), 300.0)


@pytest.fixture(scope="session")
def plate_context(of_plate):
    """That plate, without sensors and hangers."""
    return context_of(of_plate, 300.0)


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
