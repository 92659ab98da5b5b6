"""Words for places: what they name on a mesh, and layouts that obey them."""

import json

import numpy as np
import pytest
from tests.builders.commands import ran

import chladni
from chladni.errors import ChladniError
from chladni.fem.assemble import structure
from chladni.io.nastran import write_assembly
from chladni.view.surface import surface
from chladni.workflows.place_words import centre_ids, further_places, place_rules
from chladni_planning import PlanSettings, find_sensor_candidates, mounts_at, plan_test, sensors_csv
from chladni_planning.plan_page import in_words
from chladni_planning.plan_summary import summary
from chladni_specimens.forms import FORMS
from chladni_specimens.plates import folded_panel

PANEL = folded_panel()
SEEN = surface(PANEL)
HALF = "box 0 0 -1 0.3 0.3 1"
SMALL = {"sensors": 8, "modes": 5, "candidates": 80, "alike": 1.0}


def planned(**words):
    return plan_test(PANEL, PlanSettings(**SMALL, **words), built=BUILT)


BUILT = structure(PANEL)


def test_a_part_is_its_faces_and_their_corners():
    rules = place_rules(PANEL, SEEN, regions=["flanges"])
    point, face = np.split(rules.allowed, [len(SEEN.points)])
    np.testing.assert_array_equal(face, SEEN.part == 1)
    np.testing.assert_array_equal(np.flatnonzero(point), np.unique(SEEN.faces[face]))
    by_id = place_rules(PANEL, SEEN, regions=["2"])
    np.testing.assert_array_equal(by_id.allowed, rules.allowed)


def test_a_label_is_a_grid_or_the_centre_of_a_shell():
    for label, grid in (("313:n", True), (f"{centre_ids(PANEL)[7]}:n", False)):
        rules = place_rules(PANEL, SEEN, regions=[label])
        point, face = np.split(rules.allowed, [len(SEEN.points)])
        assert point.sum() == grid
        around = (PANEL.ids[SEEN.faces] == 313).any(axis=1)
        np.testing.assert_array_equal(face, around if grid else np.arange(len(face)) == 7)


def test_forbidden_places_outweigh_regions_and_the_last_cost_holds(tmp_path):
    (tmp_path / "costs.csv").write_text("part,label,cost\nflanges,,2\n,313:n,7\n")
    rules = place_rules(
        PANEL, SEEN, ["panel"], (), [HALF], ["panel=3", str(tmp_path / "costs.csv")]
    )  # fmt: skip
    inside = SEEN.points[:, 0] <= 0.3
    assert not rules.allowed[: len(inside)][inside].any()
    cost = dict(zip(PANEL.ids.tolist(), rules.cost, strict=False))
    assert (cost[313], max(cost.values())) == (7, 7)
    assert set(rules.cost) == {2, 3, 7}
    same = place_rules(PANEL, SEEN, cost={"panel": 3, "flanges": 2, "313:n": 7})
    np.testing.assert_array_equal(np.unique(same.cost), [2, 3, 7])


WRONG = [
    ({"regions": ["panle"]}, "regions 'panle': no part 'panle'; there are panel"),
    ({"regions": ["box 0 0 1"]}, "two corners in metres"),
    ({"regions": ["box 5 5 5 6 6 6"]}, r"holds nothing .* reaches from \(0, 0, -0.03\)"),
    ({"forbidden": ["9999:n"]}, "is no grid and no centre of a shell"),
    ({"forbidden": ["panel", "flanges"]}, "leave no place"),
    ({"cost": ["panel"]}, "write PLACE=NUMBER"),
    ({"cost": {"panel": 0}}, "the cost 0 is not positive"),
    ({"cost": ["panel=inf"]}, "the cost inf is not positive"),
    ({"fixed": ["panel"]}, "is no label; write 412:"),
    ({"fixed": ["9999:+Z"]}, "no grid 9999, the nearest ids are"),
    ({"fixed": ["34:+Z"], "forbidden": ["34:n"]}, "34:.Z is fixed at a forbidden place"),
    ({"regions": ["none.csv"]}, "no file none.csv"),
]


@pytest.mark.parametrize(("words", "said"), WRONG)
def test_wrong_words_are_refused_in_a_sentence(words, said):
    with pytest.raises(ChladniError, match=said):
        place_rules(PANEL, SEEN, **words)


