"""A joint's stiffness in the reduced model is that of the full structure, and so is its slope."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects.calibration_parameters import linear_scale
from chladni.fem.assemble import structure
from chladni.fem.derivative import by_part, of_lumps
from chladni.model.ground_springs import with_springs
from chladni.reduced.accuracy import accuracy, products
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import folded_panel, plate

TOP = 200.0


def written(assembly, factor):
    old = assembly.springs
    return replace(assembly, springs=replace(old, value=factor * old.value))


def test_spring_constant():
    made = with_springs(plate(0.4, 0.3, 4, 3, 1.5e-3), (1,), np.eye(3)[2:], 5e3)
    reduced = reduced_problem(made, TOP)
    effect = linear_scale(
        "spring 1", "k", "-", 1.0, of_lumps(reduced.structure, "springs", [0]), written
    )
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


def with_nu(assembly, nu):
    parts = list(assembly.parts)
    own = parts[0].section
    steel = replace(own.membrane, nu=nu)
    parts[0] = parts[0].with_section(membrane=steel, bending=steel)
    return assembly.with_parts(tuple(parts))


def test_reduced_slope_is_that_of_every_mode_of_the_structure():
    """Poisson's ratio of a part: dλ/dp of the affine reduced model."""
    here = folded_panel(h=0.06)
    reduced = reduced_problem(here, TOP, groups=12)
    nu, h = 0.3, 3e-5
    effect = linear_scale("nu", "nu", "-", nu, by_part(reduced.structure, 0, "nu"))
    state = evaluate(reduced.model, [effect], np.zeros(1))
    phi = state.vectors
    dK, dM = (d.along(phi)[0] for d in (state.dK, state.dM))
    up, down = (
        (2 * np.pi * normal_modes(structure(with_nu(here, nu + s)).system, 12).frequency) ** 2
        for s in (h, -h)
    )
    due = (up - down)[6:] / (2 * h) * nu
    got = (dK - state.lam * dM)[6:12]
    assert np.abs(due).max() > 1e-3 * state.lam[11]
    assert_allclose(got, due, atol=1e-4 * np.abs(due).max())
