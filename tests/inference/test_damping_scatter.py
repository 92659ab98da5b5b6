"""Uneven damping: uniform p where modes scatter as those of one structure, small where some rub."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import kstest

from chladni.inference.adequacy import FitTest, _evenly_damped
from chladni.inference.damping_scatter import (
    FEWEST,
    LOG_SD,
    SCATTER,
    ModalDamping,
    _statistics,
    modal_damping,
)

FITS = FitTest(True, 0.4, "it fits", "everywhere")
TAILGATES = (  # Echaniz Granado (2015), table 6
    (114, 82, 64, 37, 81, 71, 71, 74, 90, 126, 110, 77, 56, 60),
    (121, 89, 55, 68, 74, 63, 76, 77, 89, 123, 99, 49, 47, 50),
    (103, 104, 63, 53, 85, 63, 84, 109, 92, 126, 110, 46, 39, 56),
)


def damped(ratio, sd=0.03):
    ratio = np.asarray(ratio, float)
    return ModalDamping(np.linspace(30, 300, len(ratio)), ratio, np.full(len(ratio), sd))


def test_each_statistic_is_uniform_where_modes_scatter_as_believed():
    rng = np.random.default_rng(7)

    def drawn(count):
        sd = SCATTER * np.exp(LOG_SD * rng.normal(size=(count, 1)))
        return _statistics(sd * rng.normal(size=(count, 14)))

    own = drawn(2000)
    for k, seen in enumerate(drawn(300).T):
        p = [(own[:, k] >= value).mean() for value in seen]
        assert kstest(p, "uniform").statistic < 1.63 / np.sqrt(300)  # 1 %


@pytest.mark.parametrize("ratios", TAILGATES)
def test_real_tailgates_are_damped_evenly(ratios):
    assert _evenly_damped(FITS, damped(1e-4 * np.array(ratios))).passes


def test_a_few_modes_damped_ten_times_are_said_with_their_frequencies():
    ratio = 1e-4 * np.array(TAILGATES[0])
    ratio[[1, 2]] *= 10
    found = _evenly_damped(FITS, damped(ratio))
    assert not found.passes
    assert "2 of 14 modes" in found.what
    assert "6.4 % to 8.2 %" in found.what
    assert "50.77, 71.54 Hz" in found.where
    assert found.statistics[-1].value > found.statistics[-1].high


def test_lightly_damped_modes_are_no_reason():
    """Nothing that is missing takes damping away."""
    ratio = 1e-4 * np.array(TAILGATES[0])
    ratio[3] /= 30
    assert _evenly_damped(FITS, damped(ratio)).passes


def test_a_worse_test_of_fit_keeps_its_words():
    worse = FitTest(False, 1e-6, "it does not fit", "there")
    ratio = np.r_[np.full(10, 0.005), 0.1]
    assert _evenly_damped(worse, damped(ratio)).what == "it does not fit"


def test_too_few_modes_have_no_say():
    assert _evenly_damped(FITS, damped([0.001] * (FEWEST - 2) + [0.2])) is FITS


def test_clutter_and_uncertain_modes_have_no_say():
    identified = SimpleNamespace(
        frequency=np.array([10.0, 50, 60, 70, 80, 90]),
        damping=np.array([0.01, 0.01, 0.2, 0.01, 0.3, -0.1]),
        damping_sd=np.array([1e-4, 1e-4, 0.1, 1e-4, 1e-4, 1e-4]),
        relative_delta_chi2=np.array([1e4, 1e4, 1e4, 1e4, 5.0, 1e4]),
    )
    assert modal_damping(identified, 20.0, 100.0).frequency.tolist() == [50.0, 70.0]
