"""The thesis' test on a small article: its tables, cords, doubles, and all that is written."""

import numpy as np
import pytest

from chladni.ema.identification import Identified
from chladni.io.tables.read_tables import read_recordings
from chladni.progress import silent
from chladni_bench.article_scatter import DAMPING, FREQUENCIES
from chladni_bench.bench_rig import bench_rig
from chladni_bench.sine_schedule import Stage
from chladni_evidence.thesis import identified_chapter
from chladni_evidence.thesis_bench import (
    WAYS,
    Subject,
    as_damped,
    frf_poles,
    rig_on_cords,
    thesis_test,
)
from chladni_evidence.thesis_desk import Desk, tailgate_story
from chladni_evidence.thesis_modes import doubled, errors, spread
from chladni_evidence.thesis_page import RANGES
from chladni_evidence.thesis_scores import MODES_A

SHORT = (Stage(10, 50, 60, 10), Stage(50, 200, 60, 80, share=0.7))


def subject(article):
    nodes = {k: np.array([0.1 * k, 0.0, 0.0]) for k in (1, 2, 3, 9)}
    return Subject(article, drive=0, at_cord=1, nodes=nodes)


@pytest.fixture
def tested(small):
    return thesis_test(subject(small()), np.random.default_rng(565), SHORT, resolution=0.5)


def test_the_thesis_own_percentages():
    """Its tables follow from (largest - smallest) / mean, but for one slip of its own."""
    found = 100 * spread(FREQUENCIES.T)
    for k, (low, high, printed) in enumerate(RANGES):
        at = (low <= FREQUENCIES[0]) & (FREQUENCIES[0] < high)
        assert (abs(found[at].max() - printed) < 0.06) == (k < 3)
    printed = np.array([16, 23, 15, 59, 13, 12, 17, 38, 3, 2, 11, 50, 36, 18])
    rounding = 100 * 2 * 0.5e-4 / DAMPING.mean(axis=0) + 0.5  # both ends, and the print
    off = np.abs(100 * spread(DAMPING.T) - printed)
    assert (off <= rounding).sum() >= 10
    assert off.max() < 5


def test_poles_of_an_frf_are_zeros_of_its_force(small, ideal):
    """The shaker is not among them; under a hammer they are those of all that hangs together."""
    rig = bench_rig(small(), ideal())
    p = frf_poles(rig.measured)
    F, Y = np.split(np.abs(rig.measured.response(p)[:, :, 0]), [1], axis=1)
    assert (F[:, 0] < 1e-6 * Y.max(axis=1)).all()
    hammer = bench_rig(small(), ideal(shaker=None))
    poles = hammer.model.poles
    np.testing.assert_allclose(
        frf_poles(hammer.measured), poles[np.argsort(np.abs(poles))], rtol=1e-6
    )


def test_first_modes_have_the_damping_of_table_6(small):
    article = as_damped(small(damping=0.5))
    elastic = article.damping[article.elastic]
    assert len(elastic) < DAMPING.shape[1]
    np.testing.assert_allclose(elastic, np.exp(np.log(DAMPING).mean(axis=0))[: len(elastic)])


def identified(poles, shapes):
    r = len(poles)
    none = np.zeros((shapes.shape[1], 1))
    return Identified(
        np.array(poles), shapes[:, :, None], none, none, np.zeros(r), np.zeros(r), np.ones(r), 1.0,
        tuple(f"{k}:+Z" for k in range(1, len(none) + 1)), ("1:+Z",), "accelerance", (1.0, 100.0),
    )  # fmt: skip


def test_a_mode_found_twice_is_kept_once():
    """The weaker of two alike within a bandwidth goes; another shape or another place stays."""
    w = 2 * np.pi * np.array([50.0, 50.2, 50.3, 70.0])
    p = w * (-0.01 + 1j)
    one, other = np.array([1.0, 2.0, 3.0]), np.array([3.0, 0.0, -1.0])
    found = identified(p, np.array([one, 0.2 * one, other, 0.1 * one]).astype(complex))
    assert doubled(found).tolist() == [False, True, False, False]
    off, zeta = errors(found, p * 1.0001)
    np.testing.assert_allclose(off, 1 / 1.0001 - 1)
    np.testing.assert_allclose(zeta, 0, atol=1e-9)


def test_hands_and_rubber_take_the_cords_away(small):
    """Free cords ring near where they are tapped; held none does; rubber damps all of them."""
    rings = np.array([23.0, 24.5])
    poles = {way: frf_poles(rig_on_cords(small(), rings, way).measured) for way in WAYS}
    f = {way: np.abs(p) / (2 * np.pi) for way, p in poles.items()}
    for ring in rings:
        assert np.abs(f["free"] / ring - 1).min() < 0.02
    assert not ((f["held"] > 15) & (f["held"] < 27)).any()
    near = poles["rubber"][(f["rubber"] > 15) & (f["rubber"] < 27)]
    assert (-near.real / np.abs(near) > 0.2).all()


def test_everything_is_written(tested, tmp_path):
    """A table and a figure of each number, recordings that read back, and true poles found."""
    desk = Desk(tmp_path, tailgate_story(0.03))
    chapter = identified_chapter(desk, tested.subject, tested, silent)
    titles = [s.title for s in chapter.sections]
    for name in (
        "Table 3",
        "Table 4",
        "Table 5",
        "Table 6",
        *(f"Figure {k}" for k in (19, *range(23, 28))),
    ):
        assert any(t.startswith(f"{name}:") for t in titles), name
    found = chapter.numbers
    f = np.array(found["table_5"]["ours_hz"], float)
    assert chapter.lead.startswith(f"{len(f)} modes of tailgate A")
    assert found["error_against_bench"]["frequency"] < 1e-3
    a = np.sort(tested.articles[0].frequency)
    assert len(f) >= (a[a > 20] < 150).sum() - 1
    (back,) = read_recordings(tmp_path / "sine_A.uff")
    np.testing.assert_allclose(back.frf.values, tested.stepped[0].frf.values, rtol=1e-6)
    with np.load(tmp_path / MODES_A) as kept:
        np.testing.assert_allclose(kept["frequency"], f[:, 0])
