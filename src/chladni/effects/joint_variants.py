"""Other models of the joints of a deck: welds, adhesive and screws by other elements.

A solid between two sheets becomes a bar, a spring or a rigid body; a bar between two spiders
becomes rigid, or its spiders become means.  A bar or spring ends on RBE3 over the grids of the
solid's faces: the joint changes, its footprint does not.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np

from ..errors import ModelError, named
from ..geometry.beam_lines import fastener_bars
from ..geometry.facets import tangents
from ..model.added_beams import with_beams
from ..model.added_points import next_id, with_points
from ..model.assembly import Assembly, Average, Beams, Bushes, Equation, RigidBody, picked
from ..model.point_masses import with_masses
from ..model.properties import BeamSection, Isotropic, SolidSection
from .joints import solid_parts

ALL, MOVES = (1, 2, 3, 4, 5, 6), (1, 2, 3)
FACES = (  # pairs of opposite faces of a hexahedron
    ((0, 1, 2, 3), (4, 5, 6, 7)), ((0, 1, 5, 4), (3, 2, 6, 7)), ((0, 3, 7, 4), (1, 2, 6, 5)),
)  # fmt: skip
LEAST_HEIGHT = 1e-5  # [m] of a joint that is to be a bar or a spring
SQUARE = (1 / 12, 0.1406)  # I and J of a square over its area squared (Young and Budynas 2002)
SHEAR = 5 / 6
Carriers = dict[int, float]  # row of a point: weight
Family = TypeVar("Family", Beams, Bushes)


@dataclass(frozen=True, eq=False)
class JointVariant:
    """A structure with one kind of joint modelled in another way."""

    joints: str  # "welds" and "bars", for example; "deck" and "" for the deck itself
    model: str  # "welds" and "bars", for example; "deck" and "" for the deck itself
    assembly: Assembly | None  # Assembly, None where it cannot be made
    refused: str = ""  # why not, in one sentence

    @property
    def name(self) -> str:
        """Joints and model in words."""
        return f"{self.joints} {self.model}".strip()


@dataclass(frozen=True, eq=False)
class Block:
    """A hexahedron between two sheets."""

    place: np.ndarray  # (2, 3) middles of its faces [m]
    area: float  # mean of both faces [m²]
    carriers: tuple[Carriers, Carriers]  # of each face, the grids it depends on
    material: Isotropic  # Isotropic

    @property
    def height(self) -> float:
        """Distance of its faces [m]."""
        return float(np.linalg.norm(self.place[1] - self.place[0]))


Maker = Callable[[Assembly, Sequence[Block], str], Assembly]


def joint_variants(assembly: Assembly) -> list[JointVariant]:
    """All variants of a structure's joints, the structure itself first."""
    out = [JointVariant("deck", "", assembly)]
    for soft, joints in ((False, "welds"), (True, "adhesive")):
        which = list(solid_parts(assembly, soft))
        if which:
            out += _of_solids(assembly, joints, which)
    if screws := fastener_bars(assembly):
        out += _of_bars(assembly, screws)
    return out


def _tried(joints: str, model: str, make: Callable[[], Assembly]) -> JointVariant:
    """The variant, or the sentence that refuses it."""
    try:
        return JointVariant(joints, model, make())
    except ModelError as error:
        return JointVariant(joints, model, None, str(error))


def _of_solids(
    assembly: Assembly, joints: str, which: list[tuple[int, np.ndarray]]
) -> Iterator[JointVariant]:
    """Bars, springs and rigid bodies in place of metal; springs in place of adhesive."""
    models = {"as springs": _as_springs}
    if joints == "welds":
        models = {"as bars": _as_bars, "as springs": _as_springs, "rigid": _rigid}
    for model, make in models.items():
        yield _tried(joints, model, partial(_remade, assembly, which, make, f"{joints} {model}"))


