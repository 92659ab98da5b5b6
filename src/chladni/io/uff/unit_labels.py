"""Unit labels as test systems write them: products and quotients of length, force, mass and time.

A label is one of text, in any case: '(M/S^2)/N', 'm/s²', 'in/lbf-sec', '(1/N)*(mm/s2)', 'gravity'.
"""

import re
import unicodedata
from dataclasses import dataclass

_POUND, _KILOGRAM_FORCE, GRAVITY = 4.4482216152605, 9.80665, 9.80665
_NAMES: tuple[tuple[tuple[int, int, int], dict[str, float]], ...] = (
    ((1, 0, 0), {
        **dict.fromkeys(("m", "meter", "metre"), 1.0),
        **dict.fromkeys(("mm", "millimeter", "millimetre"), 1e-3),
        **dict.fromkeys(("cm", "centimeter", "centimetre"), 1e-2),
        **dict.fromkeys(("um", "μm", "micron", "micrometer", "micrometre"), 1e-6),
        **dict.fromkeys(("nm", "nanometer", "nanometre"), 1e-9),
        "pm": 1e-12,
        **dict.fromkeys(("in", "inch", "inches"), 0.0254),
        **dict.fromkeys(("mil", "thou"), 2.54e-5),
        **dict.fromkeys(("ft", "foot", "feet"), 0.3048),
    }),
    ((1, 0, -1), {"ips": 0.0254}),
    ((1, 0, -2), {
        **dict.fromkeys(("g", "gn", "g's", "grav", "gravity", "gravitie"), GRAVITY),
        "mg": 1e-3 * GRAVITY,
        "gal": 1e-2,
    }),
    ((0, 1, 0), {
        **dict.fromkeys(("n", "newton"), 1.0), "mn": 1e-3, "kn": 1e3, "dan": 10.0, "un": 1e-6,
        "μn": 1e-6, "dyn": 1e-5, "dyne": 1e-5,
        **dict.fromkeys(("lbf", "lb", "pound", "poundforce"), _POUND), "ozf": _POUND / 16,
        **dict.fromkeys(("kip", "klbf"), 1e3 * _POUND),
        **dict.fromkeys(("kp", "kgf"), _KILOGRAM_FORCE),
    }),
    ((-1, 1, 2), {"kg": 1.0}),
    ((0, 0, 1), dict.fromkeys(("s", "sec", "second"), 1.0)),
)  # fmt: skip
_KNOWN = {
    name: (*exponents, factor) for exponents, table in _NAMES for name, factor in table.items()
}
_MOTION = {(1, 0): "receptance", (1, -1): "mobility", (1, -2): "accelerance"}  # length, time
# what other code pages make of the squared sign and of micro: OEM 437 and 850, UTF-8 as Latin-1
_MISREAD = str.maketrans({"ý": "2", "æ": "μ", "â": ""})
_TOKEN = re.compile(r"(?P<name>[a-zμ']+)(?P<power>-?\d)?|(?P<sign>[*/()-])|(?P<one>1)")


@dataclass(frozen=True)
class Unit:
    """SI factor of a unit, and its exponents of length, force and time."""

    factor: float = 1.0
    length: int = 0
    force: int = 0
    time: int = 0

    def times(self, other: "Unit", power: int = 1) -> "Unit":
        """The unit a · bᵖ."""
        return Unit(
            self.factor * other.factor**power, self.length + power * other.length,
            self.force + power * other.force, self.time + power * other.time,
        )  # fmt: skip

    @property
    def motion(self) -> str | None:
        """Quantity of an FRF per force with this unit of motion, or per force already."""
        kind = _MOTION.get((self.length, self.time))
        return kind if self.force in (0, -1) else None


def plain(label: str) -> str:
    """A label in lower case with plain digits; "" where it says nothing.

    >>> plain(" (M/S²) / N "), plain("rad/second"), plain("NONE")
    ('(m/s2)/n', 'rad/s', '')
    """
    text = unicodedata.normalize("NFKC", label).lower().translate(_MISREAD)
    text = re.sub(r"\*\*|\^|(?<![a-z])none(?![a-z])|null", "", text)
    text = text.translate(str.maketrans("[]{}−–·⋅×", "()()--***"))
    text = re.sub(r"\b(sec|second)s?\b\.?", "s", re.sub(r"(?<=[a-z])\.(?=[a-z])", "*", text))
    text = re.sub(r"sec(?=-?\d)", "s", text)
    text = re.sub(r"(?<=[a-zμ\d])\s+(?=[a-zμ(])", "*", text.strip())
    text = re.sub(r"\s+", "", text).rstrip(".")
    return text if re.search(r"[^\W\d_]", text) else ""


def unit(label: str) -> Unit | None:
    """Unit of a label; None where a part of it is not known, or it says nothing.

    A slash divides by the whole product behind it, as in m/N-s and m/s*s. Where that is neither a
    motion nor a force, it divides by the next factor alone, as in 1/N*m/s2.

    >>> unit("(m/s^2)/lbf") == unit("1/lbf*(m/s2)"), unit("m/N-s").motion, unit("furlong")
    (True, 'mobility', None)
    """
    text = plain(label)
    tokens = list(_TOKEN.finditer(text))
    if not tokens or sum(len(m[0]) for m in tokens) != len(text):
        return None
    found = [_product(tokens, 0, tight) for tight in (True, False)]
    whole = [u for u, end in found if u is not None and end == len(tokens)]
    return next((u for u in whole if u.motion or is_force(u)), next(iter(whole), None))


def is_force(u: Unit) -> bool:
    """Return True for a unit of force."""
    return (u.length, u.force, u.time) == (0, 1, 0)


def _product(tokens: list[re.Match[str]], at: int, tight: bool) -> tuple[Unit | None, int]:
    """(unit, next token) of factors joined by * and /; ``tight``: one slash divides by all."""
    total, sign = Unit(), 1
    while True:
        factor, at = _factor(tokens, at, tight)
        if factor is None:
            return None, at
        total = total.times(factor, sign)
        if at == len(tokens) or tokens[at][0] == ")":
            return total, at
        if tokens[at]["sign"] is None or tokens[at][0] == "(":
            return None, at
        sign = -1 if tokens[at][0] == "/" or (tight and sign == -1) else 1
        at += 1


def _factor(tokens: list[re.Match[str]], at: int, tight: bool) -> tuple[Unit | None, int]:
    """(unit, next token) of a name with its power, of a one, or of a bracket."""
    if at == len(tokens):
        return None, at
    token = tokens[at]
    if token["one"]:
        return Unit(), at + 1
    if token[0] == "(":
        inner, end = _product(tokens, at + 1, tight)
        closed = inner is not None and end < len(tokens) and tokens[end][0] == ")"
        return (inner if closed else None), end + 1
    name, power = token["name"], int(token["power"] or 1)
    if name == "ss":  # m/ss
        name, power = "s", 2
    known = _KNOWN.get(name or "") or _KNOWN.get((name or "").removesuffix("s"))
    if known is None:
        return None, at
    length, force, time, factor = known
    return Unit().times(Unit(factor, int(length), int(force), int(time)), power), at + 1
