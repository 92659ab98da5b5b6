"""Springs, dampers, scalar masses, bushes, concentrated masses."""

from collections.abc import Iterator

import numpy as np

from ....model.assembly import Bushes, Masses, Scalars, concatenated
from ..text.deck import Deck
from ..text.table import Cards
from .axial_bushes import cbush1d, cvisc
from .context import Context, with_property

Values = dict[int, tuple[float, float]]


def _pairs(ctx: Context, names: tuple[str, ...], unit: float, damped: bool) -> list[Scalars]:
    """Scalar elements: name1 with a property, 2 with its value, 3 and 4 between scalar points."""
    out = []
    for k, name in enumerate(names):
        for cards in ctx.deck.present(name):
            value, loss = _values(ctx, cards, k, damped)
            ends = _ends(ctx, cards, points_only=k > 1)
            out.append(_scalars(ctx, cards, ends, value * unit, loss))
    return out


def _ends(
    ctx: Context, cards: Cards, points_only: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(rows (n, 2), components (n, 2), is a scalar point (n, 2)); a blank grid is the ground."""
    first = (3, 4) if points_only else (3, 5)
    nodes = np.stack([ctx.rows(cards, cards.integers(k, 0), ground=True) for k in first], axis=1)
    scalar = (nodes >= 0) & ctx.scalar[nodes]
    component = np.ones_like(nodes)
    if not points_only:
        component = np.stack([cards.integers(k, 0) for k in (4, 6)], axis=1)
        component = np.where(scalar | (nodes < 0), np.maximum(component, 1), component)
    if np.any(bad := ((component < 1) | (component > 6)).any(axis=1)):
        raise cards.refuse(int(np.argmax(bad)), "a component is not one of 1 to 6")
    if np.any(bad := (nodes < 0).all(axis=1)):
        raise cards.refuse(int(np.argmax(bad)), "both ends are blank; it joins nothing")
    return nodes, component, scalar


def _scalars(
    ctx: Context,
    cards: Cards,
    ends: tuple[np.ndarray, np.ndarray, np.ndarray],
    value: np.ndarray,
    loss: np.ndarray,
) -> Scalars:
    """K u_a u_b is work: the unit of K depends on what the two dofs are."""
    nodes, component, scalar = ends
    unit = np.where((component > 3) & ~scalar, 1.0, ctx.scale.length)
    unit = np.where(nodes < 0, unit[:, ::-1], unit)
    return Scalars(cards.integers(1), nodes, component, value / (unit[:, 0] * unit[:, 1]), loss)


def _values(ctx: Context, cards: Cards, k: int, damped: bool) -> tuple[np.ndarray, np.ndarray]:
    """(value, loss factor) of each element, from its card (kinds 2, 4) or its property."""
    if k % 2:
        loss = cards.reals(7, 0.0) if damped and k == 1 else np.zeros(len(cards))
        return cards.reals(2), loss
    known = _properties(ctx, "P" + cards.name[1:-1])
    pid = cards.properties()
    for i, p in enumerate(pid.tolist()):
        if p not in known:
            there = ", ".join(map(str, sorted(known)[:8])) or "none"
            raise cards.refuse(i, f"there is no P{cards.name[1:-1]} {p}; there are {there}")
    found = np.array([known[p] for p in pid.tolist()])
    return found[:, 0], found[:, 1] if damped else np.zeros(len(cards))


def _properties(ctx: Context, name: str) -> Values:
    """PELAS, PDAMP, PMASS: several on a card."""
    step = 4 if name == "PELAS" else 2
    out: Values = {}
    for cards in ctx.deck.present(name):
        for k in range(1, cards.width() + 1, step):
            has = np.flatnonzero(cards.words(k) != b"")
            some = cards.take(has)
            loss = some.reals(k + 2, 0.0) if step == 4 else np.zeros(len(has))
            triple = zip(some.integers(k).tolist(), some.reals(k + 1), loss, strict=True)
            for i, (pid, value, g) in enumerate(triple):
                if pid in out:
                    raise some.refuse(i, f"the id {pid} is already taken")
                out[pid] = (float(value), float(g))
    return out


def springs(ctx: Context) -> Scalars:
    """CELAS1 to CELAS4."""
    s = ctx.scale
    names = ("CELAS1", "CELAS2", "CELAS3", "CELAS4")
    found = _pairs(ctx, names, s.force * s.length, damped=True)
    return concatenated(*(found or [Scalars()]))


def dampers(ctx: Context) -> Scalars:
    """CDAMP1 to CDAMP4."""
    s = ctx.scale
    names = ("CDAMP1", "CDAMP2", "CDAMP3", "CDAMP4")
    found = _pairs(ctx, names, s.force * s.length * s.time, damped=False)
    return concatenated(*(found or [Scalars()]))


def scalar_masses(ctx: Context) -> Scalars:
    """CMASS1 to CMASS4."""
    s = ctx.scale
    names = ("CMASS1", "CMASS2", "CMASS3", "CMASS4")
    found = _pairs(ctx, names, s.inertia * s.length**2, damped=False)
    made = concatenated(*(found or [Scalars()]))
    if np.any(negative := made.value < 0):
        id = made.ids[negative][0]
        cards = next(c for c in ctx.deck.present(*names) if id in c.integers(1))
        i = int(np.argmax(cards.integers(1) == id))
        raise cards.refuse(i, "its mass is negative, which no structure has")
    return made


def masses(ctx: Context) -> Masses:
    """CONM1 and CONM2."""
    found = [_conm2(ctx, c) for c in ctx.deck.present("CONM2")]
    found += [_conm1(ctx, c) for c in ctx.deck.present("CONM1")]
    return concatenated(*(found or [Masses()]))


def skew(x: np.ndarray) -> np.ndarray:
    """[x]× (n, 3, 3): [x]× v = x × v."""
    zero = np.zeros(len(x))
    rows = [[zero, -x[:, 2], x[:, 1]], [x[:, 2], zero, -x[:, 0]], [-x[:, 1], x[:, 0], zero]]
    return np.moveaxis(np.array(rows), 2, 0)


def point_mass(m: np.ndarray, x: np.ndarray, inertia: np.ndarray) -> np.ndarray:
    """M = [[m 1, -m [x]×], [m [x]×, I - m [x]×²]] of masses off their nodes (n, 6, 6)."""
    M = np.zeros((len(m), 6, 6))
    X = skew(x)
    M[:, :3, :3] = m[:, None, None] * np.eye(3)
    M[:, 3:, :3] = m[:, None, None] * X
    M[:, :3, 3:] = -m[:, None, None] * X
    M[:, 3:, 3:] = inertia - m[:, None, None] * (X @ X)
    return M


def _mass_frames(ctx: Context, cards: Cards, node: np.ndarray, cid: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3, 3) of each mass's system at its node; -1 is basic."""
    out = np.broadcast_to(np.eye(3), (len(cid), 3, 3)).copy()
    for c in np.unique(cid[cid > 0]):
        mine = np.flatnonzero(cid == c)
        frame = ctx.frames.get(int(c), cards, int(mine[0]))
        out[mine] = frame.at(ctx.places[node[mine]])
    return out


def _conm2(ctx: Context, cards: Cards) -> Masses:
    """CONM2: mass, offset X in system CID (-1: X is the place itself), inertia about the mass."""
    node = ctx.rows(cards, cards.integers(2))
    _no_scalar(ctx, cards, node)
    cid = cards.integers(3, 0)
    T, L = _mass_frames(ctx, cards, node, cid), ctx.scale.length
    m, x = cards.reals(4, 0.0) * ctx.scale.inertia, cards.block(5, 3, 0.0)
    if np.any(m < 0):
        raise cards.refuse(int(np.argmax(m < 0)), "the mass is negative")
    x = np.where((cid == -1)[:, None], x - ctx.places[node], x) * L
    inertia = _inertia(cards)
    _no_negative(cards, inertia)
    if np.any(bad := no_body(inertia)[1]):
        i = int(np.argmax(bad))
        J = [f"{x:g}" for x in np.linalg.eigvalsh(inertia[i])]
        why = f"no body has its inertia: of the principal moments {J[2]} exceeds {J[0]} + {J[1]}"
        raise cards.refuse(i, why)
    inertia *= ctx.scale.inertia * L**2
    x = np.einsum("ni,nij->nj", x, T)
    inertia = np.einsum("nia,nij,njb->nab", T, inertia, T)
    return Masses(cards.integers(1), node, point_mass(m, x, inertia))


def _inertia(cards: Cards) -> np.ndarray:
    """Tensors (n, 3, 3) of CONM2 in the deck's units."""
    I11, I21, I22, I31, I32, I33 = cards.block(9, 6, 0.0).T
    rows = [[I11, -I21, -I31], [-I21, I22, -I32], [-I31, -I32, I33]]
    return np.moveaxis(np.array(rows), 2, 0)


_TWO_DIGITS = 0.05  # by so much the sum of moments written to two digits may be wrong
_GIVEN = 1e-3  # of the largest principal moment; a smaller one is no more than rounding


def no_body(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n,) bool: tensors (n, 3, 3) that no body has, and those of them that give all three moments.

    A body has J_3 <= J_1 + J_2, as J_1 + J_2 - J_3 = 2 ∫ x_3² dm.
    """
    J_1, J_2, J_3 = np.linalg.eigvalsh(inertia).T
    unlike = J_3 > (1 + _TWO_DIGITS) * (J_1 + J_2)
    return unlike, unlike & (J_1 > _GIVEN * J_3)


def one_sided_inertia(deck: Deck) -> Iterator[str]:
    """CONM2 with inertia about some axes alone, which no body has, in one sentence."""
    for cards in deck.present("CONM2"):
        if np.any(unlike := no_body(_inertia(cards))[0]):
            i, more = int(np.argmax(unlike)), int(unlike.sum()) - 1
            others = f" and {more} others have" if more else " has"
            yield (
                f"{cards.where(i)}: CONM2 {cards.integers(1)[i]}{others} inertia about some axes "
                "alone, which no body has"
            )


def _conm1(ctx: Context, cards: Cards) -> Masses:
    """CONM1: the 6 x 6 matrix itself, lower triangle row by row, in system CID."""
    node = ctx.rows(cards, cards.integers(2))
    _no_scalar(ctx, cards, node)
    T = _mass_frames(ctx, cards, node, cards.integers(3, 0))
    M = np.zeros((len(cards), 6, 6))
    i, j = np.tril_indices(6)
    M[:, i, j] = M[:, j, i] = cards.block(4, 21, 0.0) * ctx.scale.inertia
    _no_negative(cards, M)
    unit = np.array([1.0] * 3 + [ctx.scale.length] * 3)
    M *= unit[:, None] * unit
    R = np.zeros((len(cards), 6, 6))
    R[:, :3, :3] = R[:, 3:, 3:] = T
    return Masses(cards.integers(1), node, np.einsum("nia,nij,njb->nab", R, M, R))


def _no_negative(cards: Cards, M: np.ndarray) -> None:
    """Refuse inertia (n, k, k) that some motion would have less than none of."""
    least, most = np.linalg.eigvalsh(M)[:, [0, -1]].T
    if np.any(bad := least < -1e-6 * np.abs(most)):
        i = int(np.argmax(bad))
        raise cards.refuse(i, "its inertia is negative about some axis or along one")


def _no_scalar(ctx: Context, cards: Cards, node: np.ndarray) -> None:
    if np.any(bad := ctx.scalar[node]):
        i = int(np.argmax(bad))
        raise cards.refuse(i, f"{ctx.ids[node[i]]} is a scalar point, which has no six dofs")


def bushes(ctx: Context) -> Bushes:
    """CBUSH with PBUSH, CBUSH1D with PBUSH1D, CVISC with PVISC, CGAP with PGAP.

    The stiffness of a component that is RIGID is infinite, see :func:`.rigid_bushes.tied`.
    """
    found = [_cbush(ctx, c) for c in ctx.deck.present("CBUSH")]
    found += [_cgap(ctx, c) for c in ctx.deck.present("CGAP")]
    found += [cbush1d(ctx, c) for c in ctx.deck.present("CBUSH1D")]
    found += [cvisc(ctx, c) for c in ctx.deck.present("CVISC")]
    return concatenated(*(found or [Bushes()]))


def _pbush(ctx: Context) -> dict[int, dict[str, np.ndarray]]:
    """{PID: {"K": (6,), "B": (6,), "GE": (6,)}} as the cards have them, keys in any order."""
    out: dict[int, dict[str, np.ndarray]] = {}
    for cards in ctx.deck.present("PBUSH"):
        for i, pid in enumerate(cards.unique()):
            card = cards.single(i)
            words = card.fields(0)
            out[int(pid)] = rows = {}
            for k in range(2, len(words) + 1, 8):
                key = words[k - 1]
                if key not in ("K", "B", "GE", "RCV", "M", "T", "", "ALPHA", "TREF", "COINL"):
                    raise card.refuse(0, f"{key!r} is not one of K, B, GE, RCV, M")
                if key == "M" and card.block(k + 1, 1, 0.0).any():
                    raise card.refuse(0, "a mass M is not supported; write it as a CONM2")
                if key in ("K", "B", "GE"):
                    rows[key] = _six(card, k)
            if "GE" in rows and np.count_nonzero(rows["GE"]) == 1 and rows["GE"][0]:
                rows["GE"] = np.full(6, rows["GE"][0])  # GE1 alone stands for all
    return out


def _six(card: Cards, k: int) -> np.ndarray:
    """Six values after a key, infinite where RIGID."""
    rigid = [card.word(0, k + j) == "RIGID" for j in range(1, 7)]
    each = [np.inf if stiff else card.real(0, k + j, 0.0) for j, stiff in enumerate(rigid, 1)]
    return np.array(each)


def _cgap(ctx: Context, cards: Cards) -> Bushes:
    """CGAP as a linear solution has it: closed KA and KT, open KB, as U0 says at rest.

    EID PID GA GB X1 X2 X3 CID, the fields of a CBUSH; PGAP: PID U0 F0 KA KB KT MU1 MU2. A gap
    without an initial opening U0 is closed (MSC Nastran Quick Reference Guide, PGAP).
    """
    s = ctx.scale
    nodes = np.stack([ctx.rows(cards, cards.integers(k, 0), ground=True) for k in (3, 4)], axis=1)
    nodes = np.where((nodes[:, 0] < 0)[:, None], nodes[:, ::-1], nodes)
    K = np.zeros((len(cards), 6))
    for i, card in with_property(ctx.deck, cards):
        KA = card.real(0, 4, 0.0)
        K[i, 0] = card.real(0, 5, _OPEN * KA)
        if card.real(0, 2, 0.0) <= 0:
            K[i, :3] = KA, *[card.real(0, 6, card.real(0, 7, 0.0) * KA)] * 2
    axial = K * np.array([1.0, 0, 0, 0, 0, 0])  # across, a gap is as stiff in all directions
    frame = np.array([_bush_frame(ctx, cards, i, nodes[i], axial[i]) for i in range(len(cards))])
    place, none = _middle(ctx, nodes, 0.5) * s.length, np.zeros((len(cards), 6))
    return Bushes(cards.integers(1), nodes, frame, place, K * s.force / s.length, none, none)


_BEYOND = 1e60  # stands for an infinite stiffness where the frame of a bush is chosen
_OPEN = 1e-14  # stiffness of an open gap over that of a closed one


def _cbush(ctx: Context, cards: Cards) -> Bushes:
    known, s = _pbush(ctx), ctx.scale
    pid = cards.properties()
    if missing := [i for i, p in enumerate(pid.tolist()) if p not in known]:
        there = ", ".join(map(str, sorted(known)[:8])) or "none"
        raise cards.refuse(missing[0], f"there is no PBUSH {pid[missing[0]]}; there are {there}")
    first = ctx.rows(cards, cards.integers(3))
    second = ctx.rows(cards, cards.integers(4, 0), ground=True)
    nodes = np.stack([first, second], axis=1)
    work = np.array([s.force / s.length] * 3 + [s.force * s.length] * 3)
    K, B, GE = (
        np.array([known[p].get(key, np.zeros(6)) for p in pid.tolist()]) for key in ("K", "B", "GE")
    )
    if not (np.isfinite(B).all() and np.isfinite(GE).all()):
        raise cards.refuse(0, "B or GE is RIGID, which only a stiffness K can be")
    used = np.minimum(K, _BEYOND) + B
    frame = np.array([_bush_frame(ctx, cards, i, nodes[i], used[i]) for i in range(len(cards))])
    place = _bush_place(ctx, cards, nodes) * s.length
    return Bushes(cards.integers(1), nodes, frame, place, K * work, B * work * s.time, GE)


def _bush_frame(
    ctx: Context, cards: Cards, i: int, nodes: np.ndarray, used: np.ndarray
) -> np.ndarray:
    """Element frame: system CID, else x from end to end and y towards v (or G0)."""
    here, words = ctx.places[nodes[0]], [cards.word(i, k) for k in (5, 6, 7, 8)]
    if words[3]:
        return ctx.system_at(cards, i, cards.integer(i, 8), here)
    along = np.zeros(3) if nodes[1] < 0 else ctx.places[nodes[1]] - here
    if np.linalg.norm(along) * ctx.scale.length < 1e-12 or nodes[1] < 0:
        along = np.zeros(3)
    v = _direction(ctx, cards, i, nodes[0], words)
    if not np.any(along):
        if v is None or words[0].isdecimal():
            if np.ptp(used[:3]) == 0 and np.ptp(used[3:]) == 0:
                return np.eye(3)  # the same in every frame
            raise cards.refuse(i, "its ends coincide, so it needs a coordinate system CID")
        along, v = v, None
    if v is None:
        if np.any(used[[1, 2, 4, 5]]) and not np.any(words[:3]) and nodes[1] >= 0:
            raise cards.refuse(i, "it has lateral stiffness but neither orientation nor CID")
        v = np.eye(3)[np.argmin(np.abs(along))]
    z = np.cross(along, v)
    if not np.linalg.norm(z) > 1e-9 * np.linalg.norm(along) * np.linalg.norm(v):
        raise cards.refuse(i, "its orientation vector is along its axis or zero")
    frame = np.array([along, np.cross(z, along), z])
    return frame / np.linalg.norm(frame, axis=1)[:, None]


def _direction(
    ctx: Context, cards: Cards, i: int, node: int, words: list[str]
) -> np.ndarray | None:
    """Orientation vector of a bush in the basic frame; None where none is given."""
    if not any(words[:3]):
        return None
    if words[0].isdecimal() and not words[1] and not words[2]:
        return ctx.places[ctx.row(cards, i, int(words[0]))] - ctx.places[node]
    return cards.single(i).block(5, 3, 0.0)[0] @ ctx.frame_at(node)


def _bush_place(ctx: Context, cards: Cards, nodes: np.ndarray) -> np.ndarray:
    """Where the spring sits: at the fraction S from A to B, or at S1-S3 in system OCID."""
    s, ocid = cards.reals(9, 0.5), cards.integers(10, -1)
    place = _middle(ctx, nodes, s[:, None])
    for i in np.flatnonzero(ocid >= 0):
        one = cards.single(int(i))
        frame = ctx.frames.get(int(ocid[i]), cards, int(i))
        place[i] = frame.place(one.block(11, 3, 0.0))[0]
    return place


def _middle(ctx: Context, nodes: np.ndarray, s: np.ndarray | float) -> np.ndarray:
    """Places (n, 3) at the fraction s from A to B, at A where B is the ground."""
    A = ctx.places[nodes[:, 0]]
    B = np.where((nodes[:, 1] < 0)[:, None], A, ctx.places[nodes[:, 1]])
    return np.asarray(A + s * (B - A))
