"""Compare the effects of an object's states in words: constant, moved, new or gone."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from ..effects.estimate import Estimate
from ..inference.result import NamedEffect
from .diagnosis_result import StateResult


def by_state(states: Sequence[StateResult]) -> list[str]:
    """Return a sentence on every effect: its states, and how place and size compare."""
    found: dict[str, list[tuple[str, NamedEffect]]] = {}
    for state in states:
        for effect in state.result.effects:
            found.setdefault(effect.name, []).append((state.name, effect))
    return [_sentence(name, those, len(states)) for name, those in found.items()]


def _sentence(name: str, those: Sequence[tuple[str, NamedEffect]], count: int) -> str:
    having = list(dict.fromkeys(state for state, _ in those))
    named = ", ".join(map(repr, having))
    said = f"{name} is in {named}{' only' if len(having) < count else ', in every state'}"
    if len(having) < len(those):
        return f"{said}; with two of them in one state, places are not compared between states"
    changes = [
        f"from {a!r} to {b!r} {_moved(one, other)}, {_grown(one, other)}"
        for (a, one), (b, other) in pairwise(those)
    ]
    return "; ".join([said, *changes])


def _moved(one: NamedEffect, other: NamedEffect) -> str:
    """State if two effects are at one place, within the uncertainty of both."""
    a, b = one.where, other.where
    if a.point_m is None or b.point_m is None:
        return "it stays" if a.text == b.text else f"it moves to {b.text}"
    away = float(np.linalg.norm(np.subtract(a.point_m, b.point_m)))
    known = max(a.radius_m or 0.0, b.radius_m or 0.0)
    return "it stays" if away <= known else f"it moves by {1e3 * away:.3g} mm"


def _grown(one: NamedEffect, other: NamedEffect) -> str:
    """State if the sizes can be equal, by their intervals."""
    pairs = list(zip(one.parameters, other.parameters, strict=False))
    apart = [(p, q) for p, q in pairs if p.name == q.name and not _overlap(p, q)]
    if not apart:
        return "with the same size within its uncertainty"
    return ", ".join(f"{p.name} from {p.value:.3g} to {q.value:.3g} {q.unit}" for p, q in apart)


def _overlap(p: Estimate, q: Estimate) -> bool:
    """Return True if two intervals overlap; an interval without ends overlaps all."""
    low = max(end for end in (p.low, q.low, -np.inf) if end is not None)
    high = min(end for end in (p.high, q.high, np.inf) if end is not None)
    return bool(low <= high)
