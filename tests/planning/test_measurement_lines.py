"""Lines, duration, visibility, mass loading, searches and the linearised choice of parameters."""

import numpy as np
import pytest
from scipy.linalg import eigh

from chladni.errors import ShapeError
from chladni_bench import TABLE_3, Stage, stage_lines, stepped_sine_time
from chladni_planning import (
    Linearised,
    Rules,
    auto_mac,
    burst_random_time,
    delay_at,
    delay_cycles,
    even_lines,
    evolved,
    half_bandwidth,
    kinetic_energy,
    lines_for_poles,
    lines_per_bandwidth,
    lines_time,
    loaded_frequency,
    log_det_fisher,
    transient_left,
    visibility,
    with_visible_modes,
)
from chladni_planning.layouts.layout_quality import overlap


def test_constant_number_in_every_half_bandwidth():
    """Wherever the resonance lies, n lines (within one) fall into its half-bandwidth."""
    lines = even_lines(10, 400, 0.01, 5)
    f = np.linspace(15, 350, 200)
    count = lines_per_bandwidth(lines, f, np.full(200, 0.01))
    assert count.min() >= 4
    assert count.max() <= 6
    assert lines[0] == 10
    assert lines[-2] < 400 <= lines[-1]


def test_lines_for_poles_spend_fewer_for_the_same():
    f, zeta = np.array([28.2, 41.0, 60.3, 110.0]), np.array([0.01, 0.004, 0.006, 0.008])
    lines = lines_for_poles(10, 200, f, zeta, per_bandwidth=4)
    assert lines_per_bandwidth(lines, f, zeta).min() >= 3
    assert len(lines) < len(even_lines(10, 200, zeta.min(), 4)) / 2
    assert np.all(np.diff(np.diff(lines)) <= 0.31 * np.diff(lines)[:-1])


def test_table_3():
    """915 lines, 1.8 h for five sweeps against 400 s of burst random, sixteen times as long."""
    assert len(stage_lines(TABLE_3)) == 915
    duration = stepped_sine_time(TABLE_3, sweeps=5)
    assert duration / 3600 == pytest.approx(1.8, abs=0.05)
    assert burst_random_time(0.05, 20) == pytest.approx(400)
    assert duration / burst_random_time(0.05, 20) == pytest.approx(16, abs=0.5)


def test_a_stage_by_hand():
    stages = [Stage(10, 20, 1, 5, 5), Stage(20, 40, 1, 3, 1)]
    assert stepped_sine_time(stages) == pytest.approx(10 / 10 + 4 / 20 + 4 / 40)
    np.testing.assert_allclose(stage_lines(stages), [10, 20, 40])


def test_delay_leaves_the_residual_asked_for():
    """And the delays of table 3 do not leave 1 % (11.7 % after 30 cycles of mode 1)."""
    cycles = delay_cycles(np.array([0.0115, 0.0037]), 0.01)
    assert np.all(transient_left(np.array([0.0115, 0.0037]), cycles) <= 0.01)
    assert np.all(transient_left(np.array([0.0115, 0.0037]), cycles - 1) > 0.01)


def test_delay_at_a_line_is_that_of_the_slowest_mode_near():
    f, zeta = np.array([50.0, 50.2]), np.array([0.01, 0.004])
    assert delay_at(np.array([50.0]), f, zeta)[0] == pytest.approx(delay_cycles(0.004), abs=1)
    assert delay_at(np.array([50.0]), f[:1], zeta[:1])[0] == delay_cycles(0.01)
    assert delay_at(np.array([90.0]), f, zeta)[0] == 5
    assert lines_time(np.array([10.0, 20.0]), np.array([0, 20.0]), 10) == pytest.approx(2.5)


def test_half_bandwidth_is_between_half_power_points():
    omega = np.linspace(9, 11, 200001)
    power = 1 / np.abs(100 - omega**2 + 2j * 0.01 * 10 * omega) ** 2
    above = omega[power >= power.max() / 2]
    assert above[-1] - above[0] == pytest.approx(half_bandwidth(10.0, 0.01), rel=1e-3)


def test_nonsense_bands_are_refused():
    with pytest.raises(ShapeError, match="no lines from 20 to 10"):
        even_lines(20, 10, 0.01)


def test_kinetic_energy_adds_up():
    A = np.random.default_rng(0).normal(size=(6, 6))
    M = A @ A.T + np.eye(6)
    phi = np.random.default_rng(1).normal(size=(6, 3))
    np.testing.assert_allclose(kinetic_energy(phi, M @ phi).sum(axis=0), 1)


def test_auto_mac_of_a_blind_layout():
    """Two modes alike at the sensors have MAC 1 there."""
    phi = np.array([[1.0, 2.0], [1.0, 2.0], [1.0, -2.0]])
    assert auto_mac(phi[:2])[0, 1] == pytest.approx(1)
    assert auto_mac(phi)[0, 1] < 0.2


def in_plane_case():
    """40 normals that see modes 0-3 but hardly mode 4, and 10 in-plane places that see mode 4."""
    rng = np.random.default_rng(2)
    phi = rng.normal(size=(50, 5))
    phi[:40, 4] = 0.001 * rng.normal(size=40)
    phi[40:] *= [0.3, 0.3, 0.3, 0.3, 1]
    return phi, np.abs(phi).max(axis=0)


