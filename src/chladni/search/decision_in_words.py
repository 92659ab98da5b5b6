"""Sentences of a decision: each says of one step what was found, of what, with its numbers."""

from collections.abc import Sequence
from enum import Enum

from ..effects.registry import family
from .decision_rules import RULES
from .hypotheses import Explanation, Hypotheses
from .several import AlternativeRow

BEYOND = "an effect outside the catalogue"
UNEXPLAINED = "; nothing in the catalogue explains the recording"


class Reason(Enum):
    """Ends of a decision and refusals of a name, each in words."""

    # ends
    NAMED = "one effect is named"
    TOGETHER = "several effects are named"
    NOTHING_DUE = "no effect reaches the required gain"
    # refusals
    TOO_FEW = "too few modes or numbers"
    UNFIT = "its residual is not explained"
    AGAINST = "the held-out data speak against it"
    TOO_LITTLE = "all data together give too little evidence"
    WORSE = "the deck with it fits worse than the calibrated deck"
    NOT_FITTED = "it could not be fitted again"
    DAMPING = "the modal damping follows the change by the leader"
    NOT_SUPPORTED = "held-out data do not support a member of a set"


def refusal(case: Hypotheses, one: Explanation, why: Reason) -> str:
    """Reason why a hypothesis is not named."""
    if why is Reason.TOO_FEW:
        return case.prepared.too_little
    if why is Reason.NOT_FITTED:
        return f"{why.value}: {one.lost}"
    if why is Reason.DAMPING:
        assert one.after is not None
        return one.after.what
    if why is Reason.UNFIT:
        assert one.chances.test is not None
        return f"{why.value}: {one.chances.test.what}"
    return why.value


def test_of_fit(one: Explanation) -> str:
    """Result of the test of fit; "" without one."""
    test = one.chances.test
    if test is None:
        return ""
    note = (
        f"{100 * test.p:.0f} % of recordings drawn from a right model are as unusual with "
        f"{one.name}: {test.what}"
    )
    return note if test.passes else f"{note}, {test.where}"


def too_few(case: Hypotheses, one_of: Sequence[str]) -> str:
    """Explanations of too few data, and data that would separate them."""
    return (
        f"{case.prepared.too_little}; these explain the data, which cannot distinguish them: "
        f"{', '.join(one_of)}; more modes, or more sensors of known gain, would separate them"
    )


def supported_by_all(case: Hypotheses, one: Explanation, due: float) -> str:
    """Gain of fitted and of held-out data, which together bring what is required."""
    data = "poles" if case.poles else "data"
    return (
        f"{one.name} gained {case.gain(one):.1f} in -2 ln evidence on the {data} that "
        f"were fitted, and {one.news:.1f} on the held-out data: together "
        f"more than the required {due:.0f}"
    )


def held_out(one: Explanation) -> str:
    """Gain of a named hypothesis on the held-out data."""
    return f"{one.name}: {_news(one.news)}"


def refused(case: Hypotheses, one: Explanation, why: Reason) -> str:
    """Refusal of a hypothesis by held-out data or by its deck, with Q of the decks."""
    (seen, seen_with), (held, held_with) = one.Q
    return (
        f"{one.name} gained {case.gain(one):.0f} in -2 ln evidence, but "
        f"{why.value} ({_news(one.news)}; held-out Q "
        f"{held:.3g} calibrated, {held_with:.3g} with it; fitted Q {seen:.3g} and "
        f"{seen_with:.3g}), so it is not named"
    )


def found_together(whole: Explanation) -> str:
    """Gain of every member of a set with the others in place."""
    s = whole.together
    assert s is not None
    gains = ", ".join(f"{e.name} {g:.0f}" for e, g in zip(whole.fit.effects, s.gains, strict=True))
    return (
        f"{whole.name} explain the recording together; with the others in place "
        f"each gains in -2 ln evidence: {gains} (required: {s.due:.0f})"
    )


