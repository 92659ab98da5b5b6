"""Power of a diagnosis: shares over the size of effects, and cases of a wanted size."""

import json

import pytest
from tests.builders.quick_runs import coarse_pictures

from chladni.errors import LabelError
from chladni_evidence import blind_power
from chladni_evidence.blind_make import made_of
from chladni_evidence.blind_power import Share, power, shares
from chladni_evidence.evidence_sets import Order, of_sizes

SIZED = [
    {"effect": "point-mass", "times": t, "outcome": o, "listed": o in ("none", "among")}
    for t, o in ((1.0, "none"), (1.0, "right"), (2.0, "among"), (2.0, "right"), (2.0, "wrong"))
]
NULLS = [
    {"effect": "nothing", "times": None, "outcome": o, "listed": o == "right"}
    for o in ("right", "wrong", "admitted")
]


def test_a_wrong_name_is_no_power_and_a_name_of_nothing_is_an_alarm():
    usual = {"effect": "crack", "times": None, "outcome": "right", "listed": False}
    assert shares([*SIZED, *NULLS, usual]) == [
        Share(0.0, 1, 3, 2), Share(1.0, 1, 2, 2), Share(2.0, 2, 3, 2),
    ]  # fmt: skip


def test_intervals_hold_their_share_and_narrow_as_the_root_of_the_cases():
    few, many = Share(1.0, 8, 10, 8), Share(1.0, 800, 1000, 800)
    assert few.interval[0] < 0.8 < few.interval[1]
    widths = [s.interval[1] - s.interval[0] for s in (few, many)]
    assert widths[0] / widths[1] == pytest.approx(10.0, rel=0.1)
    assert Share(1.0, 0, 5, 0).interval[0] == 0.0
    assert Share(1.0, 5, 5, 5).interval[1] == 1.0


def test_folders_stand_side_by_side(tmp_path, monkeypatch):
    rows, said = {"old": SIZED[:2], "new": [*SIZED, *NULLS]}, []
    monkeypatch.setattr(blind_power, "score", lambda outs, say: rows[outs[0].name])
    with coarse_pictures():
        power([tmp_path / "new", tmp_path / "old"], said.append)
    written = json.loads((tmp_path / "new" / "power.json").read_text())
    assert [s["cases"] for s in written[str(tmp_path / "old")]] == [2]
    assert sum("none" in line.split() for line in said) == 1
    assert (tmp_path / "new" / "power.png").stat().st_size > 1000


def test_effects_without_a_size_are_made_once():
    null, mass = Order("plate", "nothing", 560, "fine"), Order("plate", "point-mass", 560, "fine")
    made = of_sizes([null, mass], [1.0, 2.0])
    assert [(o.kind, o.times) for o in made] == [
        ("nothing", None), ("point-mass", 1.0), ("point-mass", 2.0),
    ]  # fmt: skip
    assert of_sizes([null, mass], []) == [null, mass]


@pytest.mark.parametrize("times", [0.7, 2.0])
def test_an_effect_has_the_size_that_was_ordered(times):
    """Its change of the responses is that multiple of scatter and mesh together."""
    truth = made_of(Order("tube frame", "point-mass", 560, "fine", times=times)).truth
    floor = truth["moved_by_scatter_and_mesh_decades"]
    assert floor >= 0.5 * truth["moved_by_scatter_decades"]
    assert truth["moved_by_effect_decades"] == pytest.approx(times * floor, rel=0.3)


@pytest.mark.parametrize("text", ["1,none", "0", "-1,2"])
def test_sizes_that_are_no_numbers_are_refused(text):
    from chladni_evidence.blind_command import _sizes

    with pytest.raises(LabelError, match=r"write 0\.5,1,2"):
        _sizes(text)
