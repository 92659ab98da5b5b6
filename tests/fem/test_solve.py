from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.elements import row_of_bars, scalar
from tests.builders.refusals import says
from tests.builders.statics import static

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.errors import LabelError
from chladni.fem import solve
from chladni.fem.assemble import structure
from chladni.model.assembly import Assembly, Masses, RigidBody
from chladni.model.properties import BeamSection, Isotropic, Part

E, I, A, RHO, L, N = 210e9, 4e-9, 2e-4, 7850.0, 1.5, 6
SECTION = BeamSection(Isotropic(E, 0.3, RHO), A, I, I, 0.0, 2 * I)
ALONG_Y = np.array([(k, 2) for k in range(1, N + 2)])
CLAMPED = np.array([(0, c) for c in range(1, 7)])


def cantilever(**more):
    """A row of beams, clamped at its first point."""
    return row_of_bars(N, L, SECTION, **{"supports": CLAMPED, **more})


def oscillator(k=1e4, m=2.0, c=3.0, **more):
    """One mass along X on a spring and a damper to ground through a held base point."""
    held = [(0, c) for c in range(1, 7)] + [(1, c) for c in range(2, 7)]
    mass = Masses(np.array([1]), np.array([1]), m * np.diag([1.0, 1, 1, 0, 0, 0])[None])
    fields = dict(springs=scalar((1, 0), (1, 1), k), dampers=scalar((1, 0), (1, 1), c), masses=mass,
                  supports=np.array(held))  # fmt: skip
    return Assembly(np.array([1, 2]), np.zeros((2, 3)), (), **{**fields, **more})


def unit_load(n, at, cases=1):
    f = np.zeros((6 * n, cases))
    f[at, 0] = 1
    return f


def test_several_load_cases_at_once():
    """Tip force and tip moment: P L³/3EI and M L²/2EI, and Maxwell's reciprocity."""
    f = np.zeros((6 * (N + 1), 2))
    f[6 * N + 1, 0] = f[6 * N + 5, 1] = 1
    u = static(structure(cantilever()), f)
    assert u[6 * N + 1, 0] == pytest.approx(L**3 / (3 * E * I))
    assert u[6 * N + 1, 1] == pytest.approx(L**2 / (2 * E * I))
    assert u[6 * N + 1, 1] == pytest.approx(u[6 * N + 5, 0])


def test_weight_bends_a_cantilever():
    """ρ A g L⁴ / 8EI, nearly, with the weight lumped at six points; all of it is there."""
    made = cantilever()
    f = solve.inertia_load(made, np.array([[0.0], [-9.81], [0]]))
    assert f[1::6].sum() == pytest.approx(-RHO * A * L * 9.81)
    u = static(structure(made), f)
    assert u[6 * N + 1, 0] == pytest.approx(-RHO * A * 9.81 * L**4 / (8 * E * I), rel=1e-9)


def test_spinning_loads_grow_with_radius():
    """Angular acceleration about Z: Σ moment = -I_zz α; field and mass from the same motion."""
    made = cantilever(coupled_mass=False)
    a = np.zeros((6, 1))
    a[5] = 2.0
    f = solve.inertia_load(made, a).reshape(-1, 6)
    lumps = np.array([0.5, 1, 1, 1, 1, 1, 0.5]) * RHO * A * L / N
    assert_allclose(f[:, 1], 2 * lumps * made.points[:, 0])


def test_settled_support():
    """A moved clamp carries the free beam along rigidly, without strain."""
    settled = np.array([[0.1, 0.2, 0, 0, 0, 0.3]]).T
    u = solve.driven(cantilever(), CLAMPED, settled, np.zeros(1), ALONG_Y)[0, :, 0]
    assert_allclose(u, 0.2 + 0.3 * cantilever().points[:, 0], rtol=1e-9)


def test_moved_dof_that_is_no_support():
    """The tip pushed by d needs 3 E I d / L³ and takes the cubic shape."""
    tip, x = np.array([(N, 2)]), cantilever().points[1:, 0] / L
    u = solve.driven(cantilever(), tip, np.array([[0.01]]), np.zeros(1), ALONG_Y[1:])[0, :, 0]
    assert_allclose(u, 0.01 * x**2 * (3 - x) / 2, atol=1e-12)


def test_dependent_dof_cannot_be_moved():
    tied = cantilever(rigid=(RigidBody(1, N - 1, (N,), ((1, 2, 3, 4, 5, 6),)),))
    dofs, moves = np.array([(N, 2)]), np.array([[0.01]])
    says(f"{N + 1}:.Y", solve.driven, tied, dofs, moves, np.zeros(1), ALONG_Y)


def test_oscillator_receptance():
    """1 / (k - ω² m + i ω c)."""
    k, m, c = 1e4, 2.0, 3.0
    f = np.array([0.0, 5.0, 11.25, 40.0])
    built = structure(oscillator(k, m, c))
    H = solve.harmonic(built, unit_load(2, 6), f, built.rows(np.array([[2, 1]])))
    w = 2 * np.pi * f
    assert_allclose(H[:, 0, 0], 1 / (k - w**2 * m + 1j * w * c), rtol=1e-12)


def test_hysteretic_losses():
    """Of the whole (G) and of the spring: k (1 + i g + i η)."""
    made = oscillator(c=0.0, structural_damping=0.04)
    made = replace(made, springs=replace(made.springs, damping=np.array([0.03])))
    built = structure(made)
    H = solve.harmonic(built, unit_load(2, 6), np.array([3.0]), built.rows(np.array([[2, 1]])))
    w = 2 * np.pi * 3
    assert H[0, 0, 0] == pytest.approx(1 / (1e4 * (1 + 0.07j) - w**2 * 2))


