"""Levels: linear modes stay, elements leave their signature, levels between are foretold."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.modal_frfs import noisy

from chladni.dynamics.frf import FRF
from chladni.ema.describing_functions import cubic, drag, gap_spring, micro_slip, slider
from chladni.ema.identification import identify
from chladni.ema.level_elements import SLIDER, Element
from chladni.ema.level_fit import ElementFit, foretold
from chladni.ema.level_modes import AtLevel, modes_over_levels
from chladni.ema.level_study import _overlapped, decay_study, level_study
from chladni.ema.level_table import NORMAL_95, _tried, damping_range, level_tables
from chladni.ema.level_words import level_notes
from chladni.ema.ring_down import ring_downs
from chladni.ema.time_record import TimeRecord
from chladni_evidence.identification_evidence import recording, structure

F = np.arange(37.5, 46, 0.1)
OUT, DRIVE = ("1:+Z", "2:+Z", "3:+Z"), ("1:+Z",)
PHI = np.array([[1.0, 0.9], [0.6, -0.7], [-0.4, 0.8]])  # of the modes at the outputs [1/√kg]
HZ, ZETA = np.array([40.0, 44.0]), 0.004
LEVELS = (1.0, 3.0, 6.0, 10.0, 16.0)
A1 = 1 / ((2 * np.pi * 40) ** 2 * 2 * ZETA)  # of the linear mode at 1 N [m]
ELEMENTS = {  # name: κ over the stiffness of the first mode, and what it is a sign of
    "cubic spring": (lambda A: cubic(A, 3e-2 / (16 * A1) ** 2), "stiffening"),
    "spring behind a gap": (lambda A: gap_spring(A, 0.06, 4 * A1), "clearance"),
    "slider": (lambda A: slider(A, 0.03, 2 * A1), "friction"),
    "micro-slip": (lambda A: micro_slip(A, 0.03 / (16 * A1) ** 0.8, 0.8), "friction"),
    "drag": (lambda A: drag(A, 0.02 / (16 * A1), 1.0), "loss"),
}


def recorded(level, kappa=None, control="force", seed=0, noise=2e-3, shift=(0.0, 0.0)):
    """Accelerances at a level: the first mode holds an element, the second is linear.

    Under a force every line has the smallest amplitude at which |q| |D(q)| is the force; where the
    response of the first output is held, all lines have that amplitude.
    """
    omega, w = 2 * np.pi * F, 2 * np.pi * HZ * (1 + np.array(shift))
    linear = w[0] ** 2 - omega**2 + 2j * ZETA * w[0] * omega
    added = np.zeros(len(F), complex)
    if kappa is not None and control == "response":
        added[:] = kappa(np.full(1, level / w[0] ** 2))
    elif kappa is not None:
        A = np.geomspace(1e-3, 60, 4000) * A1
        D = np.abs(linear[:, None] + w[0] ** 2 * kappa(A)) * A / level
        at = np.argmax(D >= 1, axis=1)
        added = kappa(A[at])
    other = w[1] ** 2 - omega**2 + 2j * ZETA * w[1] * omega
    q = PHI[0] / np.stack([linear + w[0] ** 2 * added, other], axis=1)
    H = -(omega[:, None, None] ** 2) * (q @ PHI.T)[:, :, None]
    size = 1e-3 * noise * np.abs(H).max() / np.sqrt((np.abs(H) ** 2).mean(axis=0))
    return noisy(FRF(H, F, OUT, DRIVE, "accelerance"), noise, size, seed)


def at(level, kappa=None, control="force", **more):
    held = level * A1 * (2 * np.pi * 40) ** 2 if control == "response" else level
    frf = recorded(held, kappa, control, **more)
    return AtLevel(held, frf, identify(frf), control)


@cache
def studied(name, control):
    kappa = ELEMENTS[name][0]
    return level_study([at(x, kappa, control, seed=550 + k) for k, x in enumerate(LEVELS)])


@pytest.mark.parametrize("control", ["force", "response"])
@pytest.mark.parametrize("name", ELEMENTS)
def test_an_element_is_known_by_its_signature(name, control):
    """The right sign, on the right mode, by the right element or one not told apart from it."""
    sign = ELEMENTS[name][1]
    study = studied(name, control)
    first, second = study.modes
    assert second.signature in ("linear", "runs differ")
    assert first.signature == sign
    assert study.nonlinear
    assert first.explained is not None
    assert name in (first.explained.element.name, *first.as_good)
    f, zeta = first.explained.at(first.mode.amplitude)
    assert_allclose(f, first.mode.frequency, rtol=2e-3)
    assert_allclose(zeta, first.mode.damping, rtol=0.1)


@pytest.mark.parametrize("name", ELEMENTS)
def test_levels_between_are_foretold(name):
    """Three levels are seen; frequency and damping of the other two are no linear model's."""
    study = studied(name, "response")
    held = study.modes[0].held_out
    assert held.rows.tolist() == [1, 3]
    f, zeta, f_linear, zeta_linear = held.misses(study.modes[0].mode)
    assert f < 2e-3
    assert zeta < 0.15
    assert f + zeta / 100 < 0.5 * (f_linear + zeta_linear / 100)