def held_out_of_set(whole: Explanation, member: int) -> str:
    """Gain of one member on the held-out data with the others in place."""
    names = [e.name for e in whole.fit.effects]
    others = " and ".join(n for k, n in enumerate(names) if k != member)
    return f"{names[member]} added to {others}: {_news(whole.news_of(member))}"


def set_refused(made: Explanation, why: Reason, held_out: str = "") -> str:
    """Refusal of a set, with the gain on the held-out data that is too little for a member."""
    if why is Reason.NOT_SUPPORTED:
        said = f"that is too little for {held_out}"
    elif why is Reason.UNFIT:
        assert made.chances.test is not None
        said = f"the residual is not explained: {made.chances.test.what}"
    elif why is Reason.NOT_FITTED:
        said = f"they could not be fitted again: {made.lost}"
    else:
        said = why.value
    return f"{found_together(made)}; but {said}"


def perhaps_present(named: Explanation, other: str, gain: float, due: float) -> str:
    """Gain of an effect in addition to the named ones: a part of what is required."""
    return (
        f"with {named.name} in place {other} gains {gain:.0f} of "
        f"the required {due:.0f} in -2 ln evidence: it may be present too"
    )


def rival_of_member(names: Sequence[str], rivals: Sequence[AlternativeRow]) -> str:
    """Families that could replace a member of a set, whose name is the first."""
    behind = ", ".join(f"{r.name} by {r.behind:.0f}" for r in rivals)
    note = (
        f"with the others in place these data do not distinguish {names[0]} from the "
        f"next ones, which are behind in -2 ln evidence: {behind}"
    )
    odd = [_needs_impossible(r.name, r.implausible) for r in rivals if r.implausible]
    return _with_check("; ".join([note, *odd]), names)


def next_is(case: Hypotheses, before: Explanation, why: Reason, made: Explanation) -> str:
    """Refusal of a hypothesis, and the one that is tested next."""
    return f"{before.name} is refused: {refusal(case, before, why)}; {made.name} is next"


def tied(order: Sequence[Explanation], names: Sequence[str]) -> str:
    """Odds of the tied explanations, and values that one of them cannot have; the best is first."""
    best, each = order[0], {h.name: h for h in order}
    first, *others = names
    gap = {n: each[n].fit.neg2_log_evidence - best.fit.neg2_log_evidence for n in others}
    odds = "; ".join(f"2 ln B = {gap[n]:.1f} against {n}" for n in others)
    due = f"{RULES.tied:.0f} are required to separate two explanations"
    note = f"these data do not distinguish {first} from the others: {odds}; {due}"
    odd = [(n, h.fit.remarks.implausible) for n, h in each.items() if n in names]
    said = [_needs_impossible(n, why) for n, why in odd if why]
    return _with_check("; ".join([note, *said]), names)


def doubt(case: Hypotheses, lead: Explanation, due: float) -> str:
    """Gain of a leader that is too little to name it and too much to leave it out."""
    note = (
        f"{lead.name} explains the recording better than calibration alone, by "
        f"{case.gain(lead):.1f} in -2 ln evidence; {due:.0f} are required "
        "to name it: neither is certain"
    )
    return _with_check(note, (lead.name,))


def imitated(case: Hypotheses, lead: Explanation, why: Reason, gain: float) -> str:
    """Reason not to trust calibration where a refused effect gains what is required."""
    return (
        f"all data together give {lead.name} {gain:.0f} in -2 ln evidence over "
        f"calibration alone, but {refusal(case, lead, why)}: a cause outside "
        "the catalogue may imitate it"
    )


def settled_by(names: Sequence[str]) -> str:
    """Measurements that would separate these families."""
    return "; or ".join(c for c in (family(name).settled_by for name in names) if c)


def _news(news: float) -> str:
    return f"the held-out data bring {news:+.0f} in 2 ln predictive density"


def _needs_impossible(name: str, why: str) -> str:
    return f"{name} would need a value it cannot have: {why}"


def _with_check(note: str, names: Sequence[str]) -> str:
    check = settled_by(names)
    return f"{note}; to settle it: {check}" if check else note
