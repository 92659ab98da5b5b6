"""``chladni frf``: frequency response functions of a deck or case."""

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, cast

import numpy as np
import scipy.sparse as sp
import typer

from ..case import Case, load_case
from ..dofs import label, parse
from ..dynamics.coupled import coupled_receptance
from ..dynamics.frf import FRF, UNIT, Quantity, residual_flexibility
from ..dynamics.modes import ModalModel
from ..errors import FileError, LabelError
from ..io.tables.write_tables import write_npz
from ..model.analysis import Analysis, Subcase
from ..model.assembly import Assembly
from ..report.blocks import Picture, Table
from ..report.words import number
from ..workflows.case_model import model_frf
from ..workflows.loaded_model import DeckModels, Model, is_case, load_deck, load_model
from .run import Allow, Out, Run, Units, started

_MOTION = {"receptance": "m", "mobility": "m/s", "accelerance": "m/s²"}  # under a deck's own loads
REACH = 3.0  # times the band: the two-term residual is then right to (1/3)⁴ of itself
_SHOWN, _MOST = 12, 1200  # pictures; dofs a deck may ask for at once


def run(
    source: Annotated[Path, typer.Argument(metavar="DECK_or_CASE")],
    input: Annotated[
        list[str] | None, typer.Option("--input", help="Where it is driven: 12:+Z, 12:n, base:+Z.")
    ] = None,
    output: Annotated[
        list[str] | None, typer.Option("--output", help="Where it answers: 55:+Z, 55:n.")
    ] = None,
    band: Annotated[str, typer.Option(help="From and to, in Hz.")] = "1:200",
    lines: Annotated[int, typer.Option(help="How many frequencies.", min=2)] = 800,
    damping: Annotated[float, typer.Option(help="Damping ratio of every mode.", min=0)] = 0.01,
    quantity: Annotated[
        str, typer.Option(help="receptance, mobility or accelerance.")
    ] = "accelerance",
    units: Units = None,
    allow: Allow = None,
    out: Out = None,
) -> None:
    """Frequency responses between degrees of freedom.

    Without --input those the deck asks for, or of a case those its first recording holds.
    """
    low, high = limits(band)
    if quantity not in UNIT:
        raise LabelError(f"no quantity {quantity!r}; there are {', '.join(UNIT)}")
    with started("frf", source, out) as job:
        job.progress("reading the model", 0.0)
        if not input and is_case(source):
            found = [of_case(job, source, damping)]
        elif not input:
            found = of_deck(job, source, units, allow or [], output or [])
        else:
            model, frequency = load_model(source, units, allow or ()), np.linspace(low, high, lines)
            found = [response(job, model, _asked(output), input, frequency, damping)]
        for k, one in enumerate(found):
            if one.quantity != "transmissibility":
                one = one.to(cast(Quantity, quantity))
            name = f"frf_{k + 1}.npz" if k else "frf.npz"
            write_npz(job.keep(name, "the responses as arrays"), one)
            _page(job, one)


def _asked(output: list[str] | None) -> list[str]:
    if not output:
        raise FileError("--input needs at least one --output, as --output 55:+Z")
    return output


def limits(text: str) -> tuple[float, float]:
    """A band as two numbers [Hz].

    >>> limits("20:200")
    (20.0, 200.0)
    """
    try:
        low, high = (float(x) for x in text.replace(",", ":").split(":"))
    except ValueError:
        raise FileError(f"--band {text!r} is not of the form 20:200") from None
    if not 0 <= low < high:
        raise FileError(f"--band {text!r} must increase and not be negative")
    return low, high


def response(
    job: Run,
    model: Model,
    outputs: Sequence[str],
    inputs: Sequence[str],
    frequency: np.ndarray,
    damping: float,
) -> FRF:
    """Receptance by modes up to three times the band and the static rest of the others."""
    if bases := [text for text in inputs if text.startswith("base:")]:
        return _from_base(job, model, outputs, bases, list(inputs), frequency, damping)
    s = model.structure
    pick, load = (model.directions(labels).T.toarray() for labels in (outputs, inputs))
    modal = _modes(job, model, frequency[-1], damping)
    rest = residual_flexibility(s.system, modal, pick, load, points=model.places)
    phi_o, phi_i = pick.T @ modal.shapes, load.T @ modal.shapes
    loss = sp.csr_array(s.hysteretic().K.imag)
    H = coupled_receptance(modal, phi_o, phi_i, frequency, V=s.system.V, loss=loss, residual=rest)
    return FRF(H, frequency, tuple(outputs), tuple(inputs))


