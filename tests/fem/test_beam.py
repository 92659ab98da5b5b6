from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh
from tests.builders.elements import row_of_bars
from tests.builders.refusals import says

from chladni.fem import beam
from chladni.model.assembly import Assembly
from chladni.model.properties import BeamSection, Isotropic, Orthotropic

STEEL = Isotropic(210e9, 0.3, 7850.0)
A, I1, I2, J = 2e-4, 3e-9, 8e-9, 5e-9
SECTION = BeamSection(STEEL, A, I1, I2, 0.0, J, kind="beam")


def line(section=SECTION, n=1, length=2.0, **more):
    """A straight row of n beams."""
    return row_of_bars(n, length, section, **more)


def assembled(assembly):
    nodes, K, M = beam.stiffness_and_mass(assembly)
    n = 6 * len(assembly.points)
    out = np.zeros((2, n, n))
    for e, at in enumerate((6 * nodes[:, :, None] + np.arange(6)).reshape(len(nodes), -1)):
        out[0][np.ix_(at, at)] += K[e]
        out[1][np.ix_(at, at)] += M[e]
    return out


def tip(assembly, load):
    """Motion of the last point under a load on it, the first point clamped."""
    K = assembled(assembly)[0][6:, 6:]
    f = np.zeros(len(K))
    f[-6:] = load
    return np.linalg.solve(K, f)[-6:]


def turned(seed=0):
    Q = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))[0]
    return Q * np.linalg.det(Q)


GENERAL = replace(SECTION, I12=2e-9, shear=(0.5, 0.8), neutral=(0.01, -0.02), nonstructural=3.0)


@pytest.mark.parametrize("kind", ["bar", "beam", "rod"])
def test_rigid_motions_are_free(kind):
    """K u = 0 for all six, with offsets, coupling, shear and an offset neutral axis."""
    rng = np.random.default_rng(1)
    assembly = line(replace(GENERAL, kind=kind), 3, offset=rng.normal(size=(3, 2, 3)) / 10)
    K, _ = assembled(assembly)
    for u, theta in zip(np.eye(6)[:, :3], np.eye(6)[:, 3:], strict=True):
        motion = np.hstack([u + np.cross(theta, assembly.points), np.tile(theta, (4, 1))])
        assert_allclose(K @ motion.ravel(), 0, atol=1e-10 * K.max())


@pytest.mark.parametrize("n", [1, 5])
def test_cantilever_of_euler_and_timoshenko(n):
    """One element is exact: u = P L³/3EI + P L/kGA, θ = P L²/2EI, in both planes."""
    L, P = 2.0, 100.0
    for shear in ((0.0, 0.0), (0.4, 0.7)):
        u = tip(line(replace(SECTION, shear=shear), n), [P, P, P, P, 0, 0])
        G = STEEL.shear_modulus
        due = [P * L**3 / (3 * STEEL.E * I) + (P * L / (k * G * A) if k else 0)
               for I, k in zip((I1, I2), shear, strict=True)]  # fmt: skip
        turn = [P * L**2 / (2 * STEEL.E * I) for I in (I1, I2)]
        assert_allclose(u[:3], [P * L / (STEEL.E * A), *due], rtol=1e-9)
        assert_allclose(u[3:], [P * L / (G * J), -turn[1], turn[0]], rtol=1e-9)


def test_product_of_inertia_is_a_turned_section():
    """I12 of a section turned by α equals the principal section with its up vector turned."""
    alpha = 0.4
    c, s = np.cos(alpha), np.sin(alpha)
    mixed = replace(
        SECTION, I1=c**2 * I1 + s**2 * I2, I2=s**2 * I1 + c**2 * I2, I12=c * s * (I1 - I2)
    )
    load = [10.0, 20.0, 30.0, 4.0, 5.0, 6.0]
    assert_allclose(tip(line(mixed, 2), load), tip(line(SECTION, 2, up=(0, c, s)), load), rtol=1e-9)


def test_offset_is_a_rigid_arm():
    """Offsets equal beams between the moved points, seen from the old ones."""
    rng = np.random.default_rng(2)
    arms = np.tile(rng.normal(size=3) / 5, (2, 2, 1))
    inside = tip(line(SECTION, 2, offset=arms), [1, 2, 3, 4, 5, 6])
    r = arms[0, 0]
    force, moment = np.array([1.0, 2, 3]), np.array([4.0, 5, 6])
    u = tip(line(SECTION, 2), [*force, *(moment - np.cross(r, force))])
    assert_allclose(inside[3:], u[3:], rtol=1e-9)
    assert_allclose(inside[:3], u[:3] - np.cross(u[3:], r), rtol=1e-9)


def test_neutral_axis_bends_under_tension():
    """N along the shear centre is a moment N z about the neutral axis: θ = N z L / EI."""
    z, N, L = 0.02, 1000.0, 2.0
    u = tip(line(replace(SECTION, neutral=(0.0, z)), 2), [N, 0, 0, 0, 0, 0])
    turn = -N * z * L / (STEEL.E * I2)
    assert u[4] == pytest.approx(turn)
    assert u[0] == pytest.approx(N * L / (STEEL.E * A) - turn * z)