def test_a_column_that_names_no_place_is_refused(tmp_path):
    (tmp_path / "costs.csv").write_text("grid,cost\n34,2\n")
    with pytest.raises(ChladniError, match=r"costs.csv, line 1: no column label or part"):
        place_rules(PANEL, SEEN, cost=[str(tmp_path / "costs.csv")])


def test_candidates_are_spread_over_the_allowed_places():
    """As many as elsewhere, none outside; a place with a label need not be flat."""
    rules = place_rules(PANEL, SEEN, [HALF], forbidden=["box 0.1 0.1 -1 0.2 0.2 1"])
    places = find_sensor_candidates(PANEL, 60, rules=rules)
    x, y, _ = places.points.T
    assert len(places) == 60
    assert np.all(x <= 0.3)
    assert not np.any((np.abs(x - 0.15) <= 0.05) & (np.abs(y - 0.15) <= 0.05))
    corner = f"{PANEL.ids[0]}:n"
    assert PANEL.ids[0] not in find_sensor_candidates(PANEL, 1000).ids
    named = find_sensor_candidates(PANEL, 60, rules=place_rules(PANEL, SEEN, [corner, "313:n"]))
    assert set(named.ids) == {PANEL.ids[0], 313}


def test_nothing_is_put_where_it_is_not_allowed():
    found = planned(regions=["panel"], forbidden=[HALF])
    result = summary(found)
    every = [s.at for s in result.sensors] + [a.at for a in result.actuators]
    assert all(at.point_m[0] > 0.3 for at in every)
    assert np.all(PANEL.points[PANEL.rows(result.hangers), 0] > 0.3)
    assert result.refused["not allowed"] > 0


def test_fixed_sensors_are_in_the_layout_under_their_labels(tmp_path):
    """Three directions at one grid, one of them its own normal, beside a shared minimum distance.

    The table of the plan, as fixed sensors of another plan, is that plan again.
    """
    fixed = ["34:+X", "34:+Y", "313"]
    found = planned(fixed=fixed, spacing=0.05, forbidden=["flanges"])
    labels = [found.mounts.labels[k] for k in found.layout]
    assert {"34:+X", "34:+Y", "313:n"} <= set(labels)
    mounted = {s.at.label: s.at.mounted for s in summary(found).sensors}
    assert mounted["34:+X"] == mounted["313:n"] == "fixed"
    assert sum(kind == "fixed" for kind in mounted.values()) == 3
    row = found.mounts.labels.index("34:+X")
    np.testing.assert_allclose(found.mounts.directions[row], [1, 0, 0])
    assert "Fixed by the settings" in " ".join(in_words(found).notes)
    (tmp_path / "sensors.csv").write_text(sensors_csv(found))
    again = planned(fixed=[str(tmp_path / "sensors.csv")])
    assert {again.mounts.labels[k] for k in again.layout} == set(labels)


def test_a_fixed_place_away_from_grids_moves_as_its_shell(tmp_path):
    table = tmp_path / "old.csv"
    table.write_text("label,x,y,z,direction\nroof,0.31,0.11,0.008,+Z\n")
    places = find_sensor_candidates(PANEL, 40, rules=place_rules(PANEL, SEEN, fixed=[str(table)]))
    k = int(np.flatnonzero(places.fixed == "roof")[0])
    plane = PANEL.points @ np.array([1.0, 2.0, 0.0])
    assert places.moving(plane)[k] == pytest.approx(0.31 + 0.22, abs=1e-3)
    assert mounts_at(places).labels[k] == "roof"


def test_costs_count_relative_to_one_another():
    """All costs equal: no costs. Twice all costs: the same layout. Dear places are left."""
    plain = planned()
    assert "without costs" not in planned(cost=["panel=4", "flanges=4"]).cost
    dear, twice = (planned(cost={HALF: 5.0 * k, "box 0.301 0 -1 1 1 1": k}) for k in (1.0, 2.0))
    np.testing.assert_array_equal(np.sort(dear.layout), np.sort(twice.layout))
    left = [(p.mounts.points[p.layout, 0] <= 0.3).sum() for p in (plain, dear)]
    assert left[1] < left[0]
    assert dear.cost["with exchange"] < dear.cost["without costs"]
    assert dear.log_det["with exchange"] <= dear.log_det["without costs"] + 1e-9
    assert dear.log_det["without costs"] == pytest.approx(plain.log_det["with exchange"])
    assert "The sensors cost" in " ".join(in_words(dear).notes)


