"""Hypotheses with all numbers that a decision may read."""

from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any

from chladni.decision.decide import decide
from chladni.decision.hypotheses import EffectSet, Explanation, Hypotheses, Left
from chladni.effects.estimate import Remarks
from chladni.inference.adequacy import FitTest

FOR = 50.0
SERVES = Left((1.0, 0.1), (1.0, 0.1))


@dataclass(eq=False)
class Known:
    """Numbers of a hypothesis; ``then`` are those that change as it is fitted again."""

    p: float
    news: float
    left: Left
    p_damping: float = 1.0
    after_lead: float = 1.0
    then: dict[str, Any] = field(default_factory=dict)
    of: Explanation | None = None

    @cached_property
    def refined(self):
        mine = {f.name for f in fields(self)}
        own = {k: v for k, v in self.then.items() if k in mine}
        other = {k: v for k, v in self.then.items() if k not in mine}
        return on(replace(self.of, **other), replace(self, **own, then={}))

    def p_after(self, leader):
        return self.after_lead

    lost = "it is no structure"

    @property
    def note(self):
        return f"{self.of.name} is renewed"

    @property
    def chances(self):
        p = min(self.p, self.p_damping)
        what = f"what {self.of.name or 'calibration'} leaves"
        return SimpleNamespace(test=FitTest(p >= 0.01, p, what, "near 7 Hz"))

    @property
    def fit(self):
        name = self.of.name
        odd = "E of 300 MPa is too high for a sealant" if name == "adhesive-stiffness" else ""
        said = Remarks(implausible=odd)
        effect = SimpleNamespace(name=name, remarks=lambda x: said)
        return SimpleNamespace(effect=effect, fit=SimpleNamespace(of=lambda e: None))


def on(made, numbers):
    """A hypothesis with these numbers."""
    numbers.of = replace(made, costly=numbers)
    return numbers.of


def row(name, gain, p=0.5, news=FOR, left=SERVES, p_damping=1.0, **more):
    """A hypothesis that gains so much, and that nothing refuses unless it is said."""
    names = tuple(name.split(" and ")) if name else ()
    return on(Explanation(names, -gain, **more), Known(p, news, left, p_damping))


def table(*rows, null=None, then=None, sets=(), after_lead=1.0, **more):
    """All of them; ``then`` is what changes of each as it is fitted again, by name."""
    then = then or {}

    def known(one):
        numbers = replace(one.costly, then=then.get(one.name, {}), after_lead=after_lead)
        return on(one, numbers)

    sets = tuple(replace(s, hypothesis=known(s.hypothesis)) for s in sets)
    given = {"families": 20, **more}
    return Hypotheses(null or row("", 0.0), tuple(map(known, rows)), sets, **given)


def together(gains, due, news=(FOR, FOR), ahead=1e3, alternatives=((), ()), **more):
    """A set of two effects, with the news of its members."""
    made = row("crack and point-mass", 1e3, **more)
    return EffectSet(made, gains, due, ahead, alternatives, lambda k: news[k])


def named(made):
    """The name, or "" where there is none."""
    found = decide(made)
    return found.order[0].name if found.named else ""


def over(found):
    """Names of what was passed over, and why."""
    return tuple((h.name, why) for h, why in found.passed_over)
