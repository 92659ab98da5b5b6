"""Packages that add effects, installed for a test as pip would: a folder and its entry points."""

import sys
from pathlib import Path

import pytest

from chladni.effects import registry


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


@pytest.fixture(scope="module")
def example_edge_mass(tmp_path_factory):
    """The example package, installed: its one file and one entry point."""
    folder = tmp_path_factory.mktemp("site")
    write_package(folder, "example-edge-mass", {"edge-mass": "edge_mass:FAMILY"})
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        patch.syspath_prepend(str(Path(__file__).parent / "example_edge_mass"))
        registry._installed.cache_clear()
        yield registry.family("edge-mass")
    registry._installed.cache_clear()
    sys.modules.pop("edge_mass", None)
