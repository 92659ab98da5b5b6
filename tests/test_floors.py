"""A module imports only from floors below its own; heavy libraries stay at the edges."""

import ast
import sys
import tomllib
from collections import defaultdict
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

from chladni.cli.app import BUILT_IN, OF_CHECKOUT

ROOT = Path(__file__).parents[1]
PACKAGES = {  # every package of ours and where its source is
    "chladni": ROOT / "src",
    "chladni_planning": ROOT / "src",
    "chladni_bench": ROOT / "src",
    "chladni_studies": ROOT / "src",
    "chladni_specimens": ROOT / "src",
    "chladni_contract": ROOT / "src",
    "chladni_evidence": ROOT / "evidence",
    "chladni_envs": ROOT / "envs",
}
GROUND = {
    "address_space", "errors", "arguments", "arrays", "dofs", "units", "output", "progress",
    "parallel", "results", "extensions", "own_folder",
}  # fmt: skip
MAY_IMPORT = {  # floor: the floors it may use, its own aside
    **{name: GROUND for name in GROUND},
    "model": GROUND,
    "geometry": GROUND | {"model"},
    "sparse": GROUND,
    "dynamics": GROUND | {"sparse"},
    "ema": GROUND | {"dynamics"},
    "fem": GROUND | {"model", "geometry", "sparse", "dynamics"},
    "io": GROUND | {"model", "geometry", "dynamics", "ema"},
    "effects": GROUND | {"model", "geometry", "dynamics", "fem", "ema"},
}
MAY_IMPORT["reduced"] = MAY_IMPORT["effects"] | {"effects", "sparse"}
MAY_IMPORT["inference"] = MAY_IMPORT["reduced"] | {"reduced"}
MAY_IMPORT["search"] = MAY_IMPORT["inference"] | {"inference"}
MAY_IMPORT["case"] = GROUND | {"model", "geometry", "fem", "dynamics", "ema", "io", "effects"}
MAY_IMPORT["view"] = GROUND | {"model", "geometry", "dynamics"}
MAY_IMPORT["workflows"] = MAY_IMPORT["search"] | {"search", "geometry", "io", "case", "view"}
MAY_IMPORT["report"] = MAY_IMPORT["workflows"] | {"workflows"}
MAY_IMPORT["cli"] = MAY_IMPORT["report"] | {"report"}
MAY_IMPORT["__main__"] = {"cli"}
CHLADNI = MAY_IMPORT["report"] | {"report"}  # all but its commands
MAY_IMPORT["chladni_planning"] = MAY_IMPORT["chladni_studies"] = CHLADNI
MAY_IMPORT["chladni_bench"] = CHLADNI | {"chladni_planning"}
MAY_IMPORT["chladni_specimens"] = CHLADNI | {"chladni_planning"}
MAY_IMPORT["chladni_contract"] = CHLADNI | {"chladni_bench", "chladni_specimens"}
MAY_IMPORT["chladni_evidence"] = CHLADNI | {
    "chladni_planning", "chladni_bench", "chladni_specimens"
}  # fmt: skip
MAY_IMPORT["chladni_envs"] = MAY_IMPORT["workflows"] | {"workflows", "chladni_planning"}
LIBRARIES = {
    "progress": {"rich"},
    "parallel": {"threadpoolctl"},
    "sparse": {"pymetis", "sksparse"},
    "geometry": {"pyvista", "trimesh"},
    "io": {"mapdl_archive", "meshio", "pandas", "pyyeti", "pyuff", "trimesh", "xarray"},
    "view": {"pyvista", "matplotlib", "PIL"},
    "report": {"jinja2"},
    "workflows": {"threadpoolctl"},
    "cli": {"typer", "rich"},
    "chladni_bench": {"matplotlib"},
    "chladni_studies": {"distributed", "SALib", "threadpoolctl", "matplotlib"},
    "chladni_evidence": {"threadpoolctl"},
    "chladni_envs": {"gymnasium", "stable_baselines3", "sb3_contrib", "matplotlib"},
}
# module no command, environment or public name reaches: what will
WAITING_FOR: dict[str, str] = {}
EVERYWHERE = {"numpy", "scipy"} | sys.stdlib_module_names
SOURCES = sorted(
    p
    for name, root in PACKAGES.items()
    for p in (root / name).rglob("*.py")
    if p != root / "chladni" / "__init__.py"
)


