"""A fit once more where the reduced model has left its ground."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..fem.modelled import modelled
from .accuracy import LIMIT, Accuracy, accuracy
from .hypothesis_fit import HypothesisFit, UpdatingProblem, fitted
from .joint_fit import with_priors
from .likelihood import Poles, Responses
from .nuisances import measured_on, mesh_hidden, nuisances
from .preparation import SOLVED, updating_problem
from .question import Prepared, Question
from .reduced_model import evaluate
from .reduced_problem import reduced_problem

TRIES = 3  # times the basis is widened by what it lacks


@dataclass(frozen=True, eq=False)
class Renewal:
    """A hypothesis on ground that bears it.

    Attributes
    ----------
    hypothesis : HypothesisFit
    note : how far the reduced model is off
    worst : largest relative frequency error that is left
    """

    hypothesis: HypothesisFit
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


def renewed(
    question: Question, prepared: Prepared, hypothesis: HypothesisFit, held: bool = False
) -> Renewal:
    """The hypothesis on ground that bears it, and a sentence on how far the reduced model is off.

    Mesh error, modal discrepancy and the basis belong to the structure they were made for. Where
    the effect makes it another one they are made anew. Elsewhere the basis is widened by what it
    lacks, while it lacks more than ``LIMIT``. The same parameters are then fitted from where they
    were, or ``held`` there.
    """
    problem = prepared.problem
    if any(e.remakes_structure for e in hypothesis.effects):
        problem, hypothesis = _on_new_structure(question, problem, hypothesis)
    found = _accuracy(problem, hypothesis)
    note = _said(found)
    for _ in range(TRIES):
        if found.serves():
            break
        model, begun = found.renewed(hypothesis.model), hypothesis.fit
        data = hypothesis.data.over(model)
        try:
            if held:
                state = evaluate(model, begun.effects, begun.x)
                fit = replace(begun, state=state, data=data)
            else:
                fit = fitted(model, begun.effects, data, problem.mass_measurement, begun.x)
        except ModelError as error:  # what the coarse basis could not feel
            note = f"{note}; with what it lacked added to its basis it could not be fitted: {error}"
            break
        hypothesis = replace(hypothesis, fit=fit, model=model)
        found = _accuracy(problem, hypothesis)
        note = f"{note}; with what it lacked added to its basis, {found.worst:.2%}"
    return Renewal(hypothesis, note, found.worst)


def _accuracy(problem: UpdatingProblem, hypothesis: HypothesisFit) -> Accuracy:
    model, fit = hypothesis.model, hypothesis.fit
    return accuracy(problem.reduced, model, fit.effects, fit.x, problem.setup.f_max)


def _said(found: Accuracy) -> str:
    return (
        f"the frequencies of the reduced model are {found.worst:.2%} off those of the full one at "
        f"most; {LIMIT:.2%} still serve"
    )


def _on_new_structure(
    question: Question, old: UpdatingProblem, hypothesis: HypothesisFit
) -> tuple[UpdatingProblem, HypothesisFit]:
    """A strong change fitted again on a structure that has it already, with all named beside it."""
    assembly, found = question.assembly, []
    for effect in hypothesis.effects:
        x = hypothesis.fit.of(effect)
        if effect.remakes_structure:
            assembly, effect = effect.apply(assembly, x), effect.with_reference_state(x)
        found.append((effect, x))
    changed = replace(question, assembly=assembly)
    data, f_max = hypothesis.data, old.setup.f_max
    assert isinstance(data, (Responses, Poles))
    model = modelled(changed.searched(changed.assembly), SOLVED * f_max)
    rows = (data.outputs, data.inputs) if isinstance(data, Responses) else ()
    mesh = mesh_hidden(model, f_max, measured_on(changed) if rows else None)
    reduced = reduced_problem(
        model, f_max, sp.csr_array(sp.vstack(rows)) if rows else None, groups=64 if rows else 48,
        base=question.base,
    )  # fmt: skip
    of_test = [e for e in old.nuisance if e.outputs(np.zeros(len(e.parameters))) is not None]
    fresh = updating_problem(
        changed,
        reduced,
        data.over(reduced.model),
        [*nuisances(reduced, model, mesh, None if rows else f_max), *of_test],
        f_max,
    )
    fresh = replace(fresh, base=tuple(with_priors(fresh.base, old.base)))
    (first, start), *beside = found
    fresh = fresh.holding(beside)
    return fresh, _with_valleys(fresh.fitted_with(first, start, fresh.mean()), hypothesis)


def _with_valleys(hypothesis: HypothesisFit, old: HypothesisFit) -> HypothesisFit:
    """The hypothesis with other values that it had, as far behind it as they were."""
    ahead = hypothesis.neg2_log_evidence - old.neg2_log_evidence
    valleys = (replace(v, neg2_log_evidence=v.neg2_log_evidence + ahead) for v in old.valleys)
    return replace(hypothesis, valleys=tuple(valleys))
