"""CalculiX deck of an assembly: quadratic shells and beams on the same corners, linear solids.

Every side of a shell and every beam gets a node in its middle (S8R, S6, B32R); solids keep theirs
(C3D8I, C3D6, C3D4). A mean (RBE3) becomes equations with our weights. A spider (RBE2) becomes a
rigid body, and a bar between two spiders a part of it. A spring to ground leads to a fixed node a
metre away. Dhondt, CalculiX CrunchiX User's Manual 2.20. Elements without counterpart are refused.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from chladni.errors import ModelError
from chladni.fem.rigid import transformation
from chladni.geometry.facets import cell_normals
from chladni.model.assembly import Assembly, Average, Bushes, RigidBody
from chladni.model.properties import BeamSection, Isotropic, Orthotropic, Part, ShellSection

LEAST_DENSITY = 1e-6  # of welds without mass [kg/m³]: CalculiX requires a density
GRAIN = 0.03  # directions that differ by less share a card [rad]
THROUGH = 0.3  # Poisson's ratio between axis 2 and the normal: it hardly changes a sheet
_ROUNDING = 1e-12


@dataclass
class _Numbers:
    """Unused element and node numbers."""

    element: int = 1
    node: int = 1
    anchors: list[str] = field(default_factory=list)

    def elements(self, n: int) -> range:
        """The next n of them."""
        self.element += n
        return range(self.element - n, self.element)


def deck(assembly: Assembly, count: int, rows: np.ndarray) -> str:
    """The text of a frequency step that prints the motion of some points.

    Parameters
    ----------
    count : number of modes
    rows : (k,) int   rows of points; their motion is printed mode by mode
    """
    a, edges, of = assembly, *_middles(assembly)
    x = np.vstack([a.points, a.points[edges].mean(axis=1)])
    numbers = _Numbers(node=len(x) + 1)
    body = [
        *_elements(a, of, numbers),
        *_masses(a, numbers),
        *_springs(a, numbers),
        *_equations(a),
        *_rigid_bodies(a),
    ]
    nodes = ["*NODE", *(_row(k, p) for k, p in enumerate(x, start=1)), *numbers.anchors]
    held = [f"{r + 1}, {c}, {c}" for r, c in a.supports.tolist()]
    held += [f"{n}, 1, 3" for n in range(len(x) + 1, numbers.node)]
    body += ["*BOUNDARY", *held] if held else []
    places = ["*NSET, NSET=PLACES", *(f"{r + 1}," for r in np.unique(rows))]
    step = ["*STEP", "*FREQUENCY", str(count), "*NODE PRINT, NSET=PLACES", "U"]
    return "\n".join([*nodes, *body, *places, *step, "*END STEP", ""])


def _row(k: int, values: np.ndarray) -> str:
    return f"{k}, " + ", ".join(f"{v:.9e}" for v in values)


def _middles(a: Assembly) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Sides (k, 2) that get a node, and the sides of every shell (m, 4) and beam (n,)."""
    corners = a.shells.nodes
    pairs = np.stack([corners, np.roll(corners, -1, axis=1)], axis=2)
    tri = a.shells.triangle
    pairs[tri, 2] = pairs[tri, 3]  # a triangle's third side joins its third and first corner
    both = np.sort(np.concatenate([pairs.reshape(-1, 2), a.beams.nodes]), axis=1)
    if not len(both):
        return np.zeros((0, 2), int), (np.zeros((0, 4), int), np.zeros(0, int))
    edges, of = np.unique(both, axis=0, return_inverse=True)
    of = len(a.points) + of.ravel()
    n = 4 * len(corners)
    return edges, (of[:n].reshape(-1, 4), of[n:])


def _elements(a: Assembly, of: tuple[np.ndarray, np.ndarray], numbers: _Numbers) -> Iterator[str]:
    """Elements, materials and sections, part by part."""
    screws = _between_spiders(a)
    for p, part in enumerate(a.parts):
        shells = np.flatnonzero(a.shells.part == p)
        beams = np.flatnonzero((a.beams.part == p) & ~screws)
        solids = [(s, np.flatnonzero(s.part == p)) for s in a.solids]
        if len(shells):
            yield from _shells(a, p, shells, of[0], numbers)
        elif len(beams):
            yield from _material(p, _beam_section(part).material)
            yield from _beams(a, p, beams, of[1], numbers)
        elif any(len(at) for _, at in solids):
            for s, at in solids:
                kind = {8: "C3D8I", 6: "C3D6", 4: "C3D4"}[s.nodes.shape[1]]
                yield from _listed(kind, f"P{p}", s.nodes[at], numbers)
            yield from _material(p, part.section.material)  # type: ignore[union-attr]
            yield f"*SOLID SECTION, ELSET=P{p}, MATERIAL=M{p}"


