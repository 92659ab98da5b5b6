"""Check a case before a long run: what will be used, what not, and what looks wrong."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Unpack

import numpy as np

from ..arguments import checked
from ..case import Case
from ..case.make_case import CaseWords, Measured
from ..case.recordings import DEAD
from ..case.sensor_places import unrecorded_rows
from ..effects.model_errors import ABOVE, mesh_errors
from ..ema.finding import Screening
from ..errors import ChladniError, FileError
from ..fem.energy import mass_properties
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import solved
from ..geometry.nearest import ShellSurface
from ..model.assembly import Assembly
from ..parallel import one_blas_thread
from ..progress import Progress, silent, within
from ..results import Result
from ..search.left_frequencies import OTHERS, SHELLS
from ..search.preparation import ANOTHER_MASS, off_the_scales
from .case_draft import said_of
from .given_case import Source, given_case
from .loaded_model import Model, as_model
from .modes import loose_parts
from .output_only import with_natural_frequencies
from .ready_case import ready, refuse_without_effects
from .screening_of_case import POUND, RecordingAtFault, in_pounds
from .sign_of_gain import with_sign_of_gain
from .silent_channels import without_silent
from .states import each_state
from .unit_check import FAR, refuse_other_units
from .unit_guess import SIZE, guessed_units

COMMANDS = ("correlate", "calibrate", "diagnose", "study")  # the use of words by these is reported
MODES = 12  # of the model that are looked at
OFF_MASS = 0.1  # of the weighed mass: more is no scatter of sheets
OFF_MESH = 0.005  # of the structure's size: a sensor farther from the mesh is worth a look
HANGS = "check the rigid elements, releases and springs there"
TOGETHER = 1e-4  # [m]; two channels nearer than this in one direction are one place


@dataclass(frozen=True)
class CaseFinding:
    """Something that looks wrong; a ``fault`` must be corrected before a fit."""

    text: str
    remedy: str
    fault: bool = False


@dataclass(frozen=True)
class CheckedDof:
    """One row of the table of sensors as it was understood."""

    label: str
    role: str
    place: str  # "grid 412", "on the surface", "the supports"
    point_m: tuple[float, float, float]
    direction: tuple[float, float, float]
    off_mesh_m: float
    mass_kg: float


@dataclass(frozen=True, eq=False, repr=False)
class CaseCheck(Result):
    """Content of a case, as it was understood.

    Attributes
    ----------
    facts : (what, in words)
    frequency : (r,)      lowest elastic modes of the model [Hz]
    dofs : tuple of CheckedDof
    findings : tuple of CaseFinding
    unused : {command: sentences}   words each command does not use, and how the rest is read
    converged : (r,)      these frequencies on an infinitely fine mesh [Hz]; empty: not requested
    """

    facts: tuple[tuple[str, str], ...]
    frequency: np.ndarray
    dofs: tuple[CheckedDof, ...]
    findings: tuple[CaseFinding, ...]
    unused: dict[str, tuple[str, ...]]
    converged: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @property
    def faults(self) -> tuple[CaseFinding, ...]:
        """The findings that must be corrected first."""
        return tuple(f for f in self.findings if f.fault)


@checked
@one_blas_thread()
def check(
    source: Source,
    recording: Measured | Sequence[Measured] = (),
    *,
    mesh: bool = False,
    progress: Progress = silent,
    **words: Unpack[CaseWords],
) -> CaseCheck:
    """Check units, mass, size, places, band and words of a case, with the model's lowest modes.

    Parameters
    ----------
    source, recording, progress, words : as in :func:`chladni.diagnose` (SI, Hz)
    mesh : True compares the modes with those of a mesh twice as fine

    Raises
    ------
    FileError, LabelError, ModelError
        If the case cannot be read at all.
    """
    case = given_case(source, recording, words)
    progress("modes of the model", 0.1)
    model = as_model(case, "modes")
    modal = model.normal_modes(MODES + 6)
    f = modal.frequency
    elastic = f[f > 1e-3 * f[-1]][:MODES]
    converged = np.zeros(0)
    if mesh:
        progress("a mesh twice as fine", 0.3)
        converged = _converged(model, elastic)
    progress("places", 0.7)
    dofs = (*_dofs(case, case.outputs, "output"), *_dofs(case, case.inputs, "input"))
    findings = [
        *_units(case), *_mass(case), *_size(case), *_labels(case), *_places(case, dofs),
        *_band(case, elastic), *_dead(case),
        *_mesh(elastic, converged, bool(len(case.assembly.shells))),
        *(CaseFinding(said, HANGS) for said in loose_parts(model, modal)),
    ]  # fmt: skip
    if not case.recordings:
        findings.append(CaseFinding("there is no recording yet", NO_RECORDING))
    elif not any(f.fault for f in findings):
        more = _asked(case, within(progress, 0.8, 1.0))
        sure = {f.remedy for f in more if f.fault or f.remedy == ANOTHER_MASS}  # no guess any more
        findings = [f for f in findings if f.remedy.partition(", if ")[0] not in sure] + more
    unused = {c: tuple(case.said(c)) for c in COMMANDS}
    return CaseCheck(
        tuple(_facts(case)), elastic, dofs, tuple(findings), unused, converged, origin=case
    )


def _converged(model: Model, elastic: np.ndarray) -> np.ndarray:
    """Elastic frequencies on an infinitely fine mesh (r,); nan where no mesh can be refined."""
    top = float(elastic[-1])
    errors = mesh_errors(solved(model.structure, ABOVE[1] * top), top)
    if not errors:
        return np.full(len(elastic), np.nan)
    return errors[0].limit[: len(elastic)]


def _mesh(elastic: np.ndarray, converged: np.ndarray, shells: bool) -> list[CaseFinding]:
    """Report modes whose error by the mesh alone exceeds that of a careful model."""
    off = 100 * np.abs(np.log(elastic[: len(converged)] / converged))
    most = SHELLS if shells else OTHERS
    wrong = np.flatnonzero(off > most)
    if not len(wrong):
        return []
    said = (
        f"the mesh alone moves {len(wrong)} of {len(off)} modes by more than {most:g} %, the one "
        f"at {elastic[wrong[0]]:.4g} Hz by {off[wrong[0]]:.2g} %"
    )
    return [CaseFinding(said, f"refine the mesh, or trust modes below {elastic[wrong[0]]:.4g} Hz")]


ACROSS = "correct the direction of any that measured across the sheet"
NO_RECORDING = "all commands need one except modes, frf, plan, bench, render and study"
BLOCKS = "nothing can be fitted until this is corrected"


def contents(made: Assembly) -> tuple[tuple[str, str], ...]:
    """Grids and elements of a structure, its size and its mass, in words."""
    count = {
        "shells": len(made.shells), "solids": sum(map(len, made.solids)),
        "beams": len(made.beams), "springs and bushes": len(made.springs) + len(made.bushes),
        "rigid elements": len(made.rigid), "masses": len(made.masses),
    }  # fmt: skip
    held = ", ".join(f"{n} {what}" for what, n in count.items() if n)
    size = " x ".join(f"{x:.3g}" for x in np.ptp(made.points, axis=0))
    return (
        ("holds", f"{len(made.ids)} grids, {held}"),
        ("size", f"{size} m"),
        ("mass", f"{mass_properties(made)[0]:.5g} kg in the deck"),
    )


def _facts(case: Case) -> list[tuple[str, str]]:
    content, size, mass_in_deck = contents(case.assembly)
    mass, weighed = mass_properties(case.assembly)[0], "not weighed"
    if case.setup.mass is not None:
        away = f" ({100 * (case.setup.mass / mass - 1):+.2g} %)" if mass > 0 else ""
        weighed = f"{case.setup.mass:.5g} kg weighed{away}"
    out = [
        ("deck", f"{case.deck.path.name} in {case.units.name}: {content[1]}"),
        size,
        ("mass", f"{mass_in_deck[1]}, {weighed}"),
        *(("recording", said_of(r)) for r in case.recordings),
        *([] if case.recordings else [("recording", f"none yet: {NO_RECORDING}")]),
        ("sensors", f"{_several(case.outputs, 'output')}, {_several(case.inputs, 'input')}"),
    ]
    band = "the whole recording" if case.band is None else "{:g} to {:g} Hz".format(*case.band)
    without = "".join(f", without {a:g} to {b:g} Hz" for a, b in case.exclude)
    out.append(("band", band + without))
    free = ", ".join(p.name for p in case.parameters) or "the default ones: E, t, rho"
    return [*out, ("free", free)]


def _several(at: MeasuredDofs, what: str) -> str:
    return f"{len(at.labels)} {what}" + "s" * (len(at.labels) != 1)


def _dofs(case: Case, at: MeasuredDofs, role: str) -> list[CheckedDof]:
    off = np.zeros(len(at.labels))
    free = np.flatnonzero((at.grids <= 0) & ~at.base)
    surface = ShellSurface.whole(case.assembly)
    if len(free) and len(surface.nodes):
        off[free] = surface.closest_points(at.points[free]).distance
    rows = zip(
        at.labels, at.grids.tolist(), at.points.tolist(), at.directions.tolist(), at.base.tolist(),
        off.tolist(), at.mass.tolist(), strict=True,
    )  # fmt: skip
    return [
        CheckedDof(
            label, role, "the supports" if base else f"grid {grid}" if grid else "on the surface",
            tuple(point), tuple(axis), away, mass,
        )
        for label, grid, point, axis, base, away, mass in rows
    ]  # fmt: skip


def _units(case: Case) -> list[CaseFinding]:
    """Report a unit system that contradicts the weighed mass or the materials."""
    try:
        refuse_other_units(case)
    except FileError as error:
        return [CaseFinding(str(error).partition(": ")[2], BLOCKS, True)]
    try:
        guessed_units(case.assembly, case.deck.path.name, case.units)
    except FileError as error:
        return [CaseFinding(str(error).partition(": ")[2], "check E and rho of the materials")]
    return []


def _dead(case: Case) -> list[CaseFinding]:
    """Report channels without a signal, which were left out."""
    said = [n for r in case.recordings for n in r.notes if n.endswith(DEAD)]
    return [CaseFinding(n, "check its cable; use = no in sensors.csv excludes it") for n in said]


def _mass(case: Case) -> list[CaseFinding]:
    weighed, mass = case.setup.mass, float(mass_properties(case.assembly)[0])
    if weighed is None or mass <= 0 or abs(mass / weighed - 1) <= OFF_MASS:
        return []
    if not 1 / FAR <= mass / weighed <= FAR:  # that is said of its units
        return []
    said = f"the deck weighs {mass:.4g} kg, the article {weighed:.4g} kg"
    if in_pounds(mass, weighed):
        mend = f"in case.toml, [test]: mass = {weighed * POUND:.5g}, if the weight was in pounds"
        return [CaseFinding(said, mend)]
    return [CaseFinding(said, ANOTHER_MASS)]


def _size(case: Case) -> list[CaseFinding]:
    size = float(np.linalg.norm(np.ptp(case.assembly.points, axis=0)))
    if SIZE[0] <= size <= SIZE[1]:
        return []
    return [CaseFinding(f"the deck is {size:.3g} m across", "check its unit of length", True)]


def _labels(case: Case) -> list[CaseFinding]:
    """Report a row of the table that no recording has, where a recorded dof has no row."""
    out, setup = [], case.setup
    sides = ((setup.outputs, case.outputs), (setup.inputs, case.inputs))
    lost = [unrecorded_rows(table, found) for table, found in sides]
    every, unused = sum(s.use for table, _ in sides for s in table), sum(map(len, lost))
    for (table, found), rows in zip(sides, lost, strict=True):
        bare = [label for label in found.labels if label not in {s.label for s in table}]
        if rows and bare:
            said = f"the table of sensors has {rows[0]}, the recording {bare[0]}"
            if unused == every:
                none = f"0 of {every} {'row is' if every == 1 else 'rows are'} used: {said}"
                return [CaseFinding(none, "correct the labels, or leave the table out", True)]
            out.append(CaseFinding(said, "correct the label, else the row is not used"))
    return out


def _places(case: Case, dofs: tuple[CheckedDof, ...]) -> list[CaseFinding]:
    size = float(np.linalg.norm(np.ptp(case.assembly.points, axis=0)))
    out = []
    far = [d for d in dofs if d.off_mesh_m > OFF_MESH * size]
    if far:
        worst = max(far, key=lambda d: d.off_mesh_m)
        said = (
            f"{len(far)} {'place is' if len(far) == 1 else 'places are'} away from the mesh, "
            f"{worst.label} by {1e3 * worst.off_mesh_m:.3g} mm"
        )
        out.append(
            CaseFinding(
                said, "check in the picture that places are in metres and in the deck's axes"
            )
        )
    twice = [
        (a.label, b.label)
        for k, a in enumerate(dofs)
        for b in dofs[:k]
        if a.role == b.role and _same(a, b)
    ]
    if twice:
        said = f"{twice[0][1]} and {twice[0][0]} are one place and one direction"
        more = f" ({len(twice)} such pairs)" if len(twice) > 1 else ""
        out.append(CaseFinding(said + more, "check sensors.csv: one sensor may have two labels"))
    return out


def _same(a: CheckedDof, b: CheckedDof) -> bool:
    near = float(np.linalg.norm(np.subtract(a.point_m, b.point_m))) < TOGETHER
    return near and abs(float(np.dot(a.direction, b.direction))) > 1 - 1e-6


def _asked(case: Case, progress: Progress) -> list[CaseFinding]:
    """Report what diagnose would refuse before its fit, and what its screening finds."""
    out, diagnosing = [], True
    try:
        refuse_without_effects(case)
    except FileError as error:
        text, _, remedy = _without_path(case, error).partition("; ")
        out.append(CaseFinding(text, remedy, True))
        diagnosing = False
    try:
        every = each_state(with_natural_frequencies(case))
        for k, state in enumerate(every):
            stage = within(progress, k / len(every), (k + 1) / len(every))
            kept = without_silent(state)
            out += [CaseFinding(note, ACROSS) for note in kept.notes[len(state.notes) :]]
            off, screening = _screened(kept, diagnosing, stage)
            out += [CaseFinding(off, ANOTHER_MASS)] if off else []
            for f in () if screening is None else screening.findings:
                text, remedy = f.text.rstrip("."), f.repair + _ITSELF * bool(f.mend)
                out.append(CaseFinding(text, remedy, f.severity == "fault"))
    except ChladniError as error:
        out.append(CaseFinding(_without_path(case, error), BLOCKS, True))
    return list(dict.fromkeys(out))


def _screened(state: Case, diagnosing: bool, progress: Progress) -> tuple[str, Screening | None]:
    """A mass that deck and scales do not allow, and the findings on the recording."""
    try:
        prepared, screening = ready(with_sign_of_gain(state), diagnosing, progress, fitted=False)
    except RecordingAtFault as fault:
        return "", fault.screening
    return off_the_scales(prepared.problem), screening


def _without_path(case: Case, error: ChladniError) -> str:
    return str(error).removeprefix(f"{case.path}: ")


_ITSELF = " (calibrate and diagnose undo it themselves)"


def _band(case: Case, elastic: np.ndarray) -> list[CaseFinding]:
    """Report a recording in whose band the model has no elastic mode."""
    frfs = case.frfs
    if not frfs or not len(elastic):
        return []
    high = case.band[1] if case.band else float(frfs[0].frequency[-1])
    if elastic[0] <= high:
        return []
    said = f"the model's first elastic mode is at {elastic[0]:.4g} Hz, the band ends at {high:g} Hz"
    return [CaseFinding(said, "check the deck's units, and that the band is in Hz", True)]
