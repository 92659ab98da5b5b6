"""Modes of recordings: poles with their spread, damping, residues."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..arguments import checked, refuse_band, refuse_fields
from ..case import Case
from ..case.mended_recordings import with_frf
from ..dynamics.frf import FRF, Quantity
from ..dynamics.modes import ModalModel
from ..dynamics.statespace import StateSpace
from ..ema.coincident_poles import peak_notes
from ..ema.finding import Screening, notes_of_all, which
from ..ema.identification import Identified
from ..ema.identification import identify as identified
from ..ema.level_modes import AtLevel
from ..ema.level_study import LevelStudy, level_study
from ..ema.level_words import level_notes
from ..ema.realisation import realised
from ..ema.recording_screening import screened
from ..ema.response_correlations import ALIKE, RELEASE, responses, ringing
from ..ema.response_variance import noise_source
from ..ema.setup import PoleTable, Recording
from ..ema.shapes import modal_model
from ..ema.stabilisation import Stabilisation, ghosts, stabilisation
from ..errors import AccuracyError, FileError, LabelError
from ..parallel import one_blas_thread
from ..progress import Progress, silent, within
from ..results import Result
from ..search.measured_frequencies import LEAST_DELTA_CHI2
from ..units import number
from .recordings_of import read_source

TRUST = 5.0  # rms of the whitened residual above which poles are not to be trusted


@dataclass(frozen=True, eq=False)
class RecordingModes:
    """Modes identified from one recording, and its screening."""

    recording: Recording
    whole: Identified  # with the poles outside the band that contribute to it
    screening: Screening  # faults that the recording itself reveals
    diagram: Stabilisation  # poles of every order of the subspace method

    @property
    def modes(self) -> Identified:
        """The poles within the band."""
        return self.whole.sel(self.whole.inside)

    @property
    def struck(self) -> np.ndarray:
        """Among ``modes``, poles without a peak that no other order shows (r,) bool."""
        return ghosts(self.whole, self.diagram)[self.whole.inside]

    @property
    def firm(self) -> np.ndarray:
        """Among ``modes``, the ones known accurately enough to be reported as modes (r,) bool."""
        return self.modes.firm & ~self.struck

    @property
    def modal(self) -> ModalModel:
        """The ``firm`` modes, mass-normalised over the measured dofs, for MAC and synthesis.

        Raises
        ------
        LabelError
            If an output is no single component (412:n), or no point was both driven and measured.
        """
        return modal_model(self.modes.sel(self.firm))

    @property
    def state_space(self) -> StateSpace:
        """A, B, C, D of all identified poles and the band's residual terms, outputs as recorded.

        Raises
        ------
        LabelError
            If the quantity has no state space: a transmissibility.
        """
        return realised(self.whole, self.whole.quantity)  # type: ignore[arg-type]

    @property
    def poles(self) -> PoleTable:
        """The ``firm`` modes, as a table for the report."""
        m = self.modes.sel(self.firm)
        r = len(m.poles)
        return PoleTable(m.frequency, m.frequency_sd, m.damping, np.arange(1, r + 1), ("",) * r)


@dataclass(frozen=True)
class PoleChoice:
    """A choice of poles that replaces the choice by their gain.

    Attributes
    ----------
    states : int or None   all poles of a state space of that order, by the subspace method
    drop, pick : [Hz]      poles removed, poles added by hand
    """

    states: int | None = None
    drop: tuple[float, ...] = ()
    pick: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        refuse_fields(self)

    @property
    def notes(self) -> list[str]:
        """The choice, in sentences."""
        said = []
        if self.states is not None:
            said.append(f"All poles of a state space of {self.states} states (subspace method).")
        for frequencies, what in ((self.drop, "Taken out"), (self.pick, "Put in")):
            if frequencies:
                said.append(f"{what} by hand: {', '.join(f'{f:g}' for f in frequencies)} Hz.")
        return said


@dataclass(frozen=True, eq=False, repr=False)
class Identification(Result):
    """The modes of every recording, with notes and reasons not to trust them.

    ``levels`` holds a study of each object that was measured at two levels or more.
    """

    recordings: tuple[RecordingModes, ...]
    notes: tuple[str, ...] = ()
    distrust: tuple[str, ...] = ()
    levels: tuple[LevelStudy, ...] = ()

    def trusted(self) -> "Identification":
        """The result itself.

        Raises
        ------
        AccuracyError
            If there is a reason not to trust it.
        """
        if self.distrust:
            raise AccuracyError(*self.distrust)
        return self


@checked
def identify(
    source: Case | str | Path | FRF | Recording | Sequence[FRF | Recording],
    band: tuple[float, float] | None = None,
    averages: int = 1,
    choice: PoleChoice = PoleChoice(),
    *,
    quantity: Quantity | None = None,
    progress: Progress = silent,
) -> Identification:
    """Identify the poles of every recording that holds an FRF, or free decays.

    Parameters
    ----------
    source : a case, whose band and gaps apply; recordings; or the path of either
    band : [Hz]; default that of the case, else the whole
    averages : of the estimate, where the noise comes from the coherence
    choice : poles by hand, or all of a state space
    quantity : of the responses, where the file at a path does not say it

    Raises
    ------
    FileError
        If no recording holds either.
    """
    refuse_band(band)
    if averages < 1:
        raise LabelError(f"averages = {averages}; an estimate has 1 or more")
    source = read_source(source, quantity)
    if isinstance(source, Case):
        recordings = source.recordings
    else:
        recordings = tuple(with_frf(r)[0] for r in source)
    gaps: tuple[tuple[float, float], ...] = ()
    said: list[str] = []
    if isinstance(source, Case):
        band, gaps, said = band or source.band, source.exclude, source.said("identify")
        if ("test", "use") in source.given:
            recordings = recordings[:1]
    held = [r for r in (ringing(r, band or (0.0, np.inf)) for r in recordings) if r.frf is not None]
    if not held:
        where = f"{source.path} " if isinstance(source, Case) else "the recording "
        raise FileError(f"{where}has no frequency responses to identify{_has(recordings)}")
    found = []
    with one_blas_thread():
        for k, recording in enumerate(held):
            progress(f"poles of {recording.name}", k / len(held))
            part = within(progress, k / len(held), (k + 1) / len(held))
            others = ((), held) if k else (held, ())
            found.append(_modes(recording, band, gaps, averages, others, choice, part))
    screenings = notes_of_all([r.screening for r in found])
    levels = _levels(found, averages)
    said = [*screenings, *said]
    notes = [
        *choice.notes,
        *said,
        *(note for note in _notes(held, gaps, averages) if note not in said),
        *(f"{r.recording.name}: {note}" for r in found for note in peak_notes(r.modes.sel(r.firm))),
        *(note for study in levels for note in level_notes(study)),
    ]
    return Identification(tuple(found), tuple(notes), _doubts(found), levels, origin=source)


def _has(read: Sequence[Recording]) -> str:
    """Describe the content of recordings without an FRF."""
    kinds = dict.fromkeys(f.kind for r in read for f in r.functions)
    said = [f"records of kind {', '.join(kinds)}"] if kinds else []
    said += ["a table of poles"] * any(r.poles is not None for r in read)
    said += ["mode shapes"] * any(r.shapes is not None for r in read)
    if any(responses(r.functions) for r in read):
        said[0] += ", without a force: correlate, calibrate and diagnose use their frequencies"
    return f"; it has {' and '.join(said)}" if said else ""


def _modes(
    recording: Recording,
    band: tuple[float, float] | None,
    gaps: Sequence[tuple[float, float]],
    averages: int,
    others: tuple[Sequence[Recording], Sequence[Recording]],
    choice: PoleChoice,
    progress: Progress,
) -> RecordingModes:
    frf = recording.frf
    assert frf is not None
    use = np.ones(len(frf.frequency), bool)
    for low, high in gaps:
        use &= (frf.frequency < low) | (frf.frequency > high)
    found = identified(
        frf, band, averages=averages, use=use,
        states=choice.states, drop=choice.drop, pick=choice.pick, progress=progress,
    )  # fmt: skip
    diagram = stabilisation(frf, found, use, averages)
    if all(name.startswith(RELEASE) for name in frf.inputs):
        found = found.sel(~found.inside | clear(found))
        screening = Screening(recording.name)  # there is no force to hold channels against
    else:
        compared, calmer = others
        spurious = ghosts(found, diagram)
        screening = screened(recording, found, compared, calmer=calmer, spurious=spurious)
    found = without_window(found, recording.added_damping)
    return RecordingModes(recording, found, screening, diagram)


def clear(found: Identified) -> np.ndarray:
    """Select poles above the noise that a window correlates on neighbouring lines (r,) bool."""
    return np.asarray(found.relative_delta_chi2 > LEAST_DELTA_CHI2 * ALIKE)


def without_window(found: Identified, added: float) -> Identified:
    """Remove the damping that an exponential window added to the poles, p + Δσ [1/s]."""
    return replace(found, poles=found.poles + added) if added else found


def _notes(
    held: Sequence[Recording], gaps: Sequence[tuple[float, float]], averages: int
) -> tuple[str, ...]:
    notes = list(dict.fromkeys(note for r in held for note in r.notes))
    sources: dict[str, list[str]] = {}
    for r in held:
        if r.frf is not None:
            sources.setdefault(noise_source(r.frf, averages), []).append(r.name)
    notes += [f"Noise of {which(names, held)}: {source}." for source, names in sources.items()]
    for r in held:
        if r.level == 0 and len(held) > 1:
            notes.append(
                f"{r.name}: its modes are not compared with other levels, because its level is 0."
            )
        if r.added_damping:
            notes.append(
                f"{r.name}: the damping of an exponential window, {r.added_damping:.3g} 1/s, was "
                "subtracted."
            )
    if gaps:
        said = ", ".join(f"{low:g} to {high:g} Hz" for low, high in gaps)
        notes.append(f"Excluded by the case: {said}.")
    return tuple(notes)


def _levels(found: Sequence[RecordingModes], averages: int) -> tuple[LevelStudy, ...]:
    """Study the modes over levels, separately for each article and state."""
    alike: dict[tuple[str, str], list[AtLevel]] = {}
    for one in found:
        r = one.recording
        assert r.frf is not None
        alike.setdefault((r.article, r.state), []).append(
            AtLevel(r.level, r.frf, one.whole, r.control, averages)
        )
    studies = [level_study(group) for group in alike.values()]
    return tuple(s for s in studies if s.modes)


def _doubts(found: Sequence[RecordingModes]) -> tuple[str, ...]:
    """State a reason for distrust if the poles leave far more than noise."""
    weak = [r for r in found if not r.firm.any() or r.modes.chi > TRUST]
    if not weak:
        return ()
    names = ", ".join(r.recording.name for r in weak)
    return (
        f"{names}: the residual of the poles is {number(max(r.modes.chi for r in found), 3)} times "
        "the noise, so do not trust them; narrow the band (--band) or give --averages",
    )
