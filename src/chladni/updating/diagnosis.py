"""From a recording to the name of what the model left out.

1. null: ordinary parameters and scatter alone, from several starts;
2. scan: every candidate of the catalogue by fast re-analysis about two baselines, u = 0;
3. fits: the best places of every family, jointly with the ordinary parameters and the scatter;
4. evidence: Laplace, with 2 ln of the number of places tried; leaders restart the null;
5. verdict.
"""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from ..effects.effect import Effect
from ..effects.registry import families
from ..errors import ModelError
from .adequacy import FitTest, adequacy
from .candidates import candidates
from .discrepancy import MEDIAN
from .held_out_evidence import HeldOutEvidence
from .hypothesis_fit import ROUGH, Search, Trial, fitted
from .likelihood import Responses
from .map_fit import Status
from .reduced_model import evaluate

FALSE_ALARM = 1e-3  # chance that any family is named where nothing is missing
CHANGED = 6.0  # gain that ordinary parameters must bring to be called calibrated
BEHIND = 30.0  # price of any effect, in -2 ln evidence, with room to spare
RUNNING = 3  # families that are fitted to the end, at rest or not

Progress = Callable[[str, float], None]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What was found.

    Attributes
    ----------
    nominal, null : fits without, and with ordinary parameters free, scatter allowed in both
    plain : ordinary parameters alone, as any calibration would; what Q is compared with
    trials : best trial of every family, best first
    verdict : one of the public verdicts
    notes : what was done and why, one sentence each
    written : the named effect as a deck can hold it, once the held-out data have been heard
    adequacy : whether the explanation fits at all, where that was tested
    one_of : what the data cannot tell apart, where they are too few to name anything
    heard : what data that no fit saw say of the leading effect
    """

    nominal: Trial
    null: Trial
    plain: Trial
    trials: tuple[Trial, ...]
    verdict: str
    notes: tuple[str, ...] = ()
    written: Trial | None = None
    adequacy: FitTest | None = None
    one_of: tuple[str, ...] = ()
    heard: HeldOutEvidence | None = None

    @property
    def found(self) -> Trial | None:
        """The named effect, if any."""
        named = self.verdict in ("missing physics", "measurement fault")
        return self.trials[0] if named and self.trials else None

    def gain(self, trial: Trial) -> float:
        """How much better than the null, in -2 ln evidence."""
        return self.null.S - trial.S


def diagnose(
    search: Search, progress: Progress = lambda text, share: None, effects: bool = True
) -> Diagnosis:
    """Name the missing physics, or say that none is missing; without ``effects``, calibrate.

    A calibration alone is also begun from random values of the ordinary parameters; the effects
    bring starts of their own.
    """
    progress("calibration without new physics", 0.05)
    search, null = _null(search)
    nominal = _base_trial(search, search.nuisance, _nominal_starts(search))
    if not effects:
        return _calibrated(search, nominal, null)
    plain = _plain(search, null)
    progress("scan of the catalogue", 0.2)
    tried = candidates(search, null)
    trials = []
    for k, c in enumerate(tried):
        progress(f"trying {c.effect.name} {c.effect.text}", 0.3 + 0.4 * k / len(tried))
        trials += _tried(search, null, c.effect, c.start, c.base)
    trials = _by_family(trials)
    progress("closing in on the place", 0.7)
    trials = _by_family([_finished(search, t, k < RUNNING) for k, t in enumerate(trials)])
    trials = _by_family([*trials, *(t for lead in trials[:RUNNING] for t in _closer(search, lead))])
    null = _restarted(search, null, trials)
    progress("verdict", 0.95)
    called = verdict(nominal, null, trials)
    found = Diagnosis(nominal, null, plain, tuple(trials), called)
    return tested(found, search)


def tested(diagnosis: Diagnosis, search: Search) -> Diagnosis:
    """The diagnosis with its explanation held against what it predicts itself."""
    winner = diagnosis.found or diagnosis.null
    fits = adequacy(winner, search.weighing, search.labels)
    if fits is None:
        return diagnosis
    name = winner.effect.name if diagnosis.found else "calibration alone"
    note = f"of the model's own draws {fits.p:.0%} fit no better than {name}: {fits.what}"
    if fits.passes:
        return replace(diagnosis, adequacy=fits, notes=(*diagnosis.notes, note))
    note = f"{note}, {fits.where}; nothing in the catalogue explains the recording"
    notes = (*diagnosis.notes, note)
    return replace(diagnosis, adequacy=fits, verdict="not in catalogue", notes=notes, written=None)


def _null(search: Search) -> tuple[Search, Trial]:
    """The null, and the search with errors of the model's form as they spread from its state."""
    model, delta = search.bench.model, MEDIAN
    state = evaluate(model, search.base, search.mean(), False)
    starts = _null_starts(search)
    for _ in range(2):
        search = search.allowing_errors(state, delta)
        null = _base_trial(search, search.base, starts)
        if not isinstance(null.data, Responses) or null.data.error is None:
            break
        state, delta, starts = null.fit.state, null.data.error.delta, [null.fit.x]
    return search, null


def threshold() -> float:
    """The gain in -2 ln evidence that is needed to name anything.

    Under the null a Bayes factor has mean one, so that it exceeds B with probability 1/B at most
    (Markov); the families share the chance of a false alarm.
    """
    return float(2 * np.log(len(families()) / FALSE_ALARM))


