"""Beam, bar and rod properties: PBAR, PBARL, PBEAM, PBEAML, PROD, PTUBE."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ....errors import ModelError
from ....model.properties import BeamSection, BeamStation, Section
from ..text.table import Cards
from .beam_profiles import SHAPES, Profile, tube
from .context import Context
from .materials import Materials


def _section(
    ctx: Context,
    materials: Materials,
    card: Cards,
    values: tuple[float, float, float, float, float],
    shear: tuple[float, float],
    nsm: float,
    kind: str,
) -> BeamSection:
    """A section from (A, I1, I2, I12, J) in the deck's units; MID is field 2."""
    A, I1, I2, I12, J = values
    refuse_impossible(card, 0, values)
    if min(shear) < 0:
        raise card.refuse(0, f"K1 {shear[0]:g} and K2 {shear[1]:g} cannot be negative")
    L = ctx.scale.length
    return BeamSection(
        materials.isotropic(card, 0, int(card.integers(2)[0])),
        A * L**2,
        I1 * L**4,
        I2 * L**4,
        I12 * L**4,
        J * L**4,
        shear,
        nsm * ctx.scale.inertia / L,
        kind,
    )


def refuse_impossible(
    cards: Cards, i: int, values: tuple[float, float, float, float, float]
) -> None:
    """Refuse (A, I1, I2, I12, J) of which one is negative, or I1 I2 < I12².

    The smaller principal moment of area is then negative (MSC Nastran Quick Reference, PBAR).
    """
    A, I1, I2, I12, J = values
    if min(A, I1, I2, J) < 0:
        raise cards.refuse(i, f"area {A:g} and moments {I1:g}, {I2:g}, {J:g} cannot be negative")
    if I12**2 > I1 * I2 * (1 + _ROUNDED):
        raise cards.refuse(i, f"I12 {I12:g} is too large: I12² exceeds I1 I2 = {I1:g} x {I2:g}")


_ROUNDED = 1e-3  # a strip of no thickness has I12² = I1 I2, as far as the digits of a field go


def _pbar(ctx: Context, materials: Materials, card: Cards, _: int) -> BeamSection:
    """PBAR; K1, K2 blank or zero: no shear flexibility."""
    A, I1, I2, J, nsm = card.block(3, 5, 0.0)[0].tolist()
    K1, K2, I12 = card.block(17, 3, 0.0)[0].tolist()
    return _section(ctx, materials, card, (A, I1, I2, I12, J), (K1, K2), nsm, "bar")


def _shape(card: Cards, sizes: np.ndarray) -> Profile:
    """The profile of a PBARL or PBEAML with these dimensions."""
    word = card.word(0, 4)
    if np.any(sizes < 0) or not np.any(sizes > 0):
        raise card.refuse(0, f"a dimension of the {word} is not positive")
    with np.errstate(all="ignore"):
        try:
            profile = SHAPES[word][0](*sizes.tolist())
        except ModelError as error:
            raise card.refuse(
                0, f"the dimensions {sizes.tolist()} make no {word}: {error}"
            ) from None
    if not profile.area > 0 or not np.isfinite(profile.J) or min(profile.I1, profile.I2) <= 0:
        raise card.refuse(0, f"the dimensions {sizes.tolist()} make no {word}")
    return profile


def _library(kind: str) -> Callable[[Context, Materials, Cards, int], BeamSection]:
    def read(ctx: Context, materials: Materials, card: Cards, _: int) -> BeamSection:
        word = card.word(0, 4)
        if word not in SHAPES:
            raise card.refuse(0, f"TYPE {word!r} is not understood; there are {', '.join(SHAPES)}")
        count = SHAPES[word][1]
        own = np.append(card.block(9, count)[0], card.real(0, 9 + count, 0.0))
        p = _shape(card, own[:-1])
        values = (p.area, p.I1, p.I2, p.I12, p.J)
        made = _section(ctx, materials, card, values, p.shear, float(own[-1]), kind)
        if kind == "bar":
            return made
        rows = []
        for x, sizes in _stations(card, 10 + count, own, lambda _: 3 + count)[0]:
            p = _shape(card, sizes[:-1])
            rows.append((x, np.array([p.area, p.I1, p.I2, p.I12, p.J, sizes[-1]])))
        return _tapered(ctx, card, made, rows)

    return read


STATION = ("YES", "YESA", "NO")  # SO: stress output at a station along the beam
_Rows = list[tuple[float, np.ndarray]]


def _stations(
    card: Cards, k: int, own: np.ndarray, width: Callable[[str], int]
) -> tuple[_Rows, int]:
    """(x, values) of the stations from field k on, by increasing x, and the field behind them.

    Each is SO, X/XB and as many values as end A has. A blank at end B repeats end A, a blank
    between lies on the line from A to B (MSC Nastran Quick Reference Guide, PBEAM, PBEAML).
    """
    found = []
    while (word := card.word(0, k)) in STATION:
        x = card.real(0, k + 1)
        if not 0 <= x <= 1:
            raise card.refuse(0, f"X/XB is {x:g}; it is between 0 and 1")
        found.append((x, card.block(k + 2, len(own), np.nan)[0]))
        k += width(word)
    last = next((v for x, v in found if x == 1), own)
    last = np.where(np.isnan(last), own, last)
    between = {x: np.where(np.isnan(v), (1 - x) * own + x * last, v) for x, v in found if x < 1}
    if not np.allclose(between.pop(0.0, own), own, rtol=_ALIKE, atol=0):
        raise card.refuse(0, "its station X/XB = 0 differs from its end A")
    return [*sorted(between.items()), (1.0, last)], k


