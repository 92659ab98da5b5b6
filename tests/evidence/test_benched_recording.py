"""The concealed evidence on the virtual bench: what the lab believes, what it does not know."""

import numpy as np
import pytest

from chladni.case import load_case
from chladni_evidence.article_modes import ArticleModes
from chladni_evidence.bench_of_structure import form_bench
from chladni_evidence.benched_recording import can_be_benched
from chladni_evidence.evidence_sets import Order
from chladni_evidence.hidden import Hidden
from chladni_evidence.made_case import made_case, write_case
from chladni_evidence.response_of_article import Coupling


@pytest.fixture(scope="module")
def bench():
    return form_bench("tube frame", 548)


@pytest.fixture(scope="module")
def made(bench, tmp_path_factory):
    kept = tmp_path_factory.mktemp("cache")
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
    f = sine.frequency[(sine.frequency > 30) & (sine.frequency < burst.frequency[-1])]
    H = [np.stack([np.interp(f, x.frequency, np.abs(x.values[:, k, 0]))
                   for k in range(len(x.outputs))]) for x in (sine, burst)]  # fmt: skip
    assert np.median(np.abs(np.log10(H[1] / H[0]))) < 0.01


def test_a_case_of_the_bench_is_what_a_lab_hands_over(made, tmp_path):
    """Coherence, averages, masses of sensors; the truth elsewhere."""
    write_case(made["burst-random"], tmp_path / "case", tmp_path / "sealed.json")
    case = load_case(tmp_path / "case")
    assert case.frfs[0].coherence is not None
    assert case.frfs[0].variance is not None
    n = len(case.outputs.labels)
    assert sum(kg for _, kg in case.sensor_masses) == pytest.approx(
        0.005 * n + 0.4 * 0.023, rel=0.3
    )
    assert "point-mass" not in (tmp_path / "case" / "case.toml").read_text()


def test_what_has_a_law_of_its_own_keeps_its_noise(bench):
    """A rotor's torque depends on frequency by itself: no modes of a structure say it."""
    none = ArticleModes(np.ones(1), np.zeros(0, int), np.zeros((0, 3, 1)), np.zeros((1, 1)))
    rotor = Coupling(np.array([0]), np.ones((1, 1, 3)), lambda s: s[:, None, None])
    assert can_be_benched(Hidden(bench.deck, {}), none)
    assert not can_be_benched(Hidden(bench.deck, {}, (rotor,)), none)
    lossy = ArticleModes(none.frequency, none.rows, none.shapes, np.ones((1, 1)))
    assert not can_be_benched(Hidden(bench.deck, {}), lossy)


def test_an_order_is_recorded_as_before_unless_it_says_so():
    assert Order("panel", "nothing", 548, "fine").recorder == "independent noise"
