"""Samples of a study on its page: each column by its own name, each gap a gap."""

import json

import numpy as np

from chladni.report import live_samples


def test_columns_of_one_label_stay_apart():
    """Long names are shortened for the page and may look alike."""
    x = np.arange(3.0)
    made = live_samples.samples({"a": x, "b": 2 * x}, {"a": "x…y", "b": "x…y"}, {"b": 4.0}, {"a"})
    first, second = made["columns"]
    assert (first["values"], second["values"]) == ([0, 1, 2], [0, 2, 4])
    assert (first["nominal"], second["nominal"]) == (None, 4)
    assert (first["log"], second["log"]) == (True, False)


def test_a_large_study_is_cut_and_a_failed_sample_is_a_gap():
    y = np.ones(live_samples.MOST + 5)
    y[1] = np.nan
    made = live_samples.samples({"f": y}, {"f": "f"}, {})
    assert len(made["number"]) == len(made["columns"][0]["values"]) == live_samples.MOST
    assert made["columns"][0]["values"][1] is None


def test_indices_keep_their_intervals_and_have_none_where_there_is_none():
    d = np.array([0.5, np.nan])
    made = live_samples.indices({"f": {"total": (d, d / 2), "sigma": (d, None)}}, ["a", "b"], "x")
    total, sigma = made["results"][0]["series"]
    assert total["half"] == [0.25, None]
    assert sigma["half"] is None
    json.dumps(made, allow_nan=False)
