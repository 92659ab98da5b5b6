"""The second road: poles of a state space of every order, and poles chosen by hand."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.dynamics.frf import FRF
from chladni.ema.identification import evaluate, identify, kept_lines, pole_data
from chladni.ema.mode_indicators import cmif, mif
from chladni.ema.out_of_band_poles import outside
from chladni.ema.pole_fitting import polish
from chladni.ema.pole_search import with_outer_poles_if_close
from chladni.ema.pole_selection import Rule
from chladni.ema.stabilisation import ghosts, prominence, stabilisation
from chladni_evidence.identification_evidence import Known, recording, structure

F = np.geomspace(20, 200, 600)
GAP = F[(F < 60) | (F > 64)]


def exact(known: Known, f: np.ndarray = F) -> FRF:
    labels = tuple(f"{k + 1}:+Z" for k in range(len(known.shapes)))
    return FRF(known.accelerance(f)[:, :, None], f, labels, labels[:1], "accelerance")


def close(found: np.ndarray, due: np.ndarray) -> np.ndarray:
    """Distance of the nearest pole over the half bandwidth of each true one."""
    return np.asarray(np.abs(found[:, None] - due).min(axis=0) / np.abs(due.real))


@pytest.mark.parametrize("f", [F, GAP, np.linspace(20, 200, 600)], ids=["log", "gap", "even"])
@pytest.mark.parametrize("channels", [6, 40])
def test_an_exact_response_has_its_poles_at_its_own_order(f: np.ndarray, channels: int) -> None:
    """Seven modes and no more in the response: fourteen states (McKelvey's theorem)."""
    rng = np.random.default_rng(1)
    w = 2 * np.pi * np.array([25.0, 40.0, 58.0, 59.0, 90.0, 130.0, 180.0])
    known = Known(w * (-0.006 + 1j * np.sqrt(1 - 0.006**2)), rng.normal(size=(channels, 7)))
    found = identify(exact(known, f), states=14)
    assert found.order == 7
    np.testing.assert_allclose(found.poles, known.poles, rtol=1e-9)


def test_both_roads_meet_in_a_noisy_recording() -> None:
    """2 % of noise: the subspace's poles are within half a bandwidth of the other road's."""
    known = structure(2, 8, 10)
    frf, _ = recording(known, "floor", 2, lines=600)
    first, second = identify(frf), identify(frf, states=48)
    assert close(second.poles, first.poles[first.inside]).max() < 0.5
    H = evaluate(second, 2j * np.pi * frf.frequency)
    assert np.abs(H - frf.values).mean() < 0.05 * np.abs(frf.values).mean()


def test_an_order_the_lines_cannot_carry_is_refused() -> None:
    made = exact(structure(0, 8, 5))
    says("order 500: 600 lines carry 2 to 400", identify, made, states=500)


@pytest.fixture(scope="module")
def drawn():
    """The poles that are known, those found in 2 % of noise, and all orders of state space."""
    known = structure(3, 8, 10)
    frf, _ = recording(known, "floor", 3, lines=600)
    found = identify(frf)
    return known, found, stabilisation(frf, found)


def test_a_mode_is_steady_from_its_order_on_and_noise_is_not(drawn) -> None:
    known, found, diagram = drawn
    f, half = (np.abs(x) / (2 * np.pi) for x in (known.inside, known.inside.real))
    real = (np.abs(diagram.frequency[:, None] - f) < half).any(axis=1)
    steady = diagram.kind == "s"
    assert steady[real & (diagram.states > 40)].mean() > 0.8
    assert steady[~real].mean() < 0.2
    assert (diagram.seen(found)[found.inside] > 0.8).all()
    assert not ghosts(found, diagram).any()


def test_a_pole_between_the_peaks_is_struck_out(drawn) -> None:
    """A faint pole put where nothing rings: no peak, in no other order."""
    _, found, diagram = drawn
    k = int(np.diff(found.frequency[found.inside]).argmax()) + int(found.inside.argmax())
    p = np.pi * (found.frequency[k] + found.frequency[k + 1]) * (-0.004 + 1j)
    faint = 1e-3 * found.residues[k : k + 1]
    moved = replace(found, poles=np.append(found.poles, p),
                    residues=np.concatenate([found.residues, faint]))  # fmt: skip
    np.testing.assert_array_equal(ghosts(moved, diagram), np.arange(found.order + 1) == found.order)
    assert (prominence(moved)[:-1][found.inside] > 1).all()


def test_a_dropped_pole_is_gone_and_a_picked_one_is_back() -> None:
    known = structure(4, 8, 6)
    frf, _ = recording(known, "share", 4, lines=600)
    found = identify(frf)
    f = found.frequency[found.inside][3]
    without = identify(frf, drop=[f * 1.001])
    assert without.inside.sum() == found.inside.sum() - 1  # those beside the band are no modes
    assert np.abs(without.frequency - f).min() > found.damping[found.inside].max() * f
    says("no pole within 2 % of 500 Hz; there are", identify, frf, drop=[500.0])
    again = identify(frf, drop=[f], pick=[f * 1.002])
    own, sd = found.frequency[found.inside], found.frequency_sd[found.inside]
    assert again.frequency_sd[again.inside] == pytest.approx(sd, rel=0.1)
    assert (np.abs(again.frequency[again.inside] - own) < sd).all()


def test_indicators_peak_at_the_modes() -> None:
    """Of light damping, CMIF and MIF have a maximum within a line or two of each mode."""
    known = structure(5, 8, 10)
    f = np.geomspace(20, 200, 3000)
    frf = exact(known, f)
    for curve in (cmif(frf)[:, 0], mif(frf)):
        peak = np.flatnonzero((curve[1:-1] > curve[:-2]) & (curve[1:-1] > curve[2:])) + 1
        gap = np.abs(f[peak][:, None] / (np.abs(known.inside) / 2 / np.pi) - 1).min(axis=0)
        assert gap.max() < 0.004
    assert mif(frf).max() <= 1


def test_poles_beside_the_band_take_none_away_that_was_picked() -> None:
    """One in a gap that pays nothing: whoever picked it keeps it."""
    frf, _ = recording(structure(4, 8, 6), "share", 4, lines=600)
    found = identify(frf)
    data, omega_max = pole_data(frf, kept_lines(frf))
    own = found.poles[found.inside] / omega_max
    idle = 0.5 * (np.abs(own[4]) + np.abs(own[5])) * (-0.01 + 1j)
    alone = polish(data, np.append(own, idle), 0.1, iterations=0)
    fit, _ = with_outer_poles_if_close(data, alone, Rule(data.y.shape[1], len(data.s)))
    assert (~outside(data, fit.p)).sum() == len(own) + 1
