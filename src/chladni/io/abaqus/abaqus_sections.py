"""Materials, orientations and sections of an input file as parts of a deck."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from ...errors import FileError, named
from ...geometry.facets import cell_normals
from ...geometry.mesh_cells import DIMENSION, ForeignCells, across
from ...model.properties import (
    BeamSection,
    Isotropic,
    Material,
    Orthotropic,
    Part,
    Section,
    ShellSection,
    SolidSection,
)
from ..meshes.part_statement import PartStatement, beam_section
from ..nastran.read.beam_profiles import SHAPES
from ..nastran.read.coordinate_systems import Frame
from ..nastran.read.laminate import Ply, laminate_section
from .abaqus_mesh import AbaqusMesh
from .element_types import FULL, MEMBRANE, REDUCED, TRUSS, kind_of
from .keywords import Keyword

SECTIONS = (
    "SHELL SECTION", "SHELL GENERAL SECTION", "SOLID SECTION", "MEMBRANE SECTION", "BEAM SECTION",
    "BEAM GENERAL SECTION",
)  # fmt: skip
OF_MATERIALS = ("MATERIAL", "ELASTIC", "DENSITY", "DAMPING")
_PROFILES = {  # of *BEAM SECTION: shape of PBARL, positions of its sizes, shear area over area
    "RECT": ("BAR", (1, 0), 0.85),
    "CIRC": ("ROD", (0,), 0.89),
    "PIPE": ("TUBE2", (0, 1), 0.53),
    "THICK PIPE": ("TUBE2", (0, 1), 0.53),
    "BOX": ("BOX1", (1, 0, 2, 4, 3, 5), 0.44),
    "I": ("I", (1, 2, 3, 6, 4, 5), 0.44),
}
_DOWN = (0.0, 0.0, -1.0)  # n1 of beams where the file gives none


@dataclass(frozen=True, eq=False)
class AbaqusOrientation:
    """A system of material axes, turned about one of them."""

    system: Frame
    about: int  # axis of the additional rotation, 0-2
    angle: float  # [rad]

    def frames(self, x: np.ndarray) -> np.ndarray:
        """Axes (n, 3, 3), as rows, at places (n, 3)."""
        turn, (i, j) = np.eye(3), np.array([self.about + 1, self.about + 2]) % 3
        c, s = np.cos(self.angle), np.sin(self.angle)
        turn[np.ix_((i, j), (i, j))] = [[c, s], [-s, c]]
        return np.asarray(turn @ self.system.at(x))

    def on_shells(self, x: np.ndarray) -> np.ndarray:
        """Direction (n, 3) whose projection is material axis 1 of shells.

        It is the axis that follows the axis of rotation, which is the normal approximately.
        """
        return self.frames(x)[:, (self.about + 1) % 3]


def orientation_of(key: Keyword, kind: str) -> AbaqusOrientation:
    """Read *ORIENTATION and *TRANSFORM of a kind RECTANGULAR (R) or CYLINDRICAL (C).

    Points a and b are on axis 1 and in plane 1-2, or on the axis of a cylinder. Without a second
    line the third axis is the normal of shells.
    """
    a, b = np.array([*key.reals(0), *[0.0] * 6][:6]).reshape(2, 3)
    letter = kind[:1].upper()
    if letter not in ("R", "C"):
        raise key.fault(f"system {kind} is not understood; there are RECTANGULAR and CYLINDRICAL")
    z, x = (np.cross(a, b), a) if letter == "R" else (b - a, np.eye(3)[np.argmin(np.abs(b - a))])
    y = np.cross(z, x)
    if not np.linalg.norm(y) > 0:
        raise key.fault("its points lie on one line", 0)
    axes = np.array([v / np.linalg.norm(v) for v in (np.cross(y, z), y, z)])
    frame = Frame(letter, np.zeros(3) if letter == "R" else a, axes)
    two = len(key.rows) > 1
    about, angle = (int(key.real(1, 0, 3.0)), key.real(1, 1, 0.0)) if two else (3, 0.0)
    return AbaqusOrientation(frame, about - 1, float(np.radians(angle)))


class _NotUnderstood(Exception):
    """A section whose elements are left out; its text says why."""


def materials_of(keys: Iterable[Keyword]) -> dict[str, Material]:
    """Materials by name in lower case; of a table over temperature the first line holds."""
    made: dict[str, Material] = {}
    name = ""
    for key in keys:
        if key.name == "MATERIAL":
            name = key.word("NAME").lower()
            made[name] = Isotropic(0.0, 0.0, id=len(made) + 1)
        elif not name:
            raise key.fault("it stands before the first *MATERIAL")
        elif key.name == "ELASTIC":
            made[name] = _elastic(key, made[name])
        elif key.name == "DENSITY":
            made[name] = replace(made[name], rho=key.real(0, 0))
        elif "STRUCTURAL" in key.words:
            made[name] = replace(made[name], damping=float(key.words["STRUCTURAL"]))
    return made


def _elastic(key: Keyword, m: Material) -> Material:
    kind = key.words.get("TYPE", "ISOTROPIC").upper()
    if kind.startswith("ISO"):
        return Isotropic(key.real(0, 0), key.real(0, 1, 0.0), m.rho, m.damping, id=m.id)
    v = [x for row in range(len(key.rows)) for x in key.reals(row)]
    if kind == "LAMINA" and len(v) > 3:
        E1, E2, nu12, G12, G13, G23 = [*v, 0.0, 0.0][:6]
    elif kind.startswith("ENGINEERING") and len(v) > 8:
        E1, E2, nu12, (G12, G13, G23) = v[0], v[1], v[3], v[6:9]
    else:
        return m  # the elements are listed
    return Orthotropic(E1, E2, nu12, G12, G13, G23, m.rho, m.damping, m.id)


@dataclass(eq=False)
class AbaqusParts:
    """Sections in use: parts, and the elements of each."""

    mesh: AbaqusMesh
    materials: dict[str, Material]
    orientations: dict[str, AbaqusOrientation]
    parts: list[Part] = field(default_factory=list)
    cells: list[ForeignCells] = field(default_factory=list)  # their nodes by number of the deck
    assigned: set[int] = field(default_factory=set)  # elements
    nodal: dict[int, float] = field(default_factory=dict)  # thickness at nodes
    left_out: Counter[str] = field(default_factory=Counter)

    def read(self, key: Keyword) -> None:
        """Take in a section and the elements of its set by their kinds, or nodal thickness."""
        if key.name == "NODAL THICKNESS":
            for row in range(len(key.rows)):
                nodes = self.mesh.group(key, key.cell(row, 0), row)
                self.nodal |= dict.fromkeys(nodes, key.real(row, 1))
            return
        name = key.word("ELSET")
        kinds: dict[str, list[int]] = {}
        for id in dict.fromkeys(self.mesh.elements.pick(key, name)):
            kinds.setdefault(self.mesh.shapes[id][0], []).append(id)
        full = any(map(FULL.fullmatch, kinds)) and not any(map(REDUCED.fullmatch, kinds))
        dimension = {"SHELL": 2, "MEMBRANE": 2, "BEAM": 1}.get(key.name.split()[0], 3)
        for type, ids in kinds.items():
            own = 1 if TRUSS.fullmatch(type) else dimension
            if not (kind := kind_of(type)) or DIMENSION[kind] != own:
                continue
            try:
                self._add(key, type, kind, ids, full)
            except _NotUnderstood as error:
                self.left_out[f"{type} of {name}, {error}"] += len(ids)
                self.assigned |= set(ids)

    def state(self, statement: PartStatement) -> None:
        """Give a statement's section to the elements of a set, or to all that have none."""
        mesh = self.mesh
        name = next((s for s in mesh.elements.sets if s.lower() == statement.name.lower()), "")
        if statement.name and not name:
            there = named(mesh.elements.sets, 20)
            raise FileError(f"there is no element set {statement.name!r}; there are {there}")
        every = mesh.elements.sets[name] if name else list(mesh.shapes)
        kinds: dict[str, list[int]] = {}
        for id in (id for id in every if id not in self.assigned):
            kinds.setdefault(kind_of(mesh.shapes[id][0]), []).append(id)
        for kind, ids in kinds.items():
            if not kind or statement.lacks(DIMENSION[kind]):
                continue
            section = statement.section(DIMENSION[kind])
            part = self._part(name or "mesh", "", section)
            nodes = np.array([mesh.shapes[id][1] for id in ids])
            ends = np.array([[mesh.places[n] for n in row[:2]] for row in nodes.tolist()])
            nodes = nodes[:, [0, 2, 1]] if kind == "line3" else nodes
            t = getattr(section, "thickness", 0.0)
            self.cells.append(ForeignCells(kind, np.array(ids), nodes, part, t, up=across(ends)))
            self.assigned |= set(ids)

    def _add(self, key: Keyword, type: str, kind: str, ids: list[int], full: bool) -> None:
        nodes = np.array([self.mesh.shapes[id][1] for id in ids])
        section, offset, up = self._section(key, type)
        if isinstance(section, SolidSection):
            section = replace(section, full=full)
        part = self._part(key.word("ELSET"), key.scope, section)
        t: float | np.ndarray = getattr(section, "thickness", 0.0)
        if "NODAL THICKNESS" in key.words and isinstance(section, ShellSection):
            corners = nodes[:, [0, 1, 2, 2] if kind.startswith("triangle") else [0, 1, 2, 3]]
            t = np.vectorize(lambda n: self.nodal.get(n, section.thickness))(corners)
        grained = isinstance(section, ShellSection) and not isinstance(section.membrane, Isotropic)
        axis = self._axis(key, nodes) if grained else None
        along = None if up is None else self._across(key, nodes, up)
        nodes = nodes[:, [0, 2, 1]] if kind == "line3" else nodes
        cells = ForeignCells(kind, np.array(ids), nodes, part, t, axis, offset, along)
        self.cells.append(cells)
        self.assigned |= set(ids)

    def _part(self, name: str, scope: str, section: Section) -> int:
        """Position of a part; the same section of one set is one part whatever its elements."""
        same = [k for k, p in enumerate(self.parts) if p.name == name and p.section == section]
        if same:
            return same[0]
        taken = {p.name for p in self.parts}
        unique = f"{scope}.{name}" if name in taken and scope else name
        while unique in taken:
            unique += "'"
        self.parts.append(Part(len(self.parts) + 1, unique, section))
        return len(self.parts) - 1

    def _section(self, key: Keyword, type: str) -> tuple[Section, float, np.ndarray | None]:
        """Section, offset of shells, n1 of beams."""
        if key.name.startswith("BEAM"):
            return self._beam(key), 0.0, self._n1(key)
        if "COMPOSITE" in key.words:
            stack = laminate_section(self._plies(key))
            return stack, self._offset(key) * stack.thickness, None
        material = self._material(key, key.word("MATERIAL"))
        if TRUSS.fullmatch(type):
            return BeamSection(material, key.real(0, 0), kind="rod"), 0.0, np.zeros(3)
        if key.name == "SOLID SECTION":
            return SolidSection(material), 0.0, None
        bending = None if MEMBRANE.fullmatch(type) else material
        t = key.real(0, 0)
        return ShellSection(t, material, bending), self._offset(key) * t, None

    def _material(self, key: Keyword, name: str) -> Material:
        made = self.materials.get(name.lower())
        if made is None:
            raise key.fault(f"there is no material {name!r}; there are {', '.join(self.materials)}")
        if isinstance(made, Isotropic) and not made.E > 0:
            raise _NotUnderstood(f"material {name} without linear *ELASTIC")
        return made

    def _offset(self, key: Keyword) -> float:
        text = key.words.get("OFFSET", "0").upper()
        return {"SPOS": 0.5, "SNEG": -0.5}.get(text, 0.0) if text[:1] == "S" else float(text)

    def _plies(self, key: Keyword) -> list[Ply]:
        """Thickness, points, material, angle; an orientation by name counts as no angle."""
        found = []
        for row in range(len(key.rows)):
            angle = key.cell(row, 3)
            turned = (
                key.real(row, 3, 0.0) if angle and angle.lower() not in self.orientations else 0.0
            )
            found.append(Ply(self._material(key, key.cell(row, 2)), key.real(row, 0), turned))
        return found

    def _axis(self, key: Keyword, nodes: np.ndarray) -> np.ndarray | None:
        """Material axis 1; without an orientation the basic x, or z where x is the normal."""
        corners = np.array([[self.mesh.places[n] for n in row] for row in nodes[:, :4].tolist()])
        if name := key.words.get("ORIENTATION", "").lower():
            if name not in self.orientations:
                known = ", ".join(self.orientations) or "no one"
                raise key.fault(f"there is no orientation {name!r}; there are {known}")
            return self.orientations[name].on_shells(corners.mean(axis=1))
        if corners.shape[1] < 4 or nodes.shape[1] == 6:
            corners = corners[:, [0, 1, 2, 2]]
        flat = corners.reshape(-1, 3)
        normal = cell_normals(flat, np.arange(len(flat)).reshape(-1, 4))
        along_x = np.abs(normal[:, :1]) > np.cos(np.radians(0.1))
        return np.where(along_x, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])

    def _beam(self, key: Keyword) -> BeamSection:
        """Sections by their sizes, or by their area and moments; n1 is axis y of our beams."""
        kind, v = key.words.get("SECTION", "GENERAL").upper(), key.reals(0)
        material = self._beam_material(key)
        if kind == "GENERAL" and len(v) > 4:
            A, I11, I12, I22, J = v[:5]
            return BeamSection(material, A, I22, I11, I12, J)
        if kind not in _PROFILES or len(v) <= max(_PROFILES[kind][1]):
            raise _NotUnderstood(f"SECTION={kind} of {len(v)} sizes")
        shape, sizes, shear = _PROFILES[kind]
        made = beam_section(material, SHAPES[shape][0](*(v[k] for k in sizes)))
        if kind == "I":  # its height is along n2
            made = replace(made, I1=made.I2, I2=made.I1)
        return replace(made, shear=(shear, shear))

    def _beam_material(self, key: Keyword) -> Material:
        """The material by name, or E, G and DENSITY of a general section."""
        if key.words.get("MATERIAL"):
            return self._material(key, key.words["MATERIAL"])
        E, G = key.real(2, 0), key.real(2, 1)
        return Isotropic(E, E / (2 * G) - 1, float(key.words.get("DENSITY", 0)), G=G)

    def _n1(self, key: Keyword) -> np.ndarray:
        """Direction n1 of the cross-section, which is axis y of our beams."""
        v = key.reals(1) if len(key.rows) > 1 else []
        return np.array(v[:3] if any(v[:3]) else _DOWN)

    def _across(self, key: Keyword, nodes: np.ndarray, up: np.ndarray) -> np.ndarray:
        """n1 of each beam; one that lies along n1 is refused, as Abaqus does."""
        ends = np.array([[self.mesh.places[n] for n in (r[0], r[-1])] for r in nodes.tolist()])
        along = ends[:, 1] - ends[:, 0]
        if np.any(up) and np.any(
            np.linalg.norm(np.cross(along, up), axis=1) < 1e-9 * np.linalg.norm(along, axis=1)
        ):
            raise key.fault("a beam lies along its direction n1; give another in the second line")
        return np.broadcast_to(up, along.shape).copy()
