"""Properties to parts: PSHELL, PCOMP, PSOLID and, by way of :mod:`.bars`, beams and rods."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ....model.properties import (
    Anisotropic,
    AnisotropicSolid,
    BeamSection,
    Part,
    Section,
    ShellSection,
    SolidSection,
)
from ..text.table import Cards
from . import bar_sections
from .context import Context
from .laminate import Ply, laminate_section, smear
from .materials import Materials

Reader = Callable[[Context, Materials, Cards, int], Section]
_FAMILIES: dict[str, tuple[str, ...]] = {
    "shell": ("PSHELL", "PCOMP", "PCOMPG", "PQUAD1", "PQUAD2", "PTRIA1", "PTRIA2", "PTRPLT1"),
    "solid": ("PSOLID",),
    "bar": ("PBAR", "PBARL"),
    "beam": ("PBEAM", "PBEAML"),
    "rod": ("PROD",),
    "tube": ("PTUBE",),
}
_UNREAD = ("PCOMPS", "PCOMPLS", "PLSOLID", "PLPLANE", "PBCOMP", "PBMSECT", "PBRSECT")


class Parts:
    """Parts in the making: each property becomes one when an element first asks for it."""

    def __init__(self, ctx: Context) -> None:
        self._ctx = ctx
        self.materials = Materials(ctx)
        self.made: list[Part] = []
        self.shift: list[float] = []  # offset of a laminate's middle from its reference [m]
        self._line: list[tuple[int, int]] = []  # file and line of each part's property
        self._at: dict[tuple[str, int], int] = {}
        self._cards = {family: self._index(names) for family, names in _FAMILIES.items()}

    def _index(self, names: tuple[str, ...]) -> dict[int, tuple[Cards, int]]:
        out: dict[int, tuple[Cards, int]] = {}
        for name in names:
            for cards in self._ctx.deck.present(name):
                for i, id in enumerate(cards.unique()):
                    if int(id) in out:
                        other, j = out[int(id)]
                        raise cards.refuse(i, f"the id is already taken at {other.where(j)}")
                    out[int(id)] = (cards, i)
        return out

    def of(self, family: str, elements: Cards, pid: np.ndarray) -> np.ndarray:
        """Positions (n,) of the parts the elements name."""
        unique, first, inverse = np.unique(pid, return_index=True, return_inverse=True)
        at = [
            self._one(family, elements, int(i), int(p)) for p, i in zip(unique, first, strict=True)
        ]
        return np.array(at, np.int64)[inverse]

    def _one(self, family: str, elements: Cards, i: int, pid: int) -> int:
        if (family, pid) not in self._at:
            known = self._cards[family]
            if pid not in known:
                for cards in self._ctx.deck.present(*_UNREAD):
                    if pid in cards.integers(1):
                        said = f"property {pid} is a {cards.name}, not understood here"
                        raise elements.refuse(i, said)
                there = ", ".join(f"{c.name} {p}" for p, (c, _) in sorted(known.items())[:8])
                kinds = " or ".join(_FAMILIES[family][:2])
                raise elements.refuse(
                    i, f"there is no {kinds} {pid}; there are {there or 'none at all'}"
                )
            cards, k = known[pid]
            card = cards.single(k)
            section = READERS[cards.name](self._ctx, self.materials, card, pid)
            _weighs(card, section)
            name = self._ctx.deck.names.get(pid) or f"{cards.name} {pid}"
            part = Part(pid, name, section)
            self._at[family, pid] = self.add(part, cards, k, _shift(self._ctx, card))
        return self._at[family, pid]

    def add(self, part: Part, cards: Cards, i: int, shift: float = 0.0) -> int:
        """Position of a new part, which card i describes."""
        self.made.append(part)
        self.shift.append(shift)
        self._line.append((int(cards.file[i]), int(cards.lines[cards.line_start[i]])))
        return len(self.made) - 1

    def order(self) -> np.ndarray:
        """Positions of the parts as their properties stand in the deck."""
        return np.array(sorted(range(len(self.made)), key=self._line.__getitem__), np.int64)


def _positive(card: Cards, k: int, what: str, blank: float | None = None) -> float:
    value = float(card.reals(k, blank)[0])
    if not value > 0:
        raise card.refuse(0, f"the {what} is {value:g}; it is to be positive")
    return value


def _weighs(card: Cards, section: Section) -> None:
    """Refuse a non-structural mass that takes away more than the sheet or the beam has."""
    if isinstance(section, BeamSection) and section.nonstructural < 0:
        if section.material.rho * section.area + section.nonstructural < 0:
            raise card.refuse(0, "its NSM is negative, and more than the beam weighs")
    if isinstance(section, ShellSection) and section.nonstructural < 0:
        sheet = getattr(section.membrane or section.bending, "rho", 0.0)
        if not sheet * section.thickness + section.nonstructural >= 0:
            raise card.refuse(0, "its NSM is negative, and more than the sheet weighs")


def _pshell(ctx: Context, materials: Materials, card: Cards, _: int) -> ShellSection:
    """PSHELL; MID2 blank: no bending, MID3 blank: no transverse shear flexibility."""
    mids = [int(card.integers(k, 0)[0]) for k in (2, 4, 6, 11)]
    if mids[1] == -1:
        raise card.refuse(0, "MID2 is -1: plane strain is not supported")
    found = [materials.sheet(card, 0, m) if m > 0 else None for m in mids]
    if found[0] is None and found[1] is None:
        raise card.refuse(0, "neither MID1 nor MID2 is given")
    blank = card.words(3)[0] == b""
    ratio = _positive(card, 5, "bending ratio 12I/T3", 1.0)
    ts = _positive(card, 7, "shear ratio TS/T", 0.833333)
    return ShellSection(
        np.nan if blank else _positive(card, 3, "thickness") * ctx.scale.length,
        found[0],
        found[1],
        found[2],
        found[3],
        ratio,
        5 / 6 if ts == 0.833333 else ts,
        float(card.reals(8, 0.0)[0]) * ctx.scale.inertia / ctx.scale.length**2,
        rigid_shear=found[2] is None,
    )


def _plies(ctx: Context, materials: Materials, card: Cards) -> list[Ply]:
    """Layers of a PCOMP as LAM has them (:data:`_LAM`); blanks repeat the layer below.

    A PCOMPG begins each layer with its global number and has one layer a line.
    """
    fields, ahead = card.fields(0), int(card.name == "PCOMPG")
    plies: list[Ply] = []
    mid, t = 0, 0.0
    for k in range(9 + ahead, len(fields) + 1, 8 if ahead else 4):
        if not any(fields[k - 1 : k + 3]):
            continue
        mid = int(card.integers(k, mid)[0])
        t = float(card.reals(k + 1, t)[0])
        if not t > 0:
            raise card.refuse(0, f"the thickness of layer {len(plies) + 1} is {t:g}")
        angle = float(card.reals(k + 2, 0.0)[0])
        plies.append(Ply(materials.sheet(card, 0, mid), t * ctx.scale.length, angle))
    if not plies:
        raise card.refuse(0, "the laminate has no layers")
    lay = card.word(0, 8)
    if lay not in _LAM:
        known = ", ".join(name for name in _LAM if name)
        raise card.refuse(0, f"LAM {lay!r} is not understood; there are {known}")
    if lay != "SMCORE":
        return plies + plies[::-1] if lay.startswith("SY") else plies
    if not plies[1:]:
        raise card.refuse(0, "SMCORE needs the layers of its faces and, last, a core")
    t, membrane, _, _, shear, rho = smear(plies[:-1])
    face = Ply(Anisotropic(membrane, shear, rho), t / 2, 0.0)
    return [face, plies[-1], face]


# LAM: what of the layers counts (MSC Nastran Quick Reference Guide, PCOMP). SY... mirrors them.
# SMEAR ignores their order and is rigid in shear. SMCORE halves all others about the last.
_LAM = {
    "": "all", "SYM": "all", "MEM": "membrane", "SYMEM": "membrane", "BEND": "bending",
    "SYBEND": "bending", "SMEAR": "smeared", "SYSMEAR": "smeared", "SMCORE": "all",
}  # fmt: skip


def _pcomp(ctx: Context, materials: Materials, card: Cards, pid: int) -> ShellSection:
    """PCOMP smeared to equivalent membrane, bending, coupling and shear moduli."""
    return replace(
        laminate_section(_plies(ctx, materials, card), pid, _LAM[card.word(0, 8)]),
        nonstructural=float(card.reals(3, 0.0)[0]) * ctx.scale.inertia / ctx.scale.length**2,
        damping=float(card.reals(7, 0.0)[0]),
    )


def _shift(ctx: Context, card: Cards) -> float:
    """Middle of a laminate above its reference plane, Z0 + T/2 [m]."""
    if not card.name.startswith("PCOMP") or card.words(2)[0] == b"":
        return 0.0
    t = sum(ply.thickness for ply in _plies(ctx, Materials(ctx), card))
    return float(card.reals(2)[0]) * ctx.scale.length + t / 2


def _psolid(ctx: Context, materials: Materials, card: Cards, _: int) -> SolidSection:
    """PSOLID; ISOP FULL is plain 2x2x2 integration, CORDM turns a MAT9."""
    if card.words(7)[0] in (b"PFLUID", b"FFLUID"):
        raise card.refuse(0, "fluid elements are not supported")
    material = materials.solid(card, 0, int(card.integers(2)[0]))
    if isinstance(material, AnisotropicSolid) and (cid := card.integer(0, 3, 0)):
        frame = None if cid < 0 else ctx.frames.get(cid, card, 0)
        if frame is None or frame.kind != "R":
            what = "the element's own axes" if frame is None else f"system {cid}, which is curved"
            raise card.refuse(0, f"CORDM {cid}: {what}, is not supported for a MAT9")
        material = replace(material, C=_turned(material.C, frame.axes))
    return SolidSection(material, bool(card.words(6)[0] in (b"FULL", b"1")))


def _turned(C: np.ndarray, axes: np.ndarray) -> np.ndarray:
    """C (6, 6) in the basic frame of one in axes (3, 3), unit vectors as rows."""
    place = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])  # of tensor components
    tensor = C[place[:, :, None, None], place]
    tensor = np.einsum("ia,jb,kc,ld,ijkl->abcd", *[axes] * 4, tensor, optimize=True)
    i, j = np.array([0, 1, 2, 0, 1, 2]), np.array([0, 1, 2, 1, 2, 0])
    return np.asarray(tensor[i[:, None], j[:, None], i, j])


def _pquad1(ctx: Context, materials: Materials, card: Cards, _: int) -> ShellSection:
    """COSMIC PQUAD1, PTRIA1: membrane MID1, T1; bending MID2, I; shear MID3, T3; NSM."""
    mids = [int(card.integers(k, 0)[0]) for k in (2, 4, 6)]
    found = [materials.sheet(card, 0, m) if m > 0 else None for m in mids]
    inertia, t3 = (float(card.reals(k, 0.0)[0]) for k in (5, 7))
    t = float(card.reals(3, 0.0)[0]) or (12 * inertia) ** (1 / 3)
    if not t > 0:
        raise card.refuse(0, "the thickness is zero")
    return ShellSection(
        t * ctx.scale.length,
        found[0],
        found[1],
        found[2],
        None,
        12 * inertia / t**3 if inertia else 1.0,
        t3 / t if t3 else 5 / 6,
        float(card.reals(8, 0.0)[0]) * ctx.scale.inertia / ctx.scale.length**2,
        rigid_shear=found[2] is None or not t3,
    )


def _pquad2(ctx: Context, materials: Materials, card: Cards, _: int) -> ShellSection:
    """COSMIC PQUAD2, PTRIA2: homogeneous, MID, T, NSM."""
    material = materials.sheet(card, 0, int(card.integers(2)[0]))
    return ShellSection(
        _positive(card, 3, "thickness") * ctx.scale.length,
        material,
        material,
        nonstructural=float(card.reals(4, 0.0)[0]) * ctx.scale.inertia / ctx.scale.length**2,
        rigid_shear=True,
    )


READERS: dict[str, Reader] = {
    "PSHELL": _pshell,
    "PCOMP": _pcomp,
    "PCOMPG": _pcomp,
    "PSOLID": _psolid,
    "PQUAD1": _pquad1,
    "PTRIA1": _pquad1,
    "PQUAD2": _pquad2,
    "PTRIA2": _pquad2,
    **bar_sections.READERS,
}
