"""SET commands of the case control: 1, 5, 10 THRU 20 EXCEPT 15, over several lines."""

import re
from typing import Final

EVERY: Final = (1, 2**62)
_RUN = re.compile(r"^(\d+)\s+THRU\s+(\d+)(?:\s+EXCEPT\s+(.*))?$", re.I | re.A)


def members(text: str) -> tuple[tuple[int, int], ...]:
    """Ids as runs from first to last; a word that is no id (1/T2, 0.5) is passed over.

    >>> members("1, 10 THRU 20 EXCEPT 15, 16, 30")
    ((1, 1), (10, 14), (17, 20), (30, 30))
    >>> members("ALL")
    ((1, 4611686018427387904),)
    """
    runs: list[tuple[int, int]] = []
    out = last = 0  # where EXCEPT is at work, and up to which id
    for word in (w.strip() for w in text.split(",")):
        if word.upper() == "ALL":
            return (EVERY,)
        if found := _RUN.match(word):
            runs.append((int(found[1]), last := int(found[2])))
            if found[3] and found[3].strip().isdecimal():
                runs = _without(runs, out := int(found[3]))
            else:
                out = 0
        elif word.isdecimal() and out and out < int(word) < last:
            runs = _without(runs, out := int(word))
        elif word.isdecimal():
            runs.append((int(word), int(word)))
            out = 0
    return tuple(runs)


def _without(runs: list[tuple[int, int]], id: int) -> list[tuple[int, int]]:
    """The runs, the last of them split around an id."""
    a, b = runs[-1]
    return runs[:-1] + [(p, q) for p, q in ((a, id - 1), (id + 1, b)) if p <= q and a <= id <= b]
