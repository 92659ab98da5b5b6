"""Rigid alignment of a forming mesh in press position with the structure in car position.

The starts are the given position, the principal axes (four rotations) and, if given, three point
pairs. Each start is improved by trimmed point-to-plane ICP (Chen and Medioni, Image Vis. Comput. 10
(1992) 145-155; Chetverikov et al. 2005 for the trimming). Sheets symmetric to a plane have a
mirrored optimum. Therefore reflected starts are tried too, and a mirror image is reported.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..errors import AccuracyError, ModelError
from ..model.assembly import Assembly
from .formed_mesh import FormedMesh
from .nearest import ShellSurface
from .thickness_mapping import samples, shell_area

TRIM = 0.8  # share of the points that counts; the rest may have no partner
_ROUGH, _FINE = 400, 2500  # points in the search and in the last improvement
_NEAR = 5  # shells tried for each point; the face of a neighbour is accurate enough here
_GATE = 0.5  # least |cos| between the normals of partners
_REFLECTION = np.diag([1.0, -1.0, 1.0])


@dataclass(frozen=True, eq=False)
class Alignment:
    """x -> R x + d."""

    rotation: np.ndarray  # (3, 3)
    shift: np.ndarray  # (3,) [m]
    residual: float  # trimmed rms distance from the structure [m]
    mirrored: bool  # R is a reflection: the formed mesh is of the other side
    start: str  # name of the best start


def moved(formed: FormedMesh, by: Alignment) -> FormedMesh:
    """Move the formed mesh to the position of the structure."""
    return replace(formed, points=formed.points @ by.rotation.T + by.shift, nodal=formed.nodal)


def align(
    assembly: Assembly,
    formed: FormedMesh,
    *,
    parts: Sequence[str] = (),
    points: tuple[np.ndarray, np.ndarray] | None = None,
    allow_mirror: bool = False,
) -> Alignment:
    """The rigid motion that aligns the formed mesh with the shells of these parts.

    Parameters
    ----------
    parts : names of the parts in the formed mesh; default all with shells
    points : three or more places on the formed mesh and on the structure, (k, 3) each [m]
    allow_mirror : accept a reflection if it fits far better than any motion
    """
    rows = np.arange(len(assembly.shells))
    if parts:
        rows = rows[np.isin(assembly.shells.part, [assembly.part(p) for p in parts])]
    target = ShellSurface.of(assembly, rows)
    x = assembly.points[assembly.shells.nodes[rows]].mean(axis=1)
    goal = _axes(x, shell_area(assembly)[rows])
    if not len(formed.cells):
        raise ModelError("a formed mesh without cells has no normals and cannot be aligned")
    source, normal = _sampled(formed, _ROUGH)
    starts = _starts(_axes(formed.points[formed.cells].mean(axis=1), formed.area), goal)
    if points is not None:
        starts["three points"] = rigid(np.asarray(points[0], float), np.asarray(points[1], float))
    rough = {k: _icp(target, source, normal, *s, 12) for k, s in starts.items()}
    proper = _best(rough, mirrored=False)
    mirror = _best(rough, mirrored=True)
    source, normal = _sampled(formed, _FINE)
    found = [_icp(target, source, normal, *rough[proper][:2], 40)]
    use_mirror = False
    if rough[mirror][2] < rough[proper][2]:
        found.append(_icp(target, source, normal, *rough[mirror][:2], 40))
        use_mirror = found[1][2] < 0.3 * found[0][2]
    if use_mirror and not allow_mirror:
        raise ModelError(
            f"the formed mesh fits as a mirror image ({1e3 * found[1][2]:.2f} mm) but not "
            f"unchanged ({1e3 * found[0][2]:.2f} mm): it belongs to the other side; allow the "
            "mirror to use it"
        )
    R, d, residual = found[int(use_mirror)]
    extent = float(np.ptp(x, axis=0).max())
    if residual > 0.05 * extent:
        raise AccuracyError(
            f"the formed mesh is {1e3 * residual:.1f} mm from {target.name} after alignment; it "
            "may belong to another part or have another unit"
        )
    return Alignment(R, d, residual, use_mirror, mirror if use_mirror else proper)


def _sampled(formed: FormedMesh, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places and normals (n, 3), evenly distributed over the area."""
    share = np.cumsum(formed.area) / formed.area.sum()
    pick = np.unique(np.searchsorted(share, (np.arange(count) + 0.5) / count))
    at, normal = samples(formed.points, formed.cells[pick])
    return at.mean(axis=1), normal


