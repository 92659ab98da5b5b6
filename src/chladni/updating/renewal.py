"""A fit once more where the reduced model has left its ground."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..fem.modelled import modelled
from .accuracy import LIMIT, Accuracy, accuracy
from .hypothesis_fit import Search, Trial, fitted
from .likelihood import Responses
from .preparation import SOLVED, nuisances, searched
from .question import Prepared, Question
from .reduced_problem import workbench

TRIES = 3  # times the basis is widened by what it lacks


@dataclass(frozen=True, eq=False)
class Renewal:
    """A trial on ground that bears it.

    Attributes
    ----------
    trial : Trial
    note : how far the reduced model is off
    worst : largest relative frequency error that is left
    """

    trial: Trial
    note: str
    worst: float

    @property
    def distrust(self) -> tuple[str, ...]:
        """Why the result is not to be trusted; empty where the reduced model serves."""
        if self.worst <= LIMIT:
            return ()
        return (
            f"the frequencies of the reduced model stay {self.worst:.2%} off those of the full "
            f"one, {LIMIT:.2%} would serve: the result is not to be trusted; narrow the band, or "
            "bring the deck nearer to the structure first",
        )


def renewed(question: Question, prepared: Prepared, trial: Trial) -> Renewal:
    """The trial on ground that bears it, and a sentence on how far the reduced model is off.

    Mesh error, jitter and the basis belong to the structure they were made for. Where the effect
    makes it another one they are made anew. Elsewhere the basis is widened by what it lacks, while
    it lacks more than ``LIMIT``. The same parameters are then fitted from where they were.
    """
    search = prepared.search
    if trial.effect.remakes_structure:
        search, trial = _on_new_structure(question, search, trial)
    found = _accuracy(search, trial)
    note = _said(found)
    for _ in range(TRIES):
        if found.serves():
            break
        model = found.renewed(trial.model)
        data = trial.data.over(model)
        fit = fitted(model, trial.fit.effects, data, search.weighing, trial.fit.x)
        trial = Trial(trial.effect, fit, model)
        found = _accuracy(search, trial)
        note = f"{note}; with what it lacked added to its basis, {found.worst:.2%}"
    return Renewal(trial, note, found.worst)


def _accuracy(search: Search, trial: Trial) -> Accuracy:
    return accuracy(search.bench, trial.model, trial.fit.effects, trial.fit.x, search.setup.f_max)


def _said(found: Accuracy) -> str:
    return (
        f"the frequencies of the reduced model are {found.worst:.2%} off those of the full one at "
        f"most; {LIMIT:.2%} still serve"
    )


def _on_new_structure(question: Question, old: Search, trial: Trial) -> tuple[Search, Trial]:
    """A strong change fitted again on a structure that has it already."""
    effect = trial.effect
    x = trial.fit.of(effect)
    changed = replace(question, assembly=effect.apply(question.assembly, x))
    data, f_max = old.data, old.setup.f_max
    model = modelled(changed.tested(changed.assembly), SOLVED * f_max)
    rows = (data.outputs, data.inputs) if isinstance(data, Responses) else ()
    bench = workbench(
        model, f_max, sp.csr_array(sp.vstack(rows)) if rows else None, groups=64 if rows else 48
    )
    of_test = [e for e in old.nuisance if e.outputs(np.zeros(len(e.parameters))) is not None]
    fresh = searched(
        changed,
        bench,
        data.over(bench.model),
        [*nuisances(bench, model, f_max, not rows), *of_test],
        f_max,
    )
    return fresh, fresh.trial(effect.with_reference_state(x), x, fresh.mean())
