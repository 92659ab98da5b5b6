"""Loop that makes the fits and numbers a decision requests, until the decision is reached."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ..decision.decide import RULES, decide
from ..decision.decision_rules import DecisionRules
from ..decision.hypothesis_table import (
    Ask,
    CalibratedDeck,
    HypothesisTable,
    Left,
    Row,
    SetRow,
    Votes,
    Wanted,
    after,
    refined,
)
from ..decision.reasons import Decision
from ..effects.effect import Effect
from ..errors import ModelError
from ..inference.adequacy import FitTest
from ..inference.held_out_evidence import held_out_evidence
from ..inference.hypothesis_fit import HypothesisFit, UpdatingProblem
from ..inference.least_data import CONTRADICTED
from ..inference.likelihood import Responses
from ..inference.local_damping_test import damping_test_along_effect
from ..inference.map_fit import fit
from ..inference.pole_data import Poles
from ..inference.rows_of_fits import row_of
from ..inference.written_hypothesis import as_found, as_written, of_mesh
from ..reduced.reduced_model import Reduced, evaluate
from .basis_refinement import Refinement
from .diagnosis import Diagnosis, fit_test
from .question import Prepared
from .search_round import taken
from .several import Several
from .verdict_models import given, scores_of

Refine = Callable[[HypothesisFit], Refinement]


@dataclass(frozen=True, eq=False)
class Measured:
    """Fits and numbers that were made for a decision so far.

    Attributes
    ----------
    table : the rows
    fits, tests, refinements : of its rows, by key
    written : rows as a deck can hold them
    sets : several effects, by key
    decks : of a calibration
    failed : reason why a row could not be fitted again
    whole : True where rows that were decided on keep their models, 10 to 300 MB each on a tailgate
    """

    table: HypothesisTable
    fits: Mapping[str, HypothesisFit]
    tests: Mapping[str, FitTest]
    sets: Mapping[str, Several] = field(default_factory=dict)
    refinements: Mapping[str, Refinement] = field(default_factory=dict)
    written: Mapping[str, HypothesisFit] = field(default_factory=dict)
    decks: Mapping[CalibratedDeck, HypothesisFit] = field(default_factory=dict)
    failed: Mapping[str, str] = field(default_factory=dict)
    whole: bool = False

    def row(self, row: Row) -> "Measured":
        """Return a copy with a row added or replaced."""
        return replace(self, table=self.table.having(row))

    def with_Q(self, deck: CalibratedDeck, Q: tuple[float, ...]) -> "Measured":
        """Return a copy with the Q of a calibration added."""
        return replace(self, table=replace(self.table, decks={**self.table.decks, deck: Q}))


def decided(prepared: Prepared, found: Diagnosis, refine: Refine) -> tuple[Decision, Measured]:
    """Make every fit that a decision requests; return the decision and all the fits.

    Parameters
    ----------
    refine : fits a hypothesis again on a reduced model that is accurate enough for it
    """
    return decided_by(RULES, prepared, found, refine, begun(prepared, found))


def decided_by(
    rules: DecisionRules, prepared: Prepared, found: Diagnosis, refine: Refine, known: Measured
) -> tuple[Decision, Measured]:
    """Decide by some rules, with every fit that they request beyond those that are known."""
    while isinstance(decision := decide(known.table, rules), Wanted):
        known = measured(prepared, found, refine, known, decision)
    return decision, known


def begun(prepared: Prepared, found: Diagnosis) -> Measured:
    """The rows of a diagnosis before its held-out data are evaluated."""
    sets = {f"set {k}": s for k, s in enumerate(found.sets)}
    fits = {t.effect.name: t for t in found.hypotheses} | {k: s.hypothesis for k, s in sets.items()}
    table = replace(
        found.table, enough=not prepared.too_little,
        contradicted=prepared.numbers >= CONTRADICTED,
        sets=tuple(_set_row(key, s) for key, s in sets.items()),
    )  # fmt: skip
    rows = [row_of(s.hypothesis, key) for key, s in sets.items()]
    for made in table.sets:
        without = enumerate(zip(made.members, sets[made.key].without, strict=True))
        rows += [Row(made.member(k), (n,), t.neg2_log_evidence) for k, (n, t) in without]
    return Measured(table.having(*rows), fits, found.tests, sets)


def _set_row(key: str, s: Several) -> SetRow:
    names = tuple(e.name for e in s.own.effects)
    return SetRow(key, names, s.gains, s.due, s.ahead, s.alternatives)


def measured(
    prepared: Prepared, found: Diagnosis, refine: Refine, known: Measured, wanted: Wanted
) -> Measured:
    """Return the known fits and numbers with the wanted one added."""
    key, problem = wanted.key, prepared.problem
    if wanted.ask is Ask.RENEWAL:
        return _refined(prepared, found, refine, known, key)
    if wanted.ask is Ask.DECK:
        return _calibrated(prepared, found, known, CalibratedDeck[key])
    row = known.table.rows[key]
    if wanted.ask is Ask.VOTES:
        return known.row(replace(row, votes=_votes(prepared, found, known, key)))
    if wanted.ask is Ask.LEFT:
        written = as_written(known.fits[key], problem.mass_measurement)
        own, plain = known.fits[key], found.plain
        stages = [(plain, plain.fit.state), (own, written.fit.state)]
        left = Left(*((a, b) for a, b in scores_of(prepared, own, stages, prepared.held.choosing)))
        return replace(known, written={**known.written, key: written}).row(replace(row, left=left))
    if wanted.ask is Ask.AFTER:
        return _after(prepared, known, row, wanted.after)
    tested_one = known.fits.get(key, found.null)
    chances = fit_test(problem, tested_one)
    tests = {**known.tests, key: chances.test} if chances.test else known.tests
    return replace(known, tests=tests).row(chances.of(row))


def _votes(prepared: Prepared, found: Diagnosis, known: Measured, key: str) -> Votes:
    """Held-out evidence on a row, or on a member of a set with the other members in place."""
    problem, unseen = prepared.problem, prepared.unseen.choosing
    if key in known.fits:
        tested_one = held_out_evidence(problem, unseen, found.null, known.fits[key])
    else:
        whole, member = key.rsplit("/", 1)
        s = known.sets[whole]
        tested_one = held_out_evidence(problem, unseen, s.without[int(member)], s.own, s.about)
    return Votes(tested_one.held_out, tested_one.sensors, tested_one.lines)


def _refined(
    prepared: Prepared, found: Diagnosis, refine: Refine, known: Measured, key: str
) -> Measured:
    """Fit a row again on an accurate enough model; an alternative first gets its own basis.

    Among earlier refinements only the leader keeps its model, because the others are decided on.
    """
    lead, alternative = known.table.singles[:1], known.fits[key]
    try:
        if (key,) != lead and key not in known.sets:
            alternative = on_its_own_basis(prepared, found, alternative)
        whole = refine(alternative)
    except ModelError as error:
        row = replace(known.table.rows[key], key=refined(key), fitted=False)
        return replace(known, failed={**known.failed, key: str(error)}).row(row)
    done = {refined(k) for k in known.refinements if (k,) != lead and not known.whole}
    fits, written = (
        {k: t for k, t in every.items() if k not in done} for every in (known.fits, known.written)
    )
    return replace(
        known, fits={**fits, refined(key): whole.hypothesis}, written=written,
        refinements={**known.refinements, key: replace(whole, hypothesis=found.null)},  # no model
    ).row(row_of(whole.hypothesis, refined(key)))  # fmt: skip


def on_its_own_basis(
    prepared: Prepared, found: Diagnosis, alternative: HypothesisFit
) -> HypothesisFit:
    """Fit an alternative again from its result: a diagnosis keeps only its leader's model."""
    null, problem = found.null.data, prepared.problem
    assert isinstance(null, (Responses, Poles))
    problem = replace(problem, data=null.rebased(problem.reduced.model))
    base = taken(problem, alternative, ("calibration", "nuisance"))
    return problem.fitted_with(alternative.effect, alternative.fit.of(alternative.effect), base)


