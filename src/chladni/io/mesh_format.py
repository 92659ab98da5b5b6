"""Which program's model a file holds, by its first lines; by its name where these say nothing."""

import re
from pathlib import Path

from ..errors import FileError

_HEAD = 65536  # bytes of a file in which its program shows
_KEYWORD = re.compile(rb"\A(?:[ \t]*[\r\n]+|(?:\*\*|\$)[^\n]*\n)*\*[A-Za-z]")
_DYNA = re.compile(rb"^\*(?:KEYWORD\b|[A-Z]+_[A-Z])", re.IGNORECASE | re.MULTILINE)
_SIGNS = (  # beginning of the file, name of the format
    (re.compile(rb"\s*-1\s*\n\s*\d+"), "a universal file"),
    (re.compile(rb"(?:[ \t]*[\r\n]+|![^\n]*\n)*(?:/(?:COM|PREP7|BATCH|NOPR|TITLE)|NBLOCK,|ET,)",
                re.I), "an Ansys archive"),
    (re.compile(rb"\s*\$(?:MeshFormat|Comments)\b"), "a Gmsh mesh"),
    (re.compile(rb"# vtk DataFile"), "a VTK file"),
    (re.compile(rb"\s*(?:<\?xml[^>]*>\s*)?<VTKFile"), "a VTK file"),
    (re.compile(rb"\s*(?:<\?xml[^>]*>\s*)?(?:<!DOCTYPE[^>]*>\s*)?<Xdmf"), "an XDMF file"),
    (re.compile(rb"\s*solid\b[^\n]*\n\s*facet\b", re.I), "an STL file"),
    (re.compile(rb"ply\r?\n"), "a PLY file"),
    (re.compile(rb"\s*MeshVersionFormatted"), "a Medit mesh"),
)  # fmt: skip
_NAMES = {  # endings of formats without such a beginning, as meshio knows them
    ".stl": "an STL file", ".obj": "an OBJ file", ".off": "an OFF file", ".med": "a MED mesh",
    ".e": "an Exodus mesh", ".exo": "an Exodus mesh", ".ex2": "an Exodus mesh",
    ".cgns": "a CGNS mesh", ".h5m": "an H5M mesh", ".su2": "an SU2 mesh", ".vol": "a Netgen mesh",
    ".ugrid": "a UGRID mesh", ".avs": "an AVS mesh", ".mdpa": "a Kratos mesh",
    ".f3grid": "a FLAC3D mesh", ".meshb": "a Medit mesh", ".node": "a TetGen mesh",
    ".ele": "a TetGen mesh", ".vtp": "a VTK file", ".vtm": "a VTK file",
}  # fmt: skip
ABAQUS, DYNA = "an Abaqus input file", "an LS-DYNA keyword file"
ANSYS, UNIVERSAL, VTK = "an Ansys archive", "a universal file", "a VTK file"


def format_of(path: Path, head: bytes) -> str:
    """Format of a file of another program by its first bytes, with article; "" for a deck.

    >>> format_of(Path("a.inp"), b"*Heading"), format_of(Path("a"), b"SOL 103")
    ('an Abaqus input file', '')
    """
    if _KEYWORD.match(head):
        return DYNA if _DYNA.search(head) else ABAQUS
    found = next((name for sign, name in _SIGNS if sign.match(head)), "")
    return found or _NAMES.get(path.suffix.lower(), "")


def foreign_format(path: Path) -> str:
    """Format of the file at a path; "" for a deck, a folder and a file that is not there."""
    if not path.is_file():
        return ""
    with path.open("rb") as file:
        return format_of(path, file.read(_HEAD))


def refuse_foreign(path: Path, prefix: str = "") -> None:
    """Refuse a model of another program where a deck is expected; the sentence says how to go on.

    Raises
    ------
    FileError
        With the command that makes a deck of it.
    """
    if found := foreign_format(path):
        raise FileError(
            f"{prefix}{path} is {found}, not a Nastran deck; "
            f"`chladni convert {path} --out {path.stem}.bdf` makes a deck of it"
        )
