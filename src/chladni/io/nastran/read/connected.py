"""Which parts of a model hang together."""

import numpy as np

from ....errors import ModelError
from ....geometry.connected_points import components
from ....model.assembly import Assembly, Beams, Bushes, Scalars, Shells, Solids


def refuse_loose(model: Assembly, source: str) -> None:
    """Refuse a part of the model that hangs on nothing, by name.

    A component with elements passes if it is the largest such, or is held: by a support, or by
    a spring to the ground.
    """
    label = components(model)
    _refuse_loose_masses(model, label, source)
    groups = [model.shells.nodes, model.beams.nodes, *(s.nodes for s in model.solids)]
    stiff = sorted({int(k) for nodes in groups for k in np.unique(label[nodes[:, 0]])})
    if len(stiff) < 2:
        return
    held = set(label[model.supports[:, 0]].tolist()) | _grounded(label, model.springs, model.bushes)
    for number in stiff[1:]:
        if number not in held:
            points = np.flatnonzero(label == number)
            raise ModelError(
                f"{source}: {_names(model, points)} is not connected: {len(points)} points, "
                f"including grid {model.ids[points[0]]}, are joined to neither "
                f"{_names(model, np.flatnonzero(label == stiff[0]))} nor a support"
            )


def _refuse_loose_masses(model: Assembly, label: np.ndarray, source: str) -> None:
    """Refuse a mass on a grid that nothing joins to anything: it would weigh and not vibrate."""
    rows = model.masses.node
    lone = np.flatnonzero(np.bincount(label)[label[rows]] == 1)
    if not len(lone) or not label.any():  # one grid is all there is
        return
    held = set(label[model.supports[model.supports[:, 1] <= 3, 0]].tolist())
    held |= _grounded(label, model.springs, model.bushes, model.scalar_masses)
    for k in lone:
        if label[rows[k]] not in held:
            raise ModelError(
                f"{source}: mass {model.masses.ids[k]} is on grid {model.ids[rows[k]]}, which is "
                "not connected to the rest; remove or tie it"
            )


def _grounded(label: np.ndarray, *joints: Scalars | Bushes) -> set[int]:
    """Components with a joint whose other end is the ground."""
    nodes = np.concatenate([j.nodes for j in joints])
    ends = nodes[(nodes < 0).any(axis=1)].max(axis=1, initial=-1)
    return set(label[ends[ends >= 0]].tolist())


def _names(model: Assembly, points: np.ndarray) -> str:
    """Names of the parts with elements on these points."""
    inside = np.zeros(len(model.ids), bool)
    inside[points] = True
    families: list[Shells | Beams | Solids] = [model.shells, model.beams, *model.solids]
    parts = sorted({int(p) for f in families for p in f.part[inside[f.nodes[:, 0]]]})
    names = [f"part {model.parts[p].name!r}" for p in parts]
    return ", ".join(names[:3]) + (f" and {len(names) - 3} more" if len(names) > 3 else "")
