"""A recording screened against a model: level, quantity, and every channel by the mode shapes."""

from dataclasses import replace

import numpy as np

from ..dynamics.modes import ModalModel, rigid_modes
from ..ema.chain_checks import level_checks, modal_gains
from ..ema.channel_checks import left_out
from ..ema.finding import Check, Finding, Screening
from ..ema.identification import Identified
from ..ema.recording_screening import other_readings, strong_modes
from ..ema.shape_faults import LEAST_CHANNELS, LEAST_MODES, ModelShapes, shape_faults
from ..ema.shapes import real_shapes
from ..fem.assemble import Structure
from ..fem.locate import rows_of
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import Modelled
from ..geometry.grid_normals import grid_normals
from ..geometry.sampling import farthest_point_sample
from .chain_hypotheses import NOTHING_FITS, chain_faults
from .smoothed_responses import Reading

ACROSS = 0.9  # cosine to the normal: a sensor is glued flat on its sheet
AWAY = 0.12  # of the structure: a patch that the model lacks bends shapes as a shorter move would
PLACES = 400  # of the shells where a misplaced sensor may sit
EQUAL_LINES, EQUAL_DAMPING = 200, 0.02  # of the model's responses at two channels that are equal
UNLIKE = 0.3  # 1: nothing in common; the recorded difference below this share of the model's
FAR_BELOW = 1.5  # times: a deck that is so much too stiff has E more than twice too large
REACH = 1.3  # times the band: modes of the model that may mix with those of the test


def against_model(
    before: Screening, reading: Reading, found: Identified | None, gain_known: bool = True
) -> Screening:
    """Screening of level, quantity and every channel, extended by the model.

    First the chain as a whole: one fault of it may explain all other signs.
    Then the shapes, and modal constants by their order of magnitude: frequencies may be off, and
    physics may be missing.

    Parameters
    ----------
    reading : with the model up to ``REACH`` times the band at least
    found : what was identified from it, its outputs in the order of its own; None where nothing
    """
    found_in, check = chain_faults(reading, before.findings)
    faults = [f for f in found_in if f.severity == "fault"]
    if found is not None and not any(f.mend for f in faults):
        alone = other_readings(reading.frf, strong_modes(found), reading.lines)
        if alone and (not faults or alone[0].kind == faults[0].kind):
            found_in = faults = alone
    follows = _FOLLOWS if found_in else _CONFIRMED
    if found_in or any(f.kind in _CONFIRMED for f in before.findings):
        kept = tuple(f for f in before.findings if f.kind not in follows)
        before = replace(before, findings=kept)
    before = before.with_more(found_in, [check])
    if faults or found is None:
        return before
    before = before.with_more(*_supports(strong_modes(found), reading.model))
    return _by_modes(before, found, reading, gain_known)


def _supports(strong: Identified, model: Modelled) -> tuple[list[Finding], list[Check]]:
    """Modes of the test far below the first elastic mode of a deck without supports.

    A free structure has none there. Cords do, and are softer than supports; both are said.
    """
    first, count = first_elastic(model.modes), int(rigid_modes(model.modes).sum())
    if not first or not strong.order:
        return [], []
    low = strong.frequency[strong.frequency < first / FAR_BELOW]
    said = f"{count} motions of the deck are free, {len(low)} modes of the test far below the rest"
    if not len(low):
        return [], [Check("supports", said)]
    text = (
        f"the deck is free to move ({count} motions without stiffness; first elastic mode "
        f"{first:.4g} Hz), but the test has {len(low)} modes below, from {low.min():.4g} Hz: the "
        "article was held, or hangs on stiff cords."
    )
    mend = (
        "check that the case control selects the SPC set of the test, or name the cords' grids "
        "under [test] hangers"
    )
    found = Finding("supports", text, "warning", (), mend, float(len(low)))
    return [found], [Check("supports", said, False)]


