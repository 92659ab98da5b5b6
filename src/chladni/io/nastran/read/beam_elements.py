"""CBAR, CBEAM, CROD, CONROD, CTUBE: ends, orientation, offsets, pins."""

import numpy as np

from ....model.assembly import Beams, concatenated
from ....model.properties import BeamSection, Part
from ..text.table import Cards
from .bar_sections import refuse_impossible
from .context import Context, digits, only_one
from .sections import Parts

_FAMILY = {"CBAR": "bar", "CBEAM": "beam", "CROD": "rod", "CTUBE": "tube"}


def beams(ctx: Context, parts: Parts) -> Beams:
    """All two-node elements."""
    found = [_oriented(ctx, parts, c) for c in ctx.deck.present("CBAR", "CBEAM")]
    found += [_rods(ctx, parts, c) for c in ctx.deck.present("CROD", "CTUBE")]
    found += [_conrods(ctx, parts, c) for c in ctx.deck.present("CONROD")]
    return concatenated(*(found or [Beams()]))


def _straight(ctx: Context, cards: Cards, nodes: np.ndarray, part: np.ndarray) -> Beams:
    """Elements without orientation, offset or pins."""
    n = len(cards)
    made = Beams(
        cards.integers(1), nodes, part, np.zeros((n, 3)), np.zeros((n, 2, 3)),
        np.zeros((n, 2, 6), bool),
    )  # fmt: skip
    _check_length(ctx, cards, made)
    return made


def _check_length(ctx: Context, cards: Cards, made: Beams) -> np.ndarray:
    """Vectors (n, 3) from end to end; a length of zero is refused."""
    ends = ctx.places[made.nodes] * ctx.scale.length + made.offset
    along = ends[:, 1] - ends[:, 0]
    size = np.linalg.norm(along, axis=1)
    scale = np.abs(ends).max(axis=(1, 2))
    if np.any(bad := ~(size > 1e-12 * np.maximum(scale, 1e-300)) | ~np.isfinite(size)):
        i = int(np.argmax(bad))
        raise cards.refuse(i, f"its length is zero; grids {ctx.ids[made.nodes[i]].tolist()}")
    return along


def _rods(ctx: Context, parts: Parts, cards: Cards) -> Beams:
    nodes = ctx.rows(cards, cards.ids(3, 2))
    pid = cards.properties()
    return _straight(ctx, cards, nodes, parts.of(_FAMILY[cards.name], cards, pid))


def _conrods(ctx: Context, parts: Parts, cards: Cards) -> Beams:
    """CONROD brings its own section; equal ones share a part."""
    nodes = ctx.rows(cards, cards.ids(2, 2))
    mid, L = cards.integers(4), ctx.scale.length
    A, J, nsm = (cards.reals(k, 0.0) for k in (5, 6, 8))
    shared: dict[tuple[float, ...], int] = {}
    part = np.zeros(len(cards), np.int64)
    for i, key in enumerate(zip(mid.tolist(), A.tolist(), J.tolist(), nsm.tolist(), strict=True)):
        if key not in shared:
            material = parts.materials.isotropic(cards, i, int(key[0]))
            refuse_impossible(cards, i, (key[1], 0.0, 0.0, 0.0, key[2]))
            section = BeamSection(
                material, key[1] * L**2, J=key[2] * L**4,
                nonstructural=key[3] * ctx.scale.inertia / L, kind="rod",
            )  # fmt: skip
            eid = cards.integer(i, 1)
            shared[key] = parts.add(Part(eid, f"CONROD {eid}", section), cards, i)
        part[i] = shared[key]
    return _straight(ctx, cards, nodes, part)


def _default_card(ctx: Context, cards: Cards) -> Cards:
    return only_one(ctx.deck, "BAROR" if cards.name == "CBAR" else "BEAMOR")


def _defaults(ctx: Context, cards: Cards, k: int) -> bytes:
    """Text of field k on BAROR or BEAMOR."""
    found = _default_card(ctx, cards)
    return bytes(found.words(k)[0]) if len(found) else b""


