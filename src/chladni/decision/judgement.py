"""A row against the rules: whether it fits, and whether data that no fit saw support it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp

from .decision_rules import DecisionRules
from .hypothesis_table import NULL, HypothesisTable, Row, Votes, needed
from .reasons import BEYOND, Decision, Reason, Step, steps
from .tied import tied


@dataclass(frozen=True)
class JudgedTable:
    """A table and the rules it is judged by."""

    table: HypothesisTable
    rules: DecisionRules

    def due(self, row: Row | None, more: int = 0) -> float:
        """Gain that is needed to name a row; ``more`` sets stand beside the families tried."""
        return needed(self.table, row, len(self.table.singles) + more, self.rules)

    def rows(self, keys: Sequence[str]) -> tuple[Row, ...]:
        """The rows of some keys."""
        return tuple(self.table.rows[k] for k in keys)

    def calibrated(self) -> str:
        """The verdict where nothing is named."""
        changed = self.table.nominal - self.table.null.neg2_log_evidence > self.rules.changed
        return "calibration only" if changed else "nothing missing"

    def carried(self, gain: float, votes: Votes, due: float, poles: bool = False) -> bool:
        """Whether fitted data and those that no fit saw bear a name that has to gain what is due.

        ``poles`` are few: all of them together bear it, or do not. So do responses, where all that
        was asked speaks for the name and what was fitted bears a good part of it.
        """
        together = gain + votes.news
        for_it = gain > self.rules.good_part * due and votes.all_for
        poles = poles and self.rules.poles_together
        least = together if poles or for_it else min(gain, together)
        return least > due and not any(g < -self.rules.opposed * due for g in votes.given)


def tested(case: JudgedTable, decision: Decision, row: Row) -> Decision:
    """The row is named where it fits, and refused where it does not."""
    decision = replace(
        decision, tested=row.key, steps=steps(decision, Step(Reason.TESTED, row.key))
    )
    if row.fits(case.rules):
        return replace(decision, verdict=row.verdict, reason=Reason.NAMED, named=True)
    return replace(decision, verdict="not in catalogue", reason=Reason.UNFIT, named=False)


def untested(case: JudgedTable, decision: Decision) -> Decision:
    """Nothing is named; calibration alone fits, or nothing in the catalogue explains the data."""
    fits = case.table.null.fits(case.rules)
    return replace(
        decision, verdict=case.calibrated() if fits else "not in catalogue", tested=NULL,
        named=False, steps=steps(decision, Step(Reason.TESTED, NULL)),
    )  # fmt: skip


def judged(case: JudgedTable, decision: Decision, most_left: float) -> Decision:
    """The decision once data that no fit saw have been asked of the first row.

    The fitted data must carry a name after the fit was renewed. The others refuse it as surely:
    where they speak against it by the gain that would be needed to name it, where less than that is
    left of all data together, or where the deck with the effect does harm: by far, or at all where
    the fitted data bear the name by less than twice the gain due. Nor is named what leaves more
    than ``most_left`` of the Q of plain calibration, of what was fitted and of what was not. Data
    that cannot feel the effect are predicted alike without it and have no vote. Where all data
    together, or what was fitted by far, still want more than calibration, what is missing is not in
    the catalogue; or it is the leader with more beside it, where no data speak against that.
    """
    table, rules = case.table, case.rules
    row = table.rows[decision.order[0]]
    due, gain, votes, left = decision.due, table.gain(row), row.heard(), row.leaves()
    decision = replace(decision, votes=votes)
    voted = case.carried(gain, votes, due, table.poles)
    calibrated, held_out = left.held_out
    borne = voted and not held_out > rules.harm * calibrated
    faint = gain < rules.faint * due and held_out > calibrated
    if borne and not (faint or _leaves_more(row, most_left)):
        return replace(
            decision, verdict=row.verdict, reason=Reason.NAMED, named=True,
            steps=steps(decision, Step(Reason.HEARD, row.key)),
        )  # fmt: skip
    why = Reason.AGAINST if any(g < 0 for g in votes.given) else Reason.TOO_LITTLE
    if voted:
        why = Reason.WORSE if faint or not borne else Reason.LEAVES_MORE
    refused = replace(
        decision, reason=why, named=False, steps=steps(decision, Step(why, row.key)), one_of=()
    )
    together = gain + votes.news
    if together > rules.all_data * due and not borne:
        by, gain = Reason.ALL_DATA, together
    elif gain > rules.conflict * due:
        by = Reason.WHAT_WAS_FITTED
    else:
        return untested(case, refused)
    one_of = (*tied(row, case.rows(decision.order), rules.tied), BEYOND) if voted else ()
    return replace(
        refused, verdict="not in catalogue", one_of=one_of, tested=None,
        refuting=(by, min(1.0, table.families * exp(-gain / 2))),
        steps=steps(refused, Step(by, row.key, why, names=one_of)),
    )  # fmt: skip


def _leaves_more(row: Row, most: float) -> bool:
    """Whether a name leaves more of Q than may be left, fitted and held out.

    A fault of a few channels is asked of what they recorded and no fit saw: of all it is little.
    """
    if not (row.physics or row.channels):
        return False
    left = row.leaves()
    asked = (left.held_out,) if row.channels else (left.fitted, left.held_out)
    return all(with_it > most * calibrated for calibrated, with_it in asked)