def _listed(kind: str, name: str, table: np.ndarray, numbers: _Numbers) -> Iterator[str]:
    """An element card with these nodes (m, k) as rows of points."""
    if len(table):
        yield f"*ELEMENT, TYPE={kind}, ELSET={name}"
        for e, row in zip(numbers.elements(len(table)), table, strict=True):
            yield f"{e}, " + ", ".join(str(n + 1) for n in row)


def _shells(
    a: Assembly, p: int, at: np.ndarray, of: np.ndarray, numbers: _Numbers
) -> Iterator[str]:
    """S8R and S6 of one part; a thickness that varies is given at the nodes."""
    section = a.parts[p].section
    if not isinstance(section, ShellSection) or (plain := _refused(section, a, at)):
        raise ModelError(f"part {a.parts[p].name} has {plain}, which CalculiX is not given")
    yield from _material(p, section.membrane)
    whole, t = np.hstack([a.shells.nodes[at], of[at]]), a.shells.thickness[at]
    even = np.ptp(t) <= 1e-9 * t.max()
    options = "" if even else ", NODAL THICKNESS"
    if offset := float(a.shells.offset[at[0]]):
        options += f", OFFSET={offset / float(t.mean()):.9e}"
    for name, mine, orientation in _by_grain(a, p, at):
        tri = a.shells.triangle[at[mine]]
        yield from _listed("S8R", name, whole[mine][~tri], numbers)
        yield from _listed("S6", name, whole[mine][tri][:, [0, 1, 2, 4, 5, 6]], numbers)
        yield from orientation
        own = f", ORIENTATION=O{name}" if orientation else ""
        yield f"*SHELL SECTION, ELSET={name}, MATERIAL=M{p}{own}{options}"
        yield f"{t.mean():.9e}"
    if not even:
        yield "*NODAL THICKNESS"
        yield from (f"{n + 1}, {v:.9e}" for n, v in _nodal_thickness(t, whole))


def _by_grain(
    a: Assembly, p: int, at: np.ndarray
) -> Iterator[tuple[str, np.ndarray, tuple[str, ...]]]:
    """(name, positions in ``at``, orientation card) of shells whose material axis 1 agrees.

    The written material is the same in all directions across axis 1, so axis 2 need not agree.
    """
    section = a.parts[p].section
    assert isinstance(section, ShellSection)
    if not isinstance(section.membrane, Orthotropic):
        yield f"P{p}", np.arange(len(at)), ()
        return
    e1, e2 = _axes(a, at)
    _, first, group = np.unique(
        (e1 / GRAIN).round(), axis=0, return_index=True, return_inverse=True
    )
    for k, j in enumerate(first):
        name = f"P{p}G{k}"
        axes = ", ".join(f"{v:.9e}" for v in (*e1[j], *e2[j]))
        card = (f"*ORIENTATION, NAME=O{name}, SYSTEM=RECTANGULAR", axes)
        yield name, np.flatnonzero(group.ravel() == k), card


def _refused(section: ShellSection, a: Assembly, at: np.ndarray) -> str:
    """Property of a shell section without a card in CalculiX; empty where all have one."""
    if section.membrane is None or section.membrane != section.bending or section.coupling:
        return "different materials in membrane and bending"
    if section.bending_ratio != 1.0:
        return f"a bending ratio of {section.bending_ratio:g}"
    if section.nonstructural:
        return "non-structural mass"
    return "offsets that differ" if np.ptp(a.shells.offset[at]) > 1e-9 else ""


