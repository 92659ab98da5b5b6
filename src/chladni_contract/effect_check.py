"""The check of an effect in seconds: the contract of effects, rule by rule, and its visibility."""

import sys
import traceback
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from chladni.arguments import checked
from chladni.effects import registry
from chladni.effects.family import Family
from chladni.errors import AccuracyError, FileError
from chladni.model.assembly import Assembly
from chladni.progress import Progress, silent, within
from chladni.results import Result
from chladni.units import Units
from chladni.workflows.given_case import Source
from chladni.workflows.loaded_model import Model, as_model

from .effect_ground import GROUNDS, EffectGround, ground_of, usual_grounds
from .effect_rules import (
    ActingEffect,
    BrokenRule,
    acts,
    exact_slopes,
    idle_at_nominal,
    idle_in_remade_structure,
    positive_matrices,
    reports_in_json,
    survives_pickling,
    symmetric_operators,
)
from .effect_visibility import Visibility, visibility
from .family_rules import (
    TriedFamily,
    describes_itself,
    is_concealed,
    lies_in_structure,
    proposes_candidates,
    tried,
    weighed,
    writes_its_cards,
    written,
)

FamilyRule = Callable[[TriedFamily], str]
PROPOSES = "proposes candidates"


def each(rule: Callable[[ActingEffect], str], most: int | None = None) -> FamilyRule:
    """A rule on an effect as a rule on the candidates of a family, or on the first of them."""

    def over(case: TriedFamily) -> str:
        said = [_of_one(rule, acting, len(case.acting)) for acting in case.acting[:most]]
        return said[0]

    return over


def with_cards(rule: Callable[[ActingEffect, Assembly], str]) -> FamilyRule:
    """A rule on an effect and the deck as a rule on all candidates, where a deck can hold them."""

    def over(case: TriedFamily) -> str:
        if case.family.no_cards:
            return f"no cards: {case.family.no_cards}"
        said = [rule(acting, case.ground.deck) for acting in case.acting]
        return said[0]

    return over


def _of_one(rule: Callable[[ActingEffect], str], acting: ActingEffect, among: int) -> str:
    try:
        return rule(acting)
    except BrokenRule as error:
        if among == 1:
            raise
        raise BrokenRule(f"{acting.effect.where().text}: {error}") from error


RULES: dict[str, FamilyRule] = {  # what an effect does: the rule that checks it
    PROPOSES: proposes_candidates,
    "describes itself": describes_itself,
    "lies in the structure": lies_in_structure,
    "does nothing at its nominal values": each(idle_at_nominal),
    "acts at other values": each(acts),
    "has symmetric operators": each(symmetric_operators),
    "keeps K and M positive": each(positive_matrices, 1),
    "has exact slopes": each(exact_slopes),
    "does nothing where it is in the structure": each(idle_in_remade_structure),
    "applies what its terms say": with_cards(written),
    "weighs what it writes": with_cards(weighed),
    "writes its cards": writes_its_cards,
    "reports plain numbers": each(reports_in_json),
    "survives pickling": each(survives_pickling),
    "is concealed on the bench": is_concealed,
}


@dataclass(frozen=True)
class CheckedRule:
    """A rule of the contract and its outcome."""

    rule: str  # what the effect has to do
    passed: bool | None  # None where the rule could not be tried
    text: str  # the number that was measured, or the fault and its remedy

    @property
    def outcome(self) -> str:
        """Passes, fails or not tried."""
        return {True: "passes", False: "fails", None: "not tried"}[self.passed]


@dataclass(frozen=True, eq=False, repr=False)
class EffectCheck(Result):
    """An effect against the contract of effects.

    Attributes
    ----------
    effect : its name
    structure : on which it was checked, in words
    rules : every rule with its outcome
    visibility : how far it moves the responses; None where that could not be computed
    unseen : why it could not
    """

    effect: str
    structure: str
    rules: tuple[CheckedRule, ...]
    visibility: Visibility | None = None
    unseen: str = ""

    @property
    def broken(self) -> tuple[CheckedRule, ...]:
        """The rules that it breaks."""
        return tuple(r for r in self.rules if r.passed is False)

    def trusted(self) -> "EffectCheck":
        """The check, if the effect keeps every rule.

        Raises
        ------
        AccuracyError
            If it breaks one: the sentence names the first.
        """
        if self.broken:
            first = self.broken[0]
            raise AccuracyError(
                f"{self.effect} breaks {len(self.broken)} of {len(self.rules)} rules; the first, "
                f"{first.rule}: {first.text}"
            )
        return self


