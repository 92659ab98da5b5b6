"""Hypotheses with all numbers that a decision may read."""

from functools import cached_property
from types import SimpleNamespace

from chladni.effects.effect import Effect, Traits
from chladni.effects.estimate import Remarks
from chladni.inference.adequacy import FitTest
from chladni.inference.likelihood import Responses
from chladni.inference.pole_data import Poles
from chladni.search.decide import decide
from chladni.search.diagnosis import Diagnosis, FitChances
from chladni.search.hypotheses import Explanation, Hypotheses

FOR = 50.0
SERVES = ((1.0, 0.1), (1.0, 0.1))  # Q of the calibrated and of its own deck, fitted and held out


class Row(Explanation):
    """A hypothesis whose numbers are given."""

    def __init__(self, **numbers):
        self.given = numbers
        vars(self).update(numbers)

    def __getattr__(self, name):
        error = AttributeError if name.startswith("__") else AssertionError
        raise error(f"{name} was read")

    def __repr__(self):
        return f"row {self.name!r}"

    def but(self, gain=None, **numbers):
        """A copy with other numbers."""
        fit = self.fit if gain is None else fitted(self.fit.name, gain)
        return Row(**{**self.given, "fit": fit, **numbers})

    @cached_property
    def refined(self):
        return self.but(**self.then, note=f"{self.name} is renewed")

    @property
    def chances(self):
        p = min(self.p, self.p_damping)
        test = FitTest(p >= 0.01, p, f"what {self.fit.name or 'calibration'} leaves", "near 7 Hz")
        return FitChances(test, self.p, self.p_damping)

    def news_of(self, member):
        return self.together.news[member]

    def p_after(self, leader):
        return self.after_lead


def fitted(name, gain, physics=True, expected=False, **remarks):
    """The fit of effects with these names; of none, of calibration alone."""
    odd = "E of 300 MPa is too high for a sealant" if name == "adhesive-stiffness" else ""
    first, *others = (
        SimpleNamespace(name=n, expected=expected, traits=Traits()) for n in name.split(" and ")
    )
    return SimpleNamespace(
        effect=first if name else Effect(), effects=(first, *others), name=name,
        neg2_log_evidence=-gain, physics=physics,
        verdict="missing physics" if physics else "measurement fault",
        remarks=Remarks(**{"implausible": odd, **remarks}),
    )  # fmt: skip


def row(name, gain, p=0.5, news=FOR, Q=SERVES, p_damping=1.0, **more):
    """A hypothesis that gains so much, and that nothing refuses unless it is said."""
    given = {"strained": False, "together": None, "lost": "", "then": {}, "after_lead": 1.0}
    given |= {k: more.pop(k) for k in given if k in more}
    fit = fitted(name, gain, **more)
    return Row(fit=fit, p=p, news=news, Q=Q, p_damping=p_damping, **given)


class Table(Hypotheses):
    """All hypotheses of a diagnosis whose numbers are given."""

    def __init__(self, **numbers):
        vars(self).update(numbers)

    def but(self, **numbers):
        """A copy with other numbers."""
        return Table(**{**vars(self), **numbers})


def table(*rows, null=None, then=None, sets=(), after_lead=1.0, poles=False, **more):
    """All of them; ``then`` is what changes of each as it is fitted again, by name."""

    def known(one):
        return one.but(then=(then or {}).get(one.name, {}), after_lead=after_lead)

    null = null or row("", 0.0)
    null.fit.data = object.__new__(Poles if poles else Responses)
    nominal = SimpleNamespace(**{**vars(null.fit), "data": None})
    few = SimpleNamespace(too_little="2 modes do not separate the explanations")
    given = {
        "null": null, "singles": tuple(map(known, rows)), "sets": tuple(map(known, sets)),
        "enough": True, "contradicted": True, "prepared": few,
        "found": Diagnosis(nominal, null.fit, null.fit, tuple(one.fit for one in rows)),
    }  # fmt: skip
    return Table(**(given | more))


def together(gains, due, news=(FOR, FOR), ahead=1e3, alternatives=((), ()), names="", **more):
    """A set of two effects, with the news of its members."""
    s = SimpleNamespace(
        gains=gains, due=due, news=news, alternatives=alternatives, pay=min(*gains, ahead) > due
    )
    return row(names or "crack and point-mass", 1e3, together=s, **more)


def named(made):
    """The name, or "" where there is none."""
    found = decide(made)
    return found.order[0].name if found.named else ""


def over(found):
    """Names of what was passed over, and why."""
    return tuple((h.name, why) for h, why in found.passed_over)
