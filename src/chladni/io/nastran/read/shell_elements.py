"""Shell elements: corners, thickness, material direction, offset."""

import re
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ....model.assembly import Shells, concatenated
from ....model.properties import ShellSection
from ..text.table import Cards
from .context import Context
from .sections import Parts

_QUADS = ("CQUAD4", "CQUADR", "CQUAD1", "CQUAD2")
_WHOLE = re.compile(rb"[+-]?[0-9]+")
_TRIANGLES = ("CTRIA3", "CTRIAR", "CTRIA1", "CTRIA2")
SHEETS = (*_QUADS, *_TRIANGLES, "CQUAD8", "CTRIA6")
_ORDER = "check the order and place of its grids"
NORMAL = 1e-6  # length of what is left of a unit vector laid on an element: it stands normal to it


def shells(ctx: Context, parts: Parts) -> Shells:
    """All shells, quadrilaterals first."""
    found = [_quads(ctx, parts, c) for c in ctx.deck.present(*_QUADS)]
    found += [_triangles(ctx, parts, c) for c in ctx.deck.present(*_TRIANGLES)]
    found += [_with_middles(ctx, parts, c) for c in ctx.deck.present("CQUAD8", "CTRIA6")]
    return concatenated(*(found or [Shells()]))


def _quads(ctx: Context, parts: Parts, cards: Cards) -> Shells:
    nodes = ctx.rows(cards, cards.ids(3, 4))
    return _made(ctx, parts, cards, nodes, (7, *_LEGACY) if _old(cards) else (7, 8, 10, 11))


def _triangles(ctx: Context, parts: Parts, cards: Cards) -> Shells:
    nodes = ctx.rows(cards, cards.ids(3, 3))
    nodes = nodes[:, [0, 1, 2, 2]]
    return _made(ctx, parts, cards, nodes, (6, *_LEGACY) if _old(cards) else (6, 7, 10, 11))


def _with_middles(ctx: Context, parts: Parts, cards: Cards) -> Shells:
    """CQUAD8 and CTRIA6; a node on an edge may be blank or 0."""
    corners, places = (4, (15, 16, 17, 11)) if cards.name == "CQUAD8" else (3, (9, 10, 14, 11))
    ids, between = cards.ids(3, corners), cards.ids(3 + corners, corners, 0)
    there = between != 0
    nodes = ctx.rows(cards, np.hstack([ids, np.where(there, between, ids)]))
    own = np.where(there, nodes[:, corners:], -1 - np.arange(corners))
    same = (np.diff(np.sort(np.hstack([nodes[:, :corners], own]), axis=1), axis=1) == 0).any(axis=1)
    if np.any(same):
        i = int(np.argmax(same))
        raise cards.refuse(i, "a node is named twice")
    middle = np.full((len(cards), 4), -1)
    middle[:, :corners] = np.where(there, nodes[:, corners:], -1)
    square = nodes[:, [0, 1, 2, corners - 1]]
    return replace(_made(ctx, parts, cards, square, places), middle=middle)


Places = tuple[int, int | None, int | None, int]  # fields of THETA, ZOFFS, TFLAG and T1
_LEGACY = (None, None, 0)


def _old(cards: Cards) -> bool:
    """True for cards of the COSMIC release, whose elements have no offset and thickness."""
    return cards.name.endswith(("1", "2"))


def _made(ctx: Context, parts: Parts, cards: Cards, nodes: np.ndarray, places: Places) -> Shells:
    """Elements of one kind."""
    theta, zoffs, tflag, first = places
    X = ctx.places[nodes]
    corners = 3 if cards.name.startswith("CTRIA") else 4
    normal = face_normals(ctx, cards, nodes[:, :corners])
    pid = cards.properties()
    part = parts.of("shell", cards, pid)
    offset = np.zeros(len(cards)) if zoffs is None else cards.reals(zoffs, 0.0) * ctx.scale.length
    return Shells(
        cards.integers(1),
        nodes,
        part,
        _thickness(ctx, parts, cards, part, tflag, first, corners),
        _axis(ctx, cards, X, normal, theta),
        offset + np.array(parts.shift)[part],
    )


def face_normals(ctx: Context, cards: Cards, corners: np.ndarray) -> np.ndarray:
    """Unit normals (n, 3) of faces (n, 3 or 4); coincident corners and zero area are refused."""
    X = ctx.places[corners]
    same = (np.diff(np.sort(corners, axis=1), axis=1) == 0).any(axis=1)
    if np.any(same):
        i = int(np.argmax(same))
        raise cards.refuse(i, f"a corner is named twice, grids {ctx.ids[corners[i]].tolist()}")
    first, second = ((0, 2), (1, 3)) if corners.shape[1] == 4 else ((0, 1), (0, 2))
    d1, d2 = (X[:, b] - X[:, a] for a, b in (first, second))
    normal = np.cross(d1, d2)
    size = np.linalg.norm(normal, axis=1)
    span = np.ptp(X, axis=1).max(axis=1)
    flat = ~(size > 1e-10 * span**2) | ~np.isfinite(size)
    sides = np.linalg.norm(X - np.roll(X, -1, axis=1), axis=2)
    flat |= (sides < 1e-9 * span[:, None]).any(axis=1)
    if np.any(flat):
        i = int(np.argmax(flat))
        raise cards.refuse(i, f"its area is zero; grids {ctx.ids[corners[i]].tolist()}")
    normal /= size[:, None]
    before, after = X - np.roll(X, 1, axis=1), np.roll(X, -1, axis=1) - X
    turn = np.einsum("nki,ni->nk", np.cross(before, after), normal)
    if np.any(bad := ~(turn > 0).all(axis=1)):
        i = int(np.argmax(bad))
        at = ctx.ids[corners[i, int(np.argmin(turn[i]))]]
        raise cards.refuse(i, f"its inner angle at grid {at} is 180 degrees or more; {_ORDER}")
    return normal


