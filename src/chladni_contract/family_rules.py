"""The contract of effects, second part: a family on a structure, its deck and its bench.

A rule returns the number that it measured, in words, or raises
:class:`chladni_contract.effect_rules.BrokenRule`.
"""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from chladni.dynamics.eigen import normal_modes
from chladni.effects.effect import Effect, FieldChange, MatrixTerm, Parameter, SpinTerm, of
from chladni.effects.family import Article, Family
from chladni.effects.search_context import Candidate, SearchContext
from chladni.errors import ChladniError, named
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.io.nastran import assembly, read_deck, write_assembly, write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.assembly import Assembly
from chladni.reduced.gyroscopic import whirling
from chladni.units import UNITS

from .effect_ground import EffectGround
from .effect_rules import REACH, ActingEffect, BrokenRule

OFF_START = 0.1  # standard deviations between the start of a candidate and x of the checks
ALIKE, ALIKE_FIELDS = 0.1, 0.5  # of a change of frequency: what deck and terms may differ by
WEIGHED = 1e-3  # of the structure's mass: what the deck and the terms may differ by
READ = 1e-6  # relative: largest difference of the frequencies of a deck read back
CHANGED = 1e-5  # relative: least change of a frequency by the cards, and on the bench
OUTSIDE = 0.1  # of the structure's size: largest distance of a place from its box
SYSTEM = UNITS["mm-t-s"]


@dataclass(frozen=True, eq=False)
class TriedFamily:
    """A family on a structure, with its candidates."""

    family: Family
    ground: EffectGround
    candidates: Sequence[Candidate]  # of a search with FRFs
    acting: Sequence[ActingEffect]  # each of them, off every symmetry near its start


def tried(family: Family, ground: EffectGround) -> TriedFamily:
    """The candidates of a family on a structure.

    Raises
    ------
    BrokenRule
        If there are none, or one does not fit the search.
    """
    candidates = family.proposed(ground.by_responses)
    if not candidates:
        needs = f", which needs {family.needs}" if family.needs else ""
        raise BrokenRule(
            f"{family.name}{needs}, proposes no candidate on this structure; return effects from "
            "placed(where) or candidates(context), or give a deck on which it acts"
        )
    _check_fit(family, candidates, ground.by_responses)
    acting = []
    for c in candidates:
        parameters = c.effect.parameters
        step = np.array([OFF_START * p.sd for p in parameters])
        x = c.start + step * np.cos(1 + np.arange(len(step)))
        idle = np.array([p.nominal for p in parameters])
        model = ground.reduced.model_for(c.effect, c.start)
        acting.append(ActingEffect(c.effect, x, idle, model, ground.flexible))
    return TriedFamily(family, ground, candidates, acting)


def _check_fit(family: Family, candidates: Sequence[Candidate], context: SearchContext) -> None:
    """Refuse a candidate of another class, or one whose start or trials factor is impossible."""
    for c in candidates:
        effect, name = c.effect, family.effect.__name__
        if not isinstance(effect, family.effect):
            raise BrokenRule(
                f"a candidate is a {type(effect).__name__}, but the family is of {name}; propose "
                f"effects of the class {name}"
            )
        if len(c.start) != len(effect.parameters) or not len(c.start):
            raise BrokenRule(
                f"a candidate begins at {len(c.start)} numbers, but has {len(effect.parameters)} "
                "parameters; give one start for each"
            )
        if len(c.base) != len(context.null):
            raise BrokenRule(
                f"the base of a candidate has {len(c.base)} numbers, not {len(context.null)}; "
                "give one of context.bases"
            )
        if effect.trials_factor < 1:
            raise BrokenRule(
                f"the trials_factor is {effect.trials_factor}; give the number of places tried"
            )


def proposes_candidates(case: TriedFamily) -> str:
    """Candidates exist with FRFs; with frequencies alone only those of mass and stiffness do.

    ``placed`` needs no second look: :func:`chladni.effects.best_starts` serves both searches.
    """
    family, found = case.family, len(case.candidates)
    if family.candidates is None:
        return f"{found} with FRFs"
    alone = family.proposed(case.ground.by_poles)
    shy = any(of(SpinTerm, acting.effect.terms(acting.x)) for acting in case.acting)
    if bool(alone) == (shy or family.effect.kind == "test"):
        raise BrokenRule(
            f"candidates(context) gives {len(alone)} where only natural frequencies are known "
            "(context.scan is None); give some for an effect of mass or stiffness, and none for "
            "a fault of the test or a spinning part"
        )
    _check_fit(family, alone, case.ground.by_poles)
    return f"{found} with FRFs, {len(alone)} with frequencies alone"


