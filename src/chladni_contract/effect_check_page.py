"""A checked effect as a page: each rule with its outcome, and how far the effect is visible."""

from pathlib import Path
from typing import Any

from chladni.report.blocks import PageParts, Section, Table
from chladni.report.words import counted

from .effect_check import EffectCheck
from .effect_visibility import Visibility

_HEADS = ("rule", "outcome", "measured, or what to do")


def as_page(folder: Path, found: EffectCheck) -> PageParts:
    """The page; it has no pictures."""
    return in_words(found)


def in_words(found: EffectCheck) -> PageParts:
    """Lead, rules and visibility."""
    rows = [(r.rule, r.outcome, r.text) for r in found.rules]
    rules = Table(_HEADS, rows, words=_HEADS, caption=f"On: {found.structure}.")
    sections = [Section("Rules", [rules])]
    if found.visibility is not None:
        sections.append(Section("Visibility", [_table(found.visibility)]))
    return PageParts(lead(found), sections, _notes(found))


def _notes(found: EffectCheck) -> list[str]:
    """A sentence where the effect is invisible, or its change was not computed."""
    if found.unseen:
        return [f"the change of the responses was not computed: {found.unseen}"]
    if found.visibility is None or found.visibility.seen:
        return []
    return ["no draw is visible: conceal larger ones, or expect no diagnosis to name the effect"]


def lead(found: EffectCheck) -> str:
    """The result in one sentence."""
    n = len(found.rules)
    if found.broken:
        return f"{found.effect} breaks {len(found.broken)} of {n} rules."
    seen = "" if found.visibility is None else f"; {_seen(found.visibility)}"
    return f"{found.effect} keeps all {n} rules{seen}."


def _seen(v: Visibility) -> str:
    """How many of the draws a diagnosis could see."""
    return f"a diagnosis could see it in {v.seen} of {counted(len(v.moved), 'draw', 'draws')}"


def _table(v: Visibility) -> Table:
    """Change of the responses by each draw."""
    rows = [
        (str(k + 1), f"{moved:.3g}", f"{moved / v.scatter:.1f}", "yes" if moved >= v.due else "no")
        for k, moved in enumerate(v.moved)
    ]
    caption = (
        "Change of the responses of the article by each draw of conceal, rms. Scatter of E and t "
        f"by 1 % changes them by {v.scatter:.3g} decades. A change is visible from {v.due:.3g} "
        "decades on, as in the cases of the blind evidence."
    )
    return Table(("draw", "change [decades]", "over scatter", "visible"), rows, (), caption)


def as_json(found: EffectCheck) -> dict[str, Any]:
    """``effect.json``."""
    v = found.visibility
    return {
        "effect": found.effect,
        "structure": found.structure,
        "rules": [{"rule": r.rule, "outcome": r.outcome, "text": r.text} for r in found.rules],
        "visibility": None
        if v is None
        else {
            "moved_decades": v.moved,
            "scatter_decades": v.scatter,
            "due_decades": v.due,
            "seen": v.seen,
        },
    }