def test_a_case_states_the_same_words(tmp_path):
    """[plan] of a case, with its own folder for files; arguments of the call outweigh them."""
    write_assembly(PANEL, tmp_path / "panel.bdf")
    (tmp_path / "here.csv").write_text("label\n313:n\n239:n\n402:n\n187:n\n")
    case = '[model]\ndeck = "panel.bdf"\nunits = "SI"\n[plan]\nregions = ["here.csv"]\n'
    (tmp_path / "case.toml").write_text(case)
    few = {"sensors": 3, "modes": 2, "draws": 0, "alike": 1.0}
    assert set(chladni.plan(tmp_path, **few).places.ids) == {313, 239, 402, 187}
    assert set(chladni.plan(tmp_path, **few, regions=["panel"]).places.ids) > {313}
    (tmp_path / "case.toml").write_text(case.replace("here.csv", "../here.csv"))
    with pytest.raises(ChladniError, match=r"case.toml, line 5: \[plan\] regions"):
        chladni.plan(tmp_path, **few)


def test_a_diagnosis_advises_what_the_case_allows(tmp_path):
    """Allowed grids with their costs, and fixed sensors that have not measured yet."""
    write_assembly(PANEL, tmp_path / "panel.bdf")
    (tmp_path / "sensors.csv").write_text("label,role\n34:+X,output\n239:n,input\n")
    case = '[model]\ndeck = "panel.bdf"\nunits = "SI"\n[test]\nsensors = "sensors.csv"\n'
    (tmp_path / "case.toml").write_text(case)
    assert further_places(chladni.load_case(tmp_path)) is None
    plan = (
        '[plan]\nregions = ["panel", "flanges"]\nforbidden = ["313:n"]\ncost = ["402:n=3"]\n'
        'fixed = ["34:-X", "34:+Y"]\n'
    )
    (tmp_path / "case.toml").write_text(case + plan)
    found = further_places(chladni.load_case(tmp_path))
    at = dict(zip(found.grids.tolist(), found.cost.tolist(), strict=True))
    assert 313 not in at
    assert (at[402], at[187]) == (3.0, 1.0)
    assert set(at) < set(PANEL.ids.tolist())
    assert found.fixed.labels == ("34:+Y",)  # along X the grid has a sensor
    (tmp_path / "case.toml").write_text(case + plan.replace("313", "9313"))
    with pytest.raises(ChladniError, match=r"case.toml, \[plan\]: forbidden '9313:n'"):
        further_places(chladni.load_case(tmp_path))


def test_the_page_draws_allowed_places(tmp_path):
    """Faces that are not allowed have no value; without words there is no such picture."""
    deck = write_assembly(PANEL, tmp_path / "panel.bdf")
    out = str(tmp_path / "out")
    few = ["--units", "SI", "--sensors", "4", "--modes", "3", "--candidates", "40", "--drawn", "0"]
    words = ["--region", "panel", "--forbidden", HALF, "--fixed", "513:n", "--cost", "513:n=2"]
    ran("plan", deck, *few, *words, "--out", out)
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Grey: not allowed" in page
    sensors = json.loads((tmp_path / "out" / "plan.json").read_text())["sensors"]
    assert {s["label"]: s["cost"] for s in sensors}["513:n"] == 2


def test_a_frame_of_beams_obeys_the_same_words():
    """Two directions a grid, in the box or elsewhere as fixed; a part is that of the beams."""
    made = FORMS["tube frame"].made(520)
    x = made.points[:, 0]
    half = f"box {x.min()} -9 -9 {np.median(x)} 9 9"
    far = int(made.ids[made.beams.nodes.ravel()][np.argmax(x[made.beams.nodes.ravel()])])
    fixed = [f"{far}:{axis}" for axis in ("+X", "+Y", "+Z")]
    words = {"regions": [half], "fixed": fixed, "cost": {made.parts[0].name: 2.0}}
    found = plan_test(made, PlanSettings(sensors=8, modes=4, draws=0, alike=1.0, **words))
    labels = [found.mounts.labels[k] for k in found.layout]
    assert set(fixed) <= set(labels)
    rest = [found.mounts.points[k] for k in found.layout if found.mounts.labels[k] not in fixed]
    assert np.max(rest, axis=0)[0] <= np.median(x) + 1e-9
    assert len(set(found.mounts.labels)) == len(found.mounts.labels)
    with pytest.raises(ChladniError, match=r"leave no place|no beam has an allowed place"):
        plan_test(made, PlanSettings(forbidden=["box -9 -9 -9 9 9 9"]))
