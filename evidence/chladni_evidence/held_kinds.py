"""Hidden effects at the clamp and the shaker of a structure."""

import numpy as np

from chladni.errors import ModelError
from chladni.fem.released import clamps
from chladni.geometry.sampling import nearest_points
from chladni.model.clamp_springs import with_clamp_on_springs
from chladni.model.ground_springs import with_ground_bushes

from .hidden import Hidden, Site, with_lumps
from .hidden_kinds import Kind


def compliant_support(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A clamp on springs across its sheet and about its line, in terms of m ω_1².

    The translation spring has 100 to 1000 times that stiffness. The rotation spring has 3 to 30
    times r² m ω_1², with r the rms distance of the points from the clamp.
    """
    a, held = site.article, clamps(site.article)
    if not held:
        raise ModelError("the article has no supports, so it has no clamp")
    clamp = held[int(rng.integers(len(held)))]
    rows = a.rows(clamp.grids)
    z = site.normal(int(rows[0]))
    line = np.ptp(a.points[rows], axis=0)
    y = line - z * (line @ z)
    y = y / np.linalg.norm(y)
    arm2 = float(((a.points - clamp.centre) ** 2).sum(axis=1).mean())
    k = site.scale * float(np.exp(rng.uniform(np.log(100), np.log(1000)))) / size
    k_rot = site.scale * arm2 * float(np.exp(rng.uniform(np.log(3), np.log(30)))) / size
    frame = np.stack([z, y, np.cross(z, y)])
    made = with_clamp_on_springs(a, clamp.grids, clamp.held, clamp.centre, frame, {1: k, 5: k_rot})
    truth = {"value": k, "K": k, "K_rot": k_rot, "point_m": clamp.centre.tolist()}
    return Hidden(made, truth)


def shaker_restraint(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A stinger of 5 to 50 kN/m across, 1 to 10 N m/rad, and 0.5 to 1.5 % of the mass beyond it."""
    a, drive = site.article, site.drive
    on = np.unique(np.concatenate([a.shells.nodes.ravel(), a.beams.nodes.ravel()]))
    row = on[nearest_points(a.points[on], drive.points[:1])]
    k = float(np.exp(rng.uniform(np.log(5e3), np.log(5e4)))) * size
    k_rot = float(np.exp(rng.uniform(0.0, np.log(10.0)))) * size
    m = float(rng.uniform(0.005, 0.015)) * site.mass * size
    d = drive.directions[:1]
    springs = np.array([[0.0, k, k, 0.0, k_rot, k_rot]])
    made = with_lumps(with_ground_bushes(a, row, d, springs), row, m)
    point = a.points[row[0]].tolist()
    truth = {"value": k, "k_lat": k, "k_rot": k_rot, "m": m, "point_m": point}
    return Hidden(made, truth, unweighed=m)


HELD: dict[str, Kind] = {
    "compliant-support": compliant_support,
    "shaker-restraint": shaker_restraint,
}
