"""Numbers as Nastran writes them: "1.5-3", "1.", "1.D+3", ".5"; whole columns at once."""

import re

import numpy as np

_BARE_EXPONENT = re.compile(r"([0-9.])([+-])")
_REAL = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)(E[+-]?\d+|[+-]\d+)?", re.ASCII)
_DIGIT_OR_DOT = np.zeros(256, bool)
_DIGIT_OR_DOT[list(b"0123456789.")] = True


def bytes_matrix(text: np.ndarray) -> np.ndarray:
    """(n, width) uint8 of fixed-width byte strings (n,)."""
    text = np.ascontiguousarray(text)
    return text.view(np.uint8).reshape(len(text), text.dtype.itemsize)


def spell_exponents(text: np.ndarray) -> np.ndarray:
    """Exponents spelled out: 1.5-3 -> 1.5E-3, 1.D+3 -> 1.E+3, for byte strings (n,)."""
    c = bytes_matrix(text)
    c = np.where(c == ord("D"), ord("E"), c).astype(np.uint8)
    bare = (c == ord("+")) | (c == ord("-"))
    bare[:, 1:] &= _DIGIT_OR_DOT[c[:, :-1]]
    bare[:, 0] = False
    rows = np.flatnonzero(bare.any(axis=1))
    out = np.zeros((len(c), c.shape[1] + 1), np.uint8)
    out[:, :-1] = c
    at = bare[rows].argmax(axis=1)[:, None]
    place = np.arange(out.shape[1])
    shifted = np.take_along_axis(out[rows], place - (place > at), axis=1)
    out[rows] = np.where(place == at, ord("E"), shifted)
    return out.view(f"S{out.shape[1]}").ravel()


def _first_bad(text: np.ndarray, parse: type) -> int:
    for k, word in enumerate(text.tolist()):
        try:
            parse(word)
        except ValueError:
            return k
    return -1


def _parsed(text: np.ndarray, kind: type) -> tuple[np.ndarray, int]:
    joined = (bytes_matrix(text) == ord("_")).any(axis=1)  # which Python takes, and no solver
    if np.any(joined):
        return np.zeros(len(text), kind), int(np.argmax(joined))
    try:
        return text.astype(kind), -1
    except (ValueError, OverflowError):
        bad = _first_bad(text, kind)
        return np.zeros(len(text), kind), max(bad, 0)


def reals(text: np.ndarray, blank: float) -> tuple[np.ndarray, int]:
    """(values (n,), position of the first that is no number or -1) of stripped byte strings."""
    if not len(text):
        return np.zeros(0), -1
    empty = text == b""
    text = np.where(empty, b"0", text)
    values, bad = _parsed(text, float)
    if bad >= 0:
        values, bad = _parsed(spell_exponents(text), float)
    if bad < 0 and not np.all(np.isfinite(values)):
        bad = int(np.argmin(np.isfinite(values)))
    return np.where(empty, blank, values), bad


def integers(text: np.ndarray, blank: int) -> tuple[np.ndarray, int]:
    """(values (n,), position of the first that is no integer or -1) of stripped byte strings."""
    if not len(text):
        return np.zeros(0, np.int64), -1
    empty = text == b""
    values, bad = _parsed(np.where(empty, b"0", text), np.int64)
    return np.where(empty, blank, values), bad


def _fixed(value: float, width: int) -> tuple[str, int]:
    """(fixed-point spelling, its significant digits)."""
    size = abs(value)
    whole = len(str(int(size))) if size >= 1 else 0
    decimals = width - whole - 1 - (value < 0)
    text = f"{value:.{max(decimals, 0)}f}"
    text = text if "." in text else text + "."
    if whole == 0:
        text = text.replace("0.", ".", 1)
    zeros = 0 if size >= 1 or size == 0 else -int(np.floor(np.log10(size))) - 1
    return text, (whole + decimals - zeros if len(text) <= width else 0)


def _exponent(value: float, width: int) -> tuple[str, int]:
    """(Nastran's short exponent spelling, 1.234-5, its significant digits)."""
    power = f"{int(f'{value:.17e}'.split('e')[1]):+d}"
    digits = width - len(power) - 2 - (value < 0)
    mantissa, power = f"{value:.{max(digits, 0)}e}".split("e")
    text = (mantissa if "." in mantissa else mantissa + ".") + f"{int(power):+d}"
    return text, (digits + 1 if len(text) <= width else 0)


def _shortest(text: str) -> str:
    """The same number without useless zeros: 1.500-3 -> 1.5-3."""
    cut = max(text.rfind("+"), text.rfind("-"))
    mantissa, power = (text[:cut], text[cut:]) if cut > 0 else (text, "")
    mantissa = mantissa.rstrip("0")
    return ("0." if mantissa in (".", "-.") else mantissa) + power


def real(value: float, width: int = 8) -> str:
    """The most precise spelling of a real in so many columns.

    >>> real(0.001234567), real(-123456.789), real(1.5), real(2.1e11)
    ('.0012346', '-123457.', '1.5', '2.1+11')
    >>> real(0.001234567, 16)
    '.001234567'
    """
    value = float(value)
    plain = f"{value:.6g}"
    if plain == f"{value:.{width}g}" and "e" not in plain and len(plain) < width:
        text = plain if "." in plain else plain + "."
        return text.replace("0.", ".", 1) if value and abs(value) < 1 else text
    fixed, exponent = _fixed(value, width), _exponent(value, width)
    text, digits = fixed if fixed[1] >= exponent[1] else exponent
    return _shortest(text if digits > 0 else exponent[0])


def parse_real(text: str) -> float:
    """Value of one Nastran real; nan of any other text.

    >>> parse_real("1.5-3"), parse_real("2.D+3"), parse_real("x")
    (0.0015, 2000.0, nan)
    """
    word = text.strip().upper().replace("D", "E")
    if not _REAL.fullmatch(word):
        return float("nan")
    value = float(_BARE_EXPONENT.sub(r"\1E\2", word))
    return value if np.isfinite(value) else float("nan")


def field(value: float | int | str | None, width: int = 8) -> str:
    """A field's text: reals as precise as the width allows, integers and words as they are."""
    if value is None:
        return ""
    if isinstance(value, float):  # numpy's float64 is one
        return real(value, width)
    return str(value)


def fitted(value: float | int | str | None, width: int, tolerance: float) -> str | None:
    """A field's text; None where so many columns do not hold it to the relative tolerance."""
    text = field(value, width)
    if len(text) > width:
        return None
    if isinstance(value, float):
        return text if abs(parse_real(text) - value) <= tolerance * abs(value) else None
    return text
