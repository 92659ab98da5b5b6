"""Degrees of freedom: integers inside (point id, component 1-6), text only at the surface.

"412:+Z" is translation along Z at grid 412, "412:+RX" the rotation, "412:n" the normal to the
surface (a direction, so no single component) and "base:+Z" the enforced motion of the supports.
"""

import re
from collections.abc import Sequence

import numpy as np

from .errors import LabelError, named

COMPONENTS = ("X", "Y", "Z", "RX", "RY", "RZ")
_LABEL = re.compile(r"^\s*([0-9]+)\s*:\s*([+-]?)\s*(R?[XYZ])\s*$", re.IGNORECASE)


def parse(label: str) -> tuple[int, int, int]:
    """(point id, component 1-6, sign) of a label.

    >>> parse("412:-RX")
    (412, 4, -1)

    Raises
    ------
    LabelError
        If the text is not of the form node:direction.
    """
    found = _LABEL.match(label)
    if not found:
        raise LabelError(f"{label!r} is not a degree of freedom; write node:direction, as 412:+Z")
    point, sign, axis = found.groups()
    return int(point), COMPONENTS.index(axis.upper()) + 1, -1 if sign == "-" else 1


def label(point: int, component: int, sign: int = 1) -> str:
    """The text of a degree of freedom.

    >>> label(412, 3)
    '412:+Z'
    """
    return f"{point}:{'+' if sign > 0 else '-'}{COMPONENTS[component - 1]}"


def positions(wanted: Sequence[str], available: Sequence[str]) -> np.ndarray:
    """Positions of the wanted labels, in the order asked for.

    >>> positions(["7:+Z", "3:+Z"], ["3:+Z", "5:+Z", "7:+Z"])
    array([2, 0])
    """
    where = {text: k for k, text in enumerate(available)}
    if missing := [text for text in wanted if text not in where]:
        raise LabelError(f"no degree of freedom {named(missing)}; there are {named(available)}")
    return np.array([where[text] for text in wanted], dtype=int)


def rows(wanted: np.ndarray, available: np.ndarray) -> np.ndarray:
    """Row of each wanted (point, component) among the available ones; -1 where there is none.

    >>> rows(np.array([[7, 3], [9, 1]]), np.array([[3, 3], [7, 3]]))
    array([ 1, -1])
    """
    key = 8 * np.asarray(available)[:, 0].astype(np.int64) + np.asarray(available)[:, 1]
    want = 8 * np.asarray(wanted)[:, 0].astype(np.int64) + np.asarray(wanted)[:, 1]
    order = np.argsort(key, kind="stable")
    at = np.searchsorted(key, want, sorter=order)
    at = order[np.minimum(at, len(order) - 1)]
    return np.where(key[at] == want, at, -1)