def describes_itself(case: TriedFamily) -> str:
    """Claim, place, parameters and the measurement that settles it are plain words."""
    family = case.family
    claim = family.effect.claim.strip()
    if claim == Effect.claim or not claim[:1].islower() or claim.endswith("."):
        raise BrokenRule(
            f"the claim is {claim!r}; say in lower case, without a full stop, what the article has"
        )
    if not family.settled_by.strip():
        raise BrokenRule(
            "settled_by is empty; name the measurement that separates it from similar causes"
        )
    for acting in case.acting:
        if not acting.effect.where().text.strip():
            raise BrokenRule("the text of an effect is empty; say in words where it acts")
        for p in acting.effect.parameters:
            if not (p.name.strip() and p.unit.strip()):
                raise BrokenRule(
                    f"the parameter {p.name!r} has the unit {p.unit!r}; name both ('-' where it "
                    "has no unit)"
                )
    return f"{claim} ({case.acting[0].effect.where().text})"


def lies_in_structure(case: TriedFamily) -> str:
    """Grids and parts of every place exist, and its point lies at the structure."""
    made = case.ground.deck
    low, high = made.points.min(axis=0), made.points.max(axis=0)
    reach = OUTSIDE * float(np.linalg.norm(high - low))
    names = {part.name for part in made.parts}
    for acting in case.acting:
        for place in (acting.effect.where(), acting.effect.location(acting.x)):
            if missing := sorted(set(place.grids) - set(made.ids.tolist())):
                raise BrokenRule(
                    f"the place names grid {named(missing)}, which the deck lacks; give ids of "
                    "grids (assembly.ids[rows]), not rows"
                )
            if unknown := sorted(set(place.parts) - names):
                raise BrokenRule(
                    f"the place names part {named(unknown)}; the deck has {named(sorted(names))}"
                )
            if place.point_m is not None:
                point = np.array(place.point_m)
                off = float(np.linalg.norm(point - np.clip(point, low, high)))
                if not off <= reach:
                    raise BrokenRule(
                        f"the point {named(place.point_m)} m lies {off:.3g} m outside the "
                        "structure; give its place in the basic frame in metres"
                    )
    return case.acting[0].effect.where().text


def written(acting: ActingEffect, made: Assembly, within: float | None = None) -> str:
    """The deck with ``apply`` has the frequencies of the reduced model with ``terms``.

    Both may differ by a tenth of the change, which a basis of first order lacks. The elements of a
    field follow its groups, so both may then differ by half of the change. Even so the written deck
    is nearer to the fit than the deck before. Stiffness that depends on frequency has no such cards
    and is not compared.

    Parameters
    ----------
    within : relative difference that is allowed, in place of these shares
    """
    every = acting.effect.terms(acting.x)
    if any(term.rise is not None for term in of(MatrixTerm, every)):
        return "depends on frequency: its cards hold for one frequency"
    due = frequencies(acting.effect.apply(made, acting.x), acting.flexible)
    was = frequencies(made, acting.flexible)
    found = np.sqrt(np.maximum(acting.lam(acting.x), 0.0)) / (2 * np.pi)
    moved, off = float(np.abs(due / was - 1).max()), float(np.abs(found / due - 1).max())
    share = ALIKE_FIELDS if of(FieldChange, every) else ALIKE
    if off > (share * moved if within is None else within):
        r = int(np.argmax(np.abs(found / due - 1)))
        raise BrokenRule(
            f"apply() and terms() differ: flexible mode {r + 1} goes from {was[r]:.2f} to "
            f"{due[r]:.2f} Hz by apply(assembly, x) and to {found[r]:.2f} Hz by terms(x); both "
            "must be the same physics at the same places"
        )
    return f"frequencies move by {100 * moved:.2g} %, and differ by {100 * off:.2g} %"


def weighed(acting: ActingEffect, made: Assembly, within: float = WEIGHED) -> str:
    """The terms add the mass that ``apply`` adds to a structure.

    Parameters
    ----------
    within : share of the structure's mass that is allowed; by default what a balance tells apart
    """
    whole = mass_properties(made)[0]
    due = mass_properties(acting.effect.apply(made, acting.x))[0] - whole
    found = acting.state(acting.x).weight - acting.without.weight
    found += acting.effect.weight(acting.x).removed
    if abs(found - due) > within * whole:
        raise BrokenRule(
            f"apply(assembly, x) adds {1e3 * due:.3g} g and terms and weight(x) add "
            f"{1e3 * found:.3g} g; return the mass of PointTerm and MatrixTerm from weight(x) "
            "(fields of shells count by themselves)"
        )
    return f"{1e3 * found:.3g} g by its terms, {1e3 * due:.3g} g in the deck"


