"""The verdict of a diagnosis in one sentence."""

from collections.abc import Sequence

from ..effects.registry import families
from ..inference.result import NamedEffect, Scores
from ..workflows.diagnosis_result import DiagnosisResult
from .words import number


def sentence(result: DiagnosisResult) -> str:
    """State the verdict and the mesh of the decks, or the verdict of each of several states."""
    if not result.states:
        finer = f" Every shell of the written decks is halved, because {result.halved}."
        return _sentence(result) + finer * bool(result.halved)
    return " ".join(f"{s.name or 'The first state'}: {_sentence(s.result)}" for s in result.states)


def _sentence(result: DiagnosisResult) -> str:
    """State the verdict in one sentence."""
    verdict, gain = result.verdict, _gain(result)
    what = _each(result.effects)
    if verdict == "missing physics":
        return f"{'; and '.join(_lacks(result))}{'' if result.one_of else gain}."
    if verdict == "measurement fault" and result.one_of:
        return f"The recording or the model is wrong; the data cannot distinguish: {_tied(result)}."
    if verdict == "measurement fault":
        return f"The recording is wrong, not the model: {what}{gain}."
    if verdict == "nonlinear":
        signs = ", ".join(dict.fromkeys(t.signature for t in result.levels if t.sentence))
        why = what or signs or "no linear model fits"
        return f"The structure does not answer in proportion to the force: {why}."
    if not result.searched and not result.effects:
        return f"Calibration parameters were fitted; missing physics was not searched{gain}."
    if verdict in ("calibration only", "nothing missing") and result.one_of:
        better = " or ".join(result.one_of[0][1:])
        return (
            f"No effect is named; {better} explains the recording better than calibration alone, "
            f"but the evidence does not decide{gain}."
        )
    if verdict in ("calibration only", "nothing missing") and result.distrust:
        sure = verdict == "calibration only" and result.compared == "responses"
        known = "Calibration explains the recording" * sure
        return f"{known or 'No effect is named'}, but physics may still be missing{gain}."
    if verdict == "calibration only":
        return f"Calibration explains the recording; no physics is missing{gain}."
    if verdict == "nothing missing":
        return (
            f"No effect is named: {_off(result)}. The allowed errors of mesh, joints and scatter "
            "explain this as well as any effect tried."
        )
    if verdict == "not in catalogue" and result.one_of:
        return f"No effect is named; the data cannot distinguish {', '.join(result.one_of[0])}."
    if verdict == "not in catalogue":
        near = f": {what}" if what else ""
        return f"The model lacks physics that is not in the catalogue{near}."
    return verdict


def _off(result: DiagnosisResult) -> str:
    """State the difference in frequency: the allowance for a mesh may be large."""
    error = result.frequency_error
    if error is None or error.before is None:
        return "model and recording differ by little"
    return f"model and recording are {number(error.before, 2)} % apart in frequency (rms)"


def _each(effects: Sequence[NamedEffect]) -> str:
    """List effects with their claim and place."""
    words = []
    for e in effects:
        claim, place = f" ({e.claim})" * bool(e.claim), f", {e.where.text}" * bool(e.where.text)
        words.append(f"{e.name}{claim}{place}")
    return "; and ".join(words)


def _lacks(result: DiagnosisResult) -> list[str]:
    """List the missing effects, the tied ones, and the faulty channels."""
    tied = result.one_of[0] if result.one_of else ()
    one = next((e for e in reversed(result.effects) if e.name in tied), None)
    sure = [e for e in result.effects if e is not one]
    of_test = {known.name for known in families() if known.effect.kind == "test"}
    faults = [e for e in sure if e.name in of_test]
    physics = [e for e in sure if e.name not in of_test]
    words = [f"The model lacks {_each(physics)}"] if physics or not (tied or faults) else []
    if tied:
        begun = "one of" if physics else "The model lacks one of"
        words.append(f"{begun} these, which the data cannot distinguish: {_tied(result)}")
    return [*words, f"the recording is wrong too: {_each(faults)}"] if faults else words


def _tied(result: DiagnosisResult) -> str:
    """List tied effects, most probable first, then the measurement that would separate them."""
    known = {e.name for e in result.effects} | {a.name for a in result.alternatives}
    names = [name for name in result.one_of[0] if name in known]
    checks = [word for word in result.one_of[0] if word not in known]
    return ", ".join(names) + "".join(f"; to settle it, {check}" for check in checks)


def _gain(result: DiagnosisResult) -> str:
    """State Q of the last deck and of the one before it, on data that only report."""
    held = Scores() if result.agreement is None else result.agreement.held_out
    if result.compared != "responses":
        return _closer(result)
    (one, before), (last, after) = held.last_step(bool(result.effects)).items()
    if not before or after is None:
        return ""
    known, said = held.with_nuisances, ""
    if known is not None and known < before < after:
        said = (
            f", and to {number(known, 3)} with errors of mesh, joints and scatter, which a deck "
            "cannot contain"
        )
    return (
        f"; on held-out data the deviation Q goes from {number(before, 3)} ({one} deck) to "
        f"{number(after, 3)} ({last} deck){said}"
    )


def _closer(result: DiagnosisResult) -> str:
    """State the deviation of all frequencies: one or two held-out ones prove little."""
    error = result.frequency_error
    if error is None or error.calibrated is None or error.after is None:
        return ""
    named, count = bool(result.effects), sum(bool(r.after_hz) for r in result.frequencies)
    before, after = (error.calibrated if named else error.before), error.after
    one, last = ("calibrated", "updated") if named else ("given", "calibrated")
    return (
        f"; {count} frequencies are {number(before, 2)} % from the test (rms) with the {one} deck, "
        f"{number(after, 2)} % with the {last} deck"
    )
