"""The reference meshes and cases that ship with the package."""

from pathlib import Path

from ..errors import FileError

_HERE = Path(__file__).resolve().parents[1]


def mesh_path(name: str) -> Path:
    """Path of a reference mesh or case, whether installed (wheel) or in a checkout (editable).

    Raises
    ------
    FileError
        If there is none of this name; the sentence lists those there are.
    """
    folders = (_HERE / "meshes", _HERE.parents[1] / "meshes")
    for folder in folders:
        if (folder / name).is_file():
            return folder / name
    known = sorted(p.name for folder in folders if folder.is_dir() for p in folder.iterdir())
    raise FileError(f"no reference mesh {name!r}; there are {', '.join(known)}")