def first_elastic(modes: ModalModel) -> float:
    """The first elastic frequency of a deck that is free to move [Hz]; 0 for any other deck."""
    rigid = rigid_modes(modes)
    return float(modes.frequency[~rigid].min()) if rigid.any() and not rigid.all() else 0.0


_CONFIRMED = ("wrong quantity",)  # phases speak for it, and the model says whether it is so
_FOLLOWS = ("wrong quantity", "reversed sign", "not reciprocal", "delay", "equal channels",
            "cut off")  # fmt: skip


def _by_modes(
    before: Screening, found: Identified, reading: Reading, gain_known: bool
) -> Screening:
    """Level, quantity and every channel, by modal constants and shapes."""
    strong, built = strong_modes(found), reading.model.structure
    outputs, inputs = reading.outputs, reading.inputs
    near = _elastic(reading.model, REACH * found.band[1])
    labels = found.outputs
    phi_o = outputs.rows(built) @ near.shapes
    phi_i = inputs.rows(built) @ near.shapes
    before = _agreeing(before, found, phi_o, phi_i, near.frequency)
    if inputs.base.any() or not strong.order or not len(near.frequency):
        why = "the base moves" if inputs.base.any() else "no mode is above the noise"
        return before.with_more([], [Check("channels against the model", why, None)])
    gains, omega = modal_gains(strong, phi_o, phi_i, near.frequency)
    findings, check = level_checks(strong, gains, omega, gain_known, len(phi_o))
    if any(f.kind == NOTHING_FITS for f in before.findings):
        findings = []  # the level of responses that are unlike the model's has no meaning
    bad = {c for f in before.findings for c in f.channels if f.kind in _UNUSABLE}
    keep = np.array([k for k, label in enumerate(labels) if label not in bad], int)
    faults, one = _channels(real_shapes(strong)[keep], strong.frequency, built, near, outputs, keep)
    return before.with_more([*findings, *faults], [check, one])


def shapes_against_model(
    name: str, psi: np.ndarray, frequency: np.ndarray, model: Modelled, outputs: MeasuredDofs
) -> Screening:
    """Screening of every channel of a modal model by its real shapes ψ (n_out, r).

    Its faults are mended in the table of sensors.
    """
    near = _elastic(model, min(REACH * float(frequency.max()), model.band))
    every = np.arange(len(psi))
    faults, check = _channels(psi, frequency, model.structure, near, outputs, every)
    return Screening(name, tuple(replace(f, mend=()) for f in faults), (check,))


def _elastic(model: Modelled, f_max: float) -> ModalModel:
    """Elastic modes of a model up to a frequency [Hz]."""
    f = model.modes.frequency
    elastic = ~rigid_modes(model.modes) & (f <= f_max) & (f > 1e-3 * f_max)
    return model.modes.sel(np.flatnonzero(elastic))


def _channels(
    psi: np.ndarray, frequency: np.ndarray, built: Structure, near: ModalModel,
    outputs: MeasuredDofs, keep: np.ndarray,
) -> tuple[list[Finding], Check]:  # fmt: skip
    """Faults of some channels by their shapes ψ (k, r), and the check."""
    shapes = ModelShapes(
        (outputs.rows(built) @ near.shapes)[keep], near.frequency,
        lambda i: _turned(outputs, int(keep[i]), built, near.shapes),
        lambda i: _elsewhere(outputs, int(keep[i]), built, near.shapes),
    )  # fmt: skip
    kept = tuple(outputs.labels[k] for k in keep)
    faults = [] if outputs.sd.any() else shape_faults(kept, psi, frequency, shapes)
    said = f"{len(kept)} channels, {len(frequency)} modes, {len(near.frequency)} of the model"
    if outputs.sd.any() or len(kept) < LEAST_CHANNELS or len(frequency) < LEAST_MODES:
        why = f"{said}: at least {LEAST_CHANNELS} channels of known places, {LEAST_MODES} modes"
        return faults, Check("channels against the model", why, None)
    return faults, Check("channels against the model", said, not faults)


