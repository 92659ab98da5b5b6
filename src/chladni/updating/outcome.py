"""A diagnosis in numbers: Q on fitted and held-out data, frequencies, alternatives."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ..dynamics.eigen import normal_modes
from ..dynamics.modes import ModalModel
from ..ema.correlation import mac
from ..ema.mode_pairing import pair
from ..fem.assemble import Structure, structure
from ..fem.energy import mass_properties
from ..model.assembly import Assembly
from .diagnosis import Diagnosis, threshold, verdict
from .hypothesis_fit import Search, Trial, as_written
from .likelihood import Poles, Responses
from .question import Prepared, Question
from .reduced_model import State, evaluate

FIRST = 8  # paired frequencies over which the rms is reported


@dataclass(frozen=True, eq=False)
class Models:
    """The structure as the deck has it, calibrated without new physics, and with the effect."""

    nominal: Assembly
    calibrated: Assembly
    final: Assembly


def models(question: Question, diagnosis: Diagnosis) -> Models:
    """Every stage written into the assembly."""
    found = diagnosis.found
    nothing = diagnosis.verdict == "nothing missing"
    calibrated = question.assembly if nothing else applied(question.assembly, diagnosis.plain)
    if found is None or found.effect.kind == "test":
        return Models(question.assembly, calibrated, calibrated)
    return Models(
        question.assembly, calibrated, applied(question.assembly, diagnosis.written or found)
    )


def applied(assembly: Assembly, trial: Trial) -> Assembly:
    """The assembly with the ordinary parameters and the effect of a trial in it."""
    for effect in trial.fit.effects:
        assembly = effect.apply(assembly, trial.fit.of(effect))
    return assembly


@dataclass(frozen=True, eq=False)
class Scores:
    """Q nominal, calibrated and with the effect, and what is left when scatter is fitted too."""

    nominal: float
    calibrated: float
    effect: float
    floor: float

    def as_dict(self) -> dict[str, float]:
        """The keys of diagnosis.json."""
        return {
            "Q_nominal": self.nominal,
            "Q_calibrated": self.calibrated,
            "Q_with_effect": self.effect,
            "Q_floor": self.floor,
        }


def scores(prepared: Prepared, diagnosis: Diagnosis) -> tuple[Scores, Scores]:
    """Q on the data that were fitted, and on those held out."""
    winner = diagnosis.found or diagnosis.null
    stages = _states(prepared.search, diagnosis, winner)
    out, real = [], real_poles(prepared, winner)
    for use in (prepared.score.use, held_out(prepared, winner)):
        values = [_data(prepared, trial).Q(state, use, real) for trial, state in stages]
        out.append(Scores(*values))
    return out[0], out[1]


def held_out(prepared: Prepared, winner: Trial) -> np.ndarray:
    """Samples the fit never saw; of a fault of one channel, that channel's alone."""
    held = prepared.held
    if not winner.effect.channels or held.ndim < 2:
        return held
    mine = np.isin(prepared.search.labels, winner.effect.channels)
    own = held & mine
    return own if own.any() else held


STRUCTURED = 5.0  # times the spread of the recording: more than that is not noise
VETO = 0.8  # held-out Q, over that of plain calibration, above which nothing is named


def judged(prepared: Prepared, diagnosis: Diagnosis) -> Diagnosis:
    """The verdict once the held-out data have been heard, and the named effect as written.

    An effect that fits but does not help on data the fit never saw is not named. A fault of a
    channel must only not harm: it may be small beside what else is left there.
    """
    if diagnosis.found is None:
        return diagnosis
    lead = diagnosis.trials[0]
    diagnosis = replace(diagnosis, written=as_written(lead, prepared.search.weighing))
    held = scores(prepared, diagnosis)[1]
    if not held.effect > (1.0 if lead.effect.kind == "test" else VETO) * held.calibrated:
        return diagnosis
    note = (
        f"{lead.effect.name} gained {diagnosis.gain(lead):.0f} in -2 ln evidence but left the "
        f"held-out Q at {held.effect / held.calibrated:.2f} of plain calibration's, so it is not "
        "named"
    )
    plainly = verdict(diagnosis.nominal, diagnosis.null, ())
    return replace(diagnosis, verdict=plainly, notes=(*diagnosis.notes, note), written=None)


def real_poles(prepared: Prepared, winner: Trial) -> np.ndarray | None:
    """Poles of the test that have a partner in the winning model; the rest are strangers."""
    if not isinstance(prepared.score, Poles):
        return None
    data = prepared.score.over(winner.model)
    fitted = winner.fit.data
    wide = Poles(**{**vars(data), "scale": max(3 * getattr(fitted, "scale", 0.01), 0.02)})
    real = np.zeros(len(data.frequency), bool)
    real[wide.pairs(winner.fit.state, np.ones(len(real), bool))[0]] = True
    return real


