"""A thinning follows the sheet: across a fold, along a curve, never to a sheet beside it."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.effects.element_groups import element_groups
from chladni.effects.sheet_patch import surface
from chladni.effects.sheets import ThicknessDistribution
from chladni.fem.assemble import structure
from chladni.model.assembly import Assembly, Shells
from chladni_specimens.plates import folded_panel, plate


@pytest.fixture(scope="module")
def panel():
    return element_groups(structure(folded_panel(0.6, 0.3, 0.04, 0.01, 0.02, 1e-3)))


def test_a_fold_does_not_end_a_thinning(panel):
    """Begun beside the fold: shells of both parts grow thinner, by what their distance says."""
    group = int(np.argmin(((panel.centre - [0.3, 0.28, 0.0]) ** 2).sum(axis=1)))
    effect = ThicknessDistribution.on(panel, group, 1)
    x = np.array([0.0, np.log(0.06 / effect.size), 0.0, 0.0, 0.0])
    assembly = panel.structure.assembly
    changed = effect.apply(assembly, x).shells.thickness / assembly.shells.thickness
    X = assembly.points[assembly.shells.nodes]
    d2 = ((X - effect.at(x)) ** 2).sum(axis=-1)
    assert changed == pytest.approx(1 - 0.3 * np.exp(-d2 / (2 * 0.06**2)), rel=1e-12)
    assert all(changed[assembly.shells.part == k].min() < 0.9 for k in (0, 1))


def test_sheets_that_share_no_grid_are_two():
    """A second plate 1.5 mm above the first keeps its thickness."""
    one = plate(0.4, 0.3, 8, 6, 1e-3)
    two = stacked(one, 1.5e-3)
    groups = element_groups(structure(two))
    assert len(set(groups.connected.tolist())) == 2
    effect = ThicknessDistribution.on(groups, 0, 2)
    shells = two.shells
    changed = effect.apply(two, np.array([1.0, -1.0, 0.0, 0.0, 0.0])).shells.thickness
    ratio = (changed / shells.thickness).min(axis=1)
    mine = shells.part == groups.part[0]
    assert ratio[mine].min() < 0.9
    assert ratio[~mine].min() == 1.0


def stacked(one: Assembly, gap: float) -> Assembly:
    """The same plate twice, the second one as a part of its own above."""
    n, s = len(one.points), one.shells
    both = {
        name: np.concatenate([getattr(s, name)] * 2)
        for name in Shells.__dataclass_fields__
        if isinstance(getattr(s, name), np.ndarray)
    }
    both["nodes"] = np.concatenate([s.nodes, s.nodes + n])
    both["part"] = np.concatenate([s.part, s.part + 1])
    if "ids" in both:
        both["ids"] = np.arange(1, len(both["nodes"]) + 1)
    upper = replace(one.parts[0], id=2, name="upper")
    return replace(
        one,
        points=np.concatenate([one.points, one.points + np.array([0, 0, gap])]),
        ids=np.arange(1, 2 * n + 1),
        shells=replace(s, **both),
        parts=(*one.parts, upper),
    )


def test_the_centre_stays_on_a_curved_sheet():
    """A bowl 10 mm deep at 100 mm: a tangent plane misses all of it, the quadric a tenth."""
    flat = plate(0.6, 0.6, 24, 24, 1e-3)
    X = flat.points - [0.3, 0.3, 0.0]
    bowl = replace(flat, points=np.c_[X[:, :2], (X[:, :2] ** 2).sum(axis=1)])
    groups = element_groups(structure(bowl))
    own = surface(groups, int(np.argmin((groups.centre**2).sum(axis=1))), 0.6)
    near = bowl.points[((bowl.points - own.origin) ** 2).sum(axis=1) < 0.1**2]
    u = (near - own.origin) @ own.axes.T
    assert np.array([own.at(v) for v in u]) == pytest.approx(near, abs=1e-3)


def test_a_place_lies_on_the_sheet_and_is_as_uncertain_as_its_centre(panel):
    """A centre 9 mm beyond the edge is reported on the edge; R is no uncertainty of the place."""
    group = int(np.argmin(((panel.centre - [0.05, 0.15, 0.0]) ** 2).sum(axis=1)))
    effect = ThicknessDistribution.on(panel, group, 1)
    away = (np.array([-0.009, 0.15, 0.0]) - effect.surface.origin) @ effect.surface.axes.T
    x = np.array([0.0, np.log(0.01 / effect.size), *(away / effect.size), 0.3])
    place = effect.location(x, np.array([0.1, 0.1, 0.15, 0.02, 0.1]))
    edge = effect.points[effect.points[:, 0] == 0.0]
    sag = np.interp(0.15, edge[:, 1], edge[:, 2])
    np.testing.assert_allclose(place.point_m, [0.0, 0.15, sag], atol=2e-4)
    far = 1.96 * effect.size * effect.widened(np.array([0.1, 0.1, 0.15, 0.02, 0.1]))[2]
    assert place.radius_m == pytest.approx(far)
    assert effect.location(x).radius_m is None


def test_a_centre_off_the_sheet_is_reported_on_it(panel):
    """Beyond the edge: the place is the sheet's nearest grid, the depth what is left there."""
    group = int(np.argmin(((panel.centre - [0.05, 0.15, 0.0]) ** 2).sum(axis=1)))
    effect = ThicknessDistribution.on(panel, group, 1)
    away = (np.array([-0.1, 0.15, 0.0]) - effect.surface.origin) @ effect.surface.axes.T
    x = np.array([0.0, np.log(0.1 / effect.size), *(away / effect.size), 0.3])
    place = np.array(effect.location(x).point_m)
    depth = effect.reported(x, np.zeros(5))[0].value
    assembly = panel.structure.assembly
    thinnest = (effect.apply(assembly, x).shells.thickness / assembly.shells.thickness).min()
    assert abs(place[0]) < 1e-9
    assert depth == pytest.approx(1 - thinnest, rel=1e-9)


def test_a_small_patch_between_grids_stays_where_it_is(panel):
    """Of a radius below the mesh's the centre is on the sheet though no grid is near."""
    group = int(np.argmin(((panel.centre - [0.3, 0.15, 0.0]) ** 2).sum(axis=1)))
    effect = ThicknessDistribution.on(panel, group, 1)
    x = np.array([0.0, np.log(0.003 / effect.size), 0.0, 0.0, 0.0])
    assert effect.location(x).point_m == pytest.approx(effect.at(x), abs=1e-12)
