"""Properties and materials of a fresh deck."""

from collections.abc import Iterator

import numpy as np

from ....errors import ModelError
from ....model.assembly import Assembly
from ....model.properties import (
    Anisotropic,
    BeamSection,
    Isotropic,
    Material,
    Orthotropic,
    Part,
    ShellSection,
    SolidSection,
)
from ....units import Units
from ..text.format import Value, card
from .numbering import Ids, unique_ids

_EXACT = 1e-11


def thickness(part: Part) -> float:
    """Thickness of a shell part, NaN for others."""
    return part.section.thickness if isinstance(part.section, ShellSection) else np.nan


def beam_kind(part: Part) -> str:
    """Bar, beam or rod."""
    return part.section.kind if isinstance(part.section, BeamSection) else "bar"


class _Library:
    """Materials in use; a shear material given by G alone is one of its own."""

    def __init__(self) -> None:
        self.found: list[tuple[Material, bool]] = []

    def add(self, material: Material | None, shear: bool = False) -> int | None:
        """Position of a material (from 0), entered when new."""
        if material is None:
            return None
        entry = (material, shear and isinstance(material, Anisotropic))
        for k, (known, as_shear) in enumerate(self.found):
            if as_shear == entry[1] and (known is material or known == material):
                return k
        self.found.append(entry)
        return len(self.found) - 1

    def ids(self) -> list[int]:
        """Ids: the materials' own where possible."""
        return unique_ids([0 if as_shear else m.id for m, as_shear in self.found])


def properties(assembly: Assembly, units: Units, ids: Ids) -> Iterator[str]:
    """Part names, properties, materials."""
    library = _Library()
    rows = [_used(part, library) for part in assembly.parts]
    mid = library.ids()
    for part, pid, used in zip(assembly.parts, ids.part, rows, strict=True):
        numbers = [None if k is None else mid[k] for k in used]
        name, values = _property(part, pid, numbers, units)
        yield f"$ANSA_NAME_COMMENT;{pid};{name};{part.name.replace(';', ',')};NO;NO;NO;"
        yield from card(name, values, _EXACT)
    for (material, as_shear), id in zip(library.found, mid, strict=True):
        yield from _material(material, as_shear, id, units)


def _used(part: Part, library: _Library) -> list[int | None]:
    """Materials of a part: MID, or MID1, MID2, MID3, MID4."""
    s = part.section
    if not isinstance(s, ShellSection):
        return [library.add(s.material)]
    shear = s.bending if s.shear is None else s.shear
    return [
        library.add(s.membrane),
        library.add(s.bending),
        None if s.rigid_shear else library.add(shear, shear=True),
        library.add(s.coupling),
    ]


def _property(part: Part, pid: int, mid: list[int | None], units: Units) -> tuple[str, list[Value]]:
    """(card name, fields) of one part."""
    s, L = part.section, units.length
    if isinstance(s, SolidSection):
        return "PSOLID", [pid, mid[0], None, None, None, "FULL" if s.full else None]
    if isinstance(s, BeamSection):
        return beam_card(s, pid, mid[0], units)
    values: list[Value] = [pid, mid[0], s.thickness / L, mid[1]]
    values += [None if s.bending_ratio == 1 else s.bending_ratio, mid[2]]
    values += [None if s.shear_ratio == 5 / 6 else s.shear_ratio]
    values += [s.nonstructural / (units.inertia / L**2) or None]
    return "PSHELL", values + ([None, None, mid[3]] if mid[3] else [])


def beam_card(s: BeamSection, pid: int, mid: Value, units: Units) -> tuple[str, list[Value]]:
    """(card name, fields): PBAR, PBEAM or PROD."""
    L = units.length
    nsm = s.nonstructural / (units.inertia / L)
    A, I1, I2, I12, J = s.area / L**2, *(x / L**4 for x in (s.I1, s.I2, s.I12, s.J))
    if s.kind == "rod":
        return "PROD", [pid, mid, A, J, None, nsm or None]
    points: list[Value] = [0.0] * 8
    if s.kind == "bar":
        return "PBAR", [pid, mid, A, I1, I2, J, nsm, None, *points, *s.shear, I12]
    n, m = ([x / L for x in pair] for pair in (s.neutral, s.nonstructural_at))
    inertia = s.nonstructural_inertia / (units.inertia * L)
    own, there = (inertia, m, n), (inertia, m, n)
    for b in s.stations:
        points += ["NO", b.x, b.area * A, b.I1 * I1, b.I2 * I2, b.I12 * I1, b.J * J]
        points += [b.nonstructural / (units.inertia / L)]
        y, z = ([x / L for x in pair] for pair in (b.neutral, b.nonstructural_at))
        there = (b.nonstructural_inertia / (units.inertia * L), z, y)
    more: list[Value] = [*s.shear, None, None, own[0], there[0], None, None]
    more += [*own[1], *there[1], *own[2], *there[2]]
    return "PBEAM", [pid, mid, A, I1, I2, I12, J, nsm, *points, *more]


