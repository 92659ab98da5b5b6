"""From an assembly and its places to an article on the bench: true places, cords, local forces."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.modes import ModalModel, rigid_modes
from chladni.dynamics.residual import with_residual_vectors
from chladni.fem.assemble import Structure, structure
from chladni.fem.energy import mass_properties
from chladni.fem.locate import rows_of, shares_of
from chladni.fem.measured_dofs import MeasuredDofs
from chladni.fem.modelled import solved
from chladni.geometry.facets import tangents, unit
from chladni.model.assembly import Assembly
from chladni.workflows.loaded_model import LEAST_MODES

from .accelerometers import AccelerometerType
from .article_scatter import Scatter, drawn_damping
from .bench_article import BenchArticle
from .local_forces import LocalForce

ABOVE = 2.0  # modes reach so many times the highest line, residual vectors stand for the rest
SAME_PLACE = 1e-3  # nearer than this the sensor at the driving point is meant [m]
REST = 0.02  # damping of what stands above the modes
FLAT = 0.05  # of the structure's size: hangers nearer to the centre of gravity pull nowhere


@dataclass(frozen=True, eq=False)
class TruePlaces:
    """True places and directions of sensors."""

    # points, directions: (n, 3) [m], unit vectors
    points: np.ndarray
    directions: np.ndarray
    grids: np.ndarray  # (n,) int: 0 where the place is no grid

    def beginning_with(self, first: "TruePlaces") -> "TruePlaces":
        """The places with others for the first of them."""
        return TruePlaces(*(
            np.concatenate([first_own, own[len(first_own) :]])
            for first_own, own in zip(vars(first).values(), vars(self).values(), strict=True)
        ))  # fmt: skip


def true_places(
    assembly: Assembly, outputs: MeasuredDofs, inputs: MeasuredDofs, kind: AccelerometerType,
    rng: np.random.Generator,
) -> TruePlaces:  # fmt: skip
    """Return true places: each sensor a little off its place and tilted.

    The sensor at the driving point sits next to it. On beams and solids a sensor keeps its place,
    because there is no sheet to shift it along.
    """
    n = len(outputs.labels)
    u, v = tangents(outputs.directions)
    off = np.where(outputs.sd > 0, outputs.sd, kind.place_sd) * rng.normal(size=(2, n))
    at_drive = np.linalg.norm(outputs.points - inputs.points[0], axis=1) < SAME_PLACE
    angle = rng.uniform(0, 2 * np.pi, n)
    off = np.where(at_drive, kind.drive_offset * np.stack([np.cos(angle), np.sin(angle)]), off)
    tilt = kind.tilt_sd * rng.normal(size=(2, n))
    directions = unit(outputs.directions + tilt[0][:, None] * u + tilt[1][:, None] * v)
    if not len(assembly.shells):
        return TruePlaces(outputs.points, directions, outputs.grids)
    points = outputs.points + off[0][:, None] * u + off[1][:, None] * v
    return TruePlaces(points, directions, np.zeros(n, dtype=np.int64))


def benched(
    assembly: Assembly,
    outputs: MeasuredDofs,
    inputs: MeasuredDofs,
    hangers: Sequence[int],
    places: TruePlaces,
    f_max: float,
    scatter: Scatter,
    rng: np.random.Generator,
) -> BenchArticle:
    """Return the test article as modes at all places of the test, with random damping.

    If the base moves, the article stands on a shaker table: its modes have fixed supports, and no
    cords are attached. Dashpots and material losses add their dissipation to each mode, spinning
    parts couple the modes.
    """
    built = structure(assembly)
    modes = _modes(built, ABOVE * f_max)
    n = len(places.points)
    felt = rows_of(built, places.grids, places.points, places.directions)
    moved = rows_of(
        built, np.repeat(places.grids, 3), np.repeat(places.points, 3, axis=0),
        np.tile(np.eye(3), (n, 1)),
    )  # fmt: skip
    on_table = bool(inputs.base[0])
    drive = sp.csr_array((6, built.T.shape[1])) if on_table else _drive(built, inputs)
    hung = _hung(built, () if on_table else hangers)
    base = inputs.loads(built)[:1] if on_table else sp.csr_array((0, built.T.shape[1]))
    loads = sp.vstack([base if on_table else drive[:3], hung]).T.toarray()
    whole = with_residual_vectors(built.system, modes, loads)
    phi, r = whole.shapes, len(whole)
    f, zeta = whole.frequency.copy(), np.full(r, REST)
    f[: len(modes)][rigid_modes(modes)] = 0.0
    zeta[: len(modes)] = drawn_damping(scatter, len(modes), rng)
    zeta, V = zeta + dissipated(built, phi, f), built.system.V
    return BenchArticle(
        name="A", weight=mass_properties(assembly)[0], frequency=f, damping=zeta,
        outputs=felt @ phi, mounts=(moved @ phi).reshape(n, 3, r), drive=drive @ phi,
        hangers=(hung @ phi).reshape(-1, 3, r), output_labels=outputs.labels,
        input_label=inputs.labels[0], masses=outputs.mass, channels=outputs.channels,
        base=(base @ phi).ravel(), gyroscopic=phi.T @ ((V - V.T) / 2 @ phi),
        with_base=places.directions @ inputs.directions[0],
        mounts_with_base=np.tile(inputs.directions[0], (n, 1)),
    )  # fmt: skip


def _modes(built: Structure, band: float) -> ModalModel:
    """Return modes up to a frequency [Hz], at least as many as include an elastic one."""
    found = solved(built, band).modes
    least = min(LEAST_MODES, len(built.system.dofs))
    if len(found) >= least:
        return found
    return normal_modes(built.system, least)


def _drive(built: Structure, inputs: MeasuredDofs) -> sp.csr_array:
    """Motion of the driven point (6, n): along, two ways across, rotations about these axes."""
    d = inputs.directions[0]
    u, _ = tangents(d)
    axes = np.stack([d, u, np.cross(d, u)])
    grid, point = np.repeat(inputs.grids[:1], 3), np.repeat(inputs.points[:1], 3, axis=0)
    moves = rows_of(built, grid, point, axes)
    a = built.assembly
    share = shares_of(a, inputs.grids[:1], inputs.points[:1])[0]
    turns = sum(
        w * (sp.csr_array(axes) @ built.T[6 * row + 3 : 6 * row + 6])
        for (_, w), row in zip(share, a.rows([g for g, _ in share]), strict=True)
    )
    return sp.csr_array(sp.vstack([moves, turns]))


def _hung(built: Structure, hangers: Sequence[int]) -> sp.csr_array:
    """Motion of the hangers (3 k, n): along the cord, two ways across it."""
    if not hangers:
        return sp.csr_array((0, built.T.shape[1]))
    up = cord_directions(built.assembly, hangers)
    axes = np.stack([up, *tangents(up)])
    ids = np.repeat(np.array(hangers), 3)
    return built.along(ids, np.tile(axes, (len(hangers), 1)))


def cord_directions(assembly: Assembly, hangers: Sequence[int]) -> np.ndarray:
    """Return the unit vector (3,) of the cords' pull, from the centre of gravity to the hangers.

    If the hangers are on both sides of the centre, it is the middle one of the structure's three
    principal directions: in its plane, across its length.
    """
    X = assembly.points[assembly.rows(list(hangers))]
    _, centre = mass_properties(assembly)
    size = float(np.linalg.norm(np.ptp(assembly.points, axis=0)))
    away = X.mean(axis=0) - centre
    if np.linalg.norm(away) > FLAT * size:
        return np.asarray(unit(away))
    spread = assembly.points - assembly.points.mean(axis=0)
    return np.asarray(np.linalg.eigh(spread.T @ spread)[1][:, 1])


def dissipated(built: Structure, phi: np.ndarray, f: np.ndarray) -> np.ndarray:
    """ζ_r of dashpots, φᵀVφ/2ω, and of losses, (φᵀK_loss φ/ω² + g)/2, of every mode (r,)."""
    omega = np.maximum(2 * np.pi * f, 2 * np.pi * 0.1)
    out = np.full(len(f), built.assembly.structural_damping / 2)
    for A, power in ((built.system.V, 1), (built.loss, 2)):
        if A.nnz:
            out += np.einsum("nr,nr->r", phi, A @ phi) / (2 * omega**power)
    return out


def with_site(article: BenchArticle, row: np.ndarray, law: LocalForce) -> BenchArticle:
    """Add a local force along the motion row (r,)."""
    sites = np.vstack([article.sites, row[None]]) if len(article.laws) else row[None]
    return replace(article, sites=sites, laws=(*article.laws, law))
