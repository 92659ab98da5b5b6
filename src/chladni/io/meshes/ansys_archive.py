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
from .foreign_model import ForeignMesh, LeftOut
from .part_statement import PartStatement

_SHELLS = {181: 4, 63: 4, 43: 4, 143: 4, 281: 8, 93: 8}  # nodes by number of the element type
_SOLIDS = {185: 8, 45: 8, 186: 20, 95: 20, 187: 10, 92: 10, 285: 4}
_BEAMS = {188: 2, 189: 3, 180: 2}
_KINDS = {4: "quad", 8: "quad8"}
_VOLUMES = {8: "hexahedron", 20: "hexahedron20", 10: "tetra10", 4: "tetra"}
_MASS, _NO_STIFFNESS = 21, (200, 154, 170, 174)
_DOFS = {"UX": 1, "UY": 2, "UZ": 3, "ROTX": 4, "ROTY": 5, "ROTZ": 6}
_MATTERS = ("CE", "CP", "CERIG", "RBE3", "TB", "SECOFFSET")
_HEAD = 10  # numbers of an element before its nodes
Reals = Mapping[int, np.ndarray]


@dataclass
class ArchiveCommands:
    """What the commands of an archive say."""

    materials: dict[int, dict[str, float]] = field(default_factory=dict)
    sections: dict[int, dict[str, float]] = field(default_factory=dict)  # layer is its material
    names: dict[int, str] = field(default_factory=dict)
    supports: list[tuple[int, int]] = field(default_factory=list)  # node, component
    others: Counter[str] = field(default_factory=Counter)


def read_archive(path: Path) -> ForeignMesh:
    """Mesh, sections, materials, masses and supports, in the archive's own numbers."""
    import meshio
    from mapdl_archive import Archive

    try:
        made = Archive(str(path), parse_vtk=False)
        elements, ids, points = made.elem, np.asarray(made.nnum), np.asarray(made.nodes)[:, :3]
        types = dict(np.asarray(made.ekey).tolist())
        reals = dict(zip(np.asarray(made.rlblock_num).tolist(), made.rlblock, strict=True))
    except (*DAMAGED, RuntimeError) as error:
        why = "the blocks NBLOCK and EBLOCK are missing or damaged"
        raise FileError(f"{path} cannot be read as an Ansys archive: {why}") from error
    said = _lines(path)
    parts: dict[tuple[int, int, int, int], int] = {}
    rows: dict[tuple[str, int], list[list[int]]] = {}
    masses, left_out, none = [], Counter[str](), np.zeros(1)
    for element in (np.asarray(e).tolist() for e in elements):
        (material, kind, real, section), nodes = element[:4], element[_HEAD:]
        code = types.get(kind, 0)
        if code == _MASS:
            masses.append((nodes[0], float(reals.get(real, none)[0])))
        elif (shape := _shape(code, nodes)) is None:
            if code not in _NO_STIFFNESS:
                left_out[f"elements of type {code}"] += 1
        else:
            key = (code, material, section, real)
            part = parts.setdefault(key, len(parts) + 1)
            rows.setdefault((shape[0], part), []).append([element[8], *shape[1]])
    if not rows:
        raise FileError(f"{path} has no shells, solids or beams that are known")
    at = {int(id): k for k, id in enumerate(ids)}
    cells = [(kind, [[at[n] for n in row[1 : 1 + NODES[kind]]] for row in table])
             for (kind, _), table in rows.items()]  # fmt: skip
    data = {
        "element": [np.array([row[0] for row in table]) for table in rows.values()],
        "part": [np.full(len(table), part) for (_, part), table in rows.items()],
    }
    mesh = meshio.Mesh(points, cells, {"grid": ids}, data)
    names = {n: said.names.get(key[2], f"material {key[1]}") for key, n in parts.items()}
    names = {n: name if list(names.values()).count(name) == 1 else f"{name} ({n})"
             for n, name in names.items()}  # fmt: skip
    others = [LeftOut(what, n, "not understood") for what, n in (left_out + said.others).items()]
    return ForeignMesh(
        mesh, str(path), names,
        tuple(PartStatement(str(n), _values(key, said, reals)) for key, n in parts.items()),
        tuple((at[node], m) for node, m in masses),
        tuple(others),
        tuple((at[node], c) for node, c in said.supports if node in at),
    )  # fmt: skip


def _shape(code: int, nodes: list[int]) -> tuple[str, list[int]] | None:
    """Kind and nodes of an element; None for those that become no cells."""
    for table, kinds in ((_SHELLS, _KINDS), (_SOLIDS, _VOLUMES)):
        if n := table.get(code):
            return kinds[n], nodes[:n]
    if n := _BEAMS.get(code):
        return ("line", "line3")[n - 2], nodes[:n]
    return None


def _values(
    key: tuple[int, int, int, int], said: ArchiveCommands, reals: Reals
) -> dict[str, float]:
    """Properties of a part: those of its section, else of its real constants, and its material."""
    code, material, section, real = key
    own = dict(said.sections.get(section, {}))
    stuff = said.materials.get(int(own.pop("layer", material)), {})
    if code in _SHELLS and "t" not in own and real in reals:
        own["t"] = float(reals[real][0])
    return {"nu": 0.3, **stuff, **own} if {"E", "rho"} <= set(stuff) else own


_MATERIAL = {"EX": "E", "NUXY": "nu", "PRXY": "nu", "DENS": "rho"}


def _lines(path: Path) -> ArchiveCommands:
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
