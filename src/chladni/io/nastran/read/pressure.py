"""Pressures on faces as nodal forces, f_i = ∫ N_i p n dA."""

from collections.abc import Iterator

import numpy as np

from ....geometry.solid_faces import SIDES
from ..text.table import Cards
from .context import Context, id_list
from .solid_elements import SOLIDS

_SHELLS = {"CQUAD4": 4, "CQUADR": 4, "CQUAD8": 4, "CTRIA3": 3, "CTRIAR": 3, "CTRIA6": 3}
_CORNERS = {**_SHELLS, **SOLIDS}  # which alone carry a pressure, also where edges have nodes

Nodal = tuple[int, np.ndarray, np.ndarray]  # load set, rows (k,), forces (k, 3) [N]


def forces(ctx: Context) -> Iterator[Nodal]:
    """Nodal forces of PLOAD4, PLOAD2 and PLOAD."""
    elements: dict[int, tuple[str, np.ndarray]] = {}
    if any(True for _ in ctx.deck.present("PLOAD4", "PLOAD2")):
        elements = _elements(ctx)
    unit = ctx.scale.stress * ctx.scale.length**2
    for cards in ctx.deck.present("PLOAD4"):
        done, found = _on_shells(ctx, cards, unit)
        yield from found
        for i in np.flatnonzero(~done).tolist():
            yield from _pload4(ctx, cards, i, elements, unit)
    for cards in ctx.deck.present("PLOAD2"):
        for i in range(len(cards)):
            yield from _pload2(ctx, cards, i, elements, unit)
    for cards in ctx.deck.present("PLOAD"):
        for i in range(len(cards)):
            corners = [g for g in cards.single(i).ids(3, 4, 0)[0].tolist() if g]
            rows = np.array([ctx.row(cards, i, g) for g in corners], np.int64)
            if not 3 <= len(rows) <= 4:
                raise cards.refuse(i, "a face has three or four corners")
            p = np.full(len(rows), cards.real(i, 2) * unit)
            yield cards.integer(i, 1), rows, on_face(ctx.places[rows], p)


def _elements(ctx: Context) -> dict[int, tuple[str, np.ndarray]]:
    """{id: (kind, rows of its corners)} of all shells and solids."""
    out = {}
    for name, count in _CORNERS.items():
        for cards in ctx.deck.present(name):
            nodes = ctx.rows(cards, cards.ids(3, count))
            out.update(
                {e: (name, n) for e, n in zip(cards.integers(1).tolist(), nodes, strict=True)}
            )
    return out


def on_faces(X: np.ndarray, p: np.ndarray, load_axis: np.ndarray | None = None) -> np.ndarray:
    """Consistent forces (m, c, 3) of corner pressures p (m, c) on faces X (m, c, 3), c = 3 or 4.

    Along the normals, or along unit vectors ``load_axis`` (m, 3). Bilinear on quadrilaterals
    (2 x 2 Gauss points), exact on triangles: f_i = A (p_i + Σ p) / 12.
    """
    if X.shape[1] == 3:
        area = np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0]) / 2
        return (p + p.sum(axis=1)[:, None])[:, :, None] / 12 * _along(area, load_axis)
    f = np.zeros(X.shape)
    a = 1 / np.sqrt(3)
    s, t = np.array([-1, 1, 1, -1]), np.array([-1, -1, 1, 1])
    for xi, eta in ((-a, -a), (a, -a), (a, a), (-a, a)):
        N = (1 + s * xi) * (1 + t * eta) / 4
        e1, e2 = (np.einsum("c,mcj->mj", d / 4, X) for d in (s * (1 + t * eta), t * (1 + s * xi)))
        f += N[:, None] * _along(np.cross(e1, e2), load_axis) * (p @ N)[:, None, None]
    return f


def _along(area: np.ndarray, load_axis: np.ndarray | None) -> np.ndarray:
    """Area vectors (m, 1, 3), or as much area along other ways."""
    turned = area if load_axis is None else np.linalg.norm(area, axis=1)[:, None] * load_axis
    return turned[:, None]


def on_face(X: np.ndarray, p: np.ndarray, load_axis: np.ndarray | None = None) -> np.ndarray:
    """The same of one face (c, 3)."""
    return on_faces(X[None], p[None], None if load_axis is None else load_axis[None])[0]


