"""Articles with two or three effects at once, each as large as in an article of its own."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from chladni.errors import ModelError

from .hidden import Hidden, Site
from .hidden_kinds import CATALOGUED
from .joint_kinds import JOINTS

AND = " + "  # between the names of hidden effects
APART = 0.25  # least distance between two places, over the structure's size
DRAWS = 50
PAIRS = (
    "sensor-mass + extra-support",
    "orthotropic-material + point-mass",
    "thickness-distribution + sensor-mass",
    "point-mass + point-mass",
    "orthotropic-material + point-mass + sensor-mass",
    "thickness-distribution + extra-support + sensor-mass",
)
HEMS = (
    "hem-contact + thickness-distribution + sensor-mass",
    "hem-stretch + thickness-distribution + sensor-mass",
)
# kinds that are a form of an effect of the catalogue
CALLED = {
    "hem-stretch": "hem-contact", "weld-run": "weld-missing", "seam": "crack",
    "soft-clamp": "compliant-support", "stretched-sheet": "membrane-prestress",
    "rib": "stiffener",
}  # fmt: skip

HIDDEN = {**CATALOGUED, **JOINTS}
Sized = Callable[[str, list[int]], tuple[Hidden, float, float]]


def members(kind: str) -> list[str]:
    """Names of the effects that a kind hides together.

    >>> members("sensor-mass + extra-support")
    ['sensor-mass', 'extra-support']
    """
    return kind.split(AND)


def catalogued(kind: str) -> str:
    """A kind in the catalogue's names of its effects.

    >>> catalogued("hem-stretch + sensor-mass")
    'hem-contact + sensor-mass'
    """
    return AND.join(CALLED.get(name, name) for name in members(kind))


def together(
    site: Site, kind: str, seed: int, sized: Sized
) -> tuple[Hidden, list[dict[str, Any]], float]:
    """Hide all members in one article: the article, the truth of each, the least change by one.

    Parameters
    ----------
    sized : a kind and its seed -> the effect alone, its change of the responses, its size

    Raises
    ------
    ModelError
        If two of them find no separate places.
    """
    made, truths, least = Hidden(site.article, {}), list[dict[str, Any]](), np.inf
    for k, name in enumerate(members(kind)):
        for draw in range(DRAWS):
            own = [seed, k, draw, *name.encode()]
            alone, moved, size = sized(name, own)
            if _apart(site, alone.truth, truths):
                break
        else:
            raise ModelError(f"no place for {name} apart from the others of {kind}")
        there = replace(site, article=made.article)
        made = _both(made, HIDDEN[name](there, np.random.default_rng(own), size))
        truths.append(
            {"effect": catalogued(name), **alone.truth, "size": size, "moved_decades": moved}
        )
        least = min(least, moved)
    return made, truths, least


def _apart(site: Site, truth: dict[str, Any], others: list[dict[str, Any]]) -> bool:
    """True where an effect has no place, or one apart from the places of the others."""
    places = [t["point_m"] for t in others if "point_m" in t]
    away = [np.linalg.norm(np.subtract(truth.get("point_m", p), p)) for p in places]
    return "point_m" not in truth or all(d > APART * site.size for d in away)


def _both(first: Hidden, then: Hidden) -> Hidden:
    """The article of ``then``, hidden in that of ``first``, with the other changes of both."""
    return Hidden(
        then.article, {}, (*first.couplings, *then.couplings),
        lambda values: then.spoil(first.spoil(values)), first.unweighed + then.unweighed,
    )  # fmt: skip
