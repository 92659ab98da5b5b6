"""Beam, bar and rod properties: PBAR, PBARL, PBEAM, PBEAML, PROD, PTUBE."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ....errors import ModelError
from ....model.properties import BeamSection, Section
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


def _shape(card: Cards) -> tuple[Profile, float]:
    """The profile of a PBARL or PBEAML (its end A) and its mass a length."""
    word = card.words(4)[0].decode("latin-1")
    if word not in SHAPES:
        raise card.refuse(0, f"TYPE {word!r} is not understood; there are {', '.join(SHAPES)}")
    make, count = SHAPES[word]
    sizes = card.block(9, count)[0]
    if np.any(sizes < 0) or not np.any(sizes > 0):
        raise card.refuse(0, f"a dimension of the {word} is not positive")
    with np.errstate(all="ignore"):
        try:
            profile = make(*sizes.tolist())
        except ModelError as error:
            raise card.refuse(
                0, f"the dimensions {sizes.tolist()} make no {word}: {error}"
            ) from None
    if not profile.area > 0 or not np.isfinite(profile.J) or min(profile.I1, profile.I2) <= 0:
        raise card.refuse(0, f"the dimensions {sizes.tolist()} make no {word}")
    return profile, float(card.reals(9 + count, 0.0)[0])


def _library(kind: str) -> Callable[[Context, Materials, Cards, int], BeamSection]:
    def read(ctx: Context, materials: Materials, card: Cards, _: int) -> BeamSection:
        p, nsm = _shape(card)
        if kind == "beam":  # end A, then stations of SO, X/XB and as many fields; blanks repeat A
            count = SHAPES[card.words(4)[0].decode("latin-1")][1] + 1
            own = np.nan_to_num(card.block(9, count, np.nan)[0])
            k = 9 + count
            while card.words(k)[0] in STATION:
                _refuse_unlike(card, card.block(k + 2, count, np.nan)[0], own)
                k += 2 + count
        values = (p.area, p.I1, p.I2, p.I12, p.J)
        return _section(ctx, materials, card, values, p.shear, nsm, kind)

    return read


STATION = (b"YES", b"YESA", b"NO")  # SO: stress output at a station along the beam


def _refuse_unlike(card: Cards, there: np.ndarray, own: np.ndarray) -> None:
    """Refuse a station that differs from end A by more than rounding; blanks repeat it."""
    if not np.allclose(np.where(np.isnan(there), own, there), own, rtol=2e-4, atol=0):
        raise card.refuse(
            0, "a tapered beam is not supported; give it several elements, each uniform"
        )


def _pbeam(ctx: Context, materials: Materials, card: Cards, _: int) -> BeamSection:
    """PBEAM, uniform: a tapered one is refused; K1, K2 are 1 unless given."""
    A, I1, I2, I12, J, nsm = card.block(3, 6, 0.0)[0].tolist()
    k = 9
    if card.words(k)[0] not in STATION:
        k += 8  # stress recovery points
    while (word := card.words(k)[0]) in STATION:
        _refuse_unlike(card, card.block(k + 2, 6, np.nan)[0], np.array([A, I1, I2, I12, J, nsm]))
        k += 16 if word == b"YES" else 8
    K1, K2 = card.block(k, 2, 1.0)[0].tolist()
    made = _section(ctx, materials, card, (A, I1, I2, I12, J), (K1, K2), nsm, "beam")
    L = ctx.scale.length
    for j, n in ((4, 1), (8, 2), (12, 2)):  # NSI, (M1, M2), (N1, N2): end A, then end B
        _refuse_unlike(card, card.block(k + j + n, n, np.nan)[0], card.block(k + j, n, 0.0)[0])
    at, neutral = (tuple((card.block(k + j, 2, 0.0)[0] * L).tolist()) for j in (8, 12))
    inertia = card.real(0, k + 4, 0.0) * ctx.scale.inertia * L
    return replace(made, neutral=neutral, nonstructural_at=at, nonstructural_inertia=inertia)


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