def _modes(job: Run, model: Model, top: float, damping: float) -> ModalModel:
    from ..dynamics.eigen import normal_modes

    s, limit = model.structure, REACH * top
    job.progress(f"modes of {len(s.system.dofs)} degrees of freedom", 0.2)
    modal = normal_modes(s.system, band=limit, points=model.places)
    if not len(modal):
        modal = normal_modes(s.system, 1, points=model.places)
    job.progress("residual of higher modes", 0.6)
    job.notes.append(
        f"{len(modal)} modes up to {number(limit)} Hz were superposed with damping ratio "
        f"{number(damping)}; what higher modes contribute was added as a static residual."
    )
    return modal.with_damping(damping)


def _from_base(
    job: Run,
    model: Model,
    outputs: Sequence[str],
    bases: list[str],
    inputs: list[str],
    frequency: np.ndarray,
    damping: float,
) -> FRF:
    """Acceleration per acceleration of all supports (transmissibility)."""
    from ..fem.solve import base_response, inertia_load

    if len(inputs) > 1:
        raise FileError(f"--input {bases[0]} moves all supports and stands alone, not with others")
    _, axis, sign = parse(bases[0].replace("base:", "0:"))
    ends = [parse(text) for text in outputs]
    dofs, s = np.array([(point, c) for point, c, _ in ends]), model.structure
    load = s.T.T @ inertia_load(model.assembly, -np.eye(3)[:, axis - 1 : axis])
    modal, pick = _modes(job, model, frequency[-1], damping), s.rows(dofs).T.toarray()
    rest = residual_flexibility(s.system, modal, pick, load, points=model.places)
    found = base_response(s, modal, axis, frequency, dofs, residual=rest)
    signs = sign * np.array([c for _, _, c in ends])
    return replace(
        found,
        values=found.values * signs[:, None],
        outputs=tuple(outputs),
        inputs=tuple(inputs),
    )


def of_case(job: Run, source: Path, damping: float) -> FRF:
    """The model's responses on the lines, labels and quantity of a case's first recording."""
    case = load_case(source)
    if not case.frfs:
        raise FileError(f"{source} holds no FRF; give --input and --output, as --input 12:+Z")
    test = case.frfs[0]
    test = test.sel(band=(max(float(test.frequency[0]), 1e-6), float(test.frequency[-1])))
    ratio = case.damping or damping
    job.notes.append(f"Lines and places are those of the recording; every mode has {ratio:.2g}.")
    job.progress("modes", 0.2)
    return modelled(case, case.assembly, test, ratio)


def modelled(case: Case, made: Assembly, test: FRF, damping: float) -> FRF:
    """Responses of an assembly at the places of a case, on the lines of a recording."""
    from ..dynamics.eigen import normal_modes

    model = Model(case.path, made)
    top = REACH * float(test.frequency[-1])
    modal = normal_modes(model.structure.system, band=top, points=model.places)
    return model_frf(case, model, modal.with_damping(damping), test)


def of_deck(
    job: Run, source: Path, units: str | None, allow: Sequence[str], outputs: Sequence[str]
) -> list[FRF]:
    """Displacements under the deck's own dynamic loads, one column a subcase.

    Subcases at other frequencies stand in an FRF of their own.

    Raises
    ------
    FileError
        If the deck asks for no frequency response.
    """
    models = load_deck(source, units, allow)
    asked = models.analysis
    cases = [c for c in asked.subcases if c.dload and c.frequency]
    if not cases:
        raise FileError(f"{source} asks for no frequency response; give --input and --output")
    labels = list(outputs) or wanted(models.model(cases[0].id), asked, cases, job)
    job.notes.extend(asked.notes)
    job.notes.append(
        "Each input is a subcase with all its loads, as the deck gives them: values are motion, "
        "not motion per unit force."
    )
    if asked.solution == 111 and not any(c.residual for c in cases):
        job.notes.append(
            "Modes beyond those of METHOD are missing, as in Nastran without RESVEC; RESVEC = YES "
            "in the case control adds residual vectors."
        )
    return _gathered(labels, cases, _columns(job, models, cases, labels))


