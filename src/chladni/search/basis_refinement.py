"""Renewal of a fit where the reduced model is no longer accurate."""

from dataclasses import replace

import scipy.sparse as sp

from ..effects.effect import of_test
from ..errors import ModelError
from ..fem.modelled import modelled
from ..inference.hypothesis_fit import HypothesisFit, UpdatingProblem, fitted
from ..inference.joint_fit import with_priors
from ..inference.likelihood import Responses
from ..inference.map_fit import fit
from ..inference.pole_data import Poles
from ..reduced.accuracy import LIMIT, Accuracy, accuracy
from ..reduced.reduced_problem import reduced_problem
from .base_effects import mesh_hidden, nuisances
from .preparation import SOLVED, updating_problem
from .question import Prepared, Question

TRIES = 3  # times the basis is extended by its missing vectors


def refined(
    prepared: Prepared, hypothesis: HypothesisFit, written: bool = False
) -> tuple[HypothesisFit, str, tuple[str, ...]]:
    """Fit a hypothesis again on an accurate reduced model; the model's error, reasons for distrust.

    Mesh error, modal discrepancy and the basis belong to the structure they were made for. They are
    computed again where the effect changes that structure. Otherwise the basis is extended by its
    missing vectors until its error is at most ``LIMIT``. All parameters are then fitted again from
    their last values. The form of a deck (``written``) keeps the learned error of the model.
    """
    problem = prepared.problem
    if any(e.traits.remakes_structure for e in hypothesis.effects):
        problem, hypothesis = _on_new_structure(prepared.question, problem, hypothesis)
    found = _accuracy(problem, hypothesis)
    note, first = _said(found), found.worst
    for _ in range(TRIES):
        if found.serves():
            break
        model, begun = found.refined(hypothesis.model), hypothesis.fit
        data = hypothesis.data.rebased(model)
        try:
            again = fit if written else fitted
            made = again(model, begun.effects, data, problem.mass_measurement, begun.x).kept()
        except ModelError as error:  # the coarse basis hid an impossible structure
            note = f"{note}; the fit on the refined basis failed: {error}"
            break
        hypothesis = replace(hypothesis, fit=made, model=model)
        found = _accuracy(problem, hypothesis)
        note = f"{_said(found)}, after {_percent(first)} before its basis was refined"
    if found.worst <= LIMIT:
        return hypothesis, note, ()
    why = (
        f"the frequencies of the reduced model differ from the full model by "
        f"{_percent(found.worst)}, above the limit of {_percent(LIMIT)}: do not trust the result; "
        "narrow the band, or correct the deck first"
    )
    return hypothesis, note, (why,)


def _accuracy(problem: UpdatingProblem, hypothesis: HypothesisFit) -> Accuracy:
    model, fit = hypothesis.model, hypothesis.fit
    return accuracy(problem.reduced, model, fit.effects, fit.x, problem.setup.f_max)


def _said(found: Accuracy) -> str:
    return (
        "the frequencies of the reduced model differ from the full model by at most "
        f"{_percent(found.worst)} (limit {_percent(LIMIT)})"
    )


def _percent(share: float) -> str:
    """A share in per cent, to a hundredth.

    >>> _percent(0.0012), _percent(1e-6)
    ('0.12 %', 'less than 0.01 %')
    """
    return f"{100 * share:.2f} %" if share >= 5e-5 else "less than 0.01 %"


def _on_new_structure(
    question: Question, old: UpdatingProblem, hypothesis: HypothesisFit
) -> tuple[UpdatingProblem, HypothesisFit]:
    """Fit a strong change again on a structure that includes it, with the other named effects."""
    assembly, found = question.assembly, []
    for effect in hypothesis.effects:
        x = hypothesis.fit.of(effect)
        if effect.traits.remakes_structure:
            assembly, effect = effect.apply(assembly, x), replace(effect, in_structure=x.copy())
        found.append((effect, x))
    changed = replace(question, assembly=assembly)
    data, f_max = hypothesis.data, old.setup.f_max
    assert isinstance(data, (Responses, Poles))
    model = modelled(changed.searched(changed.assembly), SOLVED * f_max)
    rows = (data.outputs, data.inputs) if isinstance(data, Responses) else ()
    seen = rows or (isinstance(data, Poles) and data.shapes is not None)
    mesh = mesh_hidden(model, f_max, changed.rows if seen else None)
    reduced = reduced_problem(
        model, f_max, sp.csr_array(sp.vstack(rows)) if rows else None, groups=64 if rows else 48,
        base=question.base,
    )  # fmt: skip
    own = nuisances(reduced, model, mesh, None if rows else f_max)
    own = [*own, *filter(of_test, old.nuisance)]
    fresh = updating_problem(changed, reduced, data.rebased(reduced.model), own)
    fresh = replace(fresh, base=tuple(with_priors(fresh.base, old.base)))
    (first, start), *others = found
    fresh = fresh.holding(others)
    refined = fresh.fitted_with(first, start, fresh.mean())
    return fresh, replace(refined, optima=hypothesis.refitted(refined.fit).optima)