def _nodal_thickness(t: np.ndarray, nodes: np.ndarray) -> Iterator[tuple[int, float]]:
    """Mean thickness at every corner and middle of these shells."""
    every = np.hstack([t, (t + np.roll(t, -1, axis=1)) / 2])
    rows, at = np.unique(nodes, return_inverse=True)
    mean = np.bincount(at.ravel(), every.ravel()) / np.bincount(at.ravel())
    return zip(rows.tolist(), mean.tolist(), strict=True)


def _axes(a: Assembly, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Material axes 1 and 2 of shells: the projection of ``axis`` and its in-plane normal."""
    n = cell_normals(a.points, a.shells.nodes[at])
    e = a.shells.axis[at]
    e = e - np.einsum("ki,ki->k", e, n)[:, None] * n
    e /= np.linalg.norm(e, axis=1, keepdims=True)
    return e, np.cross(n, e)


def _material(p: int, material: object) -> Iterator[str]:
    """*MATERIAL with its elasticity and density."""
    yield f"*MATERIAL, NAME=M{p}"
    if isinstance(material, Isotropic):
        yield from ("*ELASTIC", f"{material.E:.9e}, {material.nu:.9e}")
    elif isinstance(material, Orthotropic):
        m, G23 = material, material.E2 / (2 * (1 + THROUGH))
        yield "*ELASTIC, TYPE=ENGINEERING CONSTANTS"  # eight on the first line, then the rest
        sides = (m.E1, m.E2, m.E2, m.nu12, m.nu12, THROUGH, m.G12, m.G12)
        yield ", ".join(f"{v:.9e}" for v in sides)
        yield f"{G23:.9e}, 293."
    else:
        raise ModelError(f"CalculiX is not given a material of kind {type(material).__name__}")
    yield from ("*DENSITY", f"{max(material.rho, LEAST_DENSITY):.9e}")


def _beams(a: Assembly, p: int, at: np.ndarray, of: np.ndarray, numbers: _Numbers) -> Iterator[str]:
    """B32R of one part; beams with equal orientation vectors share a section."""
    ups, group = np.unique(a.beams.up[at].round(9), axis=0, return_inverse=True)
    kind = _profile(a.parts[p])
    for j, up in enumerate(ups):
        mine = at[group.ravel() == j]
        ends = a.beams.nodes[mine]
        table = np.column_stack([ends[:, 0], of[mine], ends[:, 1]])
        yield from _listed("B32R", f"P{p}U{j}", table, numbers)
        yield f"*BEAM SECTION, ELSET=P{p}U{j}, MATERIAL=M{p}, {kind}"
        yield ", ".join(f"{v:.9e}" for v in up)


def _beam_section(part: Part) -> BeamSection:
    if not isinstance(part.section, BeamSection):
        raise ModelError(f"part {part.name} has beams but no beam section")
    return part.section


def _profile(part: Part) -> str:
    """A round tube or bar of this area and moment: R² + r² = 4 I/A, R² - r² = A/π."""
    s = _beam_section(part)
    if not np.isclose(s.I1, s.I2, rtol=1e-6) or not np.isclose(s.J, 2 * s.I1, rtol=1e-6):
        raise ModelError(f"part {part.name}: only round profiles are given to CalculiX")
    R2, r2 = 2 * s.I1 / s.area + s.area / (2 * np.pi), 2 * s.I1 / s.area - s.area / (2 * np.pi)
    R, r = np.sqrt(R2), np.sqrt(max(r2, 0.0))
    kind, sizes = ("PIPE", (R, R - r)) if r > 1e-3 * R else ("CIRC", (R, R))
    return f"SECTION={kind}\n" + ", ".join(f"{v:.9e}" for v in sizes)


def _between_spiders(a: Assembly) -> np.ndarray:
    """Beams (n,) bool with reference points of spiders at both ends: the shafts of screws."""
    centres = [r.independent for r in a.rigid if isinstance(r, RigidBody)]
    return np.asarray(np.isin(a.beams.nodes, centres).all(axis=1))


def _shaft_masses(a: Assembly) -> Iterator[tuple[int, float]]:
    """Half of a shaft's mass at each end."""
    for k in np.flatnonzero(_between_spiders(a)):
        s, ends = _beam_section(a.parts[a.beams.part[k]]), a.beams.nodes[k]
        L = float(np.linalg.norm(np.diff(a.points[ends], axis=0)))
        yield from ((int(r), s.area * s.material.rho * L / 2) for r in ends)


def _masses(a: Assembly, numbers: _Numbers) -> Iterator[str]:
    """MASS elements; only the mass itself, without offset or inertia."""
    lumps = [*_shaft_masses(a)]
    for row, m in zip(a.masses.node.tolist(), a.masses.matrix, strict=True):
        if np.abs(m - m[0, 0] * np.diag([1, 1, 1, 0, 0, 0])).max() > 1e-9 * abs(m[0, 0]):
            raise ModelError(f"the mass at grid {a.ids[row]} has an offset or inertia")
        lumps.append((row, float(m[0, 0])))
    for k, (row, value) in enumerate(lumps):
        yield from _listed("MASS", f"LUMP{k}", np.array([[row]]), numbers)
        yield from (f"*MASS, ELSET=LUMP{k}", f"{value:.9e}")


def _springs(a: Assembly, numbers: _Numbers) -> Iterator[str]:
    """Springs to ground: SPRING1 along an axis, SPRINGA along any direction."""
    for k, (rows, component) in enumerate(zip(a.springs.nodes, a.springs.component, strict=True)):
        if min(rows) >= 0 or component[int(rows[0] < 0)] > 3:
            raise ModelError(
                f"spring {a.springs.ids[k]} does not lead from a translation to ground"
            )
        end = int(rows[0] < 0)
        yield from _listed("SPRING1", f"SPRING{k}", rows[None, [end]], numbers)
        yield from (f"*SPRING, ELSET=SPRING{k}", str(component[end]), f"{a.springs.value[k]:.9e}")
    for k in range(len(a.bushes)):
        yield from _bush(a, a.bushes, k, numbers)


def _bush(a: Assembly, b: Bushes, k: int, numbers: _Numbers) -> Iterator[str]:
    row, ground = b.nodes[k]
    away = np.linalg.norm(b.place[k] - a.points[row])
    if ground >= 0 or away > 1e-9 or b.stiffness[k, 3:].any():
        raise ModelError(f"bush {b.ids[k]} is more than springs from a point to ground")
    for c in np.flatnonzero(b.stiffness[k, :3]):
        anchor = a.points[row] + b.frame[k, c]
        numbers.anchors.append(_row(numbers.node, anchor))
        name = f"BUSH{k}{c}"
        yield from _listed("SPRINGA", name, np.array([[row, numbers.node - 1]]), numbers)
        yield from (f"*SPRING, ELSET={name}", "", f"{b.stiffness[k, c]:.9e}")
        numbers.node += 1


def _equations(a: Assembly) -> Iterator[str]:
    """Equations u_ref - Σ G u = 0 for every RBE3, with our G."""
    means = tuple(r for r in a.rigid if isinstance(r, Average))
    if not means:
        return
    T, independent = transformation(replace(a, rigid=means))
    T = T.tocsr()
    for mean in means:
        for c in (c - 1 for c in mean.components if c <= 3):
            line = T[[6 * mean.reference + c]].tocoo()
            dofs = np.asarray(independent)[line.coords[1]]
            terms = [(mean.reference + 1, c + 1, 1.0)]
            terms += [
                (d // 6 + 1, d % 6 + 1, -v)
                for d, v in zip(dofs.tolist(), line.data.tolist(), strict=True)
                if abs(v) > _ROUNDING
            ]
            yield from ("*EQUATION", str(len(terms)))
            yield from (f"{n}, {d}, {v:.12e}" for n, d, v in terms)


def _rigid_bodies(a: Assembly) -> Iterator[str]:
    """One rigid body for a spider, or for two that a shaft joins."""
    spiders = {r.independent: r for r in a.rigid if isinstance(r, RigidBody)}
    partner = {}
    for i, j in a.beams.nodes[_between_spiders(a)].tolist():
        partner[i] = j
    seconds = set(partner.values())
    for k, (centre, body) in enumerate(spiders.items()):
        if centre in seconds:
            continue
        rows = set(body.dependent)
        if (other := partner.get(centre)) is not None:
            rows |= {other, *spiders[other].dependent}
        yield f"*NSET, NSET=BODY{k}"
        yield from (f"{r + 1}," for r in sorted(rows))
        yield f"*RIGID BODY, NSET=BODY{k}, REF NODE={centre + 1}"