_ALIKE = 2e-4  # stations that differ by no more repeat end A: dimensions were rounded


def _tapered(
    ctx: Context,
    card: Cards,
    made: BeamSection,
    rows: _Rows,
    end: tuple[tuple[float, ...], tuple[float, ...], float] | None = None,
) -> BeamSection:
    """The section with stations of (x, (A, I1, I2, I12, J, NSM)), unless all of them are equal.

    Parameters
    ----------
    end : neutral axis, place [m] and inertia [kg m] of the non-structural mass at end B
    """
    L, s = ctx.scale.length, made
    own = np.array([s.neutral, s.nonstructural_at]).ravel()
    own = np.append(own, s.nonstructural_inertia)
    there = own if end is None else np.array([*end[0], *end[1], end[2]])
    first = np.array([s.area, s.I1, s.I2, s.I12, s.J, s.nonstructural])
    unit = np.array([L**2, L**4, L**4, L**4, L**4, ctx.scale.inertia / L])
    alike = all(np.allclose(v * unit, first, rtol=_ALIKE, atol=0) for _, v in rows)
    if alike and np.allclose(there, own, rtol=_ALIKE, atol=0):
        return made
    stations = []
    for x, row in rows:
        refuse_impossible(card, 0, tuple(row[:5].tolist()))
        value = row * unit
        if min(*value[:3], *first[:3]) <= 0:
            raise card.refuse(0, "a tapered beam has an area and moments that are positive")
        y1, z1, y2, z2, inertia = ((1 - x) * own + x * there).tolist()
        ratio = value[:5] / np.array([s.area, s.I1, s.I2, s.I1, s.J or 1.0])
        A, I1, I2, I12, J = ratio.tolist()
        nsm = float(value[5])
        stations.append(BeamStation(x, A, I1, I2, I12, J, nsm, inertia, (y1, z1), (y2, z2)))
    return replace(made, stations=tuple(stations))


def _pbeam(ctx: Context, materials: Materials, card: Cards, _: int) -> BeamSection:
    """PBEAM; K1, K2 are 1 unless given."""
    own = card.block(3, 6, 0.0)[0]
    k = 9 if card.word(0, 9) in STATION else 17  # behind the stress recovery points
    rows, k = _stations(card, k, own, lambda word: 16 if word == "YES" else 8)
    A, I1, I2, I12, J, nsm = own.tolist()
    K1, K2 = card.block(k, 2, 1.0)[0].tolist()
    if np.any(card.block(k + 2, 2, 0.0)):
        raise card.refuse(0, "shear relief (S1, S2) is not supported")
    made = _section(ctx, materials, card, (A, I1, I2, I12, J), (K1, K2), nsm, "beam")
    L, unit = ctx.scale.length, ctx.scale.inertia * ctx.scale.length
    places = [card.block(k + j, 2, 0.0)[0] * L for j in (12, 8)]  # N, M of end A
    there = [card.block(k + j + 2, 2, np.nan)[0] * L for j in (12, 8)]
    there = [np.where(np.isnan(b), a, b) for a, b in zip(places, there, strict=True)]
    neutral, at, neutral_B, at_B = ((float(y), float(z)) for y, z in [*places, *there])
    inertia = card.real(0, k + 4, 0.0)
    end = (neutral_B, at_B, card.real(0, k + 5, inertia) * unit)
    made = replace(made, neutral=neutral, nonstructural_at=at, nonstructural_inertia=inertia * unit)
    return _tapered(ctx, card, made, rows, end)


def _prod(ctx: Context, materials: Materials, card: Cards, _: int) -> BeamSection:
    A, J = (float(card.reals(k, 0.0)[0]) for k in (3, 4))
    nsm = float(card.reals(6, 0.0)[0])
    return _section(ctx, materials, card, (A, 0.0, 0.0, 0.0, J), (0.0, 0.0), nsm, "rod")


def _ptube(ctx: Context, materials: Materials, card: Cards, _: int) -> BeamSection:
    """PTUBE: outer diameter and wall; no wall: solid."""
    outer = float(card.reals(3)[0]) / 2
    wall = float(card.reals(4, 0.0)[0]) or outer
    if not 0 < wall <= outer:
        raise card.refuse(0, f"a wall of {wall:g} does not fit a tube of radius {outer:g}")
    second = float(card.reals(6, 0.0)[0])
    if second not in (0.0, 2 * outer):
        raise card.refuse(0, f"a tapered tube (OD2 = {second:g}) is not supported")
    p = tube(outer, outer - wall)
    nsm = float(card.reals(5, 0.0)[0])
    return _section(ctx, materials, card, (p.area, 0.0, 0.0, 0.0, p.J), (0.0, 0.0), nsm, "rod")


READERS: dict[str, Callable[[Context, Materials, Cards, int], Section]] = {
    "PBAR": _pbar,
    "PBARL": _library("bar"),
    "PBEAM": _pbeam,
    "PBEAML": _library("beam"),
    "PROD": _prod,
    "PTUBE": _ptube,
}
