"""The bench's recording is the exact response, and its noise is the noise it says."""

import numpy as np
import pytest

from chladni_bench import noisy_frf
from chladni_bench.noisy_frf import MeasurementChain

F = np.linspace(5.0, 200.0, 4000)
HERTZ = np.array([30.0, 71.0, 140.0])
OUT = np.array([[1.0, -0.5, 0.8], [0.2, 0.9, -1.1]])
IN = np.array([[0.7, 0.4, 0.3]])


def recorded(chain, seed=0):
    rng = np.random.default_rng(seed)
    return noisy_frf.recorded(exact(), F, chain, rng, ("1:+Z", "2:+Z"), ("1:+Z",))


def exact():
    """Accelerance by the sum over modes, written out."""
    w, wr = 2 * np.pi * F, 2 * np.pi * HERTZ
    H = np.zeros((len(F), 2, 1), complex)
    for r in range(3):
        h = -(w**2) / (wr[r] ** 2 - w**2 + 2j * 0.01 * wr[r] * w)
        H += h[:, None, None] * np.outer(OUT[:, r], IN[:, r])
    return H


def test_without_noise_it_is_the_response():
    found = recorded(MeasurementChain(0.0, 0.0))
    np.testing.assert_array_equal(found.values, exact())
    assert found.quantity == "accelerance"
    np.testing.assert_array_equal(found.variance, 0.0)


@pytest.mark.parametrize(
    "chain",
    [MeasurementChain(0.02, 0.0), MeasurementChain(0.0, 0.01), MeasurementChain(0.01, 0.003)],
)
def test_noise_is_what_it_says(chain):
    """E|e|² is the variance given: over 8000 numbers their mean ratio is 1 within 5 sigma."""
    found = recorded(chain)
    ratio = np.abs(found.values - exact()) ** 2 / found.variance
    assert ratio.mean() == pytest.approx(1.0, abs=5 / np.sqrt(ratio.size))


def test_noise_levels():
    """``noise`` of each line's magnitude, ``floor`` of the channel's rms."""
    H = exact()
    np.testing.assert_allclose(
        np.sqrt(recorded(MeasurementChain(0.02, 0.0)).variance), 0.02 * np.abs(H), rtol=1e-9
    )
    rms = np.sqrt((np.abs(H) ** 2).mean(axis=0, keepdims=True))
    np.testing.assert_allclose(
        np.sqrt(recorded(MeasurementChain(0.0, 0.01)).variance),
        np.broadcast_to(0.01 * rms, H.shape),
        rtol=1e-9,
    )


def test_noise_has_no_preferred_phase():
    """Real and imaginary part of the noise share its variance and are uncorrelated."""
    found = recorded(MeasurementChain(0.01, 0.003))
    e = ((found.values - exact()) / np.sqrt(found.variance)).ravel()
    bound = 5 / np.sqrt(e.size)
    assert abs(np.mean(e**2)) < 1.5 * bound
    assert abs(np.mean(e)) < bound


def test_seeds_differ():
    a, b = recorded(MeasurementChain(), 0), recorded(MeasurementChain(), 1)
    assert np.all(a.values != b.values)
