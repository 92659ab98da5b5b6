"""Apply the rules to a row: the test of fit and the support by held-out data."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

from .decision_rules import DecisionRules
from .hypothesis_table import NULL, HypothesisTable, Row, needed
from .reasons import Decision, Reason, Step, steps


@dataclass(frozen=True)
class JudgedTable:
    """A table and the rules that apply to it."""

    table: HypothesisTable
    rules: DecisionRules

    def due(self, row: Row | None, more: int = 0) -> float:
        """Gain required to name a row; ``more`` sets count in addition to the families tried."""
        return needed(self.table, row, len(self.table.singles) + more, self.rules)

    def rows(self, keys: Sequence[str]) -> tuple[Row, ...]:
        """The rows of some keys."""
        return tuple(self.table.rows[k] for k in keys)

    def calibrated(self) -> str:
        """The verdict where nothing is named; joints beyond their usual scatter are calibrated."""
        null = self.table.null
        changed = self.table.nominal - null.neg2_log_evidence > self.rules.changed
        strained = null.strained
        return "calibration only" if changed or strained else "nothing missing"

    def suffices(self, row: Row, gain: float, due: float) -> bool:
        """True if fitted and held-out data together bring the required gain ``due``.

        P(fitted) P(held out | fitted) = P(both): the evidence of all data is the sum of both gains.
        Fitted responses must bring ``good_part`` of it. Natural frequencies are few, and any part
        will do.
        """
        part = 0.0 if self.table.poles else self.rules.good_part
        return gain > part * due and gain + row.foretold() > due


def tested(case: JudgedTable, decision: Decision, row: Row) -> Decision:
    """Name the row if it fits, and refuse it otherwise."""
    decision = replace(
        decision, tested=row.key, steps=steps(decision, Step(Reason.TESTED, row.key))
    )
    if row.fits(case.rules):
        return replace(decision, verdict=row.verdict, reason=Reason.NAMED, named=True)
    return replace(decision, verdict="not in catalogue", reason=Reason.UNFIT, named=False)


def untested(case: JudgedTable, decision: Decision) -> Decision:
    """Name nothing; calibration alone fits, or nothing in the catalogue explains the data."""
    fits = case.table.null.fits(case.rules)
    return replace(
        decision, verdict=case.calibrated() if fits else "not in catalogue", tested=NULL,
        named=False, steps=steps(decision, Step(Reason.TESTED, NULL)),
    )  # fmt: skip


def apply_held_out(case: JudgedTable, decision: Decision) -> Decision:
    """Decide on the first row with the held-out data.

    The fitted data must still support the name after the second fit. It is refused

    - if all data together bring less than the required gain;
    - if the deck with the effect fits worse than the calibrated deck.

    Data that are insensitive to the effect are predicted equally well without it and bring nothing.
    A refused effect refutes nothing: its gain may come from a wrong model of the errors. The test
    of fit of calibration alone decides then, and the leader is one of several explanations.
    """
    table, rules = case.table, case.rules
    row = table.rows[decision.order[0]]
    enough = case.suffices(row, table.gain(row), decision.due)
    decision = replace(decision, news=row.foretold())
    if enough and not _worse(row, rules.harm):
        return replace(
            decision, verdict=row.verdict, reason=Reason.NAMED, named=True,
            steps=steps(decision, Step(Reason.HELD_OUT, row.key)),
        )  # fmt: skip
    little = Reason.AGAINST if row.foretold() < 0 else Reason.TOO_LITTLE
    why = Reason.WORSE if enough else little
    refused = replace(
        decision, reason=why, named=False, steps=steps(decision, Step(why, row.key)), one_of=()
    )
    return untested(case, refused)


def _worse(row: Row, harm: float) -> bool:
    """True if the deck with an effect has a larger Q than the calibrated deck.

    Physics must not worsen the fitted data either. A fault of a few channels is compared on the
    held-out data of these channels.
    """
    left = row.leaves()
    compared = (left.fitted, left.held_out) if row.physics else (left.held_out,)
    return any(with_it > harm * calibrated for calibrated, with_it in compared)
