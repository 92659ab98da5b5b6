"""Every derivative of an operator leaves a Taylor remainder of second order."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.refusals import says

from chladni.fem import derivative
from chladni.fem.assemble import structure
from chladni.model.assembly import Assembly, Average, Solids
from chladni.model.properties import Isotropic, Orthotropic, Part, SolidSection
from chladni_specimens.plates import folded_panel

STEPS = np.array([2e-2, 1e-2, 5e-3])
GLUE = Isotropic(2e9, 0.42, 1200.0)
SHEET = ("t", "E", "nu", "rho")


@pytest.fixture(scope="module")
def made() -> Assembly:
    """A panel with a warped corner, a brick and a wedge of glue, a spider."""
    base = folded_panel(0.2, 0.1, 0.04, 0.01, 0.05)
    n, top = len(base.ids), base.points.max(axis=0)
    brick = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1.1, 1), (0, 0.9))])
    extra = np.vstack([0.02 * brick + top + 0.1, [[0.1, 0.05, 0.02]]])
    points = np.vstack([base.points, extra])
    points[3, 2] += 0.004
    solids = (
        Solids(np.array([901]), n + np.arange(8)[None], np.array([2])),
        Solids(np.array([902]), n + np.array([[0, 1, 2, 4, 5, 6]]), np.array([2])),
    )
    reference = len(points) - 1
    near = np.argsort(np.linalg.norm(base.points - points[reference], axis=1))[:9]
    spider = Average(
        77, reference, (1, 2, 3, 4, 5, 6), tuple((int(k), (1, 2, 3), 1.0) for k in near)
    )
    return replace(
        base, ids=np.arange(1, len(points) + 1), points=points,
        parts=(*base.parts, Part(9, "glue", SolidSection(GLUE))), solids=solids,
        rigid=(spider,),
    )  # fmt: skip


def remainder_order(change, slope, value):
    """Order of |A(p + h) - A(p) - h dA/dp|; inf where the operator is linear in p."""
    at = structure(change(0.0)).system
    out = []
    for name in "MVK":
        left, scale = [], 0.0
        for step in STEPS * value:
            moved = getattr(structure(change(step)).system, name) - getattr(at, name)
            left.append(abs(moved - step * getattr(slope, name)).max())
            scale = max(scale, abs(moved).max())
        if scale > 0:
            tiny = max(left) < 1e-9 * scale + 1e-13 * abs(getattr(at, name)).max()
            out.append(np.inf if tiny else np.log2(left[0] / left[1]))
            out.append(np.inf if tiny else np.log2(left[1] / left[2]))
    assert out, "nothing changed"
    return min(out)


def with_material(assembly, part, **changes):
    section = assembly.parts[part].section
    names = [n for n in ("membrane", "bending", "shear", "material") if getattr(section, n, None)]
    new = {n: replace(getattr(section, n), **changes) for n in names}
    parts = list(assembly.parts)
    parts[part] = parts[part].with_section(**new)
    return assembly.with_parts(tuple(parts))


def changing(assembly, part, name, value):
    return lambda step: with_material(assembly, part, **{name: value + step})


def thicker(assembly, part, step):
    shells = assembly.shells
    t = shells.thickness + step * (shells.part == part)[:, None]
    return replace(assembly, shells=replace(shells, thickness=t))


@pytest.mark.parametrize(
    ("name", "more"),
    [*((n, {}) for n in SHEET), *((n, {"coupled_mass": False}) for n in ("t", "rho")),
     *((n, {"k6rot": 1e5}) for n in SHEET[:3])],
)  # fmt: skip
def test_sheet(made, name, more):
    made = replace(made, **{"coupled_mass": True, **more})
    material = made.parts[0].section.membrane
    value = 1e-3 if name == "t" else getattr(material, name)

    def change(step):
        if name == "t":
            return thicker(made, 0, step)
        return with_material(made, 0, **{name: value + step})

    slope = derivative.by_part(structure(made), 0, name)
    order = remainder_order(change, slope, value)
    assert order > (50 if name in ("E", "rho") else 1.9)


@pytest.mark.parametrize("name", ["E1", "E2", "G12", "nu12"])
def test_grain(made, name):
    orthotropic = Orthotropic(2e10, 8e9, 0.28, 5e9, 4e9, 3e9, 700.0)
    parts = list(made.parts)
    parts[1] = parts[1].with_section(membrane=orthotropic, bending=orthotropic, shear=None)
    made = made.with_parts(tuple(parts))
    value = getattr(orthotropic, name)
    slope = derivative.by_part(structure(made), 1, name)
    assert remainder_order(changing(made, 1, name, value), slope, value) > 1.9


@pytest.mark.parametrize("name", ["E", "nu", "rho"])
@pytest.mark.parametrize(("own", "full"), [(None, False), (7e8, True)])
def test_adhesive(made, name, own, full):
    parts = list(made.parts)
    parts[2] = Part(9, "glue", SolidSection(replace(GLUE, G=own), full))
    made = made.with_parts(tuple(parts))
    value = getattr(GLUE, name)
    slope = derivative.by_part(structure(made), 2, name)
    assert remainder_order(changing(made, 2, name, value), slope, value) > 1.9


def test_what_a_part_has_not_is_named(made):
    built = structure(made)
    says("part glue has no 't'; there are E, nu, rho", derivative.by_part, built, 2, "t")


def test_slopes_are_symmetric(made):
    slope = derivative.by_part(structure(made), 2, "nu")
    for A in (slope.M, slope.V, slope.K):
        assert_allclose((A - A.T).toarray(), 0, atol=1e-9 * max(abs(A).max(), 1))