def test_losses_of_the_material():
    """A loss factor η of the beam's material makes a static answer 1 / (1 + i η) of itself."""
    lossy = BeamSection(Isotropic(E, 0.3, RHO, damping=0.1), A, I, I, 0.0, 2 * I)
    tip, load = np.array([[N + 1, 2]]), unit_load(N + 1, 6 * N + 1)
    u = []
    for section in (SECTION, lossy):
        built = structure(cantilever(parts=(Part(1, "b", section),)))
        u.append(solve.harmonic(built, load, np.array([0.0]), built.rows(tip))[0, 0, 0])
    assert u[1] == pytest.approx(u[0] / (1 + 0.1j))


def test_transmissibility_of_an_oscillator():
    """T = 1 + ω² / (ω_n² - ω² + 2iζω_nω), damped in its motion relative to the base."""
    zeta, f = 0.02, np.array([1.0, 11.0, 30.0])
    T = chladni.frf(oscillator(c=0.0), ["2:+X", "1:+X"], ["base:+X"], f, zeta).frfs[0]
    w, wn = 2 * np.pi * f, np.sqrt(1e4 / 2)
    relative = w**2 / (wn**2 - w**2 + 2j * zeta * wn * w)
    assert_allclose(T.values[:, 0, 0], 1 + relative)
    assert_allclose(T.values[:, 1, 0], 1)  # the base itself
    assert T.inputs == ("base:+X",)


def test_a_moving_base_is_damped_by_the_decks_dashpots():
    """T = (k + i ω c) / (k + i ω c - ω² m), the other way round for a base along -X."""
    f = np.array([2.0, 11.0, 30.0])
    w = 2 * np.pi * f
    pull = 1e4 + 40j * w
    for base, sign in (("base:+X", 1), ("base:-X", -1)):
        T = chladni.frf(oscillator(c=40.0), ["2:+X"], [base], f, 0.0).frfs[0]
        assert_allclose(T.values[:, 0, 0], sign * pull / (pull - 2 * w**2))


@pytest.mark.parametrize("base", ["base:+RX", "base:n"])
def test_a_base_moves_along_an_axis(base):
    with pytest.raises(LabelError, match=r"write base:\+X, base:\+Y or base:\+Z"):
        chladni.frf(oscillator(), ["2:+X"], [base], np.array([1.0]))


def test_base_excitation_equals_a_large_mass():
    """A mass of 1e6 the structure's on the clamp, pushed, gives the same accelerations."""
    made = cantilever()
    f, outputs = np.array([3.0, 20.0, 77.0]), np.array([[N + 1, 2], [3, 2]])
    high = [*f, 2000.0]  # so that more modes are superposed
    T = chladni.frf(made, [f"{N + 1}:+Y", "3:+Y"], ["base:+Y"], high, 0.0).frfs[0]
    big = 1e6 * RHO * A * L
    heavy = Masses(np.array([1]), np.array([0]), big * np.eye(6)[None])
    guided = np.array([(0, c) for c in (1, 3, 4, 5, 6)])
    loose = structure(replace(made, masses=heavy, supports=guided))
    x = solve.harmonic(loose, big * unit_load(N + 1, 1), f, loose.rows(outputs))
    acceleration = -((2 * np.pi * f) ** 2)[:, None, None] * x
    assert_allclose(T.values[:-1], acceleration, rtol=2e-5)


def test_driven_oscillator():
    """x / x_b = (k + i ω c) / (k + i ω c - ω² m), the base moved."""
    f, base, out = np.array([2.0, 11.0, 30.0]), np.array([[0, 1]]), np.array([[2, 1], [1, 1]])
    x = solve.driven(oscillator(c=40.0), base, np.array([[0.5]]), f, out)
    w = 2 * np.pi * f
    pull = 1e4 + 40j * w
    assert_allclose(x[:, 0, 0], 0.5 * pull / (pull - 2 * w**2))
    assert_allclose(x[:, 1, 0], 0.5)


def test_driven_by_all_modes_is_driven_directly():
    """The absolute modal sum is exact with every mode; amplitudes may change with the line."""
    made, f, out = cantilever(), np.array([20.0, 90.0]), np.array([[N + 1, 2], [3, 6]])
    values = np.array([[[0.01], [0.002j]], [[0.03j], [0.001]]])
    dofs = np.array([(0, 2), (0, 6)])
    direct = solve.driven(made, dofs, values, f, out)
    modal = solve.driven(made, dofs, values, f, out, normal_modes(structure(made).system))
    assert_allclose(modal, direct, rtol=1e-7, atol=1e-9 * np.abs(direct).max())


def test_dashpots_couple_the_modes_of_a_driven_structure():
    """With a damper on the tip the sum over all modes still is the direct answer."""
    tip = scalar((N, -1), (2, 1), 3.0)
    made, f = cantilever(dampers=tip, structural_damping=0.02), np.array([13.0, 90.0])
    dofs, out, value = np.array([(0, 2)]), np.array([[N + 1, 2]]), np.array([[0.01]])
    modal = solve.driven(made, dofs, value, f, out, normal_modes(structure(made).system))
    assert_allclose(modal, solve.driven(made, dofs, value, f, out), rtol=1e-7)
