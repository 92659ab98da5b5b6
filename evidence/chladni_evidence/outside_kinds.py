"""Hidden effects outside the catalogue, for which the diagnosis should report "not known"."""

from dataclasses import replace

import numpy as np

from chladni.effects.calibration_parameters import scaled_material
from chladni.errors import ModelError
from chladni.geometry.facets import point_normals, tangents
from chladni.model.assembly import Assembly
from chladni.model.properties import BeamSection, Part, SolidSection

from .hidden import Hidden, Site, around
from .hidden_kinds import Kind
from .response_of_article import Coupling

PATCH = 0.06  # radius of rotors' feet and foam, of the structure's size


def _patch(site: Site, rng: np.random.Generator) -> tuple[int, np.ndarray]:
    """A point of a sheet and up to forty around it, in the same face and in both directions."""
    for _ in range(200):
        row = site.row(rng)
        rows = around(site, row, PATCH * site.size)[:40]
        X = site.article.points[rows] - site.article.points[row]
        extent = np.linalg.svd(X, compute_uv=False)
        if extent[1] > 0.3 * extent[0]:
            return row, rows
    raise ModelError("no sheet of the article has room for a patch")


def rotor(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A spinning disc: gyroscopic torques h n x θ', which couple tilting about two axes.

    θ follows from the deflection around its foot by least squares.
    """
    row, rows = _patch(site, rng)
    n = site.normal(row)
    e = np.concatenate(tangents(n[None]))
    d = (site.article.points[rows] - site.article.points[row]) @ e.T
    slopes = np.linalg.pinv(np.column_stack([np.ones(len(d)), d]))[1:]  # (2, k) of w = u·n
    h = 5e-4 * site.mass * site.size**2 * (2 * np.pi * site.first) * size  # [N m s]
    turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
    coupling = Coupling(rows, slopes[:, :, None] * n, lambda s: h * s[:, None, None] * turn)
    truth = {"value": h, "point_m": site.article.points[row].tolist()}
    return Hidden(site.article, truth, (coupling,))


def foam(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """Foam between a patch and ground: k (1 + Δ iωτ/(1 + iωτ)), Zener's solid, per point."""
    row, rows = _patch(site, rng)
    n = point_normals(site.article.points, site.article.shells.nodes)[rows]
    k = 0.03 * site.scale * size
    relaxed, tau = float(rng.uniform(4.0, 8.0)), 1 / (2 * np.pi * np.sqrt(site.first * site.f_max))

    def stiffness(s: np.ndarray) -> np.ndarray:
        each = k / len(rows) * (1 + relaxed * s * tau / (1 + s * tau))
        return each[:, None, None] * np.eye(len(rows))

    weights = np.eye(len(rows))[:, :, None] * n
    truth = {
        "value": k,
        "point_m": site.article.points[row].tolist(),
        "relaxation": relaxed,
        "tau_s": tau,
    }
    return Hidden(site.article, truth, (Coupling(rows, weights, stiffness),))


def friction(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """A slipping joint, linearised at one level: softer, and with a loss factor of its own.

    With solids it is the fifth of all joints nearest to one joint.  With beams it is the beams at
    one end of a beam.
    """
    a = site.article
    soft, eta = 0.2 / size**3, float(rng.uniform(0.4, 0.8))
    if any(map(len, a.solids)):
        return _slipping_solids(a, rng, soft, eta)
    row = int(rng.choice(a.beams.nodes.ravel()))
    mine = (a.beams.nodes == row).any(axis=1)
    old = a.parts[int(a.beams.part[mine][0])]
    new = replace(_lossy(old, soft, eta), id=1 + max(p.id for p in a.parts), name="slipping")
    beams = replace(a.beams, part=np.where(mine, len(a.parts), a.beams.part))
    truth = {"value": soft, "loss": eta, "point_m": a.points[row].tolist()}
    return Hidden(replace(a, parts=(*a.parts, new), beams=beams), truth)


def _slipping_solids(a: Assembly, rng: np.random.Generator, soft: float, eta: float) -> Hidden:
    group = a.solids[0]
    middle = a.points[group.nodes].mean(axis=1)
    centre = middle[rng.integers(len(middle))]
    order = np.argsort(np.linalg.norm(middle - centre, axis=1))
    part, parts = group.part.copy(), list(a.parts)
    for e in order[: max(1, len(order) // 5)]:
        old = a.parts[int(group.part[e])]
        parts.append(replace(_lossy(old, soft, eta), id=1 + max(p.id for p in parts)))
        part[e] = len(parts) - 1
    solids = (replace(group, part=part), *a.solids[1:])
    truth = {"value": soft, "loss": eta, "point_m": centre.tolist()}
    return Hidden(replace(a, parts=tuple(parts), solids=solids), truth)


def _lossy(part: Part, soft: float, eta: float) -> Part:
    assert isinstance(part.section, SolidSection | BeamSection)
    return part.with_section(
        material=replace(scaled_material(part.section.material, "E", soft), damping=eta)
    )


def duplicated(site: Site, rng: np.random.Generator, size: float) -> Hidden:
    """Two channels of one cable: the second is a copy of the first."""
    one, other = rng.choice(len(site.outputs), 2, replace=False)

    def spoil(values: np.ndarray) -> np.ndarray:
        wrong = values.copy()
        wrong[:, other] = wrong[:, one]
        return wrong

    labels = site.outputs.labels
    return Hidden(site.article, {"channel": labels[other], "copy_of": labels[one]}, spoil=spoil)


OUTSIDE: dict[str, Kind] = {
    "rotor": rotor,
    "foam": foam,
    "friction-joint": friction,
    "duplicated-pair": duplicated,
}