def writes_its_cards(case: TriedFamily) -> str:
    """The edited deck is read back as the changed structure, and only its cards are touched."""
    family, acting = case.family, case.acting[0]
    with tempfile.TemporaryDirectory(prefix="chladni-") as scratch:
        path, new = Path(scratch) / "deck.bdf", Path(scratch) / "new.bdf"
        read = read_deck(write_assembly(case.ground.deck, path, SYSTEM))
        before = assembly(read, SYSTEM)
        after = acting.effect.apply(before, acting.x)
        if family.no_cards:
            if after is not before:
                raise BrokenRule(
                    "apply(assembly, x) changes the assembly, but no_cards says that no card can; "
                    "name its cards"
                )
            return f"no cards: {family.no_cards}"
        try:
            write_deck(read, new, changes(read, before, after, SYSTEM))
            again = assembly(read_deck(new), SYSTEM)
        except ChladniError as error:
            raise BrokenRule(
                f"the deck with apply(assembly, x) cannot be written: {error}"
            ) from error
        touched = touched_cards(path, new)
    at = case.ground.flexible
    found, due, was = (frequencies(a, at) for a in (again, after, before))
    if not touched or np.abs(due / was - 1).max() <= CHANGED:
        raise BrokenRule(
            "apply(assembly, x) leaves the frequencies of the deck as they are; put the effect "
            "into the assembly that it returns"
        )
    if beyond := sorted(touched - set(family.cards)):
        raise BrokenRule(
            f"the deck with it has {named(beyond)}, which Family.cards ({named(family.cards)}) "
            "lacks; name them there"
        )
    off = float(np.abs(found / due - 1).max())
    if off > READ:
        raise BrokenRule(
            f"the deck read back differs from the assembly of apply() by {100 * off:.2g} % in a "
            "frequency; add elements by the functions that docs/extending.md lists"
        )
    return f"{named(sorted(touched))}; read back within {off:.0e}"


def is_concealed(case: TriedFamily) -> str:
    """``conceal`` changes the article alone, repeats by seed, and names what is reported."""
    family, article = case.family, case.ground.article
    one, two = (family.conceal(article, np.random.default_rng(5)) for _ in range(2))
    if one.deck is not article.deck:
        raise BrokenRule("conceal changes article.deck; change article.assembly alone")
    if one.truth != two.truth:
        raise BrokenRule(
            f"conceal gives {one.truth} and then {two.truth} with one seed; draw every number "
            "from rng"
        )
    effect, start = case.acting[0].effect, case.candidates[0].start
    reported = {row.name for row in effect.reported(start, np.zeros(len(start)))}
    values = one.truth.get("parameters", {})
    if not values or not set(values) <= reported:
        raise BrokenRule(
            f"the truth of conceal has the parameters {named(values)}, but the effect reports "
            f"{named(sorted(reported))}; give with_hidden the names that it reports"
        )
    for p in effect.parameters:
        _check_prior(p, values)
    change = _change(family.effect.kind, case.ground.flexible, article, one)
    return f"{named(f'{k} = {v:.3g}' for k, v in values.items())}, {change}"


def _check_prior(p: Parameter, values: Mapping[str, float]) -> None:
    """Refuse a concealed value that the prior of its log parameter excludes."""
    value = values.get(p.name)
    if value is None or p.kind != "log" or value * p.scale <= 0:
        return
    off = abs(float(np.log(value / p.scale)) - p.mean) / p.sd
    if off > REACH:
        raise BrokenRule(
            f"conceal draws {p.name} = {value:.3g} {p.unit}, {off:.1f} standard deviations from "
            f"the prior median of {p.value(p.mean):.3g} {p.unit}; use one unit (SI) in both, or a "
            "prior that holds what conceal draws"
        )


def _change(kind: str, at: slice, before: Article, after: Article) -> str:
    """The change of an article, in words; refuse one that does not fit the kind of the effect."""
    was, now = (frequencies(a.assembly, at) for a in (before, after))
    moved, gained = float(np.abs(now / was - 1).max()), bool((after.gains != before.gains).any())
    if kind == "physics" and moved <= CHANGED:
        raise BrokenRule(
            f"the concealed article has the frequencies of the article before (to {moved:.0e}); "
            "return article.with_hidden(made, ...) with the changed assembly"
        )
    if gained == (moved > CHANGED) or gained == (kind == "physics"):
        raise BrokenRule(
            f"conceal changes frequencies by {moved:.1e} and {'some' if gained else 'no'} gains; "
            "an effect of the structure changes the assembly alone, one of the test gains alone"
        )
    return "channels changed" if gained else f"frequencies move by {100 * moved:.2g} %"


def frequencies(made: Assembly, at: slice) -> np.ndarray:
    """Natural frequencies of a structure at some positions [Hz]."""
    return _lowest(made, at.stop)[at]


@lru_cache(maxsize=4)  # rules ask for those of the deck and of the article again and again
def _lowest(made: Assembly, count: int) -> np.ndarray:
    system = structure(made).system
    modes = normal_modes(system, count)
    if not len(made.rotors):
        return modes.frequency
    G = modes.shapes.T @ ((system.V - system.V.T) / 2 @ modes.shapes)
    return whirling((2 * np.pi * modes.frequency) ** 2, G)[0] / (2 * np.pi)


def touched_cards(before: Path, after: Path) -> set[str]:
    """Names of the cards with a line that the deck before lacks, in included files as well."""
    old, name, out = set(before.read_text(encoding="utf-8").splitlines()), "", set()
    for source in read_deck(after).sources:
        for line in source.path.read_text(encoding="utf-8").splitlines():
            if line.startswith("INCLUDE"):
                continue
            word = line[:8].strip(" *")
            name = word if word.isalnum() else name
            if line not in old and not line.startswith("$"):
                out.add(name)
    return out
