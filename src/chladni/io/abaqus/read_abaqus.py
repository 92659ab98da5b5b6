"""Structures in input files of Abaqus and CalculiX."""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ...errors import FileError, named
from ...geometry.mesh_cells import DIMENSION, elements
from ...model.assembly import Assembly
from ..meshes.foreign_model import ForeignModel, LeftOut
from ..meshes.part_statement import WAY, PartStatement
from .abaqus_joints import AbaqusJoints
from .abaqus_mesh import AbaqusMesh
from .abaqus_sections import OF_MATERIALS, SECTIONS, AbaqusParts, materials_of, orientation_of
from .element_types import NO_ROTATION, READ_ELSEWHERE, kind_of
from .keywords import Keyword, keywords

_HARMLESS = """
    HEADING, PREPRINT, RESTART, ASSEMBLY, END ASSEMBLY, STEP, STATIC, FREQUENCY, BUCKLE, DYNAMIC,
    VISCO, MODAL DYNAMIC, STEADY STATE DYNAMICS, COMPLEX FREQUENCY, RANDOM RESPONSE, MODAL DAMPING,
    RESPONSE SPECTRUM, BASE MOTION, FILE FORMAT, MONITOR, CONTROLS, SOLVER CONTROLS, PARAMETER,
    SECTION CONTROLS, CLOAD, DLOAD, DSLOAD, TEMPERATURE, AMPLITUDE, INITIAL CONDITIONS, DEPVAR,
    PHYSICAL CONSTANTS, VALUES AT INFINITY, SURFACE INTERACTION, SURFACE BEHAVIOR, FRICTION,
    PLASTIC, CYCLIC HARDENING, RATE DEPENDENT, CREEP, DAMAGE INITIATION, DAMAGE EVOLUTION,
    EXPANSION, CONDUCTIVITY, SPECIFIC HEAT, NODAL THICKNESS
"""  # they change neither stiffness nor mass of the undeformed structure
_PASSED_OVER = frozenset(" ".join(_HARMLESS.split()).split(", "))
_REQUESTS = ("OUTPUT", "PRINT", "FILE")  # ends of the names of requests


def read_abaqus(path: Path, stated: Sequence[PartStatement] = ()) -> ForeignModel:
    """The structure of an input file in its own numbers; what is not understood is listed.

    Supports are those of the model and of its first step.

    Parameters
    ----------
    stated : properties of sets of elements that have no section

    Raises
    ------
    FileError
        If a line is damaged, or a set, node, material or section that it names is not there.
    """
    mesh = AbaqusMesh()
    rest = [key for key in keywords(path) if not mesh.read(key)]
    if not mesh.places:
        raise FileError(f"{path} has no *NODE")
    materials = materials_of(k for k in rest if k.name in OF_MATERIALS)
    systems = {
        k.word("NAME").lower(): orientation_of(k, k.words.get("SYSTEM", "RECTANGULAR"))
        for k in rest if k.name == "ORIENTATION"
    }  # fmt: skip
    parts = AbaqusParts(mesh, materials, systems)
    for key in (k for name in ("NODAL THICKNESS", *SECTIONS) for k in rest if k.name == name):
        parts.read(key)
    for one in sorted(stated, key=lambda s: not s.name):
        parts.state(one)
    if not parts.cells:
        sets = named(mesh.elements.sets, 20)
        raise FileError(f"{path} has no elements with a section; {WAY} for a set, {sets}")
    ids = np.array(sorted(mesh.places))
    row = {id: k for k, id in enumerate(ids.tolist())}
    joints = _joints(mesh, row, [k for k in rest if k.name not in _OF_PARTS])
    cells = [replace(c, nodes=_rows(c.nodes, row)) for c in parts.cells]
    shells, solids, beams = elements(cells, joints.points)
    made = Assembly(
        ids, parts=tuple(parts.parts), shells=shells, solids=solids, beams=beams,
        **joints.families(),
    )  # fmt: skip
    left_out = Counter(_without_section(mesh, parts)) + parts.left_out + joints.left_out
    return ForeignModel(
        made, tuple(LeftOut(what, n, "not in the deck") for what, n in left_out.items())
    )


_OF_PARTS = (*OF_MATERIALS, *SECTIONS, "ORIENTATION")


def _rows(nodes: np.ndarray, row: Mapping[int, int]) -> np.ndarray:
    return np.array([[row[n] for n in each] for each in nodes.tolist()], dtype=np.int64)


def _joints(mesh: AbaqusMesh, row: dict[int, int], keys: Sequence[Keyword]) -> AbaqusJoints:
    """Supports first, so that joints bind only motions that are free."""
    points = np.array([mesh.places[id] for id in row])
    turning = {
        row[n] for kind, nodes in mesh.shapes.values() for n in nodes
        if DIMENSION.get(kind_of(kind), 3) < 3 and not NO_ROTATION.fullmatch(kind)
    }  # fmt: skip
    joints = AbaqusJoints(mesh, row, points, frozenset(turning))
    held = ("BOUNDARY", "TRANSFORM")
    for key in sorted(keys, key=lambda k: k.name not in held):
        if not joints.read(key) and not _passed_over(key):
            joints.left_out[f"*{key.name}"] += 1
        if key.name == "STEP" and key.words.get("NLGEOM", "NO").upper() != "NO":
            joints.left_out["stress stiffening by *STEP, NLGEOM"] += 1
    return joints


def _passed_over(key: Keyword) -> bool:
    return key.name in _PASSED_OVER or key.name.endswith(_REQUESTS)


def _without_section(mesh: AbaqusMesh, parts: AbaqusParts) -> Iterator[str]:
    """Elements that are in no section or of a type without counterpart, one line each."""
    for id, (kind, _) in mesh.shapes.items():
        if kind_of(kind):
            if id not in parts.assigned:
                yield f"{kind} without a section"
        elif not READ_ELSEWHERE.fullmatch(kind):
            yield f"elements {kind}"
