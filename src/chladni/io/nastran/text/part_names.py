"""Part names, which decks carry in comments only: ANSA, HyperMesh, Femap, Patran, I-DEAS styles."""

import re
from collections.abc import Iterable
from typing import Final

_PATTERNS: Final = (
    re.compile(
        r"^\$ANSA_NAME_COMMENT;(?P<id>\d+);"
        r"P(SHELL|COMP|COMPG|SOLID|BAR|BARL|BEAM|BEAML|ROD|TUBE);(?P<name>[^;]*)"
    ),
    re.compile(r"^\$HMNAME PROP\s+(?P<id>\d+)\s*\"(?P<name>[^\"]*)\""),
    re.compile(r"^\$ Femap .*?Property (?P<id>\d+) : (?P<name>.*)"),
    re.compile(r"^\$ Pset: \"(?P<name>[^\"]*)\" will be imported as: \"\w+\.(?P<id>\d+)\""),
    re.compile(r"^\$\*?\s*I-DEAS property:\s*(?P<id>\d+)\s+name:\s*(?P<name>.*)", re.I),
    re.compile(
        r"^\$\*?\s*(?:Physical )?Property(?: Table)?:?\s+(?P<id>\d+)\s*[:=]\s*(?P<name>.*)", re.I
    ),
)
# Names that stand above a property card without its number.
_ABOVE: Final = (
    re.compile(r"^\$ Elements and Element Properties for (?:region|Body) ?: ?(?P<name>.*)"),
    re.compile(r"^\$HMNAME COMP\s+\d+\s*\"(?P<name>[^\"]*)\""),
    re.compile(r"^\$\*\s+Property:\s*(?P<name>.*)"),
)
_COMPONENT = re.compile(r"^\$HMNAME COMP\s+\d+\s*\"[^\"]*\"\s*(?P<id>\d+)")
_CARD = re.compile(r"^(P[A-Z]+[0-9]*)\*?[ ,]\s*,?\s*(\d+)")


def part_names(lines: Iterable[str]) -> dict[int, str]:
    """Names of properties by their ids; an explicit number wins over a name standing above."""
    stated: dict[int, str] = {}
    above: dict[int, str] = {}
    waiting = ""
    for line in lines:
        if line[:1] == "$":
            if found := _first(_PATTERNS, line):
                stated.setdefault(int(found["id"]), found["name"].strip())
            elif found := _first(_ABOVE, line):
                waiting = found["name"].strip()
                if component := _COMPONENT.match(line):
                    above.setdefault(int(component["id"]), waiting)
                    waiting = ""
        elif waiting and (card := _CARD.match(line)):
            above.setdefault(int(card[2]), waiting)
            waiting = ""
    return {id: name for id, name in {**above, **stated}.items() if name}


def _first(patterns: Iterable[re.Pattern[str]], line: str) -> re.Match[str] | None:
    return next((found for p in patterns if (found := p.match(line))), None)