def _columns(
    job: Run, models: DeckModels, cases: Sequence[Subcase], labels: Sequence[str]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """(frequencies, displacements) of every subcase, each under its own supports."""
    from ..fem.deck_response import response as answer

    ends = [parse(text) for text in labels]
    dofs, signs = np.array([(point, c) for point, c, _ in ends]), [sign for *_, sign in ends]
    built: dict[tuple[int, int], Model] = {}
    out = []
    for k, case in enumerate(cases):
        job.progress(f"subcase {case.id}", 0.2 + 0.6 * k / len(cases))
        held = (case.spc, case.mpc)
        if held not in built:
            built[held] = models.model(case.id)
        f, u = answer(built[held].structure, models.analysis, case, dofs)
        out.append((f, u * signs))
    return out


def _gathered(
    labels: Sequence[str], cases: Sequence[Subcase], columns: list[tuple[np.ndarray, np.ndarray]]
) -> list[FRF]:
    """Subcases at the same frequencies side by side."""
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


def wanted(model: Model, asked: Analysis, cases: Sequence[Subcase], job: Run) -> list[str]:
    """Dofs whose motion the case control asks for; the loaded ones where it names none or all."""
    ids = model.assembly.ids
    runs = [run for case in cases for run in case.outputs]
    named = np.zeros(len(ids), bool)
    for first, last in runs:
        named |= (ids >= first) & (ids <= last)
    if not named.any() or 6 * named.sum() > _MOST:
        if named.any():
            job.notes.append(
                f"The deck asks for the motion of {named.sum()} points; of so many only the "
                "loaded ones were taken, others with --output."
            )
        return _loaded(model, asked)
    scalar = model.assembly.scalar_points
    alone = np.zeros(len(ids), bool) if scalar is None else np.asarray(scalar, bool)
    return [
        label(int(ids[k]), c) for k in np.flatnonzero(named) for c in range(1, 2 if alone[k] else 7)
    ]


def _loaded(model: Model, asked: Analysis) -> list[str]:
    """The loaded degrees of freedom, for want of a wish."""
    ends = {
        (int(model.assembly.ids[row]), int(c))
        for loads in asked.dynamic.values()
        for load in loads
        for row, c in zip(load.rows, load.components, strict=True)
    }
    return [label(point, c) for point, c in sorted(ends)[:_SHOWN]]


def _page(job: Run, found: FRF) -> None:
    from ..view import plots

    unit = (_MOTION if found.inputs[0].startswith("subcase") else UNIT).get(found.quantity, "")
    peak = np.abs(found.values).max(axis=0)
    at = found.frequency[np.abs(found.values).argmax(axis=0)]
    count = max(1, _SHOWN // len(found.inputs))
    shown = sorted(np.argsort(-peak.max(axis=1), kind="stable")[:count].tolist())
    pictures = []
    for j, drive in enumerate(found.inputs):
        for i in (i for i in shown if peak[i, j] > 0):
            answer = found.outputs[i]
            name = re.sub(r"[^A-Za-z0-9]+", "_", f"frf_{answer}_from_{drive}".replace("-", "m"))
            title, curve = f"{answer} from {drive}", (found.frequency, found.values[:, i, j])
            path = job.keep(f"{name}.png", title)
            plots.frf(path, {"model": curve}, title, unit)
            pictures.append(Picture(path))
    rows = [
        (found.outputs[i], drive, number(peak[i, j]), number(at[i, j]))
        for i in shown
        for j, drive in enumerate(found.inputs)
    ]
    if len(found.outputs) > len(shown):
        job.notes.append(
            f"The {len(shown)} outputs that move most are shown; all {len(found.outputs)} are in "
            "the arrays."
        )
    heads = ("output", "input", f"largest [{unit}]" if unit else "largest", "at [Hz]")
    f, count = found.frequency, len(found.outputs) * len(found.inputs)
    job.lead = f"{count} {found.quantity} functions from {number(f[0])} to {number(f[-1])} Hz."
    job.section("Responses", [*pictures, Table(heads, rows, ("output", "input"))])
    job.say(job.lead)
