"""A case is what a user could have; the truth lies elsewhere and its hash was said before."""

import json
from functools import partial

import numpy as np
import pytest

from chladni.case import load_case
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import FRF
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni_evidence.bench_of_structure import form_bench
from chladni_evidence.made_case import (
    GROWTH,
    KINDS,
    TRIES,
    MadeCase,
    made_case,
    seal_hash,
    write_case,
)
from chladni_specimens.forms import FORMS


@pytest.fixture(scope="module")
def bench():
    return form_bench("tube frame", 500)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def case(bench, kept):
    return made_case(bench, "point-mass", 500, "fine", kept)


@pytest.mark.parametrize("name", FORMS)
def test_every_form_is_a_case(name, tmp_path):
    """Its folder loads, its sensors sit where they should, its band holds 10 to 15 modes."""
    bench = form_bench(name, 501)
    shape = (len(bench.lines), len(bench.outputs), 1)
    values = np.random.default_rng(0).normal(size=shape) + 1j
    frf = FRF(values, bench.lines, bench.outputs.labels, bench.drive.labels, "accelerance")
    write_case(MadeCase(bench, frf, 2.0, {}), tmp_path / "case", tmp_path / "sealed.json")
    read = load_case(tmp_path / "case")
    (recording,) = read.recordings
    assert recording.frf.outputs == bench.outputs.labels
    assert 8 <= len(recording.frf.outputs) <= 30
    np.testing.assert_allclose(recording.frf.values, values, rtol=1e-9)
    np.testing.assert_allclose(read.outputs.points, bench.outputs.points, atol=1e-9)
    np.testing.assert_allclose(read.outputs.directions, bench.outputs.directions, atol=1e-7)
    f = normal_modes(structure(bench.deck).system, 24).frequency
    assert 10 <= ((f > bench.fit[0]) & (f < bench.fit[1])).sum() <= 15


def test_truth_is_never_in_the_folder(case, tmp_path):
    """Neither the seal nor a word of it; its hash is the one that was said."""
    folder, sealed = tmp_path / "cases" / "one", tmp_path / "sealed" / "one.json"
    said = write_case(case, folder, sealed)
    assert sorted(p.name for p in folder.iterdir()) == [
        *("case.toml", "deck.bdf", "recording.uff", "sensors.csv")
    ]
    for path in folder.iterdir():
        text = path.read_text()
        assert not any(kind in text for kind in KINDS if kind not in ("nothing", "calibration"))
    assert said == seal_hash(sealed)
    sealed.write_text(sealed.read_text().replace("point-mass", "suspension"))
    assert said != seal_hash(sealed)


def test_truth_says_how_large(case, bench):
    """Twice the scatter or more, unless it grew all it may; the mass on the balance holds it."""
    truth = case.truth
    enough = truth["moved_by_effect_decades"] >= 2 * min(truth["moved_by_scatter_decades"], 0.15)
    assert enough or truth["size"] == pytest.approx(GROWTH**TRIES)
    plain = mass_properties(bench.deck)[0]
    assert truth["mass_kg"] - truth["value"] == pytest.approx(plain, rel=0.05)
    assert case.mass == pytest.approx(truth["mass_kg"], rel=5 * 5e-4)
    assert json.dumps(truth["values"]["E"])


def test_one_article_a_seed(bench, case, kept):
    """Whatever is hidden, scatter and formulation are those of the seed; another seed differs."""
    made = partial(made_case, bench, mesh="fine", cache=kept)
    same, other = made("suspension", 500), made("nothing", 502)
    assert same.truth["scales"] == case.truth["scales"]
    assert other.truth["scales"] != case.truth["scales"]
    again = made("point-mass", 500)
    np.testing.assert_array_equal(again.frf.values, case.frf.values)
    assert again.mass == case.mass


def test_noise_is_a_hundredth(bench, case, kept):
    """Each line off by 1 % of its magnitude: chi-squared of the variance it states."""
    quiet = made_case(bench, "nothing", 500, "fine", kept)
    loud = made_case(bench, "sensor-fault", 500, "fine", kept)
    at = bench.outputs.labels.index(loud.truth["channel"])
    d = np.delete(loud.frf.values - quiet.frf.values, at, axis=1)
    chi2 = np.mean(np.abs(d) ** 2 / np.delete(2 * quiet.frf.variance, at, axis=1))
    assert chi2 == pytest.approx(1.0, abs=0.06)
