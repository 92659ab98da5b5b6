"""Articles with two or three effects at once, each as large as it would be alone."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from chladni.errors import ModelError

from .hidden import Hidden, Site
from .hidden_kinds import CATALOGUED
from .joint_kinds import JOINTS

AND = " + "  # between the names of what is hidden
APART = 0.25  # of the structure's size lie between two places, at least
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
CALLED = {"hem-stretch": "hem-contact"}  # kinds that are a form of an effect of the catalogue

HIDDEN = {**CATALOGUED, **JOINTS}
Sized = Callable[[str, list[int]], tuple[Hidden, float, float]]


def members(kind: str) -> list[str]:
    """Names of what a kind hides at once.

    >>> members("sensor-mass + extra-support")
    ['sensor-mass', 'extra-support']
    """
    return kind.split(AND)


def catalogued(kind: str) -> str:
    """A kind by the names that the catalogue has for what it hides.

    >>> catalogued("hem-stretch + sensor-mass")
    'hem-contact + sensor-mass'
    """
    return AND.join(CALLED.get(name, name) for name in members(kind))


def together(
    site: Site, kind: str, seed: int, sized: Sized
) -> tuple[Hidden, list[dict[str, Any]], float]:
    """All members in one article: the article, the truth of each, how far the least moves it.

    Parameters
    ----------
    sized : a kind and its seed -> the effect alone, how far it moves the responses, its size

    Raises
    ------
    ModelError
        If two of them find no places that lie apart.
    """
    made, told, least = Hidden(site.article, {}), list[dict[str, Any]](), np.inf
    for k, name in enumerate(members(kind)):
        for draw in range(DRAWS):
            own = [seed, k, draw, *name.encode()]
            alone, moved, size = sized(name, own)
            if _apart(site, alone.truth, told):
                break
        else:
            raise ModelError(f"no place for {name} apart from the others of {kind}")
        there = replace(site, article=made.article)
        made = _both(made, HIDDEN[name](there, np.random.default_rng(own), size))
        told.append(
            {"effect": catalogued(name), **alone.truth, "size": size, "moved_decades": moved}
        )
        least = min(least, moved)
    return made, told, least


def _apart(site: Site, truth: dict[str, Any], others: list[dict[str, Any]]) -> bool:
    """Whether a place, if there is one, is none that another one has."""
    places = [t["point_m"] for t in others if "point_m" in t]
    away = [np.linalg.norm(np.subtract(truth.get("point_m", p), p)) for p in places]
    return "point_m" not in truth or all(d > APART * site.size for d in away)


def _both(first: Hidden, then: Hidden) -> Hidden:
    """What ``then`` hid in the article of ``first``, and all that ``first`` did beside it."""
    return Hidden(
        then.article, {}, (*first.couplings, *then.couplings),
        lambda values: then.spoil(first.spoil(values)), first.unweighed + then.unweighed,
    )  # fmt: skip
