"""Structures in keyword files of LS-DYNA: shells, solids, beams, masses, sections and materials.

Source: LS-DYNA Keyword User's Manual, Vol. I and II.
"""

from collections import Counter
from pathlib import Path

import numpy as np

from ..dyna import (
    KeywordBlock,
    keyword_blocks,
    nodes_of,
    parts_of,
    section_thickness,
    shells_of,
    table,
)
from .foreign_model import ForeignMesh, LeftOut, numbered_mesh
from .part_statement import PartStatement

_WIDTH = 10
_LINEAR = (  # materials whose first line is MID, RO, E, PR
    "ELASTIC", "001", "PLASTIC_KINEMATIC", "003", "RIGID", "020", "PIECEWISE_LINEAR_PLASTICITY",
    "024", "MODIFIED_PIECEWISE_LINEAR_PLASTICITY", "123", "SIMPLIFIED_JOHNSON_COOK", "098",
)  # fmt: skip
_MATTERS = ("ELEMENT", "CONSTRAINED", "BOUNDARY", "CONTACT_TIED", "CONTACT_SPOTWELD", "MAT")
_READ = ("ELEMENT_SHELL", "ELEMENT_SOLID", "ELEMENT_MASS")


def read_dyna_model(path: Path) -> ForeignMesh:
    """The mesh with its thickness, its materials and masses, in the file's own numbers."""
    blocks = list(keyword_blocks(path))
    ids, places = nodes_of(blocks)
    names, sections = parts_of(blocks)
    shells, t = shells_of(blocks)
    shells[:, 5] = np.where(shells[:, 5] == 0, shells[:, 4], shells[:, 5])
    gauges = section_thickness(blocks)
    gauge = np.array([gauges.get(sections.get(p, -1), np.nan) for p in shells[:, 1].tolist()])
    cells = {"quad": shells, **_solids(blocks)}
    mesh = numbered_mesh(str(path), ids, places, cells)
    mesh.cell_data["thickness"] = [
        np.where(t > 0, t, gauge[:, None])
        if b.type == "quad"
        else np.full((len(b.data), 4), np.nan)
        for b in mesh.cells
    ]
    masses = tuple((int(node), float(m)) for _, node, m in _masses(blocks))
    return ForeignMesh(mesh, str(path), names, _known(blocks), masses, tuple(_left_out(blocks)))


def _solids(blocks: list[KeywordBlock]) -> dict[str, np.ndarray]:
    """Rows of id, part and nodes of solids, by kind; ten integers on one line or two lines."""
    found: dict[str, list[np.ndarray]] = {}
    for block in blocks:
        if block.keyword not in ("ELEMENT_SOLID", "ELEMENT_SOLID_TET4TOTET10") or not block.lines:
            continue
        whole = block.widths[0]
        first = table(block, np.arange(len(block.lines)), (whole,) * 10, int)
        if first[0, 2:].any():  # one line an element
            found.setdefault("hexahedron", []).append(first)
            continue
        head, nodes = first[::2, :2], first[1::2]
        ten = bool(nodes[:, 8:].any())
        kind = "tetra10" if ten else "hexahedron"
        found.setdefault(kind, []).append(np.hstack([head, nodes[:, : 10 if ten else 8]]))
    return {kind: np.vstack(rows) for kind, rows in found.items()}


def _masses(blocks: list[KeywordBlock]) -> np.ndarray:
    """(n, 3) id, node and mass."""
    found = [np.zeros((0, 3))]
    for block in blocks:
        if block.keyword == "ELEMENT_MASS" and block.lines:
            whole, real = block.widths
            rows = np.arange(len(block.lines))
            found.append(table(block, rows, (whole, whole, real), float))
    return np.vstack(found)


def _known(blocks: list[KeywordBlock]) -> tuple[PartStatement, ...]:
    """E, nu and rho of every part, by its number."""
    stuff: dict[int, dict[str, float]] = {}
    for block in blocks:
        name = block.keyword.removeprefix("MAT_").removesuffix("_TITLE")
        if block.keyword.startswith("MAT_") and name in _LINEAR and block.lines:
            row = np.array([int(block.keyword.endswith("_TITLE"))])
            mid, rho, E, nu = table(block, row, (_WIDTH,) * 4, float)[0].tolist()
            stuff[int(mid)] = {"E": E, "nu": nu, "rho": rho}
    found = []
    for block in (b for b in blocks if b.keyword == "PART"):
        for k in range(1, len(block.lines), 2):
            pid, _, mid = table(block, np.array([k]), (_WIDTH,) * 3, int)[0].tolist()
            if mid in stuff:
                found.append(PartStatement(str(pid), stuff[mid]))
    return tuple(found)


def _left_out(blocks: list[KeywordBlock]) -> list[LeftOut]:
    """Keywords that carry stiffness, mass or supports and are not read."""
    counts: Counter[str] = Counter()
    for block in blocks:
        read = block.keyword.startswith(_READ)
        linear = block.keyword.removeprefix("MAT_").removesuffix("_TITLE") in _LINEAR
        if block.keyword.startswith(_MATTERS) and not read and not linear:
            counts[block.keyword] += max(len(block.lines), 1)
    return [LeftOut(f"*{name}", n, "lines not understood") for name, n in counts.items()]