def _remade(
    assembly: Assembly, which: list[tuple[int, np.ndarray]], make: Maker, name: str
) -> Assembly:
    """The assembly with other elements in place of solids."""
    blocks = [b for group, rows in which for b in _blocks(assembly, group, rows)]
    return make(_without_solids(assembly, which), blocks, name)


def _blocks(assembly: Assembly, group: int, rows: np.ndarray) -> Iterator[Block]:
    """Blocks of some solids, all of them hexahedra between two sheets."""
    solids, carriers = assembly.solids[group], _carriers(assembly)
    part = dict(zip(assembly.shells.nodes.ravel().tolist(),
                    np.repeat(assembly.shells.part, 4).tolist(), strict=True))  # fmt: skip
    for row in rows:
        nodes, id = solids.nodes[row], int(solids.ids[row])
        section = assembly.parts[int(solids.part[row])].section
        assert isinstance(section, SolidSection)
        assert isinstance(section.material, Isotropic)
        if len(nodes) != 8:
            raise ModelError(
                f"solid {id} has {len(nodes)} nodes, and only hexahedra have two faces"
            )
        X = assembly.points[nodes]
        ends = [_between(X, nodes, pair, carriers) for pair in FACES]
        known = [e for e in ends if e is not None]
        if not known:
            raise ModelError(f"solid {id} does not lie between two sheets, each with its own grids")
        blocks = [Block(*e, section.material) for e in known]
        yield min(blocks, key=lambda b: (_same_part(b, part), b.height))


def _same_part(block: Block, part: dict[int, int]) -> bool:
    """True if both faces hang on one part; they may then be the sides of the block."""
    a, b = ({part[row] for row in held if row in part} for held in block.carriers)
    return bool(a & b)


def _carriers(assembly: Assembly) -> dict[int, Carriers]:
    """Grids of sheets that each point depends on: those of its RBE3, or the point itself."""
    out: dict[int, Carriers] = {int(r): {int(r): 1.0} for r in np.unique(assembly.shells.nodes)}
    for body in assembly.rigid:
        if isinstance(body, Average) and not body.moved:
            out[body.reference] = {row: weight for row, _, weight in body.terms}
    return out


def _between(
    X: np.ndarray, nodes: np.ndarray, pair: tuple[tuple[int, ...], tuple[int, ...]],
    carriers: dict[int, Carriers],
) -> tuple[np.ndarray, float, tuple[Carriers, Carriers]] | None:  # fmt: skip
    """Middles, mean area and carriers of two faces; None where these share grids or have none."""
    held: list[Carriers] = []
    for face in pair:
        whole: Carriers = {}
        for node in nodes[list(face)].tolist():
            for row, weight in carriers.get(node, {}).items():
                whole[row] = whole.get(row, 0.0) + weight
        held.append(whole)
    if len(held[0]) < 3 or len(held[1]) < 3 or set(held[0]) & set(held[1]):
        return None
    corners = [X[list(face)] for face in pair]
    area = [np.linalg.norm(np.cross(c[2] - c[0], c[3] - c[1])) / 2 for c in corners]
    return np.array([c.mean(axis=0) for c in corners]), float(np.mean(area)), (held[0], held[1])


def _without_solids(assembly: Assembly, which: list[tuple[int, np.ndarray]]) -> Assembly:
    """The assembly without these solids and the RBE3 that carried them alone."""
    solids = list(assembly.solids)
    gone = np.unique(np.concatenate([solids[g].nodes[rows].ravel() for g, rows in which]))
    for group, own in enumerate(solids):
        rows = [r for g, r in which if g == group]
        solids[group] = picked(own, ~np.isin(np.arange(len(own)), np.concatenate([[], *rows])))
    left = replace(assembly, solids=tuple(s for s in solids if len(s)))
    gone = np.setdiff1d(gone, _used(left))
    rigid = tuple(
        b for b in left.rigid if not (isinstance(b, Average) and b.reference in set(gone.tolist()))
    )
    return replace(left, rigid=rigid, auto_spc=True)  # points that nothing moves are held


