"""Mesh files that ship with the package, and what is written for other programs."""

from pathlib import Path

from ..errors import FileError
from .vtu import write_vtu as write_vtu

_HERE = Path(__file__).resolve().parents[1]


def mesh_path(name: str) -> Path:
    """Path of a reference mesh, whether installed (wheel) or in a checkout (editable)."""
    folders = (_HERE / "meshes", _HERE.parents[1] / "meshes")
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    there = sorted({p.name for f in folders if f.is_dir() for p in f.iterdir() if p.is_file()})
    raise FileError(f"no reference mesh {name!r}; there are {', '.join(there) or 'none'}")
