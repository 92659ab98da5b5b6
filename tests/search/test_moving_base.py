"""Transmissibility of the reduced model is that of full matrices whose supports are moved."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from numpy.testing import assert_allclose
from tests.builders.recorded_plate import with_attachments
from tests.builders.structures import held_along_x0

from chladni.effects.attachments import AtPoints
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import Effect, MatrixTerm, Parameter, count
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.masses import LocalResonator, MassEffect, PointMass
from chladni.effects.springs import ExtraSupport
from chladni.fem.assemble import structure
from chladni.inference.likelihood import Responses
from chladni.inference.map_fit import MassMeasurement
from chladni.inference.scan import baseline, point_scores
from chladni.reduced.accuracy import LIMIT
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate

TOP = 250.0
AXES = np.array([[0.0, 0.0, 1.0], [0.6, 0.0, 0.8]])
SENSORS = np.array([7, 14, 32, 61])
ZETA = 0.03
S = 2 * np.pi * np.linspace(20, TOP, 30) * (ZETA + 1j)
CLOSE = LIMIT / ZETA  # what a frequency error that still serves does on a resonance


@pytest.fixture(scope="module")
def clamped():
    """A plate held along one edge."""
    return held_along_x0(plate(0.4, 0.25, 8, 6, 1.5e-3))


@pytest.fixture(scope="module")
def reduced(clamped):
    rows = structure(clamped).rows(np.column_stack([SENSORS, np.full(4, 3)]))
    return reduced_problem(clamped, TOP, rows, base=AXES)


@pytest.fixture(scope="module")
def data(reduced):
    rows = reduced.structure.rows(np.column_stack([SENSORS, np.full(4, 3)]))
    use = np.ones((len(S), 4), bool)
    idle = sp.csr_array((2, rows.shape[1]))
    values = np.ones((len(S), 4, 2), complex)
    carried = np.broadcast_to(AXES[:, 2], (4, 2))
    made = Responses(values, S, rows, idle, use, "transmissibility", direct=carried)
    return made.rebased(reduced.model)


@dataclass(frozen=True, eq=False)
class MatrixScale(Effect):
    """All mass at free dofs times e^x."""

    operator: sp.csr_array | None = None

    def terms(self, x):
        return (MatrixTerm("M", self.operator, np.expm1(x[0]), np.exp(x)),)


def moved_supports(assembly, axis, spring=()):
    """x_f = -(K_ff + s² M_ff)⁻¹ (K_fs + s² M_fs) x_s at the sensors, springs tied to the base."""
    loose = structure(replace(assembly, supports=np.zeros((0, 2), int)))
    K, M = loose.system.K.tolil(), loose.system.M.tocsr()
    axes = {int(a) - 1: v for a, v in zip((1, 2, 3), axis, strict=True)}
    rigid = np.array([axes.get(c - 1, 0.0) for c in loose.system.dofs[:, 1]])
    ids = assembly.ids[assembly.supports[:, 0]]
    held = np.isin(8 * loose.system.dofs[:, 0] + loose.system.dofs[:, 1],
                   8 * ids + assembly.supports[:, 1])  # fmt: skip
    for b, k in spring:
        K = K + k * sp.csr_array(b.T @ b)
    K = sp.csr_array(K)
    load = np.zeros(len(rigid))
    for b, k in spring:
        load = load + k * (b.T @ (b @ rigid))
    f, s = np.flatnonzero(~held), np.flatnonzero(held)
    out = loose.rows(np.column_stack([SENSORS, np.full(4, 3)]))
    T = []
    for line in S:
        Z = sp.csc_array(K + line**2 * M)
        x = rigid.astype(complex)
        x[f] = spl.spsolve(Z[f][:, f], load[f] - Z[f][:, s] @ rigid[s])
        T.append(out @ x)
    return np.array(T)


def test_of_the_deck(clamped, reduced, data):
    T = data.model(evaluate(reduced.model, [], np.zeros(0), False))
    for k, axis in enumerate(AXES):
        exact = moved_supports(clamped, axis)
        assert np.abs(T[:, :, k] - exact).max() < CLOSE * np.abs(exact).max()


def test_of_a_changed_structure(clamped, reduced, data):
    """Density, a mass and a spring to the base: the load follows the mass, the spring the base."""
    place, mass, stiff = 41, 0.06, 900.0
    b = reduced.structure.rows(np.column_stack([np.full(3, place), [1, 2, 3]]))
    heavy = MassEffect((Parameter("m", "kg", 0.0, 1.0, mass),), rows=b, grids=(place,))
    held = reduced.structure.rows(np.array([[23, 3]]))
    spring = AtPoints((Parameter("k", "N/m", 0.0, 1.0, stiff),), rows=held)
    rho = calibration_parameter(reduced.groups, "rho", [0])
    model = with_attachments(reduced, sp.csr_array(sp.vstack([b, held])))
    x = np.array([0.1, 0.0, 0.0])
    state = evaluate(model, [rho, spring, heavy], x, False)
    article = heavy.apply(rho.apply(clamped, x[:1]), x[2:])
    loose = structure(replace(clamped, supports=np.zeros((0, 2), int)))
    exact = moved_supports(article, AXES[1], [(loose.rows(np.array([[23, 3]])), stiff)])
    T = data.rebased(model).model(state)[:, :, 1]
    assert np.abs(T - exact).max() < CLOSE * np.abs(exact).max()


def test_slopes(reduced, data):
    """Of what changes mass the load of the base moves as well; of a moving mass, with its place."""
    where = EffectContext(
        reduced.groups, reduced.grids, reduced.candidates, Setup((), (), 1.2, TOP)
    )
    inside = np.flatnonzero((reduced.grids.point[:, 0] > 0.2) & (reduced.grids.point[:, 0] < 0.35))
    density = MatrixScale((Parameter("M", "kg", 0.0, 0.3),), operator=reduced.structure.system.M)
    effects = [
        *(calibration_parameter(reduced.groups, q, [0]) for q in ("E", "rho", "t")), density,
        PointMass.near(where, int(inside[3])), ExtraSupport.near(where, int(inside[-2])),
        LocalResonator.near(where, int(inside[5])),
    ]  # fmt: skip
    x = np.full(count(effects), 0.1)
    x[:8] = 0.03, -0.02, 0.01, 0.05, 0.2, 0.1, -0.2, -1.0
    model = reduced.model
    seen = replace(data, values=data.model(evaluate(model, effects, 0.98 * x, False)))
    _, J = seen.residual(evaluate(model, effects, x), True)

    def r(x):
        return seen.residual(evaluate(model, effects, x, False), False)[0]

    h = 1e-4
    for k, e in enumerate(h * np.eye(len(x))):
        slope = (8 * (r(x + e) - r(x - e)) - (r(x + 2 * e) - r(x - 2 * e))) / (12 * h)
        assert_allclose(J[:, k], slope, atol=1e-5 * np.abs(J[:, k]).max() + 1e-9)


def test_the_base_carries_a_lump_on_a_spring_as_the_mass_it_is(reduced, data):
    """Tuned far above the band it answers as a point mass, to (f / f_lump)² over the damping."""
    where = EffectContext(
        reduced.groups, reduced.grids, reduced.candidates, Setup((), (), 1.2, TOP)
    )
    k = int(np.argmax(reduced.grids.point[:, 0]))
    lump, mass = LocalResonator.near(where, k), PointMass.near(where, k)
    model, m, high = reduced.model_for(mass, np.zeros(3)), 0.06, 60.0
    ln = [np.log(m / e.parameters[0].scale) for e in (lump, mass)]
    x = np.array([ln[0], 0.1, -0.1, np.log(high * TOP / lump.parameters[3].scale)])
    seen = data.rebased(model)
    got, due = (
        seen.model(evaluate(model, [e], v, False))
        for e, v in ((lump, x), (mass, np.array([ln[1], 0.1, -0.1])))
    )
    assert np.abs(got - due).max() < high**-2 / ZETA * np.abs(due).max()
    assert np.abs(due - seen.model(evaluate(model, [], x[:0], False))).max() > 0.1


@pytest.mark.parametrize("matrix", ["M", "K"])
def test_low_rank_reanalysis_is_the_evaluation(reduced, data, matrix):
    places = reduced.candidates.only(np.arange(5, 55, 11))
    strengths = np.array([0.004, 0.05]) if matrix == "M" else np.array([50.0, 4e3])
    stiffer = evaluate(
        reduced.model, [calibration_parameter(reduced.groups, "E", [0])], np.array([0.04])
    )
    seen = replace(data, values=data.model(stiffer))
    rho = calibration_parameter(reduced.groups, "rho", [0])
    weighed = MassMeasurement(1.2, 0.01)
    base = baseline(reduced.model, [rho], seen, weighed, np.array([0.03]))
    rest = np.zeros(len(places))
    scores = point_scores(base, reduced.model, seen, places, matrix, strengths, rest)
    kind = MassEffect if matrix == "M" else AtPoints
    for k, c in np.ndindex(scores.shape):
        one = kind(
            (Parameter("c", "-", 0.0, 1.0, strengths[c]),), rows=places.rows[[k]], grids=(1,)
        )
        state = evaluate(reduced.model, [rho, one], np.array([0.03, 0.0]), False)
        r, _ = seen.residual(state, False)
        due = base.score(replace(base, state=state).with_mass(r[:, None], 0.0))[0]
        assert scores[k, c] == pytest.approx(due, rel=1e-6)


def test_a_wider_basis_is_loaded_as_the_whole_structure(reduced):
    """L over an extended basis is Phi' L of the structure."""
    place = reduced.candidates.only(np.array([30]))
    model = with_attachments(reduced, place.rows)
    assert model.basis.shape[1] > reduced.model.basis.shape[1]
    total = model.base.rest + model.base.groups.sum(axis=0)
    assert_allclose(total, model.basis.T @ model.base.motion.force, atol=1e-12)
