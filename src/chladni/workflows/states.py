"""Explain one state of an object, or several with shared parameters.

1. The states are explained one after the other. The joint fit of the earlier states, each with
   its own effect, is the prior of the next for E, rho, t, mesh and scatter.
2. The explanations, as decks can hold them, are fitted again together, with E, rho, t shared.
3. Every state's deck is written with the shared values and its own effect.
"""

from dataclasses import replace
from pathlib import Path

from ..case import Case
from ..case.recording_groups import of_state, states
from ..errors import FileError
from ..inference.hypothesis_fit import HypothesisFit
from ..inference.joint_fit import JointFit, joint_fit
from ..inference.written_hypothesis import as_written
from ..parallel import one_blas_thread
from ..progress import Progress, within
from ..search.calibration import FULL, CalibrationSettings
from ..search.diagnosis import Diagnosis
from ..search.earlier_answer import EarlierAnswer, read_earlier
from ..search.result_parts import shared_values
from .diagnosis_pipeline import Explained, build_result, data_of, explained
from .diagnosis_result import DiagnosisResult, StateResult
from .effects_by_state import by_state
from .output_only import with_natural_frequencies
from .screening_of_case import RecordingAtFault, at_fault


def diagnose_states(
    case: Case, diagnosing: bool, progress: Progress,
    settings: CalibrationSettings = FULL, earlier: str | Path | None = None,
) -> DiagnosisResult:  # fmt: skip
    """Diagnose (or, without ``diagnosing``, only calibrate) a case, on one BLAS thread.

    Parameters
    ----------
    settings : of a calibration; states share one set of parameters, so that none is frozen
    earlier : folder of the answer that a diagnosis builds on
    """
    with one_blas_thread():
        case = with_natural_frequencies(case)
        names = states_compared(case)
        try:
            if earlier is not None:
                case, before = _after(case, names, Path(earlier))
                known = explained(case, True, progress, before.shared, settings, before)
                return build_result(known, True, progress)
            if len(names) < 2:
                known = explained(case, diagnosing, progress, settings=settings)
                return build_result(known, diagnosing, progress)
            shared = replace(settings, freeze=False)
            return _in_states(case, names, diagnosing, progress, shared)
        except RecordingAtFault as fault:
            return at_fault(case, fault.screening, diagnosing)


def _after(case: Case, names: tuple[str, ...], folder: Path) -> tuple[Case, EarlierAnswer]:
    """The case without what an earlier answer used, and that answer.

    Raises
    ------
    FileError
        If the case has several states, or its recording was used.
    """
    if len(names) > 1:
        raise FileError(
            f"{case.path}: --earlier takes a recording of one state, and there are "
            f"{', '.join(names)}; choose one by [test] use"
        )
    before = read_earlier(folder)
    before.refuse_again(data_of(case), case.path)
    if case.setup.mass is None or case.setup.mass != before.mass:
        return case, before
    note = f"[test] mass is that of {folder}, whose answer used it, so it is not used again"
    setup = replace(case.setup, mass=None)
    return replace(case, setup=setup, notes=(*case.notes, note)), before


def states_compared(case: Case) -> tuple[str, ...]:
    """States that are explained: all, or the one that ``[test] use`` names."""
    names = states(case.recordings)
    return names[:1] if ("test", "use") in case.given else names


def each_state(case: Case) -> tuple[Case, ...]:
    """The case as each of its states is explained; as it is where there is one."""
    names = states_compared(case)
    return (case,) if len(names) < 2 else tuple(_one_state(case, names, n) for n in names)


def _in_states(
    case: Case, names: tuple[str, ...], diagnosing: bool, progress: Progress,
    settings: CalibrationSettings,
) -> DiagnosisResult:  # fmt: skip
    every: list[Explained] = []
    for k, name in enumerate(names):
        stage = within(progress, 0.8 * k / len(names), 0.8 * (k + 1) / len(names))
        known = _joint(every, [_lead(e.found) for e in every]).posterior() if every else None
        state = _one_state(case, names, name)
        every.append(explained(state, diagnosing, stage, known, settings))
    every = _with_data_of_all(every)
    joint = _joint(every, [_as_deck(e) for e in every])
    changed = any(e.found.verdict != "nothing missing" for e in every)
    every = [_with(e, fit, changed) for e, fit in zip(every, joint.fits, strict=True)]
    shared = shared_values(joint)
    results = []
    for k, (name, one) in enumerate(zip(names, every, strict=True)):
        stage = within(progress, 0.8 + 0.2 * k / len(names), 0.8 + 0.2 * (k + 1) / len(names))
        result = build_result(one, diagnosing, stage)
        rest = ", ".join(repr(n) for n in names if n != name)
        what = ", ".join(p.where for p in shared) or "nothing"
        note = (
            f"state {name!r} was fitted together with {rest}: {what} shared, effects belong to one "
            "state"
        )
        results.append(StateResult(name, replace(result, notes=(note, *result.notes))))
    first = results[0].result
    distrust = tuple(f"state {s.name!r}: {why}" for s in results for why in s.result.distrust)
    notes = (*first.notes, *by_state(results))
    return replace(first, states=tuple(results), shared=shared, distrust=distrust, notes=notes)


def _with_data_of_all(every: list[Explained]) -> list[Explained]:
    """The explanations with the data of all states in what each leaves: a state knows the others.

    The weighing of the first state counts in all of them.
    """
    known = [e.posterior for e in every if e.posterior is not None]
    if not known:
        return every
    data, mass = {d: label for k in known for d, label in k.data.items()}, known[0].mass
    left = (e.posterior and replace(e.posterior, data=data, mass=mass) for e in every)
    return [replace(e, posterior=p) for e, p in zip(every, left, strict=True)]


def _one_state(case: Case, names: tuple[str, ...], name: str) -> Case:
    """Return the case with the recordings of one state; the weighing is that of the first."""
    setup, notes = case.setup, case.notes
    recordings = of_state(case.recordings, name)
    if name != names[0]:
        setup = replace(setup, mass=None)
        if case.setup.mass is not None and recordings[0].mass is None:
            notes = (*notes, f"state {name!r} was not weighed: [test] mass is that of {names[0]!r}")
    return replace(case, recordings=recordings, setup=setup, notes=notes)


def _lead(found: Diagnosis) -> HypothesisFit:
    """Return the fit of the explanation with all its other fitted numbers."""
    return found.found or found.null


def _as_deck(one: Explained) -> HypothesisFit:
    """Return the explanation as a deck can hold it, with the learned error of the model."""
    return as_written(_lead(one.found), one.prepared.problem.mass_measurement)


def _joint(every: list[Explained], fits: list[HypothesisFit]) -> JointFit:
    """Fit all states together, with the priors of the first state."""
    return joint_fit(fits, [e.prepared.problem.mass_measurement for e in every])


def _with(one: Explained, fit: HypothesisFit, changed: bool) -> Explained:
    """Put the shared values of all states into the deck of an explanation.

    A state that needs no other values than the deck's gets them too if another state needs them.
    Decks with halved shells were fitted to one state alone.
    """
    found = replace(one.found, shared=True, halved=())
    if found.found is not None:
        return replace(one, found=replace(found, written=fit))
    if changed and found.verdict == "nothing missing":
        found = replace(found, verdict="calibration only")
    return replace(one, found=replace(found, plain=fit))