def verdict(nominal: Trial, null: Trial, trials: Sequence[Trial]) -> str:
    """The public verdict."""
    best = trials[0] if trials else None
    if best is not None and null.S - best.S > threshold():
        return "measurement fault" if best.effect.kind == "test" else "missing physics"
    return "calibration only" if nominal.S - null.S > CHANGED else "nothing missing"


def _calibrated(search: Search, nominal: Trial, null: Trial) -> Diagnosis:
    """The best of the usual and of random starts, and how many of them agree."""
    tries = [_base_trial(search, search.base, [x]) for x in _random_starts(search)]
    best = min([null, *tries], key=lambda t: t.S)
    agree = sum(t.S < best.S + 1 for t in [null, *tries])
    note = (
        f"{agree} of {len(tries) + 1} starts, {len(tries)} of them random, ended within 1 of the "
        "best -2 ln evidence"
    )
    plain = _plain(search, best)
    return tested(Diagnosis(nominal, best, plain, (), verdict(nominal, best, ()), (note,)), search)


def _random_starts(search: Search, count: int = 4) -> list[np.ndarray]:
    """Ordinary parameters drawn from their prior, the rest at its mean (a fixed seed)."""
    rng = np.random.default_rng(20250102)
    own = [e.kind == "ordinary" for e in search.base for _ in e.parameters]
    sd = np.array([p.sd for e in search.base for p in e.parameters]) * own
    return [search.mean() + sd * rng.normal(size=len(sd)) for _ in range(count)]


def _base_trial(search: Search, effects: Sequence[Effect], starts: list[np.ndarray]) -> Trial:
    """Best fit of these effects alone over several starts."""
    model = search.bench.model
    fits = [fitted(model, effects, search.data, search.weighing, x) for x in starts]
    return Trial(Effect(), min(fits, key=lambda f: f.S), model)


def _plain(search: Search, null: Trial) -> Trial:
    """Ordinary parameters without scatter or jitter, from the same starts and from the null."""
    kept = [e.writable for e in search.base]
    chosen = [e for e, k in zip(search.base, kept, strict=True) if k]
    inside = np.concatenate(
        [np.full(len(e.parameters), k) for e, k in zip(search.base, kept, strict=True)]
    ).astype(bool)
    search = search.exactly()
    return _base_trial(search, chosen, [x[inside] for x in (*_null_starts(search), null.fit.x)])


def _nominal_starts(search: Search) -> list[np.ndarray]:
    return [np.array([p.mean for e in search.nuisance for p in e.parameters])]


def _null_starts(search: Search) -> list[np.ndarray]:
    """The prior mean; where modes must be paired, also softer and stiffer by up to a third."""
    mean = search.mean()
    if isinstance(search.data, Responses):
        return [mean]
    stiff = np.array([p.name == "E" for e in search.base for p in e.parameters], dtype=float)
    return [mean + shift * stiff for shift in (0.0, -0.35, 0.35, -0.7, 0.7)]


def _tried(
    search: Search, null: Trial, effect: Effect, start: np.ndarray, base: np.ndarray
) -> list[Trial]:
    """Rough fits; the second begins at the null, where the first has not even come as far as that.

    With the effect idle a hypothesis is the null: one that stays behind it by more than its price
    has only stopped on the way. A start that is no structure at all (negative stiffness) is none.
    """
    out: list[Trial] = []
    for x in (base, null.fit.x):
        if out and out[0].S < null.S + BEHIND:
            break
        with suppress(ModelError):
            out.append(search.trial(effect, start, x, ROUGH))
    return out


def _by_family(trials: list[Trial]) -> list[Trial]:
    """The best trial of every family, best first."""
    best: dict[str, Trial] = {}
    for t in trials:
        if t.effect.name not in best or t.S < best[t.effect.name].S:
            best[t.effect.name] = t
    return sorted(best.values(), key=lambda t: t.S)


def _finished(search: Search, trial: Trial, running: bool) -> Trial:
    """A hypothesis in the running, or not yet at rest, fitted to the end from where it is."""
    at_rest = trial.fit.status is not Status.OUT_OF_STEPS
    if not isinstance(search.data, Responses) or (at_rest and not running):
        return trial
    fit = fitted(trial.model, trial.fit.effects, trial.data, search.weighing, trial.fit.x)
    return Trial(trial.effect, fit, trial.model) if fit.S < trial.S else trial


def _closer(search: Search, lead: Trial) -> list[Trial]:
    """The leader begun anew about the place it moved to, while it moves."""
    out: list[Trial] = []
    for _ in range(3):
        again = lead.effect.recentred(lead.fit.of(lead.effect), search.where)
        if again is None:
            break
        try:
            trial = search.trial(*again, _taken(search, lead, ("ordinary",)))
        except ModelError:
            break
        out.append(trial)
        if trial.S > lead.S - 1:
            break
        lead = trial
    return out


def _taken(search: Search, lead: Trial, kinds: tuple[str, ...]) -> np.ndarray:
    """Base parameters at their prior mean, those of these kinds as the leader has them."""
    x, at = search.mean(), 0
    kept = search.without(lead.effect)
    for e in search.base:
        if e in kept and e.kind in kinds:
            x[at : at + len(e.parameters)] = lead.fit.of(e)
        at += len(e.parameters)
    return x


def _restarted(search: Search, null: Trial, trials: list[Trial]) -> Trial:
    """The null again, from the base parameters of the leaders: it must not lose by a bad start."""
    tries = [null]
    for lead in trials[:2]:
        with suppress(ModelError):
            start = _taken(search, lead, ("ordinary", "nuisance"))
            tries.append(_base_trial(search, search.base, [start]))
    return min(tries, key=lambda t: t.S)