def module(path):
    """("chladni", "dynamics", "frf") of .../chladni/dynamics/frf.py; a package by its folder."""
    root = next(r for n, r in PACKAGES.items() if path.is_relative_to(r / n))
    parts = path.relative_to(root).with_suffix("").parts
    return parts[:-1] if parts[-1] == "__init__" else parts


def floor_of(name):
    """The floor of a module: its room in chladni, or the package beside it."""
    return name[0] if name[0] != "chladni" or len(name) == 1 else name[1]


def package(path):
    return module(path) if path.name == "__init__.py" else module(path)[:-1]


def front(name):
    """Names that other packages may import from a package: the ``__all__`` of its front."""
    tree = ast.parse((PACKAGES[name] / name / "__init__.py").read_text(encoding="utf-8"))
    values = {ast.unparse(n.targets[0]): n.value for n in tree.body if isinstance(n, ast.Assign)}
    return set(ast.literal_eval(values["__all__"])) if "__all__" in values else set()


def entry_points():
    """Modules that pyproject.toml names, by the group of scripts or entry points."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    groups = {"scripts": project.get("scripts", {})} | project.get("entry-points", {})
    return {
        group: {tuple(text.split(":")[0].split(".")) for text in named.values()}
        for group, named in groups.items()
    }


MODULES = {module(p) for p in SOURCES}
FRONTS = {name: front(name) for name in PACKAGES}
COMMANDS = (
    {("chladni", "cli", name) for name in BUILT_IN}
    | {tuple(name.split(".")) for name in OF_CHECKOUT.values()}
    | entry_points()["chladni.commands"]
)


@cache
def nodes(path):
    """The syntax tree of a file, node after node."""
    return tuple(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))


@cache
def imports(path):
    """(own modules, outside packages) imported anywhere in a file.

    Own modules are relative; another package than ``chladni`` is used by its front.
    """
    own, outside = set(), set()
    for node in nodes(path):
        if isinstance(node, ast.ImportFrom) and node.level:
            here = package(path)
            base = here[: len(here) - node.level + 1] + tuple(
                (node.module or "").split(".")
            ) * bool(node.module)
            named = {(*base, alias.name) for alias in node.names}
            own |= {name if name in MODULES else base for name in named}
        elif isinstance(node, ast.ImportFrom) and node.module.split(".")[0] in PACKAGES:
            base = tuple(node.module.split("."))
            assert base[0] != module(path)[0], f"{path}:{node.lineno}: own modules are relative"
            if base[0] != "chladni":
                by = f"{path}:{node.lineno}: only the front of {base[0]} is for others"
                assert base[1:] == (), by
                assert {a.name for a in node.names} <= FRONTS[base[0]], by
                own.add(base)
                continue
            named = {(*base, alias.name) for alias in node.names}
            own |= {name if name in MODULES else base for name in named}
        elif isinstance(node, ast.ImportFrom):
            outside.add(node.module.split(".")[0])
        elif isinstance(node, ast.Import):
            outside |= {alias.name.split(".")[0] for alias in node.names}
    return own, outside


def test_imports_point_down():
    """All offenders at once: the module, the floor or library it must not import.

    A command, in whichever package, stands on what commands share as well.
    """
    wrong = []
    for path in SOURCES:
        floor, (own, outside) = floor_of(module(path)), imports(path)
        over = {"cli"} if module(path) in COMMANDS else set()
        shared = set().union(*(LIBRARIES[room] for room in over))
        above = {floor_of(m) for m in own} - MAY_IMPORT[floor] - {floor} - over
        foreign = outside - EVERYWHERE - LIBRARIES.get(floor, set()) - shared
        wrong += [f"{'/'.join(module(path))} imports {name}" for name in above | foreign]
    assert not wrong, "\n".join(sorted(wrong))


def test_no_command_imports_another():
    """What commands share is in run.py, or further down; the list of commands imports them all."""
    assert COMMANDS <= MODULES
    for path in SOURCES:
        assert not imports(path)[0] & COMMANDS, path


def test_workflows_touch_no_terminal_and_no_page():
    """A notebook, an environment and a command call the same function."""
    for path in (p for p in SOURCES if floor_of(module(p)) in ("workflows", "chladni_envs")):
        own, outside = imports(path)
        assert not {floor_of(m) for m in own} & {"cli", "report", "output"}, path
        assert not outside & {"typer", "rich", "jinja2"}, path


def test_no_cycles():
    """A package re-exports its modules, so only imports of modules proper can make a cycle."""
    packages = {module(p) for p in SOURCES if p.name == "__init__.py"}
    graph = {module(p): imports(p)[0] for p in SOURCES if p.name != "__init__.py"}
    whole = {m: {n for n in needs if n not in packages} for m, needs in graph.items()}
    TopologicalSorter(whole).prepare()  # raises CycleError


def reached(roots):
    """Modules that are loaded, at once or by a call, by whoever loads the roots."""
    needs = {module(p): imports(p)[0] for p in SOURCES}
    found, ahead = set(), set(roots)
    while ahead:
        found |= ahead
        above = {m[:k] for m in ahead for k in range(1, len(m))}  # a package loads before it
        ahead = {n for m in ahead for n in needs.get(m, ())} | above
        ahead = (ahead & needs.keys()) - found
    return found


def test_nothing_is_out_of_reach():
    """Commands, environments and public names reach every module, or it waits for something."""
    environments = {m for m in MODULES if m[0] == "chladni_envs"}
    public = imports(ROOT / "src/chladni/__init__.py")[0]
    mains = {m for m in MODULES if m[-1] == "__main__"}  # python -m PACKAGE
    used = reached(COMMANDS | environments | public | mains.union(*entry_points().values()))
    assert {"/".join(m) for m in MODULES - used} == set(WAITING_FOR)


def test_names_stand_once():
    """A class or a file can be spoken of by its name.

    A command's file is called as the command, and so is that of its workflow.
    """
    classes, files = defaultdict(list), defaultdict(list)
    for path in SOURCES:
        called = floor_of(module(path)) == "workflows" and path.stem in BUILT_IN
        named = path.stem in ("__init__", "__main__") or module(path)[:2] == ("chladni", "cli")
        if not (called or named):
            files[path.stem].append(path)
        for node in nodes(path):
            if isinstance(node, ast.ClassDef):
                classes[node.name].append("/".join(module(path)))
    assert not {name: at for name, at in (classes | files).items() if len(at) > 1}


def test_files_stay_readable():
    long = {str(p): n for p in SOURCES if (n := len(p.read_text().splitlines())) > 400}
    assert not long


def test_names_are_ascii():
    """Greek belongs in docstrings; in code it is spelled (phi, omega), so anyone can type it."""
    for path in SOURCES:
        for node in nodes(path):
            for field in ("id", "arg", "attr", "name"):
                name = getattr(node, field, None) or ""
                assert name.isascii(), f"{path}:{node.lineno}: {name}"


def test_no_pickle_is_ever_loaded():
    """np.load reads with pickles refused, and nothing imports pickle to read a file."""
    for path in SOURCES:
        for node in nodes(path):
            if isinstance(node, ast.Call) and ast.unparse(node.func) == "np.load":
                assert "allow_pickle=False" in ast.unparse(node), f"{path}:{node.lineno}"
            if isinstance(node, ast.Call):
                assert ast.unparse(node.func) not in ("pickle.load", "pickle.loads"), path
