"""Several articles of one design: common mean, spread of units, values of each."""

import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.plate_recordings import T, a_case, record

import chladni
from chladni.effects.calibration_parameters import SHEET, SPREAD
from chladni.model.free_parameter import FreeParameter
from chladni.report.diagnosis_folder import write_diagnosis
from chladni.report.diagnosis_json import read_diagnosis

THICKER = {"A": 0.0, "B": 0.006, "C": -0.008}


@pytest.fixture(scope="module")
def three(tmp_path_factory):
    """Plates 1.5 % thicker than their deck, and by other amounts; E and rho as in the deck.

    Their material is little known, so that the values are, too.
    """
    folder = tmp_path_factory.mktemp("articles")
    mass = [record(folder / f"{name}.npz", t=T * np.exp(away), seed=k)
            for k, (name, away) in enumerate(THICKER.items())]  # fmt: skip
    case = a_case(folder, mass[0], *({"file": f"{n}.npz", "article": n} for n in THICKER))
    free = (FreeParameter(q, q, ("plate",), SPREAD[q], positions=(0,)) for q in SHEET)
    case = replace(case, parameters=tuple(free))
    return case, chladni.calibrate(case)


def test_differences_of_articles_are_known_far_better_than_their_values(three):
    by_name = {p.name: p for p in three[1].study.articles}
    t, rho = by_name["t of plate"], by_name["rho of plate"]
    true = np.array(list(THICKER.values()))
    away, reach = (np.array([getattr(a, k) for a in t.articles]) for k in ("away", "reach"))
    assert [a.article for a in t.articles] == list(THICKER)
    assert (np.abs(away - (true - true.mean())) < reach).all()
    assert (reach < 0.2 * np.log(t.high / t.low)).all()
    assert t.spread_low < np.std(true, ddof=1) < t.spread_high
    assert rho.spread_low == 0.0


def test_the_mean_is_that_of_the_articles(three):
    t = next(p for p in three[1].study.articles if p.name == "t of plate")
    assert t.low < T * np.exp(np.mean(list(THICKER.values()))) < t.high
    for a in t.articles:
        assert a.low < a.value < a.high
        assert_allclose(a.value, t.mean * np.exp(a.away), rtol=1e-6)


def test_one_article_is_what_it_was(three):
    """No further article adds anything, and further ones change nothing of the first's fit."""
    case, found = three
    calibrated = chladni.calibrate(replace(case, recordings=case.recordings[:1]))
    assert calibrated.study.articles == ()
    assert found.study.names == calibrated.study.names
    values = {c.where: c.estimate.value for c in found.calibrated}
    for p in found.study.articles:
        assert values[p.name] == pytest.approx(p.articles[0].value, rel=0.01)


def test_the_folder_shows_the_articles(three, tmp_path):
    case, found = three
    write_diagnosis(tmp_path, case, found, pictures=True)
    told = json.loads((tmp_path / "calibration.json").read_text())["articles"]
    assert [a["article"] for a in told[0]["articles"]] == list(THICKER)
    assert read_diagnosis(tmp_path).study.articles == found.study.articles
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Articles fitted together" in page
    assert (tmp_path / "articles.png").exists()
