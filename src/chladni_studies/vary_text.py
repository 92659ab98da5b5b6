"""Parser of ``--vary``: a number of parts or an effect at a grid, and its range."""

import re
from dataclasses import dataclass

import numpy as np

from chladni.arrays import real_number
from chladni.case.schema import FIELDS
from chladni.effects.registry import names
from chladni.errors import FileError

_FORM = re.compile(
    r"\s*(?P<name>[A-Za-z][\w-]*)(?:\s+of\s+(?P<parts>.+?)|\s+at\s+(?P<grid>[0-9]+))?"
    r"\s*=(?P<span>[^=]*)"
)


@dataclass(frozen=True)
class VaryText:
    """A range as `t of inner=0.6:0.8`, `E=90%:110%`, `point-mass at 412=1e-5:2e-4:log`."""

    text: str  # as it was given
    name: str  # field of parts, or an effect of the catalogue
    parts: str | None  # names with commas; None: of all that have the field
    grid: int | None  # place of the effect; None: the place given by a case
    # low, high: ends of the range as they were given
    low: str
    high: str
    log: bool  # uniform in the logarithm

    @property
    def is_effect(self) -> bool:
        """True where it varies an effect, not a number of parts."""
        return self.name in names()

    @property
    def plain(self) -> bool:
        """True where an end is a number in the deck's own units, not a share of its value."""
        return not self.low.endswith("%") or not self.high.endswith("%")

    def refused(self, why: str) -> FileError:
        """The error that names this text."""
        return FileError(f"--vary {self.text!r}: {why}")

    def ends(self, scale: float, nominal: float | None) -> tuple[float, float]:
        """Ends (low, high) in the unit of the nominal value.

        Parameters
        ----------
        scale : factor on a plain number
        nominal : the deck's own value; None where it has none, and 0 may be an end
        """
        if nominal is None and "%" in self.low + self.high:
            raise self.refused("the deck has no value there, so a share is not possible")
        low, high = (self._number(piece, scale, nominal or 0.0) for piece in (self.low, self.high))
        if nominal is None and not self.log:
            if not 0 <= low < high < np.inf:
                raise self.refused("the range must increase and not begin below zero")
        elif not 0 < low < high < np.inf:
            raise self.refused("the range must increase and be above zero")
        return low, high

    def _number(self, piece: str, scale: float, nominal: float) -> float:
        try:
            share = piece[-1:] == "%"
            number = real_number(piece[:-1] if share else piece)
            return number / 100 * nominal if share else number * scale
        except ValueError:
            raise _no_range(self.text) from None


def _no_range(text: str) -> FileError:
    return FileError(
        f"--vary {text!r}: {text.rpartition('=')[2].strip()!r} is not a range; write 0.6:0.8, "
        "90%:110% or 1e2:1e6:log"
    )


def vary_text(text: str) -> VaryText:
    """Parse the text of ``--vary``.

    >>> vary_text("K of PBUSH 7 = 10:1e4:log").parts
    'PBUSH 7'
    """
    found = _FORM.fullmatch(text)
    if not found:
        raise FileError(
            f'--vary {text!r} is not of the form "t of inner=0.6:0.8", "E=90%:110%", "K of PBUSH '
            f'7=10:1e4:log" or "point-mass at 412=0.01:0.2"; fields are {", ".join(FIELDS)}'
        )
    low, _, rest = found["span"].partition(":")
    high, _, log = (piece.strip() for piece in rest.partition(":"))
    if log not in ("", "log"):
        raise _no_range(text)
    grid = int(found["grid"]) if found["grid"] else None
    return VaryText(text, found["name"], found["parts"], grid, low.strip(), high, log == "log")