def _used(assembly: Assembly) -> np.ndarray:
    """Rows of the points of all elements."""
    a = assembly
    nodes = [a.shells.nodes, a.beams.nodes, a.springs.nodes, a.bushes.nodes, a.masses.node,
             *(s.nodes for s in a.solids)]  # fmt: skip
    return np.unique(np.concatenate([n.ravel() for n in nodes]))


def _ends(bare: Assembly, blocks: Sequence[Block]) -> tuple[Assembly, np.ndarray]:
    """The assembly with a point at both faces of every block, each on its RBE3; rows (n, 2)."""
    if low := [b for b in blocks if b.height < LEAST_HEIGHT]:
        x, y, z = (f"{1e3 * v:.0f}" for v in low[0].place[0])
        raise ModelError(f"the joint at ({x}, {y}, {z} mm) has no height")
    made, rows = with_points(bare, np.concatenate([b.place for b in blocks]))
    rows, first = rows.reshape(-1, 2), next_id(made)
    held = [(int(row), c) for pair, b in zip(rows, blocks, strict=True)
            for row, c in zip(pair, b.carriers, strict=True)]  # fmt: skip
    means = tuple(_mean(first + k, row, carriers) for k, (row, carriers) in enumerate(held))
    return replace(made, rigid=(*made.rigid, *means)), rows


def _as_bars(bare: Assembly, blocks: Sequence[Block], name: str) -> Assembly:
    """Square bars of the mean area of each material, on RBE3 at both ends."""
    made, rows = _ends(bare, blocks)
    axis = np.array([b.place[1] - b.place[0] for b in blocks])
    up = tangents(axis / np.linalg.norm(axis, axis=1, keepdims=True))[0]
    materials = list(dict.fromkeys(b.material for b in blocks))
    for material in materials:
        mine = [k for k, b in enumerate(blocks) if b.material == material]
        A = float(np.mean([blocks[k].area for k in mine]))
        I, J = (factor * A**2 for factor in SQUARE)
        section = BeamSection(material, A, I, I, 0.0, J, shear=(SHEAR, SHEAR))
        label = name if len(materials) == 1 else f"{name} {len(made.parts)}"
        made = with_beams(made, rows[mine], section, up[mine], label)
    return made


def _as_springs(bare: Assembly, blocks: Sequence[Block], name: str) -> Assembly:
    """CBUSH of a layer that cannot contract sideways: k_n = M A/h, k_s = G A/h, and moments.

    M = E (1-ν) / ((1+ν)(1-2ν)) is the modulus of constrained compression.  Half of the layer's mass
    is at each end.
    """
    made, rows = _ends(bare, blocks)
    frame, stiffness, mass = [], [], []
    for b in blocks:
        m, h, A = b.material, b.height, b.area
        if m.nu >= 0.5:
            raise ModelError(f"a layer with nu {m.nu:g} is incompressible, and no spring is")
        M = m.E * (1 - m.nu) / ((1 + m.nu) * (1 - 2 * m.nu))
        G, (I, J) = m.shear_modulus, (factor * A**2 for factor in SQUARE)
        x = (b.place[1] - b.place[0]) / h
        frame.append([x, *(t[0] for t in tangents(x[None]))])
        stiffness.append(np.array([M * A, G * A, G * A, G * J, M * I, M * I]) / h)
        mass.append(m.rho * A * h / 2)
    none, middles = np.zeros((len(blocks), 6)), np.array([b.place.mean(axis=0) for b in blocks])
    new = Bushes(next_id(made) + np.arange(len(blocks)), rows, np.array(frame), middles,
                 np.array(stiffness), none, none)  # fmt: skip
    made = replace(made, bushes=_joined(made.bushes, new))
    return with_masses(made, made.ids[rows.ravel()].tolist(), np.repeat(mass, 2))


