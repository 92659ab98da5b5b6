"""Spot welds and fasteners (CWELD, CFAST) as bushes between mean motions of two patches of shells.

An end of a connector is the point at which it pierces its patch. It moves as the weighted mean of
the patch (RBE3). The weights are those of four points of the shells around it, at the corners of a
square of the connector's area (MSC Nastran Quick Reference Guide, CWELD and CFAST). They are equal
where the card names a single shell or grids. A weld is a round beam with shear. About its middle
that beam is a bush:

    k = (EA/L, 12 EI/L³ (1 + φ), the same, GJ/L, EI/L, EI/L)    φ = 12 EI / 0.9 GA L²

Points that the card does not name have the ids from ``FIRST`` on.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ....errors import ChladniError
from ....geometry.nearest import ShellSurface
from ....model.added_points import with_points
from ....model.assembly import Assembly, Average, Bushes, Masses, concatenated
from ..text.table import Cards
from .context import Context, with_property
from .materials import Materials

FIRST = 101_000_001
CONNECTORS = ("CWELD", "CFAST")
_SHORTEST, _LONGEST = 0.2, 5.0  # limits of L over D of a weld


@dataclass(frozen=True, eq=False)
class _End:
    """A patch: its shells, or its grids alone, and the grid the card gives for its end."""

    shells: np.ndarray  # rows of shells
    grids: np.ndarray  # rows of points whose mean is taken as it is
    given: int  # row, or -1


@dataclass(frozen=True, eq=False)
class _Connector:
    cards: Cards
    i: int
    property: Cards
    ends: tuple[_End, _End]
    place: np.ndarray | None  # of GS or XS YS ZS [m]
    diameter: float
    wide: bool  # patches of four points, not of one shell


def with_connectors(ctx: Context, made: Assembly) -> Assembly:
    """The assembly with the points, means and bushes of all connectors."""
    found = [
        one
        for cards in ctx.deck.present(*CONNECTORS)
        if cards.name not in ctx.deck.allowed
        for one in _read(ctx, cards, made)
    ]
    for number, one in enumerate(found):
        made = _joined(ctx, made, one, number)
    return made


def _read(ctx: Context, cards: Cards, made: Assembly) -> Iterator[_Connector]:
    for i, card in with_property(ctx.deck, cards):
        reader = _weld if cards.name == "CWELD" else _fastener
        ends, at, xyz, wide = reader(ctx, cards, i, made)
        place = None
        if at:
            place = made.points[ctx.row(cards, i, at)]
        elif cards.word(i, xyz):
            place = cards.single(i).block(xyz, 3, 0.0)[0] * ctx.scale.length
        if place is None and min(end.given for end in ends) < 0:
            raise cards.refuse(i, "neither GS, nor GA and GB, nor a place is given")
        diameter = card.real(0, 3 if cards.name == "CWELD" else 2) * ctx.scale.length
        if not diameter > 0:
            raise card.refuse(0, f"D is {diameter:g}; it is to be positive")
        yield _Connector(cards, i, card, ends, place, diameter, wide)


Ends = tuple[tuple[_End, _End], int, int, bool]  # ends, GS, field of XS, patches of four points
_NONE = np.zeros(0, np.int64)


def _weld(ctx: Context, cards: Cards, i: int, made: Assembly) -> Ends:
    """CWELD of a PWELD: EID PID GS TYPE GA GB, then patches as the type has them."""
    kind, at, given = cards.word(i, 4), cards.integer(i, 3, 0), _given(ctx, cards, i, 5)
    if kind == "ALIGN":
        if min(given) < 0:
            raise cards.refuse(i, "ALIGN needs GA and GB")
        return (_End(_NONE, _NONE, given[0]), _End(_NONE, _NONE, given[1])), 0, 0, False
    if kind in ("PARTPAT", "ELPAT", "ELEMID"):
        return _ends(cards, i, made, 9, given, kind), at, 17, kind != "ELEMID"
    if kind != "GRIDID":
        names = "PARTPAT, ELPAT, ELEMID, GRIDID, ALIGN"
        raise cards.refuse(i, f"its type {kind!r} is not understood; there are {names}")
    out = []
    for first, row in zip((9, 17), given, strict=True):
        ids = [g for g in cards.single(i).ids(first, 8, 0)[0].tolist() if g]
        rows = np.array([ctx.row(cards, i, g) for g in ids], np.int64)
        if len(rows) < 3 and row < 0:
            raise cards.refuse(i, "a patch of GRIDID has three to eight grids")
        out.append(_End(_NONE, rows, row))
    return (out[0], out[1]), at, 0, False


def _fastener(ctx: Context, cards: Cards, i: int, made: Assembly) -> Ends:
    """CFAST: EID PID TYPE IDA IDB GS GA GB XS YS ZS."""
    kind, given = cards.word(i, 3), _given(ctx, cards, i, 7)
    if kind not in ("PROP", "ELEM"):
        raise cards.refuse(i, f"its type {kind!r} is not understood; there are PROP, ELEM")
    ends = _ends(cards, i, made, 4, given, "PARTPAT" if kind == "PROP" else "ELPAT")
    return ends, cards.integer(i, 6, 0), 9, True


def _given(ctx: Context, cards: Cards, i: int, k: int) -> tuple[int, int]:
    ids = [cards.integer(i, field, 0) for field in (k, k + 1)]
    first, second = (ctx.row(cards, i, id) if id else -1 for id in ids)
    return first, second


def _ends(
    cards: Cards, i: int, made: Assembly, k: int, given: tuple[int, int], kind: str
) -> tuple[_End, _End]:
    """Both patches by the ids of properties or shells in fields k and k + 1."""
    out = []
    for field, row in zip((k, k + 1), given, strict=True):
        id = cards.integer(i, field, 0)
        if kind == "PARTPAT":
            parts = [p for p, part in enumerate(made.parts) if part.id == id]
            shells = np.flatnonzero(np.isin(made.shells.part, parts))
        else:
            shells = np.flatnonzero(made.shells.ids == id)
            if kind == "ELPAT" and len(shells):
                near = np.isin(made.shells.nodes, made.shells.nodes[shells[0]]).any(axis=1)
                shells = np.flatnonzero(near & (made.shells.part == made.shells.part[shells[0]]))
        if not len(shells):
            what = "property of shells" if kind == "PARTPAT" else "shell"
            raise cards.refuse(i, f"there is no {what} {id}")
        out.append(_End(shells, _NONE, row))
    return out[0], out[1]


def _joined(ctx: Context, made: Assembly, one: _Connector, number: int) -> Assembly:
    """The assembly with one connector."""
    cards, i = one.cards, one.i
    places = np.array([_pierced(made, one, end) for end in one.ends])
    rows = [end.given for end in one.ends]
    missing = [k for k in (0, 1) if rows[k] < 0]
    if missing:
        made, new = with_points(made, places[missing])
        first = max(FIRST + 2 * number, int(made.ids[new[0] - 1]) + 1)
        ids = np.r_[made.ids[: new[0]], first + np.arange(len(new))]
        made = replace(made, ids=ids)
        for k, row in zip(missing, new.tolist(), strict=True):
            rows[k] = row
    axis = _axis(made, one, places)
    means = []
    for end, row, place in zip(one.ends, rows, places, strict=True):
        if (len(end.shells) or len(end.grids)) and not _carries(made, row):
            means.append(_mean(made, one, end, row, place, axis))
    frame, stiffness, loss, mass = _section(ctx, made, one, places, axis)
    eid, middle = cards.integer(i, 1), places.mean(axis=0)
    bush = Bushes(
        np.array([eid]), np.array([rows]), frame[None], middle[None], stiffness[None],
        np.zeros((1, 6)), np.full((1, 6), loss),
    )  # fmt: skip
    made = replace(made, bushes=concatenated(made.bushes, bush), rigid=(*made.rigid, *means))
    if mass:
        each = np.tile(np.diag([mass / 2] * 3 + [0.0] * 3), (2, 1, 1))
        lumps = Masses(np.array([eid, eid]), np.array(rows), each)
        made = replace(made, masses=concatenated(made.masses, lumps))
    return made


def _carries(made: Assembly, row: int) -> bool:
    """True where a shell, which moves the point already, has it as its corner."""
    return bool(np.any(made.shells.nodes == row))


def _pierced(made: Assembly, one: _Connector, end: _End) -> np.ndarray:
    """Place of an end: its grid, else the point of its patch next to the connector [m]."""
    if end.given >= 0:
        return np.asarray(made.points[end.given])
    place = one.place
    if place is None:
        place = made.points[[e.given for e in one.ends if e.given >= 0]][0]
    if len(end.grids):
        X = made.points[end.grids]
        normal = np.linalg.svd(X - X.mean(axis=0))[2][2]
        return np.asarray(place - normal * (normal @ (place - X.mean(axis=0))))
    surface = ShellSurface.of(made, end.shells)
    return np.asarray(surface.closest_points(place[None]).place[0])


def _axis(made: Assembly, one: _Connector, places: np.ndarray) -> np.ndarray:
    """Unit vector from end to end; the normal of the first patch where they coincide."""
    along = places[1] - places[0]
    length = np.linalg.norm(along)
    if length > 1e-6 * one.diameter:
        return np.asarray(along / length)
    if len(one.ends[0].shells):
        surface = ShellSurface.of(made, one.ends[0].shells)
        return np.asarray(surface.closest_points(places[:1]).normal[0])
    raise one.cards.refuse(one.i, "its ends lie at one place, so it has no axis")


def _across(axis: np.ndarray, towards: np.ndarray | None = None) -> np.ndarray:
    """Rows x, y, z of a frame along an axis; y near ``towards`` or the least component's axis."""
    y = np.eye(3)[np.argmin(np.abs(axis))]
    if towards is not None and np.linalg.norm(np.cross(axis, towards)) > 1e-6:
        y = towards
    y = y - axis * (axis @ y)
    y = y / np.linalg.norm(y)
    return np.array([axis, y, np.cross(axis, y)])