def test_an_in_plane_mode_gets_its_sensor():
    """The least ranked sensor moves (section 4.2.4.6), and no other mode is lost for it."""
    phi, largest = in_plane_case()
    ranked = np.arange(12)
    assert visibility(phi[ranked], largest)[4] < 0.01
    layout, moves = with_visible_modes(phi, ranked, largest, floor=0.3)
    assert [(m.mode, m.out) for m in moves] == [(4, 11)]
    assert moves[0].into >= 40
    assert np.all(visibility(phi[layout], largest) >= 0.3)
    np.testing.assert_array_equal(layout[:11], ranked[:11])


def test_a_needed_or_fixed_sensor_does_not_move():
    """Sensor 11 is fixed; 10 alone sees mode 0: so 9 goes."""
    phi, largest = in_plane_case()
    phi[:12, 0] = 0.0
    phi[10, 0] = largest[0]
    layout, moves = with_visible_modes(phi, np.arange(12), largest, floor=0.3, rules=Rules([11]))
    assert [m.out for m in moves] == [9]
    assert {10, 11} <= set(layout)


def test_visible_layouts_are_left_alone():
    phi, largest = in_plane_case()
    layout, moves = with_visible_modes(phi[:, :4], np.arange(12), largest[:4], floor=0.2)
    assert moves == ()
    np.testing.assert_array_equal(layout, np.arange(12))


def test_mass_loading_of_a_whole_model_is_exact():
    """All modes kept: the loaded frequencies are those of (K, M + masses)."""
    rng = np.random.default_rng(5)
    A, B = rng.normal(size=(2, 6, 6))
    K, M = A @ A.T + np.eye(6), B @ B.T + np.eye(6)
    lam, phi = eigh(K, M)
    m = np.array([0.3, 0.1])
    loaded = M.copy()
    loaded[:3, :3] += 0.3 * np.eye(3)
    loaded[3:, 3:] += 0.1 * np.eye(3)
    due = np.sqrt(eigh(K, loaded, eigvals_only=True)) / (2 * np.pi)
    ours = loaded_frequency(np.sqrt(lam) / (2 * np.pi), phi.reshape(2, 3, 6), m)
    np.testing.assert_allclose(ours, due)


def test_no_mass_no_shift():
    phi = np.random.default_rng(0).normal(size=(4, 3, 5))
    f = np.arange(1.0, 6.0)
    np.testing.assert_allclose(loaded_frequency(f, phi, 0.0), f)
    assert np.all(loaded_frequency(f, phi, 0.01) <= f + 1e-12)


def test_overlap():
    assert overlap(np.array([1, 2, 3, 4]), np.array([3, 4, 5])) == 0.5


def test_the_genetic_search_is_seeded_and_obeys():
    rng = np.random.default_rng(0)
    phi = rng.normal(size=(30, 4))
    rules = Rules([3], [4, 5])
    a, b = (evolved(phi, 6, seed=1, rules=rules, generations=15) for _ in range(2))
    np.testing.assert_array_equal(a, b)
    assert 3 in a
    assert not {4, 5} & set(a)
    assert log_det_fisher(phi[a]) > log_det_fisher(phi[rng.permutation(30)[:6]])


def linearised(p=4, m=30, seed=0, truth=(0,)):
    rng = np.random.default_rng(seed)
    J, H = 2 * rng.normal(size=(m, p)), 2 * rng.normal(size=(m, p))
    theta = np.zeros(p)
    theta[list(truth)] = 2.0
    return Linearised(-J @ theta + rng.normal(size=m), J, -H @ theta + rng.normal(size=m), H)


def test_freeing_the_truth_helps_held_out_data():
    """And freeing something else than the truth does not."""
    problem = linearised(truth=(1,))
    assert problem.improvement([1]) > 0.5
    assert max(problem.improvement([k]) for k in (0, 2, 3)) < 0.25 * problem.improvement([1])
    assert problem.improvement([]) == 0


def test_fit_is_the_least_squares_fit():
    problem = linearised()
    stacked = np.vstack([problem.jacobian, np.eye(4)])
    due = np.linalg.lstsq(stacked, -np.r_[problem.residual, np.zeros(4)], rcond=None)[0]
    np.testing.assert_allclose(problem.fitted([0, 1, 2, 3]), due)


def test_twins_are_unlearned():
    """Two parameters of one column: their difference keeps its prior, one of two is unlearned."""
    problem = linearised()
    twins = Linearised(
        problem.residual,
        problem.jacobian[:, [0, 0]],
        problem.held_residual,
        problem.held_jacobian[:, [0, 0]],
    )
    assert twins.unlearned([0, 1]) == pytest.approx(1, abs=0.02)
    assert twins.unlearned([0]) < 0.02


def test_linearised_shapes_are_checked():
    with pytest.raises(ShapeError, match="Jacobian is"):
        Linearised(np.zeros(3), np.zeros((4, 2)), np.zeros(3), np.zeros((3, 2)))
