"""Tables of hypotheses in which everything that a decision may ask for is there."""

from dataclasses import replace

from chladni.decision.decide import RULES, decide
from chladni.decision.hypothesis_table import (
    NULL,
    HypothesisTable,
    Left,
    Row,
    SetRow,
    after,
    refined,
)
from chladni.decision.reasons import Decision

FOR = 50.0
SERVES = Left((1.0, 0.1), (1.0, 0.1))


def row(name, gain, p=0.5, news=FOR, left=SERVES, **more):
    """A hypothesis that gains so much, and that nothing refuses unless it is said."""
    names = tuple(name.split(" and "))
    return Row(name, names, -gain, p=p, p_damping=1.0, news=news, left=left, **more)


def table(*rows, null=None, then=None, sets=(), after_lead=1.0, **more):
    """All of them; what of a row is another after its fit was renewed; sets with their rows."""
    null = null or row("", 0.0)
    null = replace(null, key=NULL, names=())
    held, singles = {NULL: null}, tuple(r.key for r in rows)
    every = [*rows, *(r for _, _, r in sets)]
    for r in every:
        changed = (then or {}).get(r.key, {})
        held[r.key] = r
        held[refined(r.key)] = replace(r, key=refined(r.key), **changed)
    for made, news, _ in sets:
        for k, v in enumerate(news):
            held[made.member(k)] = Row(made.member(k), (made.members[k],), 0.0, news=v)
    for r in rows:
        for lead in (singles[0], refined(singles[0])):
            key = after(refined(r.key), lead)
            held[key] = Row(key, r.names, 0.0, p_damping=after_lead)
    given = {"families": 20, **more}
    return HypothesisTable(held, singles, tuple(made for made, _, _ in sets), **given)


def together(key, gains, due, news=(FOR, FOR), ahead=1e3, alternatives=((), ()), **more):
    """A set of two effects: as the decision reads it, news of its members, its row."""
    made = SetRow(key, ("crack", "point-mass"), gains, due, ahead, alternatives)
    return made, news, replace(row("crack and point-mass", 1e3, **more), key=key)


def decision(made, rules=RULES):
    """The decision; nothing may be left to ask for."""
    found = decide(made, rules)
    assert isinstance(found, Decision), found
    return found


def named(made, rules=RULES):
    """The name, or "" where there is none."""
    found = decision(made, rules)
    return made.rows[found.order[0]].name if found.named else ""