def _mean(
    made: Assembly, one: _Connector, end: _End, row: int, place: np.ndarray, axis: np.ndarray
) -> Average:
    """The end as the mean of its patch."""
    eid = one.cards.integer(one.i, 1)
    if len(end.grids):
        share = dict.fromkeys(end.grids.tolist(), 1.0)
    elif not one.wide:
        share = dict.fromkeys(made.shells.nodes[end.shells].ravel().tolist(), 1.0)
    else:
        surface = ShellSurface.of(made, end.shells)
        _, y, z = _across(surface.closest_points(place[None]).normal[0], _across(axis)[1])
        half = np.sqrt(np.pi) / 4 * one.diameter
        corners = [place + half * (a * y + b * z) for a in (-1, 1) for b in (-1, 1)]
        closest = surface.closest_points(np.array(corners))
        share = {}
        for r, w in zip(closest.nodes.ravel().tolist(), closest.weight.ravel(), strict=True):
            share[r] = share.get(r, 0.0) + float(w)
    terms = tuple((r, (1, 2, 3), w) for r, w in share.items() if w > 1e-9)
    arm = made.points[[r for r, _, _ in terms]] - place
    if np.linalg.matrix_rank(arm - arm.mean(axis=0), tol=1e-6 * one.diameter) < 2:
        raise one.cards.refuse(one.i, "the grids of a patch lie in one line")
    return Average(eid, row, (1, 2, 3, 4, 5, 6), terms)


