"""Effects of the catalogue as choices on a recorded case: linear for agents, or fitted."""

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from chladni.effects.search_context import Candidate
from chladni.errors import ModelError
from chladni.inference.discrepancy import Discrepancy
from chladni.inference.hypothesis_fit import HypothesisFit, UpdatingProblem
from chladni.inference.likelihood import Responses
from chladni.reduced.reduced_model import evaluate
from chladni.search.candidates import candidates
from chladni.search.decision_rules import required_gain
from chladni.search.diagnosis import without_effects
from chladni.search.question import Prepared
from chladni.search.search_round import taken
from chladni.search.several import price
from chladni_planning import Linearised


@dataclass(frozen=True, eq=False)
class CatalogueChoices:
    """Every effect that the search proposes for a case, one choice each."""

    problem: UpdatingProblem  # with errors of the model's form from the state of the null
    null: HypothesisFit  # the fit of calibration parameters and nuisances alone
    candidates: tuple[Candidate, ...]  # effects, each with the values at which it scored best
    # best fits made so far, by the choices in them
    fits: dict[frozenset[int], HypothesisFit] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        """Name of each choice with its starting values."""
        each = ((c.effect, c.effect.location(c.start)) for c in self.candidates)
        return tuple(f"{e.name} {at.text}".rstrip() for e, at in each)

    def linearised(self, score: Responses, held: np.ndarray, own: int) -> Linearised:
        """Fitted and held-out residuals about the deck, with columns for parameters and effects.

        A calibration parameter enters by its slope.  An effect enters by its whole change at the
        values at which it scored best (θ = 1).  The nuisances are free in every fit: with the
        model's error they are whitened out of the fitted data.

        Parameters
        ----------
        score : data on which held-out samples are compared
        held : (n_f, n_out) bool     the held-out samples of it
        own : number of calibration parameters, which come first in the base
        """
        problem, x = self.problem, self.problem.mean()
        fitted, unseen = problem.data, score.only(held)
        assert isinstance(fitted, Responses)
        state = evaluate(problem.reduced.model, problem.base, x, True)
        sd = np.array([p.sd for e in problem.base for p in e.parameters])
        (r, J), (h, H) = (d.residual(state, True) for d in (fitted, unseen))
        J, H = J * sd, H * sd
        steps = [self._changes(c, (fitted, unseen), x) for c in self.candidates]
        more = [np.array([s[k] for s in steps]).T for k in (0, 1)]
        free, spread, _ = np.linalg.svd(J[:, own:], full_matrices=False)
        nuisances = Discrepancy(free, spread**2, 1.0)
        J = nuisances.whitened(np.hstack([J[:, :own], more[0] - r[:, None]]))
        H = np.hstack([H[:, :own], more[1] - h[:, None]])
        return Linearised(nuisances.whitened(r), J, h, H)

    def _changes(
        self, candidate: Candidate, data: Iterable[Responses], x: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """Residuals with the candidate at its starting values, added to the deck's parameters."""
        model = self.problem.reduced.model_for(candidate.effect, candidate.start)
        effects = [*self.problem.base, candidate.effect]
        state = evaluate(model, effects, np.concatenate([x, candidate.start]), False)
        return tuple(d.rebased(model).residual(state, False)[0] for d in data)

    def gain(self, chosen: Iterable[int]) -> float:
        """Gain of a set in -2 ln evidence over the null, less the price of each member.

        If it is positive, the fitted data alone would name the set.  Every set is fitted once; the
        gain is -inf where no physical structure is left.
        """
        chosen = frozenset(chosen)
        if not chosen:
            return 0.0
        try:
            return self.beyond_price(self._fitted(chosen))
        except ModelError:
            return float("-inf")

    def beyond_price(self, hypothesis: HypothesisFit) -> float:
        """Gain of a hypothesis over the null, less the price of each of its effects."""
        poles = not isinstance(self.null.data, Responses)
        due = required_gain(poles, len({c.effect.name for c in self.candidates}))
        prices = sum(price(due, size) for size in range(1, len(hypothesis.effects) + 1))
        return self.null.neg2_log_evidence - hypothesis.neg2_log_evidence - prices

    def _fitted(self, chosen: frozenset[int]) -> HypothesisFit:
        if chosen not in self.fits:
            first, *rest = (self.candidates[k] for k in sorted(chosen))
            held = self.problem.holding([(c.effect, c.start) for c in rest])
            begun = (held.mean(), taken(held, self.null, ("calibration", "nuisance")))
            tries = [held.fitted_with(first.effect, first.start, x) for x in begun]
            self.fits[chosen] = min(tries, key=lambda t: t.neg2_log_evidence)
        return self.fits[chosen]


def catalogue_choices(prepared: Prepared) -> CatalogueChoices:
    """The choices of a case that was prepared for updating."""
    problem, null = without_effects(prepared.problem)
    return CatalogueChoices(problem, null, tuple(candidates(problem, null)))