def test_hinge_carries_no_moment():
    """A propped span with the far end's θz and θy released: u = P L³/48EI at a hinged middle."""
    pins = np.zeros((2, 2, 6), bool)
    pins[0, 1, 4:] = True
    K, _ = assembled(line(SECTION, 2, pins=pins))
    free = np.r_[6:12]  # both ends clamped, hinge in the middle: two cantilevers side by side
    f = np.array([0, 100.0, 0, 0, 0, 0])
    u = np.linalg.solve(K[np.ix_(free, free)], f)
    assert u[1] == pytest.approx(100 / (2 * 3 * STEEL.E * I1))


def test_all_pins_released_leaves_nothing():
    pins = np.zeros((1, 2, 6), bool)
    pins[0, 1] = True
    K, _ = assembled(line(pins=pins))
    assert_allclose(K, 0, atol=1e-6 * STEEL.E * A)


def test_rod_only_stretches_and_twists():
    K, _ = assembled(line(replace(SECTION, kind="rod"), up=(0, 0, 0)))
    assert np.linalg.matrix_rank(K) == 2
    assert K[0, 0] == pytest.approx(STEEL.E * A / 2)
    assert K[3, 3] == pytest.approx(STEEL.shear_modulus * J / 2)


def test_turning_the_axes_changes_nothing():
    """Energy is blind to the frame: direction and up vector turned together."""
    R = turned()
    load = np.array([1.0, 2, 3, 4, 5, 6])
    block = np.kron(np.eye(2), R)
    plain = tip(line(GENERAL, 2), load)
    other = tip(line(GENERAL, 2, direction=R[:, 0], up=R[:, 1]), block @ load)
    assert_allclose(other, block @ plain, rtol=1e-8)


@pytest.mark.parametrize("coupled", [True, False])
@pytest.mark.parametrize("kind", ["bar", "beam", "rod"])
def test_mass_of_a_translation(kind, coupled):
    assembly = line(replace(GENERAL, kind=kind), 3, coupled_mass=coupled)
    _, M = assembled(assembly)
    for axis in np.eye(6)[:3]:
        move = np.tile(axis, 4)
        assert move @ M @ move == pytest.approx(2 * (7850 * A + 3))


def frequencies(n, section=SECTION, coupled=True):
    K, M = assembled(line(section, n, coupled_mass=coupled))
    return np.sqrt(eigh(K[6:, 6:], M[6:, 6:], eigvals_only=True)) / (2 * np.pi)


def test_cantilever_frequency_converges_with_h4():
    """(1.8751 / L)² √(EI / ρA) / 2π from above, error falling as h⁴."""
    due = 1.8751040687**2 / 4 * np.sqrt(STEEL.E * I1 / (7850 * A)) / (2 * np.pi)
    error = [frequencies(n)[0] / due - 1 for n in (2, 4)]
    assert 0 < error[1] < 1e-4
    assert error[0] / error[1] == pytest.approx(16, rel=0.15)


@pytest.mark.parametrize("coupled", [True, False])
def test_torsion_of_a_beam_has_inertia(coupled):
    """First torsion at √(GJ / ρ(I1 + I2)) / 4L; a bar's mass does not turn about its axis."""
    due = np.sqrt(STEEL.shear_modulus * J / (7850 * (I1 + I2))) / 8
    f = frequencies(12, coupled=True)
    assert np.abs(f / due - 1).min() < 2e-3
    _, M = assembled(line(replace(SECTION, kind="bar"), coupled_mass=coupled))
    assert M[3, 3] == 0


def test_rod_mass_as_nastran_has_it():
    """Coupled: axial 5/12 and 1/12 of the mass, transverse lumped."""
    _, M = assembled(line(replace(SECTION, kind="rod"), coupled_mass=True))
    m = 7850 * A * 2
    assert_allclose(M[[0, 0, 1, 2], [0, 6, 1, 8]], [5 / 12 * m, m / 12, m / 2, 0])


def test_lumped_mass_off_the_line():
    """Non-structural mass at (y, z) turns with m (y² + z²) about the line, besides its own."""
    section = BeamSection(
        Isotropic(1e9, 0.3), 1.0, nonstructural=6.0, nonstructural_at=(0.1, 0.2),
        nonstructural_inertia=0.5,
    )  # fmt: skip
    _, M = assembled(line(section, coupled_mass=False))
    assert M[3, 3] == pytest.approx(6 * 0.05 + 0.5)
    assert M[0, 4] == pytest.approx(6 * 0.2)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"length": 0.0}, "101.* no length"),
        ({"up": (1.0, 0, 0)}, "101.* orientation"),
        ({"section": replace(SECTION, material=Orthotropic(1, 1, 0, 1))}, "isotropic"),
    ],
)
def test_faults_name_the_beam(change, said):
    says(said, beam.stiffness_and_mass, line(**change))


def test_no_beams():
    nodes, K, M = beam.stiffness_and_mass(Assembly(np.arange(1), np.zeros((1, 3)), ()))
    assert len(nodes) == len(K) == len(M) == 0