def _thickness(
    ctx: Context,
    parts: Parts,
    cards: Cards,
    part: np.ndarray,
    tflag: int | None,
    first: int,
    corners: int,
) -> np.ndarray:
    """Corner thickness (n, 4): Ti, or T of the property; TFLAG 1: Ti are fractions of T."""
    nominal = np.array([getattr(p.section, "thickness", np.nan) for p in parts.made])[part]
    if tflag is None:
        return np.repeat(nominal[:, None], 4, axis=1)
    own = cards.block(first, corners, np.nan)
    laminate = np.isin(part, [k for k, p in enumerate(parts.made) if _smeared(p.section)])
    own[laminate] = np.nan
    fraction = (cards.integers(tflag, 0) == 1)[:, None]
    own = np.where(fraction, own * nominal[:, None], own * ctx.scale.length)
    t = np.where(np.isnan(own), nominal[:, None], own)
    if np.any(bad := ~(t.mean(axis=1) > 0) | (t < 0).any(axis=1)):
        i = int(np.argmax(bad))
        why = "its thickness is negative" if (t[i] < 0).any() else "its thickness is zero"
        if np.isnan(t[i]).any():
            why = "neither it nor its property gives a thickness"
        raise cards.refuse(i, why)
    return t if corners == 4 else t[:, [0, 1, 2, 2]]


def _smeared(section: object) -> bool:
    """True for a laminate, whose thickness the elements cannot change."""
    shear = getattr(section, "shear", None)
    return getattr(section, "shear_ratio", 0) == 1.0 and hasattr(shear, "Q")


def _axis(ctx: Context, cards: Cards, X: np.ndarray, normal: np.ndarray, k: int) -> np.ndarray:
    """Material axis 1 (n, 3): THETA from side G1-G2, or x of system MCID, laid on the element."""
    words, system = cards.words(k), _by_system(cards, k)
    side = X[:, 1] - X[:, 0]
    side = side - np.einsum("ni,ni->n", side, normal)[:, None] * normal
    side /= np.linalg.norm(side, axis=1)[:, None]
    if np.all(system | (words == b"")):
        axis = side
    else:
        angle = np.zeros(len(cards))
        angle[~system] = np.radians(cards.take(~system).reals(k, 0.0))
        across = np.cross(normal, side)
        axis = np.cos(angle)[:, None] * side + np.sin(angle)[:, None] * across
    if np.any(system):
        axis = axis.copy()
        axis[system] = _from_systems(ctx, cards.take(system), X[system], normal[system], k)
    return axis


def _by_system(cards: Cards, k: int) -> np.ndarray:
    """(n,) bool, True where field k is an integer: MCID, not THETA."""
    words = cards.words(k).tolist()
    whole = np.array([bool(_WHOLE.fullmatch(w)) for w in words], bool)
    for i in np.flatnonzero(whole):
        if words[i].startswith(b"-"):
            said = words[i].decode("latin-1")
            why = f"is the integer {said}, so a coordinate system, and none has a negative number"
            raise cards.refuse(int(i), f"{cards.field_name(k)} {why}; an angle is {said}.")
    return whole


def _from_systems(
    ctx: Context, cards: Cards, X: np.ndarray, normal: np.ndarray, k: int
) -> np.ndarray:
    """Axis x (or radial) of coordinate systems at element centres, laid on the elements (n, 3).

    Where x is normal to the element, y (which then lies in it) takes its place.
    """
    flat, size = _laid(ctx, cards, X, normal, k)
    first = np.where(size[:, 0] < NORMAL, 1, 0)
    at = np.arange(len(cards))
    return flat[at, first] / size[at, first, None]


def _laid(
    ctx: Context, cards: Cards, X: np.ndarray, normal: np.ndarray, k: int
) -> tuple[np.ndarray, np.ndarray]:
    """Axes x and y of each element's system without their normal part (n, 2, 3), their lengths."""
    cid, centre = cards.integers(k), X.mean(axis=1)
    axes = np.zeros((len(cards), 2, 3))
    for c in np.unique(cid):
        mine = np.flatnonzero(cid == c)
        frame = ctx.frames.get(int(c), cards, int(mine[0]))
        axes[mine] = frame.at(centre[mine])[:, :2]
    flat = axes - np.einsum("nai,ni->na", axes, normal)[..., None] * normal[:, None]
    return flat, np.linalg.norm(flat, axis=2)


def second_axes(ctx: Context) -> Iterator[str]:
    """Shells whose material axis 1 is y of their MCID, one sentence a kind of card."""
    for names, corners in ((_QUADS, 4), (_TRIANGLES, 3)):
        for every in ctx.deck.present(*names):
            k = corners + 3
            cards = every.take(_by_system(every, k))
            if not len(cards):
                continue
            nodes = ctx.rows(cards, cards.ids(3, corners))
            _, size = _laid(ctx, cards, ctx.places[nodes], face_normals(ctx, cards, nodes), k)
            if len(found := np.flatnonzero(size[:, 0] < NORMAL)):
                i = int(found[0])
                yield (
                    f"{cards.where(i)}: {cards.name} {cards.integers(1)[i]} and "
                    f"{len(found) - 1} others lie across x of their MCID; "
                    "its y is their material axis 1"
                )


def filled_thickness(parts: Parts, shells: Shells) -> None:
    """A property without T gets the mean of its elements' corner thicknesses."""
    for k, part in enumerate(parts.made):
        if isinstance(part.section, ShellSection) and np.isnan(part.section.thickness):
            mean = float(shells.thickness[shells.part == k].mean())
            parts.made[k] = part.with_section(thickness=mean)
