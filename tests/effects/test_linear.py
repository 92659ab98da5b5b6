"""A joint's stiffness in the reduced model is that of the full structure, and so is its slope."""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from chladni.effects.linear import linear_scale
from chladni.effects.points import with_springs
from chladni.fem.assemble import structure
from chladni.fem.derivative import by_spring
from chladni.model.plates import plate
from chladni.updating.accuracy import accuracy, products
from chladni.updating.reduced import evaluate
from chladni.updating.workbench import workbench

TOP = 200.0


def written(assembly, value):
    old = assembly.springs
    return replace(assembly, springs=replace(old, value=np.full(len(old.value), value)))


def test_spring_constant():
    made = with_springs(plate(0.4, 0.3, 4, 3, 1.5e-3), (1,), np.eye(3)[2:], 5e3)
    bench = workbench(made, TOP)
    effect = linear_scale("spring 1", "k", "N/m", 5e3, by_spring(bench.structure, 0), written)
    x, h = np.array([0.4]), 1e-4
    q = np.random.default_rng(0).normal(size=(len(bench.model.basis), 2))
    K = structure(effect.apply(made, x)).system.K
    got = products(bench.model, [effect], x, q)[0]
    assert_allclose(got, K @ q, atol=1e-9 * np.abs(K @ q).max())
    state = evaluate(bench.model, [effect], x)
    slope = np.einsum("prr->pr", state.dK)[0]
    up, down = (evaluate(bench.model, [effect], x + s, False).lam for s in (h, -h))
    scale = np.abs(slope).max()
    assert_allclose(slope, (up - down) / (2 * h), atol=1e-5 * scale)
    assert scale > 0
    assert accuracy(bench, bench.model, [effect], 0 * x, TOP).worst < 1e-9
