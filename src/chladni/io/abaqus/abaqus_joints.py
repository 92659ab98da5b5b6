"""Supports, masses, springs, couplings, ties and equations of an input file."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ...geometry.mesh_cells import across
from ...geometry.nearest import ShellSurface
from ...model.assembly import (
    Average,
    Bushes,
    Equation,
    Masses,
    RigidBody,
    Scalars,
    appended,
)
from .abaqus_mesh import AbaqusMesh
from .abaqus_sections import orientation_of
from .keywords import Keyword

ALL = (1, 2, 3, 4, 5, 6)
_LABELS = {  # of *BOUNDARY: components held
    "ENCASTRE": ALL, "PINNED": (1, 2, 3), "XSYMM": (1, 5, 6), "YSYMM": (2, 4, 6),
    "ZSYMM": (3, 4, 5), "XASYMM": (2, 3, 4), "YASYMM": (1, 3, 5), "ZASYMM": (1, 2, 6),
}  # fmt: skip
_NEAR = 0.05  # of a master face's size: slave nodes so near are tied (Abaqus, *TIE)
_ROUNDING = 1e-9


@dataclass(eq=False)
class AbaqusJoints:
    """Joints over the rows of points, in the order of the file.

    A motion that depends already, or is held, does not depend again: Abaqus removes such
    constraints as well. They are counted in ``left_out``.
    """

    mesh: AbaqusMesh
    row: dict[int, int]  # of points by number of the deck
    points: np.ndarray  # (n, 3); slave nodes of ties on solids are moved onto their masters
    turning: frozenset[int]  # rows of points of shells and beams, which have rotations
    left_out: Counter[str] = field(default_factory=Counter)
    supports: set[tuple[int, int]] = field(default_factory=set)
    dependent: set[tuple[int, int]] = field(default_factory=set)
    rigid: list[RigidBody | Average | Equation] = field(default_factory=list)
    frames: dict[int, np.ndarray] = field(default_factory=dict)
    masses: list[tuple[int, np.ndarray]] = field(default_factory=list)
    scalars: list[tuple[tuple[int, int], tuple[int, int], float]] = field(default_factory=list)
    lines: list[tuple[tuple[int, int], float]] = field(default_factory=list)  # springs along them
    coupling: Keyword | None = None  # that *KINEMATIC and *DISTRIBUTING speak of

    def read(self, key: Keyword) -> bool:
        """Take in a keyword; False where it is no joint."""
        reader = getattr(self, f"_read_{key.name.lower().replace(' ', '_')}", None)
        if reader is None:
            return False
        reader(key)
        return True

    def families(self) -> dict[str, Any]:
        """The families of an assembly over these points; all ids are given by the deck."""
        axes = np.broadcast_to(np.eye(3), (len(self.points), 3, 3)).copy()
        for row, turned in self.frames.items():
            axes[row] = turned
        rows, components, values = zip(*self.scalars, strict=True) if self.scalars else ((), (), ())
        springs = {
            "ids": np.zeros(len(rows), np.int64),
            "nodes": np.array(rows, np.int64).reshape(-1, 2),
            "component": np.array(components, np.int64).reshape(-1, 2),
            "value": np.array(values, float),
        }
        masses = {
            "ids": np.zeros(len(self.masses), np.int64),
            "node": np.array([row for row, _ in self.masses], np.int64),
            "matrix": np.array([M for _, M in self.masses]).reshape(-1, 6, 6),
        }
        return {
            "points": self.points,
            "axes": axes if self.frames else None,
            "rigid": tuple(self.rigid),
            "supports": np.array(sorted(self.supports), dtype=np.int64).reshape(-1, 2),
            "masses": appended(Masses(), **masses),
            "springs": appended(Scalars(), **springs),
            "bushes": self._axial_springs(),
        }

    def _axial_springs(self) -> Bushes:
        ends = np.array([rows for rows, _ in self.lines], dtype=np.int64).reshape(-1, 2)
        x = np.diff(self.points[ends], axis=1)[:, 0]
        z = np.cross(x, across(self.points[ends]))
        frame = np.stack([x, np.cross(z, x), z], axis=1)
        stiffness = np.zeros((len(ends), 6))
        stiffness[:, 0] = [value for _, value in self.lines]
        made: Bushes = appended(
            Bushes(),
            ids=np.zeros(len(ends), np.int64),
            nodes=ends,
            frame=frame / np.linalg.norm(frame, axis=2, keepdims=True),
            place=self.points[ends].mean(axis=1),
            stiffness=stiffness,
        )
        return made

    def _rows(self, key: Keyword, name: str, row: int = -1) -> list[int]:
        return [self.row[id] for id in self.mesh.group(key, name, row)]

    def _one(self, key: Keyword, name: str) -> int:
        rows = self._rows(key, name)
        if len(rows) != 1:
            raise key.fault(f"{name!r} stands for {len(rows)} nodes; one is due")
        return rows[0]

    def _bound(self, row: int, component: int) -> bool:
        """True for a motion that depends or is held."""
        return (row, component) in self.dependent or (row, component) in self.supports

    def _free(self, row: int, components: Iterable[int], by: str) -> tuple[int, ...]:
        """Components that may depend, which do so from now on."""
        wanted = tuple(components)
        free = tuple(c for c in wanted if not self._bound(row, c))
        if len(free) < len(wanted):
            self.left_out[f"constraints of *{by} on motions that depend or are held already"] += 1
        self.dependent |= {(row, c) for c in free}
        return free

    def _read_boundary(self, key: Keyword) -> None:
        if key.step > 1:
            return
        if key.words.get("OP", "").upper() == "NEW":
            self.supports.clear()
        for k in range(len(key.rows)):
            label, last = key.cell(k, 1).upper(), key.cell(k, 2)
            if label in _LABELS:
                components: Sequence[int] = _LABELS[label]
            else:
                first = int(key.real(k, 1))
                components = range(first, int(key.real(k, 2, first) if last else first) + 1)
            if key.real(k, 3, 0.0):
                self.left_out["*BOUNDARY with a motion, which is held at zero"] += 1
            rows = self._rows(key, key.cell(k, 0), k)
            self.supports |= {(row, c) for row in rows for c in components if 1 <= c <= 6}

    def _read_transform(self, key: Keyword) -> None:
        """Displacement frames, which supports follow."""
        rows = self._rows(key, key.word("NSET"))
        frames = orientation_of(key, key.words.get("TYPE", "R")).frames(self.points[rows])
        self.frames |= dict(zip(rows, frames, strict=True))

    def _elements(self, key: Keyword) -> list[tuple[str, tuple[int, ...]]]:
        """Type and rows of the nodes of the elements of a keyword's set."""
        ids = self.mesh.elements.pick(key, key.word("ELSET"))
        each = (self.mesh.shapes[id] for id in dict.fromkeys(ids))
        return [(kind, tuple(self.row[n] for n in nodes)) for kind, nodes in each]

    def _read_mass(self, key: Keyword) -> None:
        for _, (row, *_) in self._elements(key):
            self.masses.append((row, key.real(0, 0) * np.diag([1.0, 1, 1, 0, 0, 0])))

    def _read_rotary_inertia(self, key: Keyword) -> None:
        a, b, c, ab, ac, bc = (key.reals(0) + [0.0] * 6)[:6]
        M = np.zeros((6, 6))
        M[3:, 3:] = [[a, ab, ac], [ab, b, bc], [ac, bc, c]]
        self.masses += [(row, M) for _, (row, *_) in self._elements(key)]

    def _read_spring(self, key: Keyword) -> None:
        """SPRING1 to ground and SPRING2 between two dofs; SPRINGA along the line of its nodes."""
        if "NONLINEAR" in key.words:
            self.left_out["*SPRING, NONLINEAR"] += 1
            return
        for kind, rows in self._elements(key):
            if kind == "SPRINGA":
                value = next((key.real(k, 0) for k in range(len(key.rows)) if key.cell(k, 0)), 0.0)
                if np.linalg.norm(np.diff(self.points[list(rows)], axis=0)) > 0:
                    self.lines.append(((rows[0], rows[1]), value))
                else:
                    self.left_out["SPRINGA without length"] += 1
            else:
                two = kind == "SPRING2"
                components = int(key.real(0, 0)), int(key.real(0, 1)) if two else 0
                self.scalars.append(((rows[0], rows[1] if two else -1), components, key.real(1, 0)))

    def _body(self, by: str, lead: int, rows: Iterable[int], components: Iterable[int]) -> None:
        """RBE2 of the motions that are free to depend."""
        found = {r: self._free(r, components, by) for r in rows if r != lead}
        found = {r: c for r, c in found.items() if c}
        if found:
            self.rigid.append(RigidBody(0, lead, tuple(found), tuple(found.values())))

    def _read_rigid_body(self, key: Keyword) -> None:
        lead = self._one(key, key.word("REF NODE"))
        if key.words.get("ELSET"):
            nodes = dict.fromkeys(r for _, rows in self._elements(key) for r in rows)
            self._body(key.name, lead, nodes, ALL)
        for word, components in (("NSET", ALL), ("TIE NSET", ALL), ("PIN NSET", (1, 2, 3))):
            if key.words.get(word):
                self._body(key.name, lead, self._rows(key, key.words[word]), components)

    def _read_kinematic_coupling(self, key: Keyword) -> None:
        lead = self._one(key, key.word("REF NODE"))
        for k in range(len(key.rows)):
            first = int(key.real(k, 1, 1.0))
            components = range(first, int(key.real(k, 2, first if key.cell(k, 1) else 6)) + 1)
            self._body(key.name, lead, self._rows(key, key.cell(k, 0), k), components)

    def _read_coupling(self, key: Keyword) -> None:
        self.coupling = key
        if "ORIENTATION" in key.words:
            self.left_out["ORIENTATION of *COUPLING"] += 1

    def _of_coupling(self, key: Keyword) -> tuple[int, list[int]]:
        if self.coupling is None:
            raise key.fault("it stands before the first *COUPLING")
        own = self.coupling
        return self._one(own, own.word("REF NODE")), self._rows(own, own.word("SURFACE"))

    def _read_kinematic(self, key: Keyword) -> None:
        lead, rows = self._of_coupling(key)
        each = [
            (int(key.real(k, 0)), int(key.real(k, 1, key.real(k, 0)))) for k in range(len(key.rows))
        ]
        components = sorted({c for a, b in each for c in range(a, b + 1)}) or ALL
        self._body("COUPLING", lead, rows, components)

    def _read_distributing(self, key: Keyword) -> None:
        lead, rows = self._of_coupling(key)
        self._mean("COUPLING", lead, dict.fromkeys(rows, 1.0))

    def _read_distributing_coupling(self, key: Keyword) -> None:
        weights: dict[int, float] = {}
        for k in range(len(key.rows)):
            weights |= dict.fromkeys(self._rows(key, key.cell(k, 0), k), key.real(k, 1, 1.0))
        for _, (lead, *_) in self._elements(key):
            self._mean(key.name, lead, weights)

    def _mean(self, by: str, lead: int, weights: dict[int, float]) -> None:
        """RBE3: the reference follows the mean of the others in all six motions."""
        if any(self._bound(lead, c) for c in ALL):
            self.left_out[f"*{by} whose reference node is held or depends already"] += 1
            return
        self.dependent |= {(lead, c) for c in ALL}
        terms = tuple((r, (1, 2, 3), w) for r, w in weights.items() if r != lead)
        self.rigid.append(Average(0, lead, ALL, terms))

    def _read_mpc(self, key: Keyword) -> None:
        """BEAM, TIE, PIN and LINK; the first node, or each of a set, depends on the second."""
        for k, cells in enumerate(key.rows):
            kind = cells[0].upper()
            if kind not in ("BEAM", "TIE", "PIN", "LINK") or len(cells) < 3:
                self.left_out[f"*MPC {kind}"] += 1
                continue
            (lead, *_), rows = self._rows(key, cells[2], k), self._rows(key, cells[1], k)
            if kind == "BEAM":
                self._body(key.name, lead, rows, ALL)
            for row in rows if kind == "LINK" else ():
                x = self.points[row] - self.points[lead]
                c = 1 + int(np.argmax(np.abs(x)))
                if self._free(row, (c,), key.name):
                    order = [c, *(d for d in (1, 2, 3) if d != c)]
                    terms = [
                        (r, d, s * x[d - 1]) for r, s in ((row, 1.0), (lead, -1.0)) for d in order
                    ]
                    self._equation(terms)
            for row in rows if kind in ("TIE", "PIN") else ():
                for c in self._free(row, ALL if kind == "TIE" else (1, 2, 3), key.name):
                    self._equation([(row, c, 1.0), (lead, c, -1.0)])

    def _equation(self, terms: list[tuple[int, int, float]]) -> None:
        """Σ a q = 0; terms of no size are left out."""
        kept = [t for t in terms if abs(t[2]) > _ROUNDING * abs(terms[0][2])]
        self.rigid.append(Equation(0, *(tuple(column) for column in zip(*kept, strict=True))))

    def _read_equation(self, key: Keyword) -> None:
        """A number of terms, then node or set, component and factor of each."""
        cells = [(k, j) for k, row in enumerate(key.rows) for j, cell in enumerate(row) if cell]
        while cells:
            count = int(key.real(*cells[0]))
            own, cells = cells[1 : 3 * count + 1], cells[3 * count + 1 :]
            if count < 1 or len(own) < 3 * count:
                raise key.fault(f"an equation of {count} terms ends early")
            sets = [self._rows(key, key.cell(*at), at[0]) for at in own[::3]]
            components = [int(key.real(*at)) for at in own[1::3]]
            factors = [key.real(*at) for at in own[2::3]]
            for i in range(max(map(len, sets))):
                rows = [s[min(i, len(s) - 1)] for s in sets]
                if self._free(rows[0], components[:1], key.name):
                    self._equation(list(zip(rows, components, factors, strict=True)))

    def _read_tie(self, key: Keyword) -> None:
        for k, cells in enumerate(key.rows):
            if len(cells) < 2:
                raise key.fault("a slave and a master surface are due", k)
            faces = self.mesh.faces(key, cells[1])
            if not faces or min(len(corners) for corners, _ in faces) < 3:
                raise key.fault(f"{cells[1]!r} is no surface of elements", k)
            self._tie(
                key, self._rows(key, cells[0], k), [[self.row[n] for n in f] for f, _ in faces]
            )

    def _tie(self, key: Keyword, slaves: list[int], faces: list[list[int]]) -> None:
        """u_s = Σ N_i (u_i + θ_i × d): a node follows the nearest point of a face, d away.

        Where the faces have no rotations the node is moved onto them, as Abaqus does.
        """
        table = np.array([(*f, f[-1])[:4] for f in faces])
        masters = set(table.ravel().tolist())
        rows = [r for r in slaves if r not in masters]
        if not rows:
            return
        near = ShellSurface.over("a master surface", self.points, table).closest_points(
            self.points[rows]
        )
        size = np.linalg.norm(np.ptp(self.points[table], axis=1), axis=1)
        limit = float(key.words.get("POSITION TOLERANCE") or 0) or _NEAR * size[near.shell]
        turning = {r in self.turning for r in masters} == {True}
        far = near.distance > limit
        self.left_out["slave nodes of *TIE beyond the tolerance"] += int(far.sum())
        for i in np.flatnonzero(~far):
            row, nodes, weights = rows[i], near.nodes[i].tolist(), near.weight[i].tolist()
            w = dict(zip(nodes, weights, strict=True))
            if not turning and key.words.get("ADJUST", "YES").upper() == "YES":
                self.points[row] = near.place[i]
            d = self.points[row] - near.place[i]
            for c in self._free(row, ALL if turning else (1, 2, 3), key.name):
                terms = [(row, c, 1.0), *((m, c, -x) for m, x in w.items())]
                if c <= 3 and turning:
                    a, b = c % 3, (c + 1) % 3  # (θ × d)_c = θ_a d_b - θ_b d_a
                    terms += [(m, 4 + a, -x * d[b]) for m, x in w.items()]
                    terms += [(m, 4 + b, x * d[a]) for m, x in w.items()]
                self._equation(terms)
