"""Every public object fits a screen: what a notebook prints of it is bounded."""

import inspect

import numpy as np
import pytest

import chladni
from chladni.errors import ChladniError
from chladni.results import DrawnPicture, Result, ShownBriefly

LONGEST = 2000  # characters of a repr, and of the HTML of data
SHORT = {"BenchSettings", "EstimateSettings", "PlanSettings", "PoleChoice", "StudySettings"}


def test_every_public_class_shows_itself_briefly():
    """A class is data that show themselves, a result, or settings whose defaults are short."""
    kinds = {n: v for n in chladni.__all__ if inspect.isclass(v := getattr(chladni, n))}
    kinds = {n: v for n, v in kinds.items() if not issubclass(v, ChladniError | dict)}
    long = {n for n, v in kinds.items() if not issubclass(v, Result | ShownBriefly)}
    assert long == SHORT
    assert all(len(repr(kinds[name]())) < LONGEST for name in SHORT)


@pytest.fixture(scope="module")
def objects(case):
    model = chladni.load(case)
    modal = model.normal_modes(8)
    up = case.frfs[0].outputs[0]
    many = np.arange(1.0, 500.0)
    return {
        "case": case,
        "words": case.asked,
        "deck": case.deck,
        "assembly": case.assembly,
        "shells": case.assembly.shells,
        "places": case.outputs,
        "recording": case.recordings[0],
        "responses": case.frfs[0],
        "model": model,
        "modes": modal,
        "state space": model.state_space(up, up, 4),
        "poles": chladni.PoleTable(many, many, many, many.astype(int), ("",) * len(many)),
        "sensor": chladni.Sensor("1:+Z", 1, direction=np.array([0.0, 0.0, 1.0])),
        "picture": DrawnPicture(bytes(100_000)),
    }


def test_no_object_prints_its_arrays(objects):
    long = {n: len(repr(x)) for n, x in objects.items() if len(repr(x)) > LONGEST}
    assert not long
    tables = {n: x._repr_html_() for n, x in objects.items() if isinstance(x, ShownBriefly)}
    assert len(tables) >= len(objects) - 2
    assert all(html.count("<tr>") <= 30 for html in tables.values())
    assert all(len(html) < 4 * LONGEST for html in tables.values())


def test_sizes_and_types_are_named(objects):
    responses = objects["responses"]
    assert str(responses.values.shape) in repr(responses)
    assert "x Recording" in repr(objects["case"])
    assert repr(objects["picture"]) == "<DrawnPicture: a PNG of 100000 bytes>"


def test_html_escapes_a_hostile_name():
    html = chladni.Sensor("<script>alert(1)</script>")._repr_html_()
    assert "<script>" not in html
