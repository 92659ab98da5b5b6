"""Evaluate a test: FRFs from time data, ring-downs, screening of every recording."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from ..arguments import checked
from ..case import Case
from ..case.mended_recordings import with_frf
from ..dynamics.frf import FRF
from ..ema.finding import Check, Finding, Screening, notes_of_all
from ..ema.frf_estimate import EstimateSettings, FrfEstimate, refuse_unknown
from ..ema.identification import Identified, identify
from ..ema.level_study import LevelStudy, decay_study
from ..ema.level_words import mode_sentence
from ..ema.recording_screening import screened
from ..ema.ring_down import RingDown, ring_downs
from ..ema.setup import Recording
from ..errors import ChladniError, FileError
from ..fem.modelled import modelled
from ..parallel import one_blas_thread
from ..progress import Progress, silent
from ..results import Result
from ..units import number
from .case_model import REACH
from .identify import without_window
from .recordings_of import read_source
from .screening_of_case import screened_by_model

MOVES = 1.5  # damping at one amplitude over that at another: more is no linear structure
DISTORTED = 0.05  # harmonics over the fundamental
LINES = 2500  # of an FRF: more take minutes to identify; whoever wants that names a band


@dataclass(frozen=True, eq=False)
class RecordingEvaluation:
    """Evaluation of one recording."""

    recording: Recording  # with the FRFs
    estimate: FrfEstimate | None  # details of their estimation, if it held time data
    decays: tuple[RingDown, ...]  # free decays of its strongest modes, if its inputs stop
    screening: Screening
    # study of the modes over the decaying amplitude
    levels: LevelStudy = field(default_factory=LevelStudy)


@dataclass(frozen=True, eq=False, repr=False)
class Evaluation(Result):
    """The evaluation of every recording of a test."""

    recordings: tuple[RecordingEvaluation, ...]
    notes: tuple[str, ...] = ()


@checked
def evaluate_recordings(
    source: Case | str | Path | FRF | Recording | Sequence[FRF | Recording],
    settings: EstimateSettings | None = None,
    *,
    progress: Progress = silent,
) -> Evaluation:
    """Estimate FRFs from time data, and screen every recording.

    The first recording of a case is screened against its model as well. A case that compares
    natural frequencies does not know the places of its channels; it is screened alone.

    Parameters
    ----------
    source : a case, recordings, or the path of either
    settings : excitation, method, lines and band of the estimate

    Raises
    ------
    FileError
        If no recording holds FRFs or time data, or no FRF can be estimated.
    LabelError
        If excitation or method have no such name.
    """
    source = read_source(source)
    settings = settings or EstimateSettings()
    refuse_unknown(settings)
    case = source if isinstance(source, Case) else None
    read = source.recordings if isinstance(source, Case) else tuple(source)
    made = [with_frf(r, settings) for r in read]
    held = [(r, e) for r, e in made if r.frf is not None]
    if not held:
        raise FileError(
            "the recordings have neither a force with its responses nor FRFs; identify finds "
            "poles and damping of free decays"
        )
    found = []
    with one_blas_thread():
        for k, (r, e) in enumerate(held):
            progress(f"screening {r.name}", k / len(held))
            others = [] if k else [other for other, _ in held[1:]]
            decays = ring_downs(r.time) if r.time is not None else ()
            calmer = [other for other, _ in held if other is not r]
            screening = _screened(case, r, others, calmer, first=k == 0)
            assert r.frf is not None
            levels = decay_study(decays, r.frf.quantity)
            screening = _with_time(screening, e, decays)
            found.append(RecordingEvaluation(r, e, decays, screening, levels))
    said = notes_of_all([f.screening for f in found])
    said += [note for f in found for note in _decay_notes(f)]
    if settings != EstimateSettings() and not any(e for _, e in held):
        said.append("Nothing was estimated, so excitation, method, lines and band were not used.")
    own = case.said("test") if case is not None else [n for r, _ in held for n in r.notes]
    return Evaluation(tuple(found), tuple(dict.fromkeys([*said, *own])), origin=source)


def _decay_notes(found: RecordingEvaluation) -> list[str]:
    """Return a sentence on each mode whose frequency or damping depends on its amplitude."""
    name = found.recording.name
    beats = (
        "to settle it, measure at two levels: a second mode within a bandwidth causes similar beats"
    )
    return [f"{name}: free decay: {mode_sentence(m)}; {beats}" for m in found.levels.moving]


def _screened(
    case: Case | None,
    r: Recording,
    others: Sequence[Recording],
    calmer: Sequence[Recording],
    first: bool,
) -> Screening:
    identified = _identified(case, r)
    if case is None or not (first and case.frfs) or identified is None:
        return screened(r, identified, others, calmer=calmer)
    model = modelled(case.tested(case.assembly), REACH * identified.band[1])
    return screened_by_model(case, identified, model)


def _identified(case: Case | None, r: Recording) -> Identified | None:
    """Return the modes of a recording, or None if they cannot be identified."""
    frf = r.frf
    assert frf is not None
    if len(frf.frequency) > LINES:
        return None
    try:
        use = None if case is None else case.lines(frf.frequency)
        found = identify(frf, None if case is None else case.band, use=use)
    except ChladniError:
        return None
    return without_window(found, r.added_damping)


def _with_time(
    screening: Screening, estimate: FrfEstimate | None, decays: Sequence[RingDown]
) -> Screening:
    """Add findings from time data: distortion, and damping that depends on amplitude."""
    findings: list[Finding] = []
    checks = []
    if estimate is not None and estimate.distortion is not None:
        worst = float(estimate.distortion.max())
        k, i = divmod(int(estimate.distortion.argmax()), estimate.distortion.shape[1])
        f, output = estimate.frf.frequency[k], estimate.frf.outputs[i]
        if worst > DISTORTED:
            text = (
                f"the response {output} has {100 * worst:.2g} % harmonics at {f:.4g} Hz: the "
                "structure, the shaker or the front end is not linear there."
            )
            mend = "measure at a lower level and compare"
            findings.append(Finding("distortion", text, "warning", (output,), mend, worst))
        said = f"at most {100 * worst:.2g} % at {f:.4g} Hz"
        checks.append(Check("harmonic distortion", said, worst <= DISTORTED))
    if decays:
        most = max(decays, key=lambda d: d.moves)
        said = (
            f"damping differs {number(most.moves, 3)}-fold over the decay at "
            f"{most.frequency:.4g} Hz"
        )
        checks.append(Check("free decays", said, most.moves < MOVES))
    return screening.with_more(findings, checks)
