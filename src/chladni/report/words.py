"""Format numbers for engineers: four digits, SI prefixes, intervals in one unit."""

import math
from collections.abc import Sequence

from ..units import number as number

_PREFIX = {9: "G", 6: "M", 3: "k", 0: "", -3: "m", -6: "µ", -9: "n"}
_SCALED = ("Pa", "N/m", "N m", "N s/m")  # units that take a prefix in front
_NONE = "–"


def rounded(value: float, digits: int = 2) -> float:
    """Round a value to its significant digits.

    >>> rounded(76390.0), rounded(0.6581)
    (76000.0, 0.66)
    """
    return float(f"{value:.{digits}g}")


def hertz(f: float | None) -> str:
    """Format a frequency in Hz, with digits that a test can resolve, equal in a column.

    >>> hertz(41.936), hertz(120.0), hertz(1234.5678), hertz(None)
    ('41.94', '120.00', '1234.6', '–')
    """
    if f is None or not math.isfinite(f):
        return _NONE
    return f"{f:.{2 if abs(f) < 999.995 else 1}f}"


def criterion(value: float | None) -> str:
    """MAC or CoMAC, three digits after the point.

    >>> criterion(1.0), criterion(0.7049), criterion(None)
    ('1.000', '0.705', '–')
    """
    return _NONE if value is None or not math.isfinite(value) else f"{value:.3f}"


def unit_text(unit: str) -> str:
    """A unit with raised digits.

    >>> unit_text("N/m2"), unit_text("kg/m3"), unit_text("m4"), unit_text("-")
    ('N/m²', 'kg/m³', 'm⁴', '')
    """
    if unit in ("-", "1"):
        return ""
    return unit.replace("**", "").replace("^", "").translate(str.maketrans("234", "²³⁴"))


def quantity(value: float | None, unit: str = "", reference: float | None = None) -> str:
    """A value with its unit; stiffnesses and stresses get a prefix chosen by ``reference``.

    >>> quantity(3.1e9, "N/m2"), quantity(0.0007, "m"), quantity(0.4, "-")
    ('3.1 GN/m²', '0.7 mm', '0.4')
    """
    scale, named = display_unit(value if reference is None else reference, unit)
    shown = number(None if value is None else value / scale)
    return f"{shown} {named}".strip() if shown != _NONE else _NONE


def share(x: float) -> str:
    """A share with two digits.

    >>> share(0.01234)
    '1.2 %'
    """
    return f"{number(100 * x, 2)} %"


def interval(value: float | None, low: float | None, high: float | None, unit: str = "") -> str:
    """A value and its interval in the same unit.

    >>> interval(3.1e9, 2.2e9, 4.4e9, "N/m2")
    '3.1 GN/m² (2.2 to 4.4)'
    """
    scale, _ = display_unit(value, unit)
    text = quantity(value, unit)
    if low is None or high is None:
        return text
    return f"{text} ({number(low / scale)} to {number(high / scale)})"


def odds_of(p: float) -> str:
    """Odds of a probability, at most a million.

    >>> odds_of(0.75), odds_of(0.2)
    ('3 : 1', '1 : 4')
    """
    p = min(max(p, 1e-6), 1 - 1e-6)
    odds = number(rounded(max(p / (1 - p), (1 - p) / p)), 2)
    return f"{odds} : 1" if p >= 0.5 else f"1 : {odds}"


def percent(new: float | None, old: float | None) -> str:
    """Format a change in per cent, to a hundredth if it is small; beyond a doubling as a factor.

    >>> percent(0.02, 0.2), percent(1.03, 1.0), percent(0.9997, 1.0), percent(1.0, None)
    ('-90 %', '+3.0 %', '-0.03 %', '–')
    >>> percent(0.999999, 1.0), percent(2.0, 1.0), percent(7.5, 2.0)
    ('0.00 %', '+100 %', '3.75 times')
    """
    if new is None or not old or not math.isfinite(new / old):
        return _NONE
    if new / old > 2:
        return f"{number(new / old, 3)} times"
    change = 100 * (new / old - 1)
    decimals = 0 if abs(change) >= 10 else 1 if abs(change) >= 1 else 2
    sign = "+" if round(change, decimals) > 0 else ""
    return f"{sign}{fixed(change, decimals)} %"


def fixed(value: float, decimals: int) -> str:
    """A number with so many decimals, zero without a sign.

    >>> fixed(-0.0004, 3), fixed(-1.5, 1)
    ('0.000', '-1.5')
    """
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


def direction(vector: Sequence[float]) -> str:
    """Format a unit vector, by its axis if it is along one.

    >>> direction((0.0, 0.0, -1.0)), direction((0.6, 0.0, 0.8))
    ('-Z', '0.60 0.00 0.80')
    >>> direction((-0.001, 0.0, 0.999999))
    '0.00 0.00 1.00'
    """
    axis = max(range(3), key=lambda k: abs(vector[k]))
    if abs(vector[axis]) > 1 - 1e-6:
        return ("+" if vector[axis] > 0 else "-") + "XYZ"[axis]
    return " ".join(fixed(x, 2) for x in vector)


def counted(n: int, one: str, many: str) -> str:
    """Format a number with its noun, and a verb if one is given.

    >>> counted(1, "thing is", "things are"), counted(0, "thing is", "things are")
    ('1 thing is', '0 things are')
    """
    return f"{n} {one if n == 1 else many}"


def display_unit(value: float | None, unit: str) -> tuple[float, str]:
    """The unit in which a value is shown, as a multiple of its own, and its name.

    >>> display_unit(2.1e11, "N/m2"), display_unit(0.0012, "m")
    ((1000000000.0, 'GN/m²'), (0.001, 'mm'))
    """
    shown = unit_text(unit)
    if not value or not math.isfinite(value):
        return 1.0, shown
    if unit == "m" and abs(value) < 0.5:
        return 1e-3, "mm"
    if unit == "kg" and abs(value) < 0.5:
        return 1e-3, "g"
    if not unit.startswith(_SCALED):
        return 1.0, shown
    power = 3 * math.floor(math.log10(abs(value)) / 3)
    power = min(9, max(power, 0))
    return 10.0**power, _PREFIX[power] + shown
