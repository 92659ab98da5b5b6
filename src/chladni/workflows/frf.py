"""Frequency responses: of a case's recording, of a deck's own loads, or between given dofs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from ..arguments import checked
from ..case import Case
from ..case.sensor_places import ROLES, placed, sensor_masses, weight_of_sensors
from ..dofs import label, parse
from ..dynamics.frf import FRF
from ..errors import FileError, LabelError, ShapeError
from ..fem.base_motion import base_motion
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import Modelled, modelled
from ..io.tables.sensor_table import exciter, read_layout
from ..model.analysis import Analysis, Subcase
from ..model.point_masses import with_masses
from ..parallel import one_blas_thread
from ..progress import Progress, silent
from ..results import Result
from ..units import Units
from .case_model import REACH, model_frf, receptances
from .given_case import Source
from .loaded_model import DeckModels, Model, as_model, opened, similar_names

Side = Sequence[str] | MeasuredDofs  # outputs, or inputs
MOST_DOFS, MOST_NAMED = 1200, 12  # dofs a deck may ask for; loaded ones taken in their stead


@dataclass(frozen=True, eq=False, repr=False)
class FrequencyResponses(Result):
    """Responses, one FRF for each set of frequencies, with notes on the computation."""

    frfs: tuple[FRF, ...]
    notes: tuple[str, ...] = ()


@checked
@one_blas_thread()
def frf(
    source: Source,
    outputs: str | Side = (),
    inputs: str | Side = (),
    frequency: np.ndarray | None = None,
    damping: float = 0.01,
    *,
    units: str | Units | None = None,
    progress: Progress = silent,
) -> FrequencyResponses:
    """Compute frequency responses of a model.

    Parameters
    ----------
    source : a case (lines and places of its recording), a deck (its own loads), a model, an
        Assembly, or the path of a case or deck
    outputs, inputs : labels as 55:+Z, 12:n or base:+Z, or places as ``placed_layout`` makes them;
        without inputs those of the source
    frequency : (n_f,) [Hz]     with inputs
    damping : ratio of every mode, where the case gives none
    units : of a deck given by its path

    Raises
    ------
    FileError
        If the places of excitation or response are missing.
    """
    to: Side = (outputs,) if isinstance(outputs, str) else outputs
    by: Side = (inputs,) if isinstance(inputs, str) else inputs
    if damping < 0:
        raise LabelError(f"damping = {damping:g}; a ratio is 0 or more")
    if frequency is not None:
        lines = np.asarray(frequency, float)
        if lines.ndim != 1 or not len(lines) or not (np.isfinite(lines) & (lines >= 0)).all():
            raise ShapeError(
                "argument frequency takes a list of one or more frequencies [Hz], 0 or more"
            )
        frequency = lines
    found_in = opened(source, units)
    found = _responses(found_in, to, by, frequency, damping, progress)
    return replace(found, origin=found_in)


def _responses(
    source: Case | Model | DeckModels, outputs: Side, inputs: Side,
    frequency: np.ndarray | None, damping: float, progress: Progress,
) -> FrequencyResponses:  # fmt: skip
    if _labels(inputs):
        if frequency is None or not _labels(outputs):
            raise FileError("--input needs at least one --output, as --output 55:+Z")
        model = as_model(source, "frf")
        refuse_unknown(model, outputs, inputs)
        progress("modes", 0.2)
        made = model.solved(REACH * float(frequency[-1]))
        progress("residual of higher modes", 0.6)
        one = superposed(model, made, outputs, inputs, frequency, damping)
        note = (
            f"{len(made.modes)} modes up to {made.band:.4g} Hz were superposed with damping ratio "
            f"{damping:.4g}; the contribution of higher modes was added as a static residual."
        )
        return FrequencyResponses((one,), (*model.notes, note))
    if isinstance(source, Case):
        return _of_recording(source, damping, progress)
    if isinstance(source, DeckModels):
        return _of_deck(source, _labels(outputs), progress)
    raise FileError(f"{source.source}: give --input and --output, as --input 12:+Z")


def _of_recording(case: Case, damping: float, progress: Progress) -> FrequencyResponses:
    """Compute the model's responses on lines, labels and quantity of a case's first recording."""
    if not case.frfs:
        raise FileError(f"{case.path} has no FRF; give --input and --output, as --input 12:+Z")
    test = case.frfs[0]
    test = test.sel(band=(max(float(test.frequency[0]), 1e-6), float(test.frequency[-1])))
    ratio = case.damping or damping
    note = f"Lines and places come from the recording; every mode has {ratio:.2g}."
    progress("modes", 0.2)
    model = modelled(case.tested(case.assembly), REACH * float(test.frequency[-1]))
    return FrequencyResponses((model_frf(case, model, ratio, test),), (note, *case.said("frf")))


def _labels(side: Side) -> tuple[str, ...]:
    return side.labels if isinstance(side, MeasuredDofs) else tuple(side)


def placed_layout(
    model: Model, path: Path, driven: Sequence[str] = ()
) -> tuple[Model, MeasuredDofs, MeasuredDofs]:
    """Return the model with the masses of a layout's sensors, and its :func:`layout_places`."""
    outputs, inputs = layout_places(model, path, driven)
    if driven:
        said = f"Driven at {', '.join(driven)} (--input); the sensors are those of {path.name}."
        model = replace(model, notes=(*model.notes, said))
    if not (masses := sensor_masses(model.assembly, outputs, inputs)):
        return model, outputs, inputs
    grids, m = zip(*masses, strict=True)
    said = f"{weight_of_sensors(model.assembly, outputs, inputs, path.name)}."
    loaded = with_masses(model.assembly, grids, np.array(m))
    return replace(model, assembly=loaded, notes=(*model.notes, said)), outputs, inputs


