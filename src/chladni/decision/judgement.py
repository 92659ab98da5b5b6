"""Judge one hypothesis: the test of fit, the held-out data, and its deck."""

from .hypotheses import Explanation, Hypotheses
from .reasons import Decision, Reason, Step


def tested(decision: Decision, one: Explanation) -> Decision:
    """Name a hypothesis if it fits, and refuse it otherwise."""
    decision = decision.then(Step(Reason.TESTED, one), tested=one)
    if one.fits:
        return decision.then(verdict=one.verdict, reason=Reason.NAMED, named=True)
    return decision.then(verdict="not in catalogue", reason=Reason.UNFIT, named=False)


def untested(case: Hypotheses, decision: Decision) -> Decision:
    """Name nothing; calibration alone fits, or nothing in the catalogue explains the data."""
    verdict = case.calibrated if case.null.fits else "not in catalogue"
    return decision.then(
        Step(Reason.TESTED, case.null), verdict=verdict, tested=case.null, named=False
    )


def apply_held_out(case: Hypotheses, decision: Decision) -> Decision:
    """Decide on the first hypothesis with the held-out data.

    The fitted data must still support the name after the second fit. It is refused

    - if all data together bring less than the required gain;
    - if the deck with the effect fits worse than the calibrated deck.

    Data that are insensitive to the effect are predicted equally well without it and bring nothing.
    A refused effect refutes nothing: its gain may come from a wrong model of the errors. The test
    of fit of calibration alone decides then, and the leader is one of several explanations.
    """
    one = decision.order[0]
    enough = case.suffices(case.gain(one), decision.due, lambda: one.numbers.news)
    decision = decision.then(news=one.numbers.news)
    if enough and not one.worse:
        return decision.then(
            Step(Reason.HELD_OUT, one), verdict=one.verdict, reason=Reason.NAMED, named=True
        )
    little = Reason.AGAINST if one.numbers.news < 0 else Reason.TOO_LITTLE
    why = Reason.WORSE if enough else little
    return untested(case, decision.then(Step(why, one), reason=why, named=False, one_of=()))
