"""The concealed evidence on the virtual bench: what the lab believes, what it does not know."""

import numpy as np
import pytest

from chladni.case import load_case
from chladni_evidence.bench_of_structure import panel_bench
from chladni_evidence.evidence_sets import Order
from chladni_evidence.made_case import made_case, write_case


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def bench():
    return panel_bench("panel", 548)


@pytest.fixture(scope="module")
def made(bench, kept):
    names = ("independent noise", "stepped-sine", "burst-random")
    return {n: made_case(bench, "point-mass", 548, "fine", kept, n) for n in names}


def test_the_same_article_is_tested_in_every_way(made):
    """Truth and weighed mass are those of one article; only the recording differs."""
    plain = made["independent noise"]
    for name, case in made.items():
        assert case.truth["value"] == plain.truth["value"]
        assert case.mass == pytest.approx(plain.mass, rel=3e-3)
        assert case.truth.get("recorded_by", "independent noise") == name
        assert (case.benched is None) == (case is plain)


def test_two_excitations_of_one_article_agree(made):
    """Same sensors, same places: what is left between them is transients, leakage and noise."""
    sine, burst = (made[n].frf for n in ("stepped-sine", "burst-random"))
    f = np.geomspace(60, 300, 200)
    H = [
        np.array([np.interp(f, x.frequency, np.abs(x.values[:, k, 0])) for k in range(20)])
        for x in (sine, burst)
    ]
    assert np.median(np.abs(np.log10(H[1] / H[0]))) < 0.01


def test_a_case_of_the_bench_is_what_a_lab_hands_over(made, tmp_path):
    """Coherence, averages, masses of sensors; the truth elsewhere."""
    write_case(made["burst-random"], tmp_path / "case", tmp_path / "sealed.json")
    case = load_case(tmp_path / "case")
    assert case.frfs[0].coherence is not None
    assert case.frfs[0].variance is not None
    assert sum(kg for _, kg in case.carried) > 0.09
    text = (tmp_path / "case" / "case.toml").read_text()
    assert "point-mass" not in text


def test_what_has_a_law_of_its_own_keeps_its_noise(bench, kept):
    """A rotor's torque depends on frequency by itself: no modes of a structure say it."""
    case = made_case(bench, "rotor", 548, "fine", kept, "stepped-sine")
    assert case.benched is None
    assert "recorded_by" not in case.truth


def test_an_order_says_how_it_is_recorded():
    assert Order("panel", "nothing", 548, "fine").recorder == "independent noise"