def layout_places(
    model: Model, path: Path, driven: Sequence[str] = ()
) -> tuple[MeasuredDofs, MeasuredDofs]:
    """Place the outputs and inputs of a layout on a model.

    Parameters
    ----------
    path : a table of sensors, or ``plan.json``
    driven : labels as 12:+Z, 12:n or base:+Z in place of its inputs
    """
    if not path.is_file():
        raise FileError(f"no file {path}{similar_names(path)}")
    sensors = read_layout(path, [exciter(label, "--input") for label in driven])
    outputs, inputs = (
        placed(
            model.assembly,
            [s for s in sensors if s.role == role],
            "--input" if driven and role == "input" else path.name,
        )
        for role in ROLES
    )
    if outputs.base.any():
        raise FileError(f"{path}: the base is the input of a shaker table, not a sensor")
    return outputs, inputs


def refuse_unknown(model: Model, outputs: Side, inputs: Side) -> None:
    """Refuse ends the model does not have, and a moving base together with other inputs."""
    bases = [text for text in _labels(inputs) if text.startswith("base:")]
    if bases and len(_labels(inputs)) > 1:
        raise FileError(f"--input {bases[0]} moves all supports, so it must be the only input")
    for side in (outputs,) if bases else (outputs, inputs):
        if not isinstance(side, MeasuredDofs):
            model.directions(side)


def superposed(
    model: Model, made: Modelled, outputs: Side, inputs: Side,
    frequency: np.ndarray, damping: float,
) -> FRF:  # fmt: skip
    """Superpose solved modes, up to ``REACH`` times the band, and the static rest of the others.

    Where the base moves: acceleration per acceleration of all supports (transmissibility).
    """
    s, names = made.structure, (_labels(outputs), _labels(inputs))
    pick = outputs.rows(s) if isinstance(outputs, MeasuredDofs) else model.directions(outputs)
    if (b := _ways_of_base(inputs)) is None:
        load = inputs.rows(s) if isinstance(inputs, MeasuredDofs) else model.directions(inputs)
        return FRF(receptances(made, damping, pick, load, frequency), frequency, *names)
    base = base_motion(s, b)
    if isinstance(outputs, MeasuredDofs):
        moved = outputs.directions @ b.T
    else:
        moved = model.directions(outputs, free=False) @ base.whole
    load = sp.csr_array(-base.force.T)
    H = receptances(made, damping, pick, load, frequency)
    values = moved - (2 * np.pi * frequency)[:, None, None] ** 2 * H
    return FRF(values, frequency, *names, "transmissibility")


def _ways_of_base(inputs: Side) -> np.ndarray | None:
    """Directions (k, 3) in which the inputs move all supports; None where they are forces."""
    if isinstance(inputs, MeasuredDofs):
        return inputs.directions if inputs.base.any() else None
    if not inputs[0].startswith("base:"):
        return None
    try:
        _, axis, sign = parse(inputs[0].replace("base:", "0:"))
    except LabelError:
        axis = 0
    if not 1 <= axis <= 3:
        raise LabelError(f"--input {inputs[0]}: write base:+X, base:+Y or base:+Z")
    return sign * np.eye(3)[[axis - 1]]