def _section(
    ctx: Context, made: Assembly, one: _Connector, places: np.ndarray, axis: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, float]:
    """(frame, stiffness (6,) [N/m, N m/rad], loss factor, mass [kg])."""
    card = one.property
    if card.name == "PFAST":
        return _fastener_section(ctx, card, places, axis)
    material = Materials(ctx).isotropic(card, 0, card.integer(0, 2))
    E, G, D = material.E, material.shear_modulus, one.diameter
    L = float(np.linalg.norm(places[1] - places[0]))
    if card.word(0, 8) == "SPOT" and all(len(end.shells) for end in one.ends):
        L = sum(float(made.shells.thickness[end.shells[0]].mean()) for end in one.ends) / 2
    else:
        L = min(max(L, _SHORTEST * D), _LONGEST * D)
    A, I = np.pi * D**2 / 4, np.pi * D**4 / 64
    shear = 12 * E * I / L**3 / (1 + 12 * E * I / (0.9 * G * A * L**2))
    k = np.array([E * A / L, shear, shear, 2 * G * I / L, E * I / L, E * I / L])
    return _across(axis), k, material.damping, 0.0


def _fastener_section(
    ctx: Context, card: Cards, places: np.ndarray, axis: np.ndarray
) -> tuple[np.ndarray, np.ndarray, float, float]:
    """PFAST: PID D MCID MFLAG KT1 KT2 KT3 KR1 KR2 KR3 MASS GE."""
    s = ctx.scale
    k = card.block(5, 6, 0.0)[0] * ([s.force / s.length] * 3 + [s.force * s.length] * 3)
    mcid, frame = card.integer(0, 3, -1), _across(axis)
    if mcid >= 0:
        try:
            system = ctx.system_at(card, 0, mcid, places[0] / s.length)
        except ChladniError as error:
            raise card.refuse(0, f"MCID {mcid}: {error}") from None
        along = np.linalg.norm(np.cross(axis, system[1])) < 1e-6
        frame = _across(axis, system[2 if along else 1])
        if card.integer(0, 4, 0) == 1:
            frame = system
    return frame, np.asarray(k), card.real(0, 12, 0.0), card.real(0, 11, 0.0) * s.inertia
