"""Many channels or lines: band by band is as good as all at once."""

from itertools import pairwise

import numpy as np
import pytest

from chladni.ema import identification, pole_search_by_parts
from chladni.ema.identification import identify, pole_data
from chladni.ema.pole_search_by_parts import core_bands, few_channels
from chladni_evidence.identification_evidence import held_against, recording, structure


@pytest.mark.parametrize("kind", ["share", "floor, unsaid"])
def test_bands_find_what_the_whole_finds(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Three bands, forty channels in thirty-two combinations: as sure as the fit of all at once.

    At the ends of the band the two may stand for what rings beyond by other poles, so that there
    only the truth is asked.
    """
    known = structure(7, 9, 40)
    frf, variance = recording(known, kind, 7, lines=900)
    whole = identify(frf)
    monkeypatch.setattr(identification, "is_large", lambda data: True)
    monkeypatch.setattr(pole_search_by_parts, "PER_BAND", 300)
    found = identify(frf)
    told = held_against(known, frf, variance, found)
    assert (told.missed, told.invented) == (0, 0)
    scores = np.concatenate([told.z_frequency, told.z_damping])
    assert np.sqrt((scores**2).mean()) < 1 + 3 / np.sqrt(2 * len(scores))
    here, there = (one.sel(np.flatnonzero(one.inside)[1:-1]) for one in (found, whole))
    assert (np.abs(here.frequency - there.frequency) < there.frequency_sd).all()
    np.testing.assert_allclose(here.frequency_sd, there.frequency_sd, rtol=0.25)
    assert found.chi == pytest.approx(whole.chi, rel=0.02)


def test_combinations_of_channels_carry_the_modes_and_the_noise() -> None:
    """Weights are those of the noise: what is left of the combinations has unit variance."""
    known = structure(8, 6, 60)
    frf, _ = recording(known, "floor", 8, lines=500)
    data, _ = pole_data(frf, frf.frequency > 0)
    few = few_channels(data)
    data_scale = (2 * np.pi * frf.frequency[-1]) ** 2
    clean = known.accelerance(frf.frequency) / data_scale
    h = np.sqrt((data.w**2).mean(axis=0))
    V, *_ = np.linalg.lstsq(h * data.y, few.y, rcond=None)
    fresh = recording(known, "floor", 80, lines=500)[0].values[:, :, 0] / data_scale
    noise = few.w * ((h * (fresh - clean)) @ V)  # V knows the noise it was made of
    assert (np.abs(noise) ** 2).mean() == pytest.approx(2.0, rel=0.05)
    left = h * clean - (h * clean) @ V.real @ V.real.T
    assert np.linalg.norm(left) < 1e-2 * np.linalg.norm(h * clean)


def test_bands_are_cut_between_resonances() -> None:
    known = structure(9, 12, 10)
    frf, _ = recording(known, "floor", 9, lines=4000)
    data, _ = pole_data(frf, frf.frequency > 0)
    bands = core_bands(data)
    assert bands[0][0] == 0
    assert bands[-1][1] == 4000
    assert all(a[1] == b[0] for a, b in pairwise(bands))
    for low, _ in bands[1:]:
        gap = np.abs(2 * np.pi * frf.frequency[low] - np.abs(known.poles))
        assert (gap > 2 * np.abs(known.poles.real)).all()