def _rigid(bare: Assembly, blocks: Sequence[Block], name: str) -> Assembly:
    """One RBE2 over the grids of both faces of every block."""
    _refuse_shared(bare, [[*b.carriers[0], *b.carriers[1]] for b in blocks])
    made, rows = with_points(bare, np.array([b.place.mean(axis=0) for b in blocks]))
    first = next_id(made)
    bodies = tuple(
        _body(first + k, int(row), [*b.carriers[0], *b.carriers[1]])
        for k, (row, b) in enumerate(zip(rows, blocks, strict=True))
    )
    return replace(made, rigid=(*made.rigid, *bodies))


def _body(id: int, lead: int, rows: Sequence[int]) -> RigidBody:
    return RigidBody(id, lead, tuple(rows), (ALL,) * len(rows))


def _mean(id: int, row: int, carriers: Carriers) -> Average:
    return Average(id, row, ALL, tuple((r, MOVES, w) for r, w in carriers.items()))


def _refuse_shared(assembly: Assembly, groups: Sequence[Sequence[int]]) -> None:
    """Refuse rigid bodies that share grids with each other or with others of the deck."""
    taken = {r for b in assembly.rigid if isinstance(b, RigidBody) for r in b.dependent}
    every = [row for rows in groups for row in dict.fromkeys(rows)]
    count = Counter([*every, *taken])
    if shared := sorted(row for row in every if count[row] > 1):
        ids = assembly.ids[sorted(set(shared))].tolist()
        raise ModelError(
            f"grids {named(ids, 3)} would follow two rigid bodies; a finer mesh keeps the joints "
            "apart"
        )


def _of_bars(assembly: Assembly, pieces: Sequence[np.ndarray]) -> Iterator[JointVariant]:
    """Screws without flexibility, and screws whose spiders do not stiffen their hole."""
    spiders = {b.independent: b for b in assembly.rigid if isinstance(b, RigidBody)}
    nodes = [np.unique(assembly.beams.nodes[piece]).tolist() for piece in pieces]
    led = {row: spiders[row] for rows in nodes for row in rows if row in spiders}

    def rest() -> list[RigidBody | Average | Equation]:
        if not led:
            raise ModelError("the screws have no RBE2 at their ends")
        return [b for b in assembly.rigid if b not in led.values()]

    def rigid() -> Assembly:
        gone = np.isin(np.arange(len(assembly.beams)), np.concatenate(list(pieces)))
        bodies = rest()
        for rows in nodes:
            if any(row not in led for row in rows):
                raise ModelError(
                    f"the screw at grid {assembly.ids[rows[0]]} has an end without RBE2"
                )
            follow = [r for row in rows for r in led[row].dependent]
            bodies.append(_body(led[rows[0]].id, rows[0], [*follow, *rows[1:]]))
        beams = assembly.beams
        made = replace(assembly, beams=picked(beams, ~gone), rigid=tuple(bodies))
        half = np.array([_bar_mass(assembly, int(k)) / 2 for k in np.flatnonzero(gone)])
        ends = assembly.ids[beams.nodes[gone].ravel()].tolist()
        return with_masses(made, ends, np.repeat(half, 2))

    def spread() -> Assembly:
        means = (_mean(b.id, row, dict.fromkeys(b.dependent, 1.0)) for row, b in led.items())
        return replace(assembly, rigid=(*rest(), *means))

    yield _tried("screws", "rigid", rigid)
    yield _tried("screws", "on RBE3", spread)


def _bar_mass(assembly: Assembly, row: int) -> float:
    """Mass of a bar [kg]."""
    section = assembly.parts[int(assembly.beams.part[row])].section
    assert isinstance(section, BeamSection)
    a, b = assembly.points[assembly.beams.nodes[row]]
    rho = getattr(section.material, "rho", 0.0)
    return float((rho * section.area + section.nonstructural) * np.linalg.norm(b - a))


def _joined(old: Family, new: Family) -> Family:
    """Two families of one kind as one."""
    return type(old)(**{k: np.concatenate([getattr(old, k), getattr(new, k)]) for k in vars(old)})