def test_what_is_held_out_is_not_looked_at():
    """Other values at the levels held out change nothing of what is foretold there."""
    mode = studied("slider", "response").modes[0].mode
    other = np.array([1.0, 1.01, 1.0, 1.01, 1.0])
    changed = replace(mode, frequency=mode.frequency * other, damping=mode.damping * other**40)
    a, b = foretold(mode), foretold(changed)
    assert_allclose(a.frequency, b.frequency)
    assert_allclose(a.damping, b.damping)
    assert a.mean == b.mean


def test_amplitudes_are_displacements():
    """A held response is its own over ω²; a force gives its receptance, less than at the peak."""
    (held, _) = modes_over_levels([at(x, None, "response") for x in (1.0, 2.0)])
    assert_allclose(held.amplitude, np.array([1.0, 2.0]) * A1, rtol=0.01)
    (forced, _) = modes_over_levels([at(x) for x in (1.0, 2.0)])
    assert np.all(forced.amplitude < np.array([1.0, 2.0]) * A1)
    assert np.all(forced.amplitude > 0.6 * np.array([1.0, 2.0]) * A1)


def test_a_cubic_spring_has_its_size_from_forces_too():
    """Each line has an amplitude of its own; k3 still comes out, and no damping."""
    fit = studied("cubic spring", "force").modes[0].explained
    assert fit.element.name == "cubic spring"
    assert_allclose(fit.values[0] / fit.largest**2, 3e-2 / (16 * A1) ** 2, rtol=0.05)


def test_where_a_slider_gives_way_is_found_from_forces_too():
    """Its curve bends among the lines that are averaged: 4 % off by their mean amplitude alone."""
    k, slip = 0.05, 0.29 * 16 * A1
    study = level_study([at(x, lambda A: slider(A, k, slip), seed=550 + n, noise=3e-3)
                         for n, x in enumerate(LEVELS)])  # fmt: skip
    fit = study.modes[0].explained
    assert fit.element.name == "slider"
    assert_allclose(fit.values * [1, fit.largest], [k, slip], rtol=0.02)


def test_two_poles_of_one_peak_that_leans_are_one_mode():
    """Of tuning draw 504: the lowest level has two of one shape about 40 Hz; all five follow it."""
    b, n = 9.1e-3, 0.6074
    runs = [at(x, lambda A: drag(A, b / (16 * A1) ** n, n), seed=50400 + k, noise=1.2e-3)
            for k, x in enumerate(LEVELS)]  # fmt: skip
    poles = runs[0].modes.frequency
    assert ((poles > 39) & (poles < 41)).sum() > 1
    first, second = modes_over_levels(runs)
    assert first.level.tolist() == second.level.tolist() == list(LEVELS)
    assert_allclose(second.damping, ZETA, rtol=0.02)


@pytest.mark.parametrize("count", [4, pytest.param(100, marks=pytest.mark.slow)])
def test_linear_recordings_never_fire(count):
    for draw in range(count):
        study = level_study([at(x, None, seed=10 * draw + k, noise=0.01)
                             for k, x in enumerate((1.0, 4.0, 16.0))])  # fmt: skip
        assert len(study.modes) == 2
        assert not study.nonlinear, level_notes(study)


def test_what_moves_every_mode_alike_is_a_drift():
    """A warmer object has all frequencies lower by one factor."""
    runs = [at(x, None, seed=k, shift=(d, d))
            for k, (x, d) in enumerate([(1.0, 0.0), (4.0, -4e-3), (16.0, -9e-3)])]  # fmt: skip
    study = level_study(runs)
    assert study.drift
    assert not study.nonlinear
    assert "drifted" in level_notes(study)[0]
    first = [at(x, None, seed=k, shift=(d, 0)) for k, x, d in ((1, 4, -4e-3), (2, 16, -9e-3))]
    alone = level_study([runs[0], *first])
    assert alone.nonlinear
    assert alone.modes[0].signature == "softening"


