"""Archives of Ansys (.cdb): nodes and elements by mapdl-archive; sections and materials by line.

Source: Ansys Mechanical APDL Command Reference (MPDATA, SECTYPE, SECBLOCK, SECDATA, RLBLOCK, D).
"""

import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from ...errors import FileError
from ...geometry.mesh_cells import NODES
from ..damage import DAMAGED
from .foreign_model import ForeignMesh, LeftOut, numbered_mesh
from .part_statement import PartStatement

_KINDS = {  # by the number of the element type
    **dict.fromkeys((181, 63, 43, 143), "quad"), **dict.fromkeys((281, 93), "quad8"),
    **dict.fromkeys((185, 45), "hexahedron"), **dict.fromkeys((186, 95), "hexahedron20"),
    **dict.fromkeys((187, 92), "tetra10"), 285: "tetra", 188: "line", 180: "line", 189: "line3",
}  # fmt: skip
_STRAIGHT = {"quad8": "quad", "hexahedron20": "hexahedron", "tetra10": "tetra", "line3": "line"}
_MASS, _NO_STIFFNESS = 21, (200, 154, 170, 174)
_DOFS = {"UX": 1, "UY": 2, "UZ": 3, "ROTX": 4, "ROTY": 5, "ROTZ": 6}
_MATTERS = ("CE", "CP", "CERIG", "RBE3", "TB", "SECOFFSET")
_HEAD = 10  # numbers of an element before its nodes
Reals = Mapping[int, np.ndarray]


@dataclass
class ArchiveCommands:
    """Properties and supports that the commands of an archive state."""

    materials: dict[int, dict[str, float]] = field(default_factory=dict)
    sections: dict[int, dict[str, float]] = field(default_factory=dict)  # layer is its material
    names: dict[int, str] = field(default_factory=dict)
    supports: list[tuple[int, int]] = field(default_factory=list)  # node, component
    others: Counter[str] = field(default_factory=Counter)


def read_archive(path: Path) -> ForeignMesh:
    """Mesh, sections, materials, masses and supports, in the archive's own numbers."""
    from mapdl_archive import Archive

    try:
        made = Archive(str(path), parse_vtk=False)
        ids, points = np.asarray(made.nnum, np.int64), np.asarray(made.nodes)[:, :3]
        types, rows = dict(made.ekey.tolist()), [e.tolist() for e in made.elem]
        reals = dict(zip(made.rlblock_num, made.rlblock, strict=True))
    except (*DAMAGED, RuntimeError) as error:
        why = "the blocks NBLOCK and EBLOCK are missing or damaged"
        raise FileError(f"{path} cannot be read as an Ansys archive: {why}") from error
    said = _commands(path)
    parts: dict[tuple[int, ...], int] = {}  # number by type, material, real constants, section
    cells: dict[str, list[list[int]]] = {}
    masses = []
    for (material, type_, real, section, *_), element, nodes in (
        (r, r[8], r[_HEAD:]) for r in rows
    ):
        code = types.get(type_, 0)
        kind = _KINDS.get(code, "")
        if kind and 0 in nodes[: NODES[kind]]:  # without nodes on edges
            kind = _STRAIGHT.get(kind, kind)
        if kind:
            part = parts.setdefault((code, material, real, section), len(parts) + 1)
            cells.setdefault(kind, []).append([element, part, *nodes[: NODES[kind]]])
        elif code == _MASS:
            masses.append((nodes[0], float(reals.get(real, [0.0])[0])))
        elif code not in _NO_STIFFNESS:
            said.others[f"elements of type {code}"] += 1
    names = [said.names.get(key[3], f"material {key[1]}") for key in parts]
    names = [n if names.count(n) == 1 else f"{n} ({k})" for k, n in enumerate(names, start=1)]
    return ForeignMesh(
        numbered_mesh(str(path), ids, points, cells),
        str(path),
        dict(enumerate(names, start=1)),
        tuple(PartStatement(str(k), _values(key, said, reals)) for key, k in parts.items()),
        tuple(masses),
        tuple(LeftOut(what, n, "not understood") for what, n in said.others.items()),
        tuple(said.supports),
    )


def _values(key: tuple[int, ...], said: ArchiveCommands, reals: Reals) -> dict[str, float]:
    """Properties of a part: those of its section, else of its real constants, and its material."""
    code, material, real, section = key
    own = dict(said.sections.get(section, {}))
    stuff = said.materials.get(int(own.pop("layer", material)), {})
    if _KINDS[code].startswith("quad") and real in reals:
        own.setdefault("t", float(reals[real][0]))
    return {"nu": 0.3, **stuff, **own} if {"E", "rho"} <= set(stuff) else own


_MATERIAL = {"EX": "E", "NUXY": "nu", "PRXY": "nu", "DENS": "rho"}


def _commands(path: Path) -> ArchiveCommands:
    """Commands of the archive, line by line."""
    said, kind, section = ArchiveCommands(), "", 0
    block = 0  # layers of a SECBLOCK that follow
    for line in path.read_text(encoding="latin-1").splitlines():
        words = [w.strip() for w in line.split(",")]
        name = words[0].upper()
        if block:
            block -= 1
            _section(said, section, kind, words)
        elif name in ("MPDATA", "MP"):
            _property(said, words[2:] if words[1].upper().startswith("R") else words[1:], name)
        elif name == "SECTYPE":
            section, kind = int(words[1]), " ".join(words[2:4]).upper().strip()
            said.names |= {section: words[4]} if words[4:] and words[4] else {}
        elif name == "SECBLOCK":
            block = int(words[1])
        elif name == "SECDATA":
            _section(said, section, kind, words[1:])
        elif name == "D" and len(words) > 3 and words[1].isdigit():
            all_ = words[2].upper() == "ALL"
            wanted = (
                _DOFS.values() if all_ else [_DOFS[words[2].upper()]] * (words[2].upper() in _DOFS)
            )
            said.supports += [(int(words[1]), c) for c in wanted]
        elif name in _MATTERS and not (name == "SECOFFSET" and words[1:2] == ["MID"]):
            said.others[name] += 1
    return said


def _property(said: ArchiveCommands, words: list[str], command: str) -> None:
    """MPDATA: material, label, position, values; MP: label, material, value."""
    if command == "MP":
        words = [words[1], words[0], *words[1:]]
    else:
        words = [words[0], words[1], "", *words[4:]]
    if words[1].upper() in _MATERIAL and len(words) > 3:
        own = said.materials.setdefault(int(words[0]), {})
        own.setdefault(_MATERIAL[words[1].upper()], float(words[3]))


def _section(said: ArchiveCommands, section: int, kind: str, words: list[str]) -> None:
    """A line of numbers of a section: a layer of a shell, or the sizes of a beam."""
    numbers = [float(w) if re.fullmatch(r"[-+.\dEe]+", w) else 0.0 for w in words]
    own = said.sections.setdefault(section, {})
    if kind.startswith("SHELL"):
        own["t"] = own.get("t", 0.0) + numbers[0]
        if len(numbers) > 1 and numbers[1] and own.setdefault("layer", numbers[1]) != numbers[1]:
            own["layer"] = -1.0  # of several materials: no statement has it
    elif kind.startswith("BEAM RECT"):
        own |= {"b": numbers[0], "h": numbers[1]}
    elif kind.startswith("BEAM CSOLID"):
        own["d"] = 2 * numbers[0]
    elif kind.startswith("BEAM CTUBE"):
        own |= {"d": 2 * numbers[1], "t": numbers[1] - numbers[0]}