def _material(m: Material, as_shear: bool, id: int, units: Units) -> list[str]:
    """MAT1, MAT8 or MAT2."""
    if not isinstance(m, Anisotropic):
        name, *values = material_card(m, id, units)
        return card(str(name), values, _EXACT)
    p, rho = units.stress, m.rho / units.density or None
    Q = np.zeros((3, 3)) if as_shear else m.Q / p
    if as_shear:
        Q[:2, :2] = m.G / p
    upper = Q[np.triu_indices(3)].tolist()
    return card("MAT2", [id, *upper, rho, *[None] * 4, m.damping or None], _EXACT)


def material_card(m: Material, id: int, units: Units) -> list[Value]:
    """MAT1 or MAT8 as (name, field, field, ...)."""
    p, rho = units.stress, m.rho / units.density or None
    if isinstance(m, Isotropic):
        G = None if m.G is None else m.G / p
        return ["MAT1", id, m.E / p, G, m.nu, rho, None, None, m.damping or None]
    if not isinstance(m, Orthotropic):
        raise ModelError(f"an Anisotropic material {m.id} of some of its parts cannot be changed")
    moduli: list[Value] = [m.E1 / p, m.E2 / p, m.nu12, m.G12 / p]
    moduli += [m.G1z / p or None, m.G2z / p or None]
    return ["MAT8", id, *moduli, rho, *[None] * 8, m.damping or None]


def beam_element(assembly: Assembly, row: int, pid: int, units: Units) -> list[Value]:
    """CBAR, CBEAM or CROD; vectors in the displacement frames of their grids."""
    b = assembly.beams
    i, j = b.nodes[row].tolist()
    kind = beam_kind(assembly.parts[b.part[row]])
    head: list[Value] = [int(b.ids[row]), pid, *assembly.ids[[i, j]].tolist()]
    if kind == "rod":
        return ["CROD", *head]
    frames = [np.eye(3) if assembly.axes is None else assembly.axes[r] for r in (i, j)]
    values = [*head, *(frames[0] @ b.up[row]).tolist(), None]
    values += [_packed(b.pins[row, end]) for end in (0, 1)]
    if np.any(b.offset[row]):
        for end in (0, 1):
            values += (frames[end] @ b.offset[row, end] / units.length).tolist()
    return ["CBAR" if kind == "bar" else "CBEAM", *values]


def _packed(flags: np.ndarray) -> int | None:
    """Components as one integer, 456; None where none is set."""
    text = "".join(str(c + 1) for c in np.flatnonzero(flags))
    return int(text) if text else None


def material_direction(assembly: Assembly) -> list[float | int | None]:
    """THETA (a real), MCID (0: basic) or None (along side G1-G2) of every shell."""
    s = assembly.shells
    if not len(s):
        return []
    X = assembly.points[s.nodes]
    d2 = np.where(s.triangle[:, None], X[:, 2] - X[:, 0], X[:, 3] - X[:, 1])
    d1 = np.where(s.triangle[:, None], X[:, 1] - X[:, 0], X[:, 2] - X[:, 0])
    normal = np.cross(d1, d2)
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    side, basic = (
        _laid(v, normal) for v in (X[:, 1] - X[:, 0], np.broadcast_to([1.0, 0, 0], normal.shape))
    )
    axis = _laid(s.axis, normal)
    angle = np.degrees(
        np.arctan2(
            np.einsum("ni,ni->n", np.cross(side, axis), normal),
            np.einsum("ni,ni->n", side, axis),
        )
    )
    along = np.linalg.norm(axis - basic, axis=1) < 1e-9
    out: list[float | int | None] = []
    for k, a in enumerate(angle.tolist()):
        free = abs(a) < 1e-7 or not np.any(axis[k])
        out.append(None if free else 0 if along[k] else a)
    return out


def _laid(v: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Unit vectors along the projections of v on the elements; zero where v is normal."""
    flat = v - np.einsum("ni,ni->n", v, normal)[:, None] * normal
    size = np.linalg.norm(flat, axis=1)
    return flat / np.where(size > 1e-9, size, np.inf)[:, None]