def test_runs_that_differ_a_little_are_no_nonlinearity():
    """Beyond the noise, within what the same object repeats to."""
    study = level_study([at(1.0, noise=2e-4), at(2.0, seed=1, noise=2e-4, shift=(1.2e-3, 0.0))])
    assert study.modes[0].mode.frequency_moves
    assert study.modes[0].signature == "runs differ"
    assert not study.nonlinear


def test_one_level_says_nothing_and_two_have_a_trend_and_no_element():
    one, kappa = at(1.0), ELEMENTS["slider"][0]
    assert not level_study([one, one]).modes
    assert level_notes(level_study([one, replace(one, level=None)])) == []
    study = level_study([at(1.0, kappa, "response"), at(16.0, kappa, "response", seed=1)])
    first = study.modes[0]
    assert first.signature == "friction"
    assert not first.fits
    assert first.held_out is None
    assert "three levels would show" in level_notes(study)[0]


def test_notes_name_the_mode_that_moves_alone():
    said = level_notes(studied("cubic spring", "response"))
    assert said[0].startswith("nonlinear: natural frequencies change with level: 40")
    assert sum(note.startswith("nonlinear") for note in said) == 1
    calm = level_notes(level_study([at(1.0), at(8.0, seed=1)]))
    assert calm == ["no natural frequency or damping changes with level (1, 8)"]


def test_a_mode_without_partner_is_not_followed():
    """Far away, or of another shape."""
    one = at(1.0)
    far = replace(at(8.0, seed=1), modes=replace(one.modes, poles=one.modes.poles * [1.0, 1.2]))
    assert len(modes_over_levels([one, far])) == 1
    other = one.modes.residues.copy()
    other[1] *= np.array([1.0, -1.0, 1.0])[:, None]
    turned = replace(at(8.0, seed=1), modes=replace(one.modes, residues=other))
    assert len(modes_over_levels([one, turned])) == 1


def test_averages_are_counted_where_the_coherence_states_the_noise():
    """Of n averages (1 - γ²)/(γ² n): the lines' spread is smaller by √n, as that of the poles."""
    one = at(1.0)
    spoken = replace(one.frf, variance=None, coherence=np.full(one.frf.values.shape, 0.9))
    runs = [replace(one, level=x, frf=spoken) for x in (1.0, 2.0)]
    few, many = (modes_over_levels([replace(r, averages=n) for r in runs])[0] for n in (1, 4))
    assert_allclose(few.frequency_sd, 2 * many.frequency_sd, rtol=0.01)
    assert_allclose(few.damping_sd, 2 * many.damping_sd, rtol=0.01)


def test_a_level_without_a_pole_is_passed_over():
    """Nothing was found at the second of three: its neighbours are followed as without it."""
    runs = [at(x, seed=k) for k, x in enumerate((1.0, 4.0, 8.0))]
    none = replace(runs[1], modes=runs[1].modes.sel(np.zeros(2, bool)))
    followed = modes_over_levels([runs[0], none, runs[2]])
    assert [m.level.tolist() for m in followed] == [[1.0, 8.0]] * 2
    assert not modes_over_levels([replace(none, level=0.5), *runs])