def _data(prepared: Prepared, trial: Trial) -> Responses | Poles:
    return prepared.score.over(trial.model)


def _states(search: Search, diagnosis: Diagnosis, winner: Trial) -> list[tuple[Trial, State]]:
    """Nominal, calibrated, with the effect; and the last with all it was fitted with."""
    null, plain = diagnosis.null, diagnosis.plain
    nominal = evaluate(null.model, search.base, search.mean(), False)
    final = plain.fit.state
    if diagnosis.found is not None:
        final = (diagnosis.written or as_written(winner, search.weighing)).fit.state
    elif diagnosis.verdict == "nothing missing":
        final = nominal
    last = winner if diagnosis.found is not None else null
    return [(null, nominal), (plain, plain.fit.state), (last, final), (last, last.fit.state)]


def effect_entry(trial: Trial) -> dict[str, Any]:
    """One effect as diagnosis.json has it."""
    effect, x = trial.effect, trial.fit.of(trial.effect)
    return {
        "name": effect.name,
        "claim": effect.claim,
        "log_evidence": -trial.S / 2,
        "where": effect.location(x),
        "parameters": effect.reported(x, trial.fit.sd(effect)),
    }


def alternatives(diagnosis: Diagnosis) -> list[dict[str, Any]]:
    """Everything that was tried and is not the answer, with the reason."""
    found = diagnosis.found
    best = found if found is not None else diagnosis.null
    out = []
    for trial in diagnosis.trials:
        if trial is found:
            continue
        out.append(
            {
                "name": trial.effect.name,
                "log_evidence": -trial.S / 2,
                "why_not": why_not(trial, best, found is not None, diagnosis.gain(trial)),
                "where": trial.effect.location(trial.fit.of(trial.effect)),
            }
        )
    if found is not None:
        gap = (diagnosis.null.S - best.S) / 2
        name = "calibration only"
        reason = f"E, rho and t alone are e^{gap:.0f} times less probable"
        out.append({"name": name, "log_evidence": -diagnosis.null.S / 2, "why_not": reason})
    return sorted(out, key=lambda a: -a["log_evidence"])


def why_not(trial: Trial, best: Trial, named: bool, gain: float) -> str:
    """Why a hypothesis was not named, with a number."""
    if not named and gain > threshold(trial.data):
        return f"gains {gain:.1f} in -2 ln evidence, but does not help on the data held out"
    if not named:
        return (
            f"gains {gain:.1f} in -2 ln evidence over plain calibration; "
            f"{threshold(trial.data):.0f} are needed before anything is named"
        )
    gap = (trial.S - best.S) / 2
    return (
        f"e^{gap:.0f} times less probable than {best.effect.name}; leaves {trial.fit.misfit:.0f} "
        f"of weighted squares, {best.effect.name} {best.fit.misfit:.0f}"
    )


def frequency_table(
    question: Question,
    prepared: Prepared,
    stages: Sequence[tuple[str, Assembly]],
    real: np.ndarray | None = None,
) -> list[dict[str, float | None]]:
    """Identified frequencies beside those of every stage, by full models: before_hz ..."""
    test, shapes = _test_modes(prepared)
    if not len(test):
        return []
    top = 2.0 * float(test.max())
    rows: list[dict[str, float | None]] = [{"test_hz": float(f)} for f in test]
    for name, made in stages:
        built = structure(made)
        modes = _flexible(normal_modes(built.system, band=top), 0.02 * float(test.min()))
        at, value = _paired(question, prepared, built, modes, test, shapes, real)
        for k in range(len(test)):
            rows[k][f"{name}_hz"] = None if at[k] < 0 else float(modes.frequency[at[k]])
            rows[k][f"mac_{name}"] = None if at[k] < 0 or np.isnan(value[k]) else float(value[k])
    return rows


def _flexible(modes: ModalModel, lowest: float) -> ModalModel:
    keep = modes.frequency > lowest
    return ModalModel(modes.frequency[keep], modes.damping[keep], modes.shapes[:, keep], modes.dofs)


def _test_modes(prepared: Prepared) -> tuple[np.ndarray, np.ndarray | None]:
    """Frequencies of the test and, where there are sensors enough, shapes (n_out, n)."""
    if isinstance(prepared.score, Poles):
        return prepared.score.frequency, None
    found = prepared.identified
    assert found is not None
    low, high = found.band
    keep = (found.frequency >= low) & (found.frequency <= high) & (found.damping < 0.05)
    keep &= found.gain > 3.0
    shapes = np.imag(found.residues[keep, :, 0] * 1j).T if found.residues.shape[1] >= 4 else None
    if shapes is not None:
        residues = found.residues[keep, :, 0]
        turn = np.exp(-0.5j * np.angle((residues**2).sum(axis=1)))
        shapes = (residues * turn[:, None]).real.T
    return found.frequency[keep], shapes