_UNUSABLE = ("dead channel", "duplicated channels")


def _agreeing(
    before: Screening, found: Identified, phi: np.ndarray, drive: np.ndarray, f: np.ndarray
) -> Screening:
    """Equal channels are no matter where the model's are equal as well, and a fault where not.

    The model has modes f (m,) [Hz], of shapes φ (n, m) at the outputs and (n_in, m) at the inputs.
    """
    labels, omega_r, top = found.outputs, 2 * np.pi * f, 2 * np.pi * found.band[1]
    out = []
    s = 1j * np.linspace(0.1, 1.0, EQUAL_LINES) * top
    h = s[:, None] ** 2 / (s[:, None] ** 2 + 2 * EQUAL_DAMPING * omega_r * s[:, None] + omega_r**2)
    H = np.einsum("nm,fm,im->fni", phi, h, drive)
    for one in before.findings:
        if one.kind != "equal channels":
            out.append(one)
            continue
        a, b = (H[:, labels.index(c)] for c in one.channels)
        apart = float(np.linalg.norm(a - b) / np.maximum(np.linalg.norm([a, b]), 1e-300))
        if apart > UNLIKE and one.value < UNLIKE * apart:
            text = (
                f"outputs {' and '.join(one.channels)} are equal within their noise, but differ by "
                f"{100 * apart:.0f} % in the model: one sensor has two labels."
            )
            mend = left_out(one.channels[1])
            out.append(Finding("duplicated channels", text, "fault", one.channels, mend, one.value))
    return replace(before, findings=tuple(out))


_AXES = ("+X", "+Y", "+Z")


def _turned(
    dofs: MeasuredDofs, i: int, built: Structure, shapes: np.ndarray
) -> tuple[np.ndarray, list[str]]:
    """The place of a channel along either way of every axis that it does not point along."""
    axes = [k for k in range(3) if abs(dofs.directions[i, k]) < 0.9]
    ways = np.array([np.eye(3)[k] for k in axes])
    grids, points = np.repeat(dofs.grids[i], len(axes)), np.tile(dofs.points[i], (len(axes), 1))
    rows = rows_of(built, grids, points, ways) @ shapes
    names = [_AXES[k] for k in axes] + [_AXES[k].replace("+", "-") for k in axes]
    values = np.concatenate([rows, -rows])
    size = np.linalg.norm(values, axis=1)
    seen = size > 0.02 * np.linalg.norm(shapes, axis=0).mean() / np.sqrt(len(shapes))
    return values[seen], [n for n, s in zip(names, seen, strict=True) if s]


def _elsewhere(
    dofs: MeasuredDofs, i: int, built: Structure, shapes: np.ndarray
) -> tuple[np.ndarray, list[str]]:
    """Grids of the shells spread evenly, along the channel's direction or across the shell."""
    made = built.assembly
    if not len(made.shells):
        return np.zeros((0, shapes.shape[1])), []
    rows = np.unique(made.shells.nodes)
    points = made.points[rows]
    pick = farthest_point_sample(points, min(PLACES, len(rows)))
    far = np.linalg.norm(points[pick] - dofs.points[i], axis=1)
    pick = pick[far > AWAY * np.ptp(points, axis=0).max()]
    grids, normals = made.ids[rows[pick]], grid_normals(made, rows[pick])
    own = np.tile(dofs.directions[i], (len(pick), 1))
    other = np.abs((own * normals).sum(axis=1)) < ACROSS
    grids = np.concatenate([grids, *[grids[other]] * 2])
    ways = np.concatenate([own, normals[other], -normals[other]])
    at = np.concatenate([points[pick], *[points[pick][other]] * 2])
    values = rows_of(built, grids, at, ways) @ shapes
    return np.asarray(values), [f"grid {g}" for g in grids]
