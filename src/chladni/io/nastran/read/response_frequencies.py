"""Frequencies of response: FREQ, FREQ1, FREQ2 as lists; FREQ3, FREQ4, FREQ5 from the modes."""

from collections.abc import Callable

import numpy as np

from ....errors import FileError
from ....model.following_frequencies import Between, Following, Times
from ..text.table import Cards
from .context import Context


def _freq(card: Cards) -> np.ndarray:
    """FREQ: a list."""
    return np.array([card.real(0, k) for k in range(2, len(card.fields(0)) + 1) if card.word(0, k)])


def _freq1(card: Cards) -> np.ndarray:
    """FREQ1: f_1 + k Δf, k = 0 ... n."""
    count = _count(card, card.integer(0, 4, 1))
    return card.real(0, 2) + card.real(0, 3) * np.arange(count + 1)


def _freq2(card: Cards) -> np.ndarray:
    """FREQ2: n logarithmic steps."""
    a, b = card.real(0, 2), card.real(0, 3)
    if not 0 < a < b:
        raise card.refuse(0, f"the frequencies {a:g} and {b:g} do not increase from above zero")
    return np.geomspace(a, b, _count(card, card.integer(0, 4, 1)) + 1)


def _count(card: Cards, n: int) -> int:
    if not 0 < n <= 1_000_000:
        raise card.refuse(0, f"{n} steps are not between 1 and a million")
    return n


_FREQUENCIES: dict[str, Callable[[Cards], np.ndarray]] = {
    "FREQ": _freq, "FREQ1": _freq1, "FREQ2": _freq2,
}  # fmt: skip


def listed(ctx: Context) -> dict[int, np.ndarray]:
    """FREQ, FREQ1, FREQ2 by set [Hz]; several cards of a set are taken together."""
    found: dict[int, list[np.ndarray]] = {}
    for name, read in _FREQUENCIES.items():
        for cards in ctx.deck.present(name):
            for i, sid in enumerate(cards.integers(1).tolist()):
                found.setdefault(sid, []).append(read(cards.single(i)))
    out = {sid: np.unique(np.concatenate(parts)) / ctx.scale.time for sid, parts in found.items()}
    if any(np.any(f < 0) for f in out.values()):
        raise FileError(f"{ctx.deck.path}: a frequency of response is negative")
    return out


def _band(card: Cards, low: float | None, high: float) -> tuple[float, float]:
    """F1 and F2, increasing."""
    a = card.real(0, 2, low)
    b = card.real(0, 3, max(a, high))
    if not 0 <= a <= b:
        raise card.refuse(0, f"the frequencies {a:g} and {b:g} do not increase from zero")
    return a, b


def _freq3(card: Cards, unit: float) -> Between:
    """FREQ3: F1 F2 TYPE NEF CLUSTER."""
    a, b = _band(card, None, 0.0)
    kind, cluster = card.word(0, 4) or "LINEAR", card.real(0, 6, 1.0)
    if kind not in ("LINEAR", "LOG") or (kind == "LOG" and not a > 0) or not cluster > 0:
        raise card.refuse(0, f"TYPE {kind!r} is not LINEAR or LOG from above zero, or CLUSTER is")
    count = _count(card, card.integer(0, 5, 10))
    return Between(a / unit, b / unit, count, cluster, kind == "LOG")


def _freq4(card: Cards, unit: float) -> Times:
    """FREQ4: F1 F2 FSPD NFM: NFM frequencies in f_r (1 - FSPD) ... f_r (1 + FSPD)."""
    a, b = _band(card, 0.0, 1e20)
    spread, count = card.real(0, 4, 0.1), _count(card, card.integer(0, 5, 3))
    if not 0 <= spread < 1:
        raise card.refuse(0, f"FSPD {spread:g} is not between 0 and 1")
    factors = np.linspace(1 - spread, 1 + spread, count) if count > 1 else np.ones(1)
    return Times(a / unit, b / unit, tuple(factors.tolist()))


def _freq5(card: Cards, unit: float) -> Times:
    """FREQ5: F1 F2 FR1 FR2...: fractions of the modal frequencies."""
    a, b = _band(card, 0.0, 1e20)
    last = len(card.fields(0))
    factors = tuple(card.real(0, k) for k in range(4, last + 1) if card.word(0, k))
    return Times(a / unit, b / unit, factors)


_FOLLOWING: dict[str, Callable[[Cards, float], Following]] = {
    "FREQ3": _freq3, "FREQ4": _freq4, "FREQ5": _freq5,
}  # fmt: skip


def following(ctx: Context) -> dict[int, tuple[Following, ...]]:
    """FREQ3, FREQ4, FREQ5 by set."""
    out: dict[int, tuple[Following, ...]] = {}
    for name, read in _FOLLOWING.items():
        for cards in ctx.deck.present(name):
            for i, sid in enumerate(cards.integers(1).tolist()):
                out[sid] = (*out.get(sid, ()), read(cards.single(i), ctx.scale.time))
    return out