def _after(prepared: Prepared, known: Measured, row: Row, leader: str) -> Measured:
    """Test whether the damping that a row does not explain follows the leader's changes."""
    key, test, damping = after(row.key, leader), known.tests.get(row.key), prepared.problem.damping
    tested_one = Row(key, row.names, row.neg2_log_evidence, p_damping=1.0)
    if test is None or damping is None:
        return known.row(tested_one)
    left = damping.beyond(known.fits[row.key].fit.state)
    follows = damping_test_along_effect(test, known.fits[leader], left)
    tests = {**known.tests, key: follows}
    return replace(known, tests=tests).row(replace(tested_one, p_damping=follows.p))


def _calibrated(
    prepared: Prepared, found: Diagnosis, known: Measured, deck: CalibratedDeck
) -> Measured:
    """Q of a calibration on the fitted data, with the mesh error and without it, as in a deck."""
    null, problem = found.null, prepared.problem

    def Q(model: Reduced, effects: Sequence[Effect], x: np.ndarray) -> tuple[float, ...]:
        data = prepared.score.rebased(model)
        try:
            idle = np.where(of_mesh(effects), 0.0, x)
            ways = (idle,) if isinstance(data, Poles) else (x, idle)
            each = [evaluate(model, effects, at, False) for at in ways]
        except ModelError:  # no physical structure: this calibration is no candidate
            return (np.inf, np.inf)
        return tuple(data.Q(state, data.use) for state in each)

    if deck is CalibratedDeck.GIVEN:
        x = given(problem, null)
        off = not found.hypotheses and _leaves_the_scales(problem, null, x)
        known = replace(known, table=replace(known.table, off_the_scales=off))
        return known.with_Q(deck, Q(null.model, problem.base, x))
    try:
        made = numbers(prepared, found, known, deck)
    except ModelError:  # without scatter its numbers belong to no physical structure
        return known.with_Q(deck, ())
    known = replace(known, decks={**known.decks, deck: made})
    return known.with_Q(deck, Q(made.model, made.fit.effects, made.fit.x))


def _leaves_the_scales(problem: UpdatingProblem, null: HypothesisFit, x: np.ndarray) -> bool:
    """True where the deck's mass is not the weighed one: a calibration alone cannot keep it."""
    weighed = problem.mass_measurement
    if weighed is None:
        return False
    state = evaluate(null.model, problem.base, x, False)
    return not weighed.agrees(float(state.weight))


def numbers(
    prepared: Prepared, found: Diagnosis, known: Measured, deck: CalibratedDeck
) -> HypothesisFit:
    """The calibration that is reported where no effect is named."""
    mass = prepared.problem.mass_measurement
    if deck in known.decks:
        return known.decks[deck]
    if deck is CalibratedDeck.FOUND:
        return as_found(found.null)
    plain = found.plain
    fits_itself = deck is CalibratedDeck.WRITTEN and isinstance(plain.data, Poles)
    if deck is CalibratedDeck.PLAIN or fits_itself:
        return plain
    if deck is CalibratedDeck.WRITTEN:
        return as_written(found.null, mass)
    x = [
        np.array([p.nominal for p in e.parameters]) if e.kind == "calibration" else plain.fit.of(e)
        for e in plain.fit.effects
    ]
    begun = np.concatenate([np.zeros(0), *x])
    own = fit(plain.model, plain.fit.effects, plain.data, mass, begun, max_steps=0)
    return replace(plain, fit=own)