def _on_shells(ctx: Context, cards: Cards, unit: float) -> tuple[np.ndarray, list[Nodal]]:
    """(which PLOAD4 load a single shell along its normal, their forces), all at once."""
    done = np.zeros(len(cards), bool)
    plain = np.all([cards.words(k) == b"" for k in (7, 8, 9, 10, 11, 12)], axis=0)
    if not np.any(plain):
        return done, []
    eid, sid, p = cards.integers(2), cards.integers(1), cards.block(3, 4, np.nan) * unit
    p = np.where(np.isnan(p), np.nan_to_num(p[:, :1]), p)
    out: list[Nodal] = []
    for name, count in _SHELLS.items():
        for shells in ctx.deck.present(name):
            rows, ids = ctx.rows(shells, shells.ids(3, count)), shells.integers(1)
            order = np.argsort(ids)
            at = order[np.minimum(np.searchsorted(ids, eid, sorter=order), len(ids) - 1)]
            mine = plain & (ids[at] == eid) & ~done
            done |= mine
            for s in np.unique(sid[mine]):
                which = mine & (sid == s)
                face = rows[at[which]]
                f = on_faces(ctx.places[face], p[which, :count])
                out.append((int(s), face.ravel(), f.reshape(-1, 3)))
    return done, out


def _known(
    cards: Cards, i: int, id: int, elements: dict[int, tuple[str, np.ndarray]]
) -> tuple[str, np.ndarray]:
    if id not in elements:
        raise cards.refuse(i, f"element {id} is not a shell or solid of the deck")
    return elements[id]


def _pload2(
    ctx: Context, cards: Cards, i: int, elements: dict[int, tuple[str, np.ndarray]], unit: float
) -> Iterator[Nodal]:
    """PLOAD2: SID P EID1 EID2... or THRU: along the normals of shells."""
    p = cards.real(i, 2) * unit
    ids = id_list(cards, i, 3, np.array(sorted(elements)))
    if "THRU" in cards.fields(i):
        ids = [e for e in ids if e in elements]
    for id in ids:
        name, rows = _known(cards, i, id, elements)
        if name in SOLIDS:
            raise cards.refuse(i, f"element {id} is a {name}, PLOAD2 loads shells")
        yield cards.integer(i, 1), rows, on_face(ctx.places[rows], np.full(len(rows), p))


def _pload4(
    ctx: Context, cards: Cards, i: int, elements: dict[int, tuple[str, np.ndarray]], unit: float
) -> Iterator[Nodal]:
    """PLOAD4: shells along their normals, faces of solids inwards, or along N in system CID."""
    sid, first = cards.integer(i, 1), cards.integer(i, 2)
    card, ids, marks = cards.single(i), [first], (0, 0)
    if cards.word(i, 7) == "THRU":
        past = cards.integer(i, 8) + 1
        ids = [first, *sorted(e for e in elements if first < e < past)]
    else:
        marks = (cards.integer(i, 7, 0), cards.integer(i, 8, 0))
    p = card.block(3, 4, np.nan)[0] * unit
    p = np.where(np.isnan(p), 0.0 if np.isnan(p[0]) else p[0], p)
    for id in ids:
        name, rows = _known(cards, i, id, elements)
        if name in SOLIDS:
            rows = _face(ctx, cards, i, name, rows, marks)
        X = ctx.places[rows]
        load_axis = _direction(ctx, cards, i, X.mean(axis=0))
        yield sid, rows, on_face(X, p[: len(rows)], load_axis)


def _direction(ctx: Context, cards: Cards, i: int, place: np.ndarray) -> np.ndarray | None:
    """Unit vector N in system CID; None: along the normal."""
    N = cards.single(i).block(10, 3, 0.0)[0]
    if not np.any(N):
        return None
    return np.asarray(N @ ctx.system_at(cards, i, cards.integer(i, 9, 0), place)) / np.linalg.norm(
        N
    )


def _face(
    ctx: Context, cards: Cards, i: int, name: str, rows: np.ndarray, marks: tuple[int, int]
) -> np.ndarray:
    """Corners of a solid's face, its normal inwards, beginning at G1.

    G1 and G3 are opposite corners. A triangle of a CPENTA needs G1 only, one of a CPYRAM both its
    corners of the base. G4 of a CTETRA is the node that is not on the face.
    """
    a = ctx.row(cards, i, marks[0])
    b = ctx.row(cards, i, marks[1]) if marks[1] else -1
    for side in SIDES[SOLIDS[name]]:
        face = rows[list(dict.fromkeys(side))]
        if a not in face or not _marked(name, face, a, b):
            continue
        X = ctx.places[face]
        normal = np.cross(X[1] - X[0], X[-1] - X[0])
        if normal @ (ctx.places[rows].mean(axis=0) - X.mean(axis=0)) < 0:
            face = face[::-1]
        return np.roll(face, -int(np.flatnonzero(face == a)[0]))
    raise cards.refuse(i, f"grids {marks[0]} and {marks[1]} mark no face of the {name}")


def _marked(name: str, face: np.ndarray, a: int, b: int) -> bool:
    """True where b (opposite corner, or for a CTETRA the node off the face) fits the face."""
    if name == "CTETRA":
        return b >= 0 and b not in face
    if len(face) == 3:
        return b < 0 if name == "CPENTA" else b in face[:2] and a in face[:2]
    opposite = face[(int(np.flatnonzero(face == a)[0]) + 2) % 4]
    return bool(b == opposite)