def _paired(
    question: Question, prepared: Prepared, built: Structure, modes: ModalModel,
    test: np.ndarray, shapes: np.ndarray | None, real: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Model mode of every test mode (-1: none) and their MAC (n,)."""
    n = len(test)
    at, value = np.full(n, -1), np.full(n, np.nan)
    if shapes is not None:
        phi = question.outputs.rows(built) @ modes.shapes
        pairs = pair(modes.frequency, test, mac(phi, shapes))
        at[pairs.test], value[pairs.test] = pairs.model, pairs.mac
        return at, value
    assert isinstance(prepared.score, Poles)
    eye = np.eye(len(modes.frequency))
    score = prepared.score
    lam = (2 * np.pi * modes.frequency) ** 2
    state = State(lam, eye, np.zeros(0), np.zeros(0), 0.0, np.zeros(0), None, None)
    if score.outputs is not None:
        a, b = (rows @ modes.shapes for rows in (score.outputs, score.inputs))  # type: ignore[operator]
        score = Poles(**{**vars(score), "a": a, "b": b})
    _, mode = score.forced(state, np.ones(n, bool) if real is None else real)
    return mode, value


def rms(rows: Sequence[dict[str, float | None]], key: str, first: int = FIRST) -> float | None:
    """Root mean square of ln(model/test) over the first paired frequencies, in per cent."""
    both = [(r[key], r["test_hz"]) for r in rows if r.get(key)][:first]
    if not both:
        return None
    d = np.log([float(a or 1) / float(b or 1) for a, b in both])
    return float(100 * np.sqrt(np.mean(d**2)))


def structured(prepared: Prepared, diagnosis: Diagnosis) -> dict[str, Any]:
    """Is what calibration leaves structure or noise: its rms over the recording's own spread."""
    plain = diagnosis.plain
    if isinstance(prepared.score, Poles):
        real = real_poles(prepared, diagnosis.found or diagnosis.null)
        assert real is not None
        left = 100 * float(np.sqrt(prepared.score.Q(plain.fit.state, real, real))) * np.log(10)
        known = 100 * float(np.median(prepared.score.sd[real]))
        text = f"{left:.2g} % rms of the frequencies, which are known to {known:.1g} %"
    else:
        data = prepared.score.over(plain.model)
        left = float(np.sqrt(data.Q(plain.fit.state, prepared.score.use)))
        chi = 1.0 if prepared.identified is None else prepared.identified.chi
        known = 0.01 * chi / np.log(10)
        text = f"{left:.2g} decades rms, the recording is known to about {known:.1g}"
    far = left > STRUCTURED * known
    is_so = bool(far and diagnosis.found is not None)
    if is_so:
        end = "that is structured, not noise"
    elif not far:
        end = "nothing more can be read from that"
    elif diagnosis.trials:
        end = "mesh error and scatter within the parts account for it as well as any effect tried"
    else:
        end = "more than noise; a diagnosis says whether physics is missing"
    return {
        "is": is_so,
        "left": left,
        "known": known,
        "sentence": f"ordinary parameters alone leave {text}: {end}",
    }


def as_dict(
    question: Question, prepared: Prepared, diagnosis: Diagnosis, stages: Models
) -> dict[str, Any]:
    """``diagnosis.json`` but for the files."""
    fitted, held = scores(prepared, diagnosis)
    found = diagnosis.found
    last, deck = found or diagnosis.null, diagnosis.written or found or diagnosis.plain
    every = (("before", stages.nominal), ("calibrated", stages.calibrated), ("after", stages.final))
    rows = frequency_table(question, prepared, every, real_poles(prepared, last))
    weighing, left = question.weighing, structured(prepared, diagnosis)
    what = prepared.what
    if last.effect.channels:
        what = f"channel {', '.join(last.effect.channels)} on the lines held out of {what}"
    return {
        "verdict": diagnosis.verdict,
        "effects": [] if found is None else [effect_entry(found)],
        "alternatives": alternatives(diagnosis),
        "fit": {
            **fitted.as_dict(),
            "held_out": {**held.as_dict(), "what": what},
            "gain_over_calibration": None if found is None else diagnosis.gain(found),
            "threshold": threshold(last.data),
        },
        "calibrated": [
            {"where": e.text, **row}
            for e in deck.fit.effects
            if e.kind == "ordinary"
            for row in e.reported(deck.fit.of(e), deck.fit.sd(e))
        ],
        "mass": {
            "weighed_kg": None if weighing is None else weighing.mass,
            "model_kg": mass_properties(stages.final)[0],
        },
        "frequencies": rows,
        "structured": left,
        "notes": [*prepared.notes, *diagnosis.notes, left["sentence"]],
    }