@checked
def check_effect(
    effect: str | Family,
    deck: Source | None = None,
    units: str | Units | None = None,
    *,
    progress: Progress = silent,
) -> EffectCheck:
    """Check an effect against the contract of effects, in seconds and without a diagnosis.

    Every effect of chladni keeps the same rules: slopes equal differences, ``apply`` agrees with
    ``terms``, cards are read back, the bench conceals the effect, and others.
    Then articles that conceal it show how far it moves their responses.

    Parameters
    ----------
    effect : name of an installed or registered effect, or its ``Family``
    deck : path of a Nastran deck or case, a model from ``chladni.load``, or an Assembly; without
        one a generated plate, or two plates with joints, with what the effect needs
    units : unit system of the path of a bare deck

    Raises
    ------
    LabelError
        If there is no effect of this name.
    FileError, ModelError
        If the deck cannot be used.
    """
    family = effect if isinstance(effect, Family) else registry.family(effect)
    place, grounds = _grounds(family, deck, units)
    for k, (structure, prepared) in enumerate(grounds.items()):
        stage = within(progress, 0.8 * k / len(grounds), 0.8 * (k + 1) / len(grounds))
        stage(structure, 0.0)
        ground = prepared()
        rules = checked_rules(family, ground, progress=stage)
        if any(rule.passed is not None for rule in rules if rule.rule != PROPOSES):
            break
    seen: Visibility | None = None
    unseen = "rules are broken"
    if all(rule.passed for rule in rules):
        progress("visibility", 0.8)
        try:
            seen, unseen = visibility(family, ground), ""
        except Exception as error:  # noqa: BLE001  of the package that is checked
            unseen = in_words(error, family)
    progress("done", 1.0)
    return EffectCheck(family.name, structure, rules, seen, unseen, origin=place)


def _grounds(
    family: Family, deck: Source | None, units: str | Units | None
) -> tuple[Model | None, dict[str, Callable[[], EffectGround]]]:
    """The given model, and the structures on which candidates are looked for in turn."""
    if deck is None:
        return None, {name: GROUNDS[name] for name in usual_grounds(family)}
    place = as_model(deck, "check-effect", units)
    if place.units is None:
        raise FileError(
            f"{place.source}: an effect is checked in SI, so the deck needs its unit system "
            "(--units)"
        )
    return place, {place.source.name: lambda: ground_of(place.assembly)}


def checked_rules(
    family: Family,
    ground: EffectGround,
    names: Collection[str] = RULES,
    progress: Progress = silent,
) -> tuple[CheckedRule, ...]:
    """The rules with these names, each with its outcome on a structure."""
    progress(PROPOSES, 0.2)
    try:
        case = tried(family, ground)
    except Exception as error:  # noqa: BLE001  of the package that is checked
        rest = [name for name in names if name != PROPOSES]
        first = CheckedRule(PROPOSES, False, in_words(error, family))
        return (first, *(CheckedRule(name, None, "it needs a candidate") for name in rest))
    out = []
    for k, name in enumerate(names):
        progress(name, 0.3 + 0.7 * k / len(names))
        out.append(_outcome(name, RULES[name], case))
    return tuple(out)


def _outcome(name: str, rule: FamilyRule, case: TriedFamily) -> CheckedRule:
    try:
        return CheckedRule(name, True, rule(case))
    except Exception as error:  # noqa: BLE001  of the package that is checked
        return CheckedRule(name, False, in_words(error, case.family))


def in_words(error: Exception, family: Family) -> str:
    """An error of a rule or of the code of an effect, in one sentence."""
    if isinstance(error, BrokenRule):
        return str(error)
    given = (family.effect, family.placed, family.candidates, family.conceal)
    names = {getattr(one, "__module__", "") for one in given}
    files = {getattr(sys.modules.get(name), "__file__", None) for name in names}
    frames: Sequence[traceback.FrameSummary] = traceback.extract_tb(error.__traceback__)
    at = ([frame for frame in frames if frame.filename in files] or frames)[-1]
    said = " ".join(str(error).split())
    return (
        f"{type(error).__name__} in {at.name} ({Path(at.filename).name}, line {at.lineno}): {said}"
    )