Motion = tuple[np.ndarray, np.ndarray]


def _axes(x: np.ndarray, weight: np.ndarray) -> Motion:
    """Area-weighted principal axes (columns, right-handed) and centroid."""
    centre = weight @ x / weight.sum()
    _, axes = np.linalg.eigh((x - centre).T * weight @ (x - centre))
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    return axes, centre


def _starts(source: Motion, goal: Motion) -> dict[str, Motion]:
    """Starts: the given position and the aligned principal axes, rotated and reflected."""
    out = {"as it lies": (np.eye(3), np.zeros(3))}
    out["as it lies, mirrored"] = (_REFLECTION, goal[1] - _REFLECTION @ source[1])
    for a in (1, -1):
        for b in (1, -1):
            for c in (1, -1):
                R = goal[0] @ np.diag([a, b, c]) @ source[0].T
                out[f"principal axes {a:+d}{b:+d}{c:+d}"] = (R, goal[1] - R @ source[1])
    return out


def rigid(source: np.ndarray, goal: np.ndarray) -> Motion:
    """R, d minimising Σ |R a + d - b|² (Kabsch, Acta Cryst. A32 (1976) 922)."""
    if source.shape != goal.shape or len(source) < 3:
        raise ModelError(f"{len(source)} and {len(goal)} points; three pairs or more are due")
    a, b = source - source.mean(axis=0), goal - goal.mean(axis=0)
    U, _, Vt = np.linalg.svd(a.T @ b)
    R = Vt.T @ np.diag([1, 1, np.linalg.det(Vt.T @ U.T)]) @ U.T
    return R, goal.mean(axis=0) - R @ source.mean(axis=0)


def _best(found: dict[str, tuple[np.ndarray, np.ndarray, float]], *, mirrored: bool) -> str:
    mine = {k: v[2] for k, v in found.items() if (np.linalg.det(v[0]) < 0) == mirrored}
    return min(mine, key=lambda k: mine[k])


def _icp(
    target: ShellSurface,
    source: np.ndarray,
    normal: np.ndarray,
    R: np.ndarray,
    d: np.ndarray,
    steps: int,
) -> tuple[np.ndarray, np.ndarray, float]:
    """Trimmed point-to-plane ICP: min Σ (n·(ω x p + d - (q - p)))² over the nearest 80 %."""
    from scipy.spatial.transform import Rotation

    residual = before = np.inf
    for _ in range(steps):
        p = source @ R.T + d
        closest_points = target.closest_points(p, normal @ R.T, _GATE, near=_NEAR)
        ok = np.isfinite(closest_points.distance)
        far = np.where(ok, closest_points.distance, np.linalg.norm(np.ptp(source, axis=0)))
        keep = np.argsort(far, kind="stable")[: int(TRIM * len(p))]
        residual = float(np.sqrt((far[keep] ** 2).mean()))
        keep = keep[ok[keep]]
        if len(keep) < 6:
            break
        n, gap = closest_points.normal[keep], closest_points.place[keep] - p[keep]
        A = np.column_stack([np.cross(p[keep], n), n])
        step = np.linalg.lstsq(A, np.einsum("ki,ki->k", n, gap), rcond=1e-10)[0]
        turn = Rotation.from_rotvec(step[:3]).as_matrix()
        R, d = turn @ R, turn @ d + step[3:]
        if np.abs(step).max() < 1e-8 or abs(before - residual) < 1e-4 * residual:
            break
        before = residual
    return R, d, residual
