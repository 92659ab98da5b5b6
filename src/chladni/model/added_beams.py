"""Beams added to an assembly: stringers, ribs, brackets, fasteners that a deck lacks."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..errors import ModelError
from .added_points import next_id
from .assembly import Assembly, appended
from .properties import BeamSection, Part


def with_beam_line(
    assembly: Assembly,
    grids: Sequence[int],
    section: BeamSection,
    up: Sequence[float] | np.ndarray | None = None,
    name: str = "added beam",
    offset: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
) -> Assembly:
    """Add a line of beams, one between each two successive grids, as a part of their own.

    Parameters
    ----------
    grids : ids of two or more grids of the assembly
    section : areas and moments, about the reference line (SI)
    up : (3,)       direction of plane 1, not along the line, basic frame; by default the axis of
        that frame which is the most across each beam
    name : of the part
    offset : (3,)   of the beams from their grids, basic frame [m]

    Raises
    ------
    LabelError
        If the assembly has no such grid.
    ModelError
        If a beam has no length, ``up`` lies along it, or a rod has an offset.
    """
    ends = assembly.rows(np.asarray(grids, np.int64))
    return with_beams(assembly, np.column_stack([ends[:-1], ends[1:]]), section, up, name, offset)


def with_beams(
    assembly: Assembly,
    nodes: np.ndarray,
    section: BeamSection,
    up: Sequence[float] | np.ndarray | None,
    name: str,
    offset: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
) -> Assembly:
    """Add beams between rows of points (n, 2) as a part of their own; see :func:`with_beam_line`.

    Parameters
    ----------
    up : (3,), (n, 3) or None

    Raises
    ------
    ModelError
        If a beam has no length, ``up`` lies along it, or a rod has an offset.
    """
    n, rod = len(nodes), section.kind == "rod"
    along = np.diff(assembly.points[nodes], axis=1)[:, 0]
    v = np.eye(3)[np.abs(along).argmin(axis=1)]
    if up is not None:
        v = np.broadcast_to(np.asarray(up, float), (n, 3))
    if not n or np.any(np.linalg.norm(np.cross(along, v), axis=1) < 1e-9):
        raise ModelError(f"{name}: a beam needs two grids apart, and a direction across itself")
    if rod and np.any(offset):
        raise ModelError(f"{name}: a rod runs from grid to grid; only bars and beams have offsets")
    new = appended(
        assembly.beams, ids=next_id(assembly) + np.arange(n), nodes=nodes,
        part=np.full(n, len(assembly.parts)),
        up=0 * v if rod else v / np.linalg.norm(v, axis=1, keepdims=True),
        offset=np.broadcast_to(np.asarray(offset, float), (n, 2, 3)),
    )  # fmt: skip
    part = Part(1 + max((p.id for p in assembly.parts), default=0), name, section)
    return replace(assembly, beams=new, parts=(*assembly.parts, part))
