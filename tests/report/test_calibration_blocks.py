"""What a calibration knows survives its JSON, whichever of its parts are there."""

import json
from dataclasses import replace

import pytest

from chladni.inference.calibration_result import (
    ArticleParameter,
    ArticleValue,
    Basin,
    CalibrationStudy,
    PosteriorSample,
    RegionShare,
    RegionsToFree,
    SampledParameter,
    WorstMode,
)
from chladni.report.blocks import Code, Table
from chladni.report.calibration_blocks import study_sections
from chladni.report.typed_fields import as_data, made

SAMPLE = PosteriorSample(
    (SampledParameter("E of a", "Pa", 2.0, 1.9, 2.1, 2.0, 1.9, 2.2, 0.9, 5.0, 900.0),),
    16, 400, 30, True, 6.0, ((0.1,), (0.2,)), (0.15,), ((0.01,),),
)  # fmt: skip
ARTICLES = (
    ArticleParameter("t of a", "m", 1e-3, 9e-4, 1.1e-3, 0.01, 0.0, None,
                     (ArticleValue("A", 1e-3, 9e-4, 1.1e-3, 0.0, 0.002),)),
)  # fmt: skip
NEXT = RegionsToFree(
    (WorstMode(100.0, 110.0),), (WorstMode(50.0, 50.0, 0.99),),
    (RegionShare("a", 0.6, 0.2, 0.8, 0.9), RegionShare("b", 0.4, 0.8, 0.9, 0.6, "free")),
)  # fmt: skip
STUDY = CalibrationStudy(sample=SAMPLE, articles=ARTICLES, guidance=NEXT)


@pytest.mark.parametrize("study", [CalibrationStudy(), STUDY])
def test_a_study_is_read_as_it_was_written(study):
    assert made(CalibrationStudy, json.loads(json.dumps(as_data(study)))) == study


def sections(study):
    return {s.title: s.blocks for s in study_sections(study)}


def test_each_part_of_a_study_has_its_table():
    found = sections(STUDY)
    assert "900" in found["Uncertainty of the values"][0].rows[0]
    assert "not bounded" in found["Articles fitted together"][0].rows[0][2]
    table, _, words = found["Regions to free next"]
    assert isinstance(table, Table)
    assert isinstance(words, Code)
    assert words.lines == ("[[parameter]]", 'parts = ["a"]', 'field = "E"')
    assert not any(sections(CalibrationStudy()).values())


def test_a_basin_without_starts_is_explained_and_a_stiffness_beyond_a_doubling_is_a_factor():
    far = replace(NEXT, regions=(RegionShare("doubler", 0.6, 0.2, 2966.48, 0.9),))
    found = sections(CalibrationStudy(basins=(Basin(0.0, 0, ()),), starts=12, guidance=far))
    (basins,), (regions, *_) = found["Basins of the fit"], found["Regions to free next"]
    assert basins.rows[0][1] == "0"
    assert "where it alone ended, starts is 0" in basins.caption
    assert regions.rows[0][3] == "2966 times"


def test_chains_that_have_not_converged_say_so_on_the_page():
    short = replace(STUDY, sample=replace(SAMPLE, converged=False))
    caption = sections(short)["Uncertainty of the values"][0].caption
    assert "not converged" in caption
    assert "not converged" not in sections(STUDY)["Uncertainty of the values"][0].caption
