"""Errors of labels and places: outputs exchanged, forces elsewhere, the deck mirrored."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import product

import numpy as np

from ..ema.finding import Finding
from ..errors import named as listed
from ..fem.locate import rows_of
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import Modelled, node_points
from ..geometry.sampling import farthest_point_sample
from .smoothed_responses import (
    CHANCE,
    EXPLAINED,
    Hypothesis,
    Smoothed,
    against,
    level_free,
    log10_of,
    mean_squares,
)

PLACES = 400  # where the force may act
TRIED = 12  # places of another force whose level is found again
MOVED = 0.02  # of the structure: places nearer than that to their mirror images are the same
OFF = 0.05  # of the structure: mirror images farther from every grid are off it


def relabelled(seen: Smoothed) -> list[Hypothesis]:
    """The outputs under each other's labels, as many as it takes; of two, shapes tell better."""
    from scipy.optimize import linear_sum_assignment

    labels, (declared, _) = seen.reading.outputs.labels, seen.as_declared
    itself = np.arange(len(labels))

    def exchanged(H: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
        log_H = level_free(H)
        apart = np.stack(
            [mean_squares(log_H - seen.log_test[:, [k]]).mean(axis=1) for k in range(len(labels))]
        )  # (output as labelled, place in the model)
        _, place = linear_sum_assignment(apart)
        return float(np.median(apart[itself, place])), place, apart

    Q, place, apart = min(map(exchanged, seen.answers()), key=lambda found: found[0])
    moved = np.flatnonzero(place != itself)
    if len(moved) == 2:
        return _exchanged(apart[itself, itself], apart[itself, place], moved, labels)
    if not len(moved):
        return []
    rows = [f"{labels[k]} that of {labels[place[k]]}" for k in moved]
    text = (
        f"{len(moved)} of {len(labels)} outputs have exchanged labels: after the exchange "
        + against(Q, declared)
    )
    mend = f"in sensors.csv give each the grid and direction of the other: {listed(rows, 6)}"
    channels = tuple(labels[k] for k in moved)
    return [Hypothesis(Q, declared, Finding("permuted labels", text, "fault", channels, mend))]


def _exchanged(
    before: np.ndarray, after: np.ndarray, pair: np.ndarray, labels: tuple[str, ...]
) -> list[Hypothesis]:
    """Two outputs under each other's label; Q is the mean over outputs, before and after (n,)."""
    if before[pair].mean() < EXPLAINED * CHANCE:
        return []
    Q, declared = float(after.mean()), float(before.mean())
    names = tuple(labels[k] for k in pair)
    text = f"outputs {names[0]} and {names[1]} are exchanged: after the exchange mean " + against(
        Q, declared
    )
    mend = f"in sensors.csv exchange the labels {names[0]} and {names[1]}"
    found = Finding("swapped channels", text, "fault", names, mend, mend=("exchanged", *names))
    return [Hypothesis(Q, declared, found, "mean")]


def _drives(model: Modelled, way: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Grids (k,) spread over a structure, their points, their shapes (k, r) along a direction."""
    built, points = model.structure, node_points(model.structure)
    pick = farthest_point_sample(points, min(PLACES, len(points)))
    grids, at = built.system.dofs[pick, 0], points[pick]
    return grids, at, rows_of(built, grids, at, np.tile(way, (len(pick), 1))) @ model.modes.shapes


def driven_elsewhere(seen: Smoothed) -> list[Hypothesis]:
    """Each force at other grids, along the direction it is said to have."""
    inputs, out = seen.reading.inputs, list[Hypothesis]()
    if inputs.base.any():
        return out
    for j, label in enumerate(inputs.labels):
        one = slice(j, j + 1)
        grids, at, drive = _drives(seen.reading.model, inputs.directions[j])
        declared = min(seen.score(H[:, :, one], one) for H in seen.answers())
        Q = np.full(len(grids), np.inf)
        for H in seen.answers(drive=drive):
            log_H = log10_of(H)
            log_H = log_H - np.median(log_H.real, axis=(0, 1))
            Q = np.minimum(Q, np.median(mean_squares(log_H - seen.log_test[:, :, one]), axis=0))
        k = int(Q.argmin())
        off = float(np.linalg.norm(at[k] - inputs.points[j]))
        text = (
            f"the force {label} acts near grid {grids[k]}, {off:.3g} m from the declared place: "
            f"there {against(Q[k], declared)}"
        )
        mend = f"in sensors.csv give input {label} the grid {grids[k]}, or its true place"
        found = Finding("misplaced force", text, "fault", (label,), mend, float(grids[k]))
        out.append(Hypothesis(float(Q[k]), declared, found))
    return out


def two_forces(seen: Smoothed) -> list[Hypothesis]:
    """Some outputs under the declared force, the others under one at another grid.

    Q is the mean over outputs here: their median does not see fewer than half of them. The outputs
    of the other force are unlike the model as declared (``EXPLAINED`` of ``CHANCE``).
    """
    inputs = seen.reading.inputs
    if inputs.base.any():
        return []
    return [h for j in range(len(inputs.labels)) for h in _two_forces(seen, j)]


def _two_forces(seen: Smoothed, j: int) -> Iterator[Hypothesis]:
    outputs, inputs = seen.reading.outputs, seen.reading.inputs
    grids, _, drive = _drives(seen.reading.model, inputs.directions[j])
    declared, best = np.inf, np.inf
    split = 0, np.zeros(0), np.zeros(0)
    for H, others in zip(seen.answers(), seen.answers(drive=drive), strict=True):
        level = np.median(log10_of(H).real)
        of_own = log10_of(H[:, :, [j]]) - level - seen.log_test[:, :, [j]]  # (n_s, n_out, 1)
        of_other = log10_of(others) - level - seen.log_test[:, :, [j]]  # (n_s, n_out, k)
        own, other = mean_squares(of_own)[:, 0], mean_squares(of_other)
        declared = min(declared, float(own.mean()))
        for k in np.argsort(np.minimum(own[:, None], other).mean(axis=0))[:TRIED]:
            both = np.where(other[:, k] < own, of_other[:, :, k], of_own[:, :, 0])
            common = np.median(both.real)  # the level, without what the other force adds to it
            pair = mean_squares(of_own[:, :, 0] - common), mean_squares(of_other[:, :, k] - common)
            Q = float(np.minimum(*pair).mean())
            if Q < best:
                best, split = Q, (int(grids[k]), *pair)
    grid, own, other = split
    moved = other < EXPLAINED * own
    if min(moved.sum(), (~moved).sum()) < 2 or own[moved].mean() < EXPLAINED * CHANCE:
        return
    labels = tuple(label for label, m in zip(outputs.labels, moved, strict=True) if m)
    text = (
        f"{len(labels)} of {len(moved)} outputs ({listed(labels, 6)}) belong to another force "
        f"than {inputs.labels[j]}, one near grid {grid}: mean smoothed Q against the model is then "
        f"{best:.2g}, as declared {declared:.2g}."
    )
    mend = "give the outputs of each force a recording, or an input, of their own"
    found = Finding("two forces mixed", text, "fault", labels, mend, float(grid))
    yield Hypothesis(best, declared, found, "mean")


def mirrored(seen: Smoothed) -> list[Hypothesis]:
    """Sensors and forces at the mirror images of their places, about the middle or through zero.

    Several images fit equally well on a symmetric structure: that of the fewest axes is taken.
    """
    reading, (declared, _) = seen.reading, seen.as_declared
    points = reading.model.structure.assembly.points
    centres = (points.min(axis=0) + points.max(axis=0)) / 2, np.zeros(3)
    found = list[tuple[float, int, str]]()
    for signs, middle in product(product((1, -1), repeat=3), centres):
        turn = np.array(signs)
        outputs, inputs = (
            _image(at, turn, middle, reading.model) for at in (reading.outputs, reading.inputs)
        )
        if outputs is None or inputs is None:
            continue
        if (read := replace(reading, outputs=outputs, inputs=inputs).smoothed()) is None:
            continue
        Q = round(min(map(read.score, read.answers())), 4)
        axes = " and ".join(axis for axis, sign in zip("XYZ", signs, strict=True) if sign < 0)
        found.append((Q, len(axes), axes))
    if not found:
        return []
    Q, _, axes = min(found)
    text = (
        f"deck and sensors are mirrored against each other along {axes}: with sensors and force at "
        f"the mirror images of their places {against(Q, declared)}"
    )
    mend = f"reverse {axes} of all places in sensors.csv, or of all grids in the deck"
    return [Hypothesis(Q, declared, Finding("mirrored deck", text, "fault", (), mend))]


def _image(
    at: MeasuredDofs, turn: np.ndarray, middle: np.ndarray, model: Modelled
) -> MeasuredDofs | None:
    """Dofs at the grids nearest to their mirror images; None off the structure, or unmoved."""
    made = model.structure.assembly
    if at.base.any():
        return None
    size = float(np.linalg.norm(np.ptp(made.points, axis=0)))
    images = middle + turn * (at.points - middle)
    if np.linalg.norm(images - at.points, axis=1).max() < MOVED * size:
        return None
    from scipy.spatial import cKDTree

    apart, near = cKDTree(made.points).query(images)
    if apart.max() > OFF * size:
        return None
    return replace(
        at, grids=made.ids[near], points=made.points[near], directions=turn * at.directions
    )
