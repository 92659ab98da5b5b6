"""A joint's stiffness in the reduced model is that of the full structure, and so is its slope."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.calibration_parameters import linear_scale
from chladni.fem.assemble import structure
from chladni.fem.derivative import by_part, by_radius, by_spring, with_radius
from chladni.model.assembly import Average, Masses
from chladni.model.ground_springs import with_springs
from chladni.reduced.accuracy import accuracy, products
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import folded_panel, plate

TOP = 200.0


def written(assembly, value):
    old = assembly.springs
    return replace(assembly, springs=replace(old, value=np.full(len(old.value), value)))


def test_spring_constant():
    made = with_springs(plate(0.4, 0.3, 4, 3, 1.5e-3), (1,), np.eye(3)[2:], 5e3)
    reduced = reduced_problem(made, TOP)
    effect = linear_scale("spring 1", "k", "N/m", 5e3, by_spring(reduced.structure, 0), written)
    x, h = np.array([0.4]), 1e-4
    q = np.random.default_rng(0).normal(size=(len(reduced.model.basis), 2))
    K = structure(effect.apply(made, x)).system.K
    got = products(reduced.model, [effect], x, q)[0]
    assert_allclose(got, K @ q, atol=1e-9 * np.abs(K @ q).max())
    state = evaluate(reduced.model, [effect], x)
    slope = state.dK.along(state.vectors)[0]
    up, down = (evaluate(reduced.model, [effect], x + s, False).lam for s in (h, -h))
    scale = np.abs(slope).max()
    assert_allclose(slope, (up - down) / (2 * h), atol=1e-5 * scale)
    assert scale > 0
    assert accuracy(reduced, reduced.model, [effect], 0 * x, TOP).worst < 1e-9


R = 0.21


def with_nu(assembly, nu):
    parts = list(assembly.parts)
    own = parts[0].section
    steel = replace(own.membrane, nu=nu)
    parts[0] = parts[0].with_section(membrane=steel, bending=steel)
    return assembly.with_parts(tuple(parts))


def carried():
    """A panel that carries 0.2 kg 30 mm above it on an RBE3 with smooth weights."""
    base = folded_panel(h=0.06)
    points = np.vstack([base.points, [[0.31, 0.16, 0.04]]])
    at = len(points) - 1
    near = np.argsort(np.linalg.norm(base.points - points[at], axis=1))[:14]
    spider = Average(77, at, (1, 2, 3, 4, 5, 6), tuple((int(k), (1, 2, 3), 1.0) for k in near))
    lump = Masses(np.array([1]), np.array([at]), 0.2 * np.diag([1, 1, 1, 1e-4, 2e-4, 3e-4])[None])
    ids = np.arange(1, len(points) + 1)
    whole = replace(base, ids=ids, points=points, rigid=(spider,), masses=lump)
    return whole, spider


@pytest.mark.parametrize("name", ["nu", "R"])
def test_reduced_slope_is_that_of_every_mode_of_the_structure(name):
    """Poisson's ratio of a part, the radius of a spider: dλ/dp of the affine reduced model."""
    whole, spider = carried()
    here = with_radius(whole, 0, R)
    reduced = reduced_problem(here, TOP, groups=12)
    value, change, slope = {
        "nu": (0.3, lambda v: with_nu(here, v), by_part(reduced.structure, 0, "nu")),
        "R": (R, lambda v: with_radius(whole, 0, v), by_radius(reduced.structure, spider, R)),
    }[name]
    effect = linear_scale(name, name, "-", value, slope)
    state = evaluate(reduced.model, [effect], np.zeros(1))
    phi = state.vectors
    dK, dM = (d.along(phi)[0] for d in (state.dK, state.dM))
    h = 1e-4 * value
    up, down = (
        (2 * np.pi * normal_modes(structure(change(value + s)).system, 12).frequency) ** 2
        for s in (h, -h)
    )
    due = (up - down)[6:] / (2 * h) * value
    got = (dK - state.lam * dM)[6:12]
    assert np.abs(due).max() > 1e-3 * state.lam[11]
    assert_allclose(got, due, atol=1e-4 * np.abs(due).max())
