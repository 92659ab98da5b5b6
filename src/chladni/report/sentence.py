"""The verdict of a diagnosis in one sentence."""

from collections.abc import Sequence

from ..effects.registry import families
from ..inference.result import FrequencyError, NamedEffect, Scores
from ..search.result_parts import last_step_in_words
from ..workflows.diagnosis_result import DiagnosisResult
from .words import number


def sentence(result: DiagnosisResult) -> str:
    """State the verdict and the mesh of the decks, or the verdict of each of several states."""
    if not result.states:
        finer = f" Every shell of the written decks is halved, because {result.halved}."
        return _sentence(result) + finer * bool(result.halved)
    return " ".join(f"{s.name or 'The first state'}: {_sentence(s.result)}" for s in result.states)


def _sentence(result: DiagnosisResult) -> str:
    """State the verdict in one sentence.

    A claim is plain only if the result is trusted and no score of the written decks is against it.
    The sentence then says which score is.
    """
    verdict, worse = result.verdict, against(result)
    plain, gain = not (worse or result.distrust), _gain(result, worse)
    what, gain_of_one = _each(result.effects), gain if worse or not result.one_of else ""
    if verdict == "missing physics":
        lacks = _lacks(result, "The model lacks" if plain else "The model may lack")
        return f"{'; and '.join(lacks)}{gain_of_one}."
    if verdict == "measurement fault" and result.one_of:
        tied = f"the data cannot distinguish: {_tied(result)}"
        return f"The recording or the model is wrong; {tied}{gain_of_one}."
    if verdict == "measurement fault":
        wrong = "is wrong, not the model" if plain else "may be wrong, and not the model"
        return f"The recording {wrong}: {what}{gain}."
    if verdict == "nonlinear":
        signs = ", ".join(dict.fromkeys(t.signature for t in result.levels if t.sentence))
        why = what or signs or "no linear model fits"
        return f"The structure does not answer in proportion to the force: {why}."
    if only_fitted(result):
        return f"Calibration parameters were fitted; missing physics was not searched{gain}."
    if verdict in ("calibration only", "nothing missing") and result.one_of:
        better = " or ".join(result.one_of[0][1:])
        return (
            f"No effect is named; {better} explains the recording better than calibration alone, "
            f"but the evidence does not decide{gain}."
        )
    if verdict in ("calibration only", "nothing missing") and not plain:
        return f"No effect is named, but physics may still be missing{gain}."
    if verdict == "calibration only":
        beyond = f" that exceeds the error of the mesh ({_of_mesh(result)})" * bool(
            result.mesh_error
        )
        return f"Calibration explains the recording; no physics is missing{beyond}{gain}."
    if verdict == "nothing missing":
        return (
            f"No effect is named: {_off(result)}. The allowed errors of mesh, joints and scatter "
            "explain this as well as any effect tried."
        )
    if verdict == "not in catalogue" and result.one_of:
        if len(result.one_of[0]) == 1:
            return f"No effect is named; the recording shows {result.one_of[0][0]}."
        return f"No effect is named; the data cannot distinguish {', '.join(result.one_of[0])}."
    if verdict == "not in catalogue":
        if result.compared != "responses" and not what:
            return (
                "No single effect of the catalogue explains the recording: the model lacks other "
                "physics, or several effects at once."
            )
        near = f": {what}" if what else ""
        return f"The model lacks physics that is not in the catalogue{near}."
    return verdict


def only_fitted(result: DiagnosisResult) -> bool:
    """True for a calibration: no physics was searched, and the recording is not at fault."""
    other = ("missing physics", "measurement fault", "nonlinear")
    return not (result.searched or result.effects or result.verdict in other)


def against(result: DiagnosisResult) -> str:
    """Statement that the written deck is worse than one before it; "" where it is not."""
    said = last_step_in_words(result.agreement, bool(result.effects))
    if said or result.compared == "responses" or not (off := _off_by_deck(result)):
        return said
    last, after = off.popitem()
    best = min(off, key=lambda deck: off[deck])
    if after <= off[best]:
        return ""
    return (
        f"the frequencies of the {last} deck are farther from the test than those of the {best} "
        f"deck ({number(after, 2)} %, {number(off[best], 2)} % before)"
    )


def _of_mesh(result: DiagnosisResult) -> str:
    return f"up to {number(100 * result.mesh_error, 2)} % of a frequency"


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


def _lacks(result: DiagnosisResult, claim: str) -> list[str]:
    """List the missing effects, the tied ones, and the faulty channels."""
    tied = result.one_of[0] if result.one_of else ()
    one = next((e for e in reversed(result.effects) if e.name in tied), None)
    sure = [e for e in result.effects if e is not one]
    of_test = {known.name for known in families() if known.effect.kind == "test"}
    faults = [e for e in sure if e.name in of_test]
    physics = [e for e in sure if e.name not in of_test]
    words = [f"{claim} {_each(physics)}"] if physics or not (tied or faults) else []
    if tied:
        begun = "one of" if physics else f"{claim} one of"
        words.append(f"{begun} these, which the data cannot distinguish: {_tied(result)}")
    return [*words, f"the recording is wrong too: {_each(faults)}"] if faults else words


def _tied(result: DiagnosisResult) -> str:
    """List tied effects, most probable first, then the measurement that would separate them."""
    known = {e.name for e in result.effects} | {a.name for a in result.alternatives}
    names = [name for name in result.one_of[0] if name in known]
    checks = [word for word in result.one_of[0] if word not in known]
    return ", ".join(names) + "".join(f"; to settle it, {check}" for check in checks)


def _gain(result: DiagnosisResult, worse: str) -> str:
    """State the scores of the last deck and of the one before it, on data that only report.

    ``worse`` says that the last one is worse.
    """
    held = Scores() if result.agreement is None else result.agreement.held_out
    (one, before), (last, after) = held.last_step(bool(result.effects)).items()
    known, said = held.with_nuisances, ""
    if known is not None and before and after is not None and known < before < after:
        said = (
            f"; Q is {number(known, 3)} with errors of mesh, joints and scatter, which no deck "
            "contains"
        )
    if worse:
        return f"; {worse}{said}"
    if result.compared != "responses":
        return _of_frequencies(result)
    if not before or after is None:
        return ""
    return (
        f"; on held-out data the deviation Q goes from {number(before, 3)} ({one} deck) to "
        f"{number(after, 3)} ({last} deck){said}"
    )


def _off_by_deck(result: DiagnosisResult) -> dict[str, float]:
    """Deviation of all frequencies [%] by deck: one or two held-out ones prove little."""
    error, named = result.frequency_error or FrequencyError(), bool(result.effects)
    off = {"given": error.before, "calibrated": error.calibrated if named else error.after}
    if named:
        off["updated"] = error.after
    known = {deck: x for deck, x in off.items() if x is not None}
    return known if len(known) == len(off) else {}


def _of_frequencies(result: DiagnosisResult) -> str:
    if not (off := _off_by_deck(result)):
        return ""
    count = sum(bool(r.after_hz) for r in result.frequencies)
    (one, before), (last, after) = list(off.items())[-2:]
    return (
        f"; {count} frequencies are {number(before, 2)} % from the test (rms) with the {one} deck, "
        f"{number(after, 2)} % with the {last} deck"
    )
