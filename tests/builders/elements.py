"""Elements without the columns that a test is not about."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from chladni.model.assembly import Assembly, Beams, Bushes, Scalars
from chladni.model.properties import BeamSection, Part

CUBE = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float
)


def bars(nodes: Any, part: int = 0, up: Sequence[float] = (0.0, 1.0, 0.0), **more: Any) -> Beams:
    """Beams (n, 2) of one part, toward one direction, without offsets and pins."""
    n = len(nodes)
    columns = {
        "ids": np.arange(101, 101 + n), "nodes": np.asarray(nodes), "part": np.full(n, part),
        "up": np.tile(np.asarray(up, float), (n, 1)), "offset": np.zeros((n, 2, 3)),
        "pins": np.zeros((n, 2, 6), bool),
    }  # fmt: skip
    return Beams(**{**columns, **more})


def row_of_bars(
    n: int,
    length: float,
    section: BeamSection,
    direction: Sequence[float] = (1.0, 0, 0),
    up: Sequence[float] = (0.0, 1.0, 0.0),
    **more: Any,
) -> Assembly:
    """A straight row of n beams; columns of them, and fields of the assembly, may be given."""
    points = np.linspace(0, length, n + 1)[:, None] * np.array(direction)
    columns = {name: more.pop(name) for name in ("offset", "pins") if name in more}
    nodes = np.stack([np.arange(n), np.arange(1, n + 1)], axis=1)
    fields = {"ids": np.arange(1, n + 2), "points": points, "parts": (Part(1, "b", section),)}
    return Assembly(**{**fields, "beams": bars(nodes, up=up, **columns), **more})


def scalar(
    nodes: Sequence[int], components: Sequence[int], value: float, damping: float = 0.0
) -> Scalars:
    """One spring, dashpot or mass between components of two points; -1 is the ground."""
    table = np.array([nodes]), np.array([components]), np.array([value]), np.array([damping])
    return Scalars(np.array([1]), *table)


def bush(
    nodes: Sequence[int], place: Any, stiffness: Any, frame: Any = None, viscous: Any = 0.0,
    loss: float = 0.0,
) -> Bushes:  # fmt: skip
    """One bush at a place."""
    one, axes = np.ones((1, 6)), np.eye(3) if frame is None else frame
    return Bushes(
        np.array([1]), np.array([nodes]), np.array([axes], float), np.array([place], float),
        np.array([stiffness], float), viscous * one, loss * one,
    )  # fmt: skip
