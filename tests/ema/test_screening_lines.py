"""Lines that screening needs: all of a short recording, of a long one those of its resonances."""

import numpy as np
from tests.builders.modal_frfs import modal_frf

from chladni.ema.identification import identify
from chladni.ema.recording_screening import strong_modes
from chladni.ema.screening_lines import screening_lines
from chladni.ema.shapes import lines_per_bandwidth
from chladni_evidence.identification_evidence import held_against, recording, structure


def test_of_a_short_recording_all_lines_are_taken() -> None:
    frf, _ = recording(structure(580), "share", 580)
    assert screening_lines(frf).all()


def test_a_twentieth_of_the_lines_shows_every_mode() -> None:
    """No mode missed, none invented; four lines in each half-bandwidth, two where it is ragged."""
    known = structure(581)
    frf, variance = recording(known, "floor, unsaid", 581, lines=20_000)
    use = screening_lines(frf)
    assert use.sum() < 1000
    found = identify(frf, use=use)
    told = held_against(known, frf, variance, found)
    assert (told.missed, told.invented) == (0, 0)
    assert np.abs(told.frequency).max() < 1e-3
    strong = strong_modes(found)
    assert strong.order == len(known.inside)
    assert lines_per_bandwidth(strong, frf.frequency[use]).min() > 2


def test_resonances_as_narrow_as_the_lines_are_apart_keep_theirs() -> None:
    """However long the recording: three lines about each peak, no fewer than at full length."""
    f = np.linspace(10.0, 2000.0, 6000)
    hertz = np.array([301.0, 777.7, 1500.2])
    frf = modal_frf(f, hertz, np.random.default_rng(582).normal(size=(30, 3)), 1e-3)
    use = screening_lines(frf)
    assert use.sum() < 1000
    for one in hertz:
        assert use[np.abs(f - one).argsort()[:3]].all()
