"""Two levels on the bench: with a gap that closes homogeneity fails, and says where; else never."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.ema.recording_screening import screened
from chladni.ema.screening import homogeneity
from chladni.ema.setup import Recording
from chladni_bench.accelerometers import AccelerometerType
from chladni_bench.bench_recording import BenchTest, channels_of, level_for, record
from chladni_bench.bench_rig import BenchSetup, bench_rig
from chladni_bench.drive_signals import pink_rms
from chladni_bench.local_forces import Clearance, CubicSpring, JenkinsSlider
from chladni_bench.sine_schedule import SineLine
from chladni_bench.sine_sweep import swept

BAND = (20.0, 120.0)
ABOUT = (25.0, 32.0)  # the first elastic mode, at 28 Hz
SWEEP = [SineLine(float(f), 40, 20, 1.0) for f in np.geomspace(22, 110, 120)]


def pair(rig, kind, seed, averages=8, resolution=0.25):
    """The same article at half and at twice its level."""
    rng = np.random.default_rng(seed)
    level, channels = level_for(rig, kind, BAND), channels_of(rig, rng)
    found = []
    for factor in (0.5, 2.0):
        test = BenchTest(kind, BAND, factor * level, resolution, averages, sweeps=4)
        if kind == "stepped-sine":
            found.append(swept(rig, test, SWEEP, rng, channels=channels))
        else:
            found.append(record(rig, test, rng, channels=channels))
    return found


@pytest.mark.parametrize("kind", ["burst-random", "multisine", "stepped-sine"])
@pytest.mark.parametrize("noise", [4.4e-5, 2e-2])
def test_a_linear_article_is_homogeneous_whatever_the_noise(small, kind, noise):
    """Of six draws none is called nonlinear, with good sensors and with bad ones."""
    rig = bench_rig(small(damping=0.02), BenchSetup(AccelerometerType(noise=noise)))
    for seed in range(6):
        low, high = (r.frf for r in pair(rig, kind, seed))
        found = homogeneity(low, high)
        assert found.linear, (seed, found.ratio, found.rms)
        assert found.channels == ()
        assert found.bands == ()


def site(small, kind, law_of):
    """An article with a law at its first sensor, sized by how far that moves at half its level."""
    plain = bench_rig(small(damping=0.02))
    level = 0.5 * level_for(plain, kind, BAND)
    f = np.geomspace(*(ABOUT if kind == "stepped-sine" else BAND), 2000)
    x = plain.measured.response(2j * np.pi * f)[:, :2, 0] / (2 * np.pi * f[:, None]) ** 2
    if kind == "stepped-sine":  # of the force that is held, to the crest
        size = float(level * np.abs(x[:, 1] / x[:, 0] / (2 * np.pi * f) ** 2).max())
    else:
        size = level * float(pink_rms(f, x[:, 1]))
    k = 0.3 * 4.0 * (2 * np.pi * 28) ** 2
    article = small(damping=0.02, laws=(law_of(size, k),))
    return replace(article, sites=article.outputs[:1])


@pytest.mark.parametrize(
    "law_of",
    [lambda x, k: CubicSpring(k / (4 * x) ** 2), lambda x, k: JenkinsSlider(k, k * x)],
    ids=["cubic spring", "friction"],
)
def test_what_hardens_or_slips_with_the_level_is_found_and_told_where(small, law_of):
    rig = bench_rig(site(small, "multisine", law_of))
    low, high = (r.frf for r in pair(rig, "multisine", 1, 5, 0.5))
    found = homogeneity(low, high)
    assert not found.linear
    assert found.channels
    assert min(band[0] for band in found.bands) < 35  # the first mode moves most


def test_a_gap_that_closes_at_the_higher_level_only_is_told_with_channels_and_band(small):
    """Stepped sine: it is reached about the resonances, so that is where the levels differ."""
    article = site(small, "stepped-sine", lambda x, k: Clearance(1.5 * x, 3 * k))
    few = [SineLine(float(f), 30, 20, 1.0) for f in np.geomspace(*ABOUT, 16)]
    rig = bench_rig(article)
    rng = np.random.default_rng(0)
    level, channels = level_for(rig, "stepped-sine", BAND), channels_of(rig, rng)
    read = []
    for factor in (0.5, 3.0):
        test = BenchTest("stepped-sine", BAND, factor * level, sweeps=2)
        found = swept(rig, test, few, rng, channels=channels)
        read.append(Recording(f"{factor}.uff", found.frf, level=factor))
        if factor < 1:  # it never closes: the linear article, but for gains and noise
            ideal = found.truth * channels.true[1:] / channels.stated[1:]
            assert np.abs(found.frf.values[:, :, 0] / ideal - 1).max() < 0.02
    (finding,) = (f for f in screened(read[0], None, read[1:]).findings if f.kind == "not linear")
    assert finding.channels
    assert set(finding.channels) <= set(article.output_labels)
    assert f"at {finding.channels[0]}" in finding.text
    assert " Hz: not linear" in finding.text
    levels = homogeneity(read[0].frf, read[1].frf)
    assert all(ABOUT[0] <= a < b <= ABOUT[1] for a, b in levels.bands)
    assert levels.bands