def _oriented(ctx: Context, parts: Parts, cards: Cards) -> Beams:
    nodes = ctx.rows(cards, cards.ids(3, 2))
    pid = cards.properties(int(_defaults(ctx, cards, 2) or 0))
    part = parts.of(_FAMILY[cards.name], cards, pid)
    if cards.name == "CBEAM" and np.any(warps := cards.ids(17, 2, 0).any(axis=1)):
        raise cards.refuse(int(np.argmax(warps)), "warping (SA, SB) is not supported")
    flags = _flags(ctx, cards)
    up = _up(ctx, cards, nodes, flags)
    offset = _offsets(ctx, cards, nodes, flags, up)
    made = Beams(cards.integers(1), nodes, part, up, offset, _pins(cards))
    along = _check_length(ctx, cards, made)
    across = np.linalg.norm(np.cross(along, up), axis=1)
    limit = 1e-6 * np.linalg.norm(along, axis=1) * np.linalg.norm(up, axis=1)
    if np.any(bad := ~(across > limit)):
        raise cards.refuse(int(np.argmax(bad)), "its orientation vector is along its axis or zero")
    return made


def _flags(ctx: Context, cards: Cards) -> list[str]:
    """OFFT of every element, GGG where blank (or a CBEAM's BIT, a real)."""
    default = _defaults(ctx, cards, 8).decode("latin-1") or "GGG"
    out = []
    for i, word in enumerate(cards.words(8).tolist()):
        text = word.decode("latin-1") or default
        text = text if text.isalpha() else "GGG"
        if len(text) != 3 or text[0] not in "GB" or set(text[1:]) - set("GOE"):
            raise cards.refuse(i, f"OFFT {text!r} is not understood; there are GGG, BGG, GGO...")
        out.append(text)
    return out


def _up(ctx: Context, cards: Cards, nodes: np.ndarray, flags: list[str]) -> np.ndarray:
    """Orientation vectors (n, 3) in the basic frame, from G0 or X1-X3."""
    words = cards.words(5)
    blank = (words == b"") & (cards.words(6) == b"") & (cards.words(7) == b"")
    usual = [_defaults(ctx, cards, k) for k in (5, 6, 7)]
    if np.any(blank) and not any(usual):
        raise cards.refuse(int(np.argmax(blank)), "its orientation vector (or G0) is missing")
    words, *others = (np.where(blank, w, cards.words(k)) for k, w in enumerate(usual, start=5))
    grid = np.array([w.isdigit() for w in words.tolist()], bool)
    grid &= np.all([w == b"" for w in others], axis=0)
    up = np.zeros((len(cards), 3))
    given = ~grid & ~blank
    up[given] = cards.take(given).block(5, 3, 0.0)
    if np.any(blank & ~grid):
        up[blank & ~grid] = _default_card(ctx, cards).block(5, 3, 0.0)[0]
    basic = np.array([f[0] == "B" for f in flags])
    up = np.where(basic[:, None], up, ctx.basic(nodes[:, 0], up))
    for i in np.flatnonzero(grid):
        g0 = ctx.row(cards, int(i), int(words[i]))
        up[i] = ctx.places[g0] - ctx.places[nodes[i, 0]]
    return up


def _offsets(
    ctx: Context, cards: Cards, nodes: np.ndarray, flags: list[str], up: np.ndarray
) -> np.ndarray:
    """Offsets (n, 2, 3) of the ends in the basic frame [m]."""
    given = cards.block(11, 6, 0.0).reshape(-1, 2, 3) * ctx.scale.length
    out = np.stack([ctx.basic(nodes[:, e], given[:, e]) for e in (0, 1)], axis=1)
    for i, flag in enumerate(flags):
        for end in (0, 1):
            if flag[1 + end] in "OE":
                x = ctx.places[nodes[i, 1]] - ctx.places[nodes[i, 0]]
                z = np.cross(x, up[i])
                frame = np.array([x, np.cross(z, x), z])
                size = np.linalg.norm(frame, axis=1)
                if np.any(size == 0):
                    raise cards.refuse(i, "an offset in the element's own frame needs a length")
                out[i, end] = given[i, end] @ (frame / size[:, None])
    return out


def _pins(cards: Cards) -> np.ndarray:
    """(n, 2, 6) bool of PA, PB."""
    pins = np.zeros((len(cards), 2, 6), bool)
    for end in (0, 1):
        words = cards.words(9 + end)
        for i in np.flatnonzero(words != b""):
            for c in digits(cards, int(i), words[i].decode("latin-1"), "pin"):
                pins[i, end, c - 1] = True
    return pins