def _of_deck(models: DeckModels, outputs: Sequence[str], progress: Progress) -> FrequencyResponses:
    """Compute displacements under the deck's own dynamic loads, one column for each subcase.

    Subcases at other frequencies form a separate FRF.
    """
    requests = models.analysis
    cases = [c for c in requests.subcases if c.dload and c.frequency]
    if not cases:
        raise FileError(
            f"{models.source} requests no frequency response; give --input and --output"
        )
    first = models.model(cases[0].id)
    labels, notes = list(outputs), list(dict.fromkeys((*first.notes, *requests.notes)))
    if not labels:
        labels, said = _wanted(first, requests, cases)
        notes = [*said, *notes]
    notes.append(
        "Each input is a subcase with all loads of the deck: values are motion, not motion per "
        "unit force."
    )
    if requests.solution == 111 and not any(c.residual for c in cases):
        notes.append(
            "Modes beyond those of METHOD are missing, as in Nastran without RESVEC; RESVEC = YES "
            "in the case control adds residual vectors."
        )
    columns = _columns(models, first, cases, labels, progress)
    return FrequencyResponses(tuple(_gathered(labels, cases, columns)), tuple(notes))


def _columns(
    models: DeckModels,
    first: Model,
    cases: Sequence[Subcase],
    labels: Sequence[str],
    progress: Progress,
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return (frequencies, displacements) of every subcase; the first model is already built."""
    from ..fem.deck_response import response

    ends = [parse(text) for text in labels]
    dofs, signs = np.array([(point, c) for point, c, _ in ends]), [sign for *_, sign in ends]
    built = {(cases[0].spc, cases[0].mpc): first}
    out = []
    for k, case in enumerate(cases):
        progress(f"subcase {case.id}", 0.2 + 0.6 * k / len(cases))
        held = (case.spc, case.mpc)
        if held not in built:
            built[held] = models.model(case.id)
        f, u = response(built[held].structure, models.analysis, case, dofs)
        out.append((f, u * signs))
    return out


def _gathered(
    labels: Sequence[str], cases: Sequence[Subcase], columns: list[tuple[np.ndarray, np.ndarray]]
) -> list[FRF]:
    """Gather subcases at the same frequencies into one FRF."""
    groups: dict[bytes, list[int]] = {}
    for k, (f, _) in enumerate(columns):
        groups.setdefault(f.tobytes(), []).append(k)
    return [
        FRF(
            np.stack([columns[k][1] for k in group], axis=2),
            columns[group[0]][0],
            tuple(labels),
            tuple(f"subcase {cases[k].id}" for k in group),
        )
        for group in groups.values()
    ]


def _wanted(
    model: Model, requests: Analysis, cases: Sequence[Subcase]
) -> tuple[list[str], list[str]]:
    """Return the dofs that the case control requests; the loaded ones for none or all."""
    ids = model.assembly.ids
    runs = [run for case in cases for run in case.outputs]
    named = np.zeros(len(ids), bool)
    for first, last in runs:
        named |= (ids >= first) & (ids <= last)
    if not named.any():
        return _loaded(model, requests), []
    if 6 * named.sum() > MOST_DOFS:
        note = (
            f"The deck requests the motion of {named.sum()} points; only the loaded ones were "
            "calculated. Use --output for others."
        )
        return _loaded(model, requests), [note]
    scalar = model.assembly.scalar_points
    alone = np.zeros(len(ids), bool) if scalar is None else np.asarray(scalar, bool)
    found = np.flatnonzero(named)
    return [label(int(ids[k]), c) for k in found for c in range(1, 2 if alone[k] else 7)], []


def _loaded(model: Model, requests: Analysis) -> list[str]:
    """Return the loaded degrees of freedom, used when none is requested."""
    ends = {
        (int(model.assembly.ids[row]), int(c))
        for loads in requests.dynamic.values()
        for load in loads
        for row, c in zip(load.rows, load.components, strict=True)
    }
    return [label(point, c) for point, c in sorted(ends)[:MOST_NAMED]]
