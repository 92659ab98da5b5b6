"""A module imports only from floors below its own; heavy libraries stay at the edges."""

import ast
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

SRC = Path(__file__).parents[1] / "src"
GROUND = {"errors", "arrays", "dofs", "units", "output", "progress"}
MAY_IMPORT = {  # floor: the floors it may use, its own aside
    **{name: GROUND for name in GROUND},
    "model": GROUND,
    "dynamics": GROUND,
    "meshing": GROUND | {"model"},
    "fem": GROUND | {"model", "dynamics"},
    "ema": GROUND | {"dynamics"},
    "bench": GROUND | {"dynamics", "ema"},
    "effects": GROUND | {"model", "dynamics", "fem", "ema"},
}
MAY_IMPORT["updating"] = MAY_IMPORT["effects"] | {"effects"}
MAY_IMPORT["case"] = GROUND | {"model", "dynamics", "meshing", "fem", "ema"}
BELOW = MAY_IMPORT["updating"] | {"updating", "meshing", "bench", "case"}
MAY_IMPORT |= {"view": BELOW, "study": BELOW, "report": BELOW}
MAY_IMPORT["planning"] = BELOW | {"view", "report"}
MAY_IMPORT["cli"] = BELOW | {"view", "study", "report", "planning"}
MAY_IMPORT["__main__"] = {"cli"}
LIBRARIES = {
    "progress": {"rich"},
    "dynamics": {"sksparse"},
    "meshing": {"meshio", "pyvista", "trimesh", "pyyeti"},
    "ema": {"pyuff"},
    "view": {"pyvista", "matplotlib", "PIL"},
    "study": {"dask"},
    "report": {"jinja2"},
    "cli": {"typer", "rich", "threadpoolctl"},
}
EVERYWHERE = {"numpy", "scipy"} | sys.stdlib_module_names
SOURCES = sorted(
    p
    for p in (SRC / "chladni").rglob("*.py")
    if p.parent != SRC / "chladni" or p.name != "__init__.py"
)


def module(path):
    """("chladni", "dynamics", "frf") of .../chladni/dynamics/frf.py; a package by its folder."""
    parts = path.relative_to(SRC).with_suffix("").parts
    return parts[:-1] if parts[-1] == "__init__" else parts


def package(path):
    return module(path) if path.name == "__init__.py" else module(path)[:-1]


MODULES = {module(p) for p in SOURCES}


def imports(path):
    """(own modules, outside packages) imported anywhere in a file; own ones must be relative."""
    own, outside = set(), set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.ImportFrom) and node.level:
            here = package(path)
            base = here[: len(here) - node.level + 1] + tuple(
                (node.module or "").split(".")
            ) * bool(node.module)
            named = {(*base, alias.name) for alias in node.names}
            own |= {name if name in MODULES else base for name in named}
        elif isinstance(node, ast.ImportFrom):
            outside.add(node.module.split(".")[0])
        elif isinstance(node, ast.Import):
            outside |= {alias.name.split(".")[0] for alias in node.names}
    return own, outside


@pytest.mark.parametrize("path", SOURCES, ids=lambda p: "/".join(module(p)))
def test_imports_point_down(path):
    floor, (own, outside) = module(path)[1], imports(path)
    assert {m[1] for m in own} <= MAY_IMPORT[floor] | {floor}
    assert outside <= EVERYWHERE | LIBRARIES.get(floor, set())


def test_no_cycles():
    """A package re-exports its modules, so only imports of modules proper can make a cycle."""
    packages = {module(p) for p in SOURCES if p.name == "__init__.py"}
    graph = {module(p): imports(p)[0] for p in SOURCES if p.name != "__init__.py"}
    whole = {m: {n for n in needs if n not in packages} for m, needs in graph.items()}
    TopologicalSorter(whole).prepare()  # raises CycleError


def test_files_stay_readable():
    long = {p.name: n for p in SOURCES if (n := len(p.read_text().splitlines())) > 400}
    assert not long


def test_names_are_ascii():
    """Greek belongs in docstrings; in code it is spelled (phi, omega), so anyone can type it."""
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            for field in ("id", "arg", "attr", "name"):
                name = getattr(node, field, None) or ""
                assert name.isascii(), f"{path}:{node.lineno}: {name}"


def test_no_pickle_is_ever_loaded():
    """np.load reads with pickles refused, and nothing imports pickle to read a file."""
    for path in SOURCES:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "np.load":
                assert "allow_pickle=False" in ast.unparse(node), f"{path}:{node.lineno}"
            if isinstance(node, ast.Call):
                assert ast.unparse(node.func) not in ("pickle.load", "pickle.loads"), path