def decay(force, seed=0, rate=2000.0, seconds=4.0):
    """Accelerations of a 40 Hz oscillator let go at 1 m/s, its spring's extra force by ``force``.

    Symplectic steps of a quarter sample; 0.1 % noise; a hit before it, so that it is a test.
    """
    w, dt, n = 2 * np.pi * 40, 0.25 / rate, int(rate * seconds)
    p, v, f, out = 0.0, 1.0, 0.0, np.zeros(n)
    for i in range(4 * n):
        a = -2 * 0.003 * w * v - w**2 * (p + f)
        v += dt * a
        f = force(f, p + dt * v, dt * v)
        p += dt * v
        if i % 4 == 0:
            out[i // 4] = a
    out += 1e-3 * np.abs(out).max() * np.random.default_rng(seed).normal(size=n)
    hit = np.zeros(n + 50)
    hit[20:30] = 1.0
    response = np.concatenate([np.zeros(50), out])
    return TimeRecord(hit[None, None], response[None, None], rate, ("1:+Z",), ("1:+Z",))


@pytest.mark.parametrize(
    ("force", "sign"),
    [
        (lambda f, p, dp: 0.0, "linear"),
        (lambda f, p, dp: 2e3 * p**3, "stiffening"),
        (lambda f, p, dp: min(max(f + 0.02 * dp, -6e-6), 6e-6), "friction"),
    ],
)
def test_a_free_decay_falls_through_levels(force, sign):
    """Of one recording: the amplitude is the displacement, the signature that of the element."""
    (found,) = decay_study(ring_downs(decay(force)), "accelerance").modes
    assert found.signature == sign
    assert 1 / (2 * np.pi * 40) * 0.2 < found.mode.amplitude[-1] < 1.05 / (2 * np.pi * 40)
    fit = found.explained
    if sign == "stiffening":
        assert_allclose(fit.values[0] / fit.largest**2, 2e3, rtol=0.1)
    if sign == "friction":
        assert fit.element.name == "slider"
        assert_allclose(fit.values * [1, fit.largest], [0.02, 3e-4], rtol=0.1)


def test_a_neighbour_that_beats_is_no_nonlinearity():
    """Two linear modes within a bandwidth: what is filtered out of their decay swells and sinks."""
    t = np.arange(8000) / 2000
    rings = [np.exp(-0.006 * w * t) * np.sin(w * t) for w in 2 * np.pi * np.array([40.0, 40.3])]
    one = decay(lambda f, p, dp: 0.0)
    beating = np.concatenate([np.zeros(50), rings[0] + 0.6 * rings[1]])
    study = decay_study(ring_downs(replace(one, response=beating[None, None])), "accelerance")
    assert any(m.mode.moves for m in study.modes)
    assert not study.nonlinear


def test_a_neighbour_that_is_rung_into_is_no_sign():
    """The second mode a bandwidth away: linear, it moves only as the peak beside it leans."""
    study = studied("slider", "force")
    first = study.modes[0]
    beside = replace(first.mode, frequency=first.mode.frequency + 0.3,
                     amplitude=first.mode.amplitude / 3)  # fmt: skip
    far = replace(beside, frequency=first.mode.frequency + 20)
    every = [first, replace(first, mode=beside), replace(first, mode=far)]
    assert [_overlapped(m, every) for m in every] == [False, True, False]


@pytest.mark.parametrize(
    ("control", "kind"),
    [("force", "share"), *(pytest.param(*one, marks=pytest.mark.slow)
                           for one in (("response", "floor"), ("force", "share, unsaid")))],
)  # fmt: skip
def test_intervals_of_a_linear_object_hold_its_poles_at_every_level(control, kind):
    """95 of 100 of the table's rows, three standard deviations of such a share granted.

    What the lowest level is not sure of is in every level's: of a constant noise, without it,
    errors are 1.2 times what is stated.
    """
    held, scores = [], []
    for seed in range(585, 588):
        known = structure(seed, 6, 5)
        levels = [
            AtLevel(x, frf, identify(frf), control)
            for k, x in enumerate((1.0, 2.0, 4.0, 8.0))
            for frf in [recording(known, kind, 10 * seed + k, lines=300)[0]]
        ]
        size, zeta = np.abs(known.poles), -known.poles.real / np.abs(known.poles)
        for table in level_tables(level_study(levels)):
            for row in table.rows:
                k = np.abs(size - 2 * np.pi * row.frequency_hz).argmin()
                f = size[k] / (2 * np.pi)
                held += [row.frequency_low_hz < f < row.frequency_high_hz,
                         row.damping_low < zeta[k] < row.damping_high]  # fmt: skip
                scores += [(row.frequency_hz - f) / row.frequency_sd_hz,
                           (row.damping - zeta[k]) / row.damping_sd]  # fmt: skip
                assert 0 < row.damping_low < row.damping < row.damping_high
    assert len(held) > 120
    assert np.mean(held) > 0.95 - 3 * np.sqrt(0.95 * 0.05 / len(held))
    assert np.sqrt(np.mean(np.square(scores))) < 1 + 3 / np.sqrt(2 * len(scores))


def test_a_damping_that_is_hardly_known_has_a_range_of_what_oscillates():
    """ln ζ ± 1.96 σ / ζ, which no σ takes below zero or above critical damping."""
    known, unknown, none = np.array([0.02]), np.array([20.0]), np.array([0.0])
    low, high = damping_range(known, 0.1 * known)
    np.testing.assert_allclose(low * high, known**2)
    np.testing.assert_allclose(np.log(high / low), 0.2 * NORMAL_95)
    assert [x.item() for x in damping_range(known, unknown)] == [0.0, 1.0]
    np.testing.assert_allclose(damping_range(known, none), [known, known])
    np.testing.assert_allclose(damping_range(np.array([1.2]), none)[1], 1.2)


def test_a_number_that_no_data_bound_has_no_upper_end():
    """exp(2 σ) of a logarithm that nothing is known of is infinite, and no fault."""
    unknown = np.full(2, 1e3)
    fit = ElementFit(Element((SLIDER,)), 40.0, 0.01, np.ones(2), unknown, 1.0, 1.0, 9)
    number = _tried(fit).numbers[0]
    assert (number.low, number.value, number.high) == (0.0, 1.0, np.inf)
