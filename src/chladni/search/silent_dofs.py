"""Drives and sensors at which a model does not respond, because of their place or direction.

A support holds them, or the motion they measure is uncoupled: a force in the plane of a flat sheet
moves no sensor across it. The logarithm of such a response is that of a rounding error.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ..dynamics.reduction import attachments, shifted
from ..errors import LabelError, named
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import Modelled

NOTHING = 1e-8  # of √(|H_oo| |H_ii|): a smaller |H_oi| is rounding
LINES, DAMPING = 30, 0.05  # at which responses are compared
AXES = tuple(zip(("+X", "+Y", "+Z"), np.eye(3), strict=True))


def refuse_silent(model: Modelled, outputs: MeasuredDofs, inputs: MeasuredDofs) -> None:
    """Refuse drives and sensors at which the response of the model is numerically nothing."""
    if inputs.base.any() or not (len(inputs.labels) and len(outputs.labels)):
        return
    sides = {"drive": inputs, "sensor": outputs}
    held = {what: at.only(_fixed(model, at)) for what, at in sides.items()}
    if any(at.labels for at in held.values()):
        raise LabelError(_held(model, {what: at for what, at in held.items() if at.labels}))
    silent = _silent(model, outputs, inputs)
    drives, sensors = silent.all(axis=0), silent.all(axis=1)
    if drives.any():
        what, own, other, said = "drive", drives, outputs, "no sensor"
    elif sensors.any():
        what, own, other, said = "sensor", sensors, inputs, "with no drive"
    else:
        return
    at = sides[what].only(np.asarray(own))
    said = f"move{'s' * (len(at.labels) == 1)} {said}"
    ways = [axis for axis, n in AXES if not _silent(model, _along(at, n), other).all()]
    theirs: list[str] = []
    if what == "drive":
        said += f" declared along {_declared(other)}"
        theirs = [axis for axis, n in AXES if not _silent(model, at, _along(other, n)).all()]
    raise LabelError(
        f"{_listed(what, at.labels)} of the model, declared along {_declared(at)}, {said} ("
        f"less than {NOTHING:g} of the response of the point itself); {_would(ways, theirs)}"
        "correct the place or the direction in the label or in sensors.csv, or leave the channel "
        "out with use = no"
    )


def silent_sensors(model: Modelled, outputs: MeasuredDofs, inputs: MeasuredDofs) -> tuple[str, ...]:
    """Labels of the sensors that move with no drive."""
    if inputs.base.any():
        return ()
    return outputs.only(np.asarray(_silent(model, outputs, inputs).all(axis=1))).labels


def _declared(at: MeasuredDofs) -> str:
    """The axes nearest to the directions of dofs."""
    return " and ".join("XYZ"[k] for k in np.unique(np.abs(at.directions).argmax(axis=1)))


def _held(model: Modelled, held: dict[str, MeasuredDofs]) -> str:
    """Sentence on the places that supports hold."""
    several = " and ".join(_listed(what, at.labels) for what, at in held.items())
    ways = [
        a for a, n in AXES if not any(_fixed(model, _along(at, n)).all() for at in held.values())
    ]
    return (
        f"the supports of the deck hold {several}, so the model does not respond there; "
        f"{_would(ways)}compare the grid and direction of each with the supports"
    )


def _fixed(model: Modelled, at: MeasuredDofs) -> np.ndarray:
    """True for each dof that a support holds (n,)."""
    return np.asarray(abs(at.rows(model.structure)).sum(axis=1) == 0)


def _would(ways: Sequence[str], of_sensors: Sequence[str] = ()) -> str:
    """The directions that would respond."""
    said = f"along {' or '.join(ways)} it would" if ways else "no other direction would"
    if of_sensors:
        said += f", or with sensors along {' or '.join(of_sensors)}"
    return f"{said}; "


def _listed(what: str, labels: Sequence[str]) -> str:
    return f"{what}{'s' * (len(labels) > 1)} {named(labels, 3)}"


def _along(at: MeasuredDofs, n: np.ndarray) -> MeasuredDofs:
    """These places along another direction n (3,)."""
    return replace(at, directions=np.tile(n, (len(at.labels), 1)))


def _silent(model: Modelled, one: MeasuredDofs, other: MeasuredDofs) -> np.ndarray:
    """True for pairs (n_one, n_other) without any response, by the modes and statically.

    A response is compared with those of the two points to themselves along their best axes.
    """
    built, f, phi = model.structure, model.modes.frequency, model.modes.shapes
    top = max(float(f[-1]), 1e-3)
    s = 2 * np.pi * np.geomspace(0.01 * top, top, LINES) * (DAMPING + 1j)
    d = 1 / (s[:, None] ** 2 + (2 * np.pi * f) ** 2)
    a, b = (at.rows(built) @ phi for at in (one, other))
    own = [
        np.max([np.abs((_along(at, n).rows(built) @ phi) ** 2 @ d.T).max(axis=1) for _, n in AXES],
               axis=0)
        for at in (one, other)
    ]  # fmt: skip
    H = np.abs(np.einsum("or,kr,ir->koi", a, d, b, optimize=True)).max(axis=0)
    silent = H <= NOTHING * np.sqrt(np.outer(*own))
    if not silent.any():
        return np.asarray(silent)
    every = sp.csr_array(sp.vstack([at.rows(built) for at in (one, other)]))
    flexible = f[f > 0.02 * top]
    hertz = 0.5 * float(flexible[0] if len(flexible) else top)
    S = every @ attachments(shifted(built.system, hertz), every)
    scale, n = np.sqrt(np.diag(S)), len(one.labels)
    return np.asarray(silent & (np.abs(S[:n, n:]) <= NOTHING * np.outer(scale[:n], scale[n:])))
