"""What is hidden is physics: limits, reciprocity, work, and sizes that can be seen."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.effects.hems import hem_lines
from chladni.errors import ModelError
from chladni.fem.energy import mass_properties
from chladni.geometry.facets import cell_areas
from chladni.model.ground_springs import with_ground_bushes
from chladni_bench.part_scatter import WELDS, decades_apart, scattered_parts
from chladni_evidence.article_modes import article_modes
from chladni_evidence.bench_of_structure import panel_bench
from chladni_evidence.held_kinds import HELD
from chladni_evidence.hidden import Hidden, Site, with_lumps
from chladni_evidence.hidden_kinds import (
    CATALOGUED,
    calibration,
    crack,
    local_resonator,
    mass_patch,
    orthotropic,
    prestress,
    stiffness_patch,
    thinning,
)
from chladni_evidence.joint_kinds import SOFTEST, hem, hem_stretch, viscoelastic, weld_run
from chladni_evidence.mesh_transfer import Spots, mesh_transfer, still_there
from chladni_evidence.outside_kinds import duplicated, foam, friction, rotor
from chladni_evidence.pair_kinds import APART, HEMS, HIDDEN, PAIRS, catalogued, together
from chladni_evidence.response_of_article import Coupling, accelerance, seen
from chladni_specimens.forms import FORMS
from chladni_specimens.plates import folded_panel
from chladni_specimens.tailgate.design import TailgateDesign
from chladni_specimens.tailgate.tailgate import tailgate

TOP = 200.0
LINES = np.linspace(20.0, TOP, 120)


@pytest.fixture(scope="module")
def site():
    a = folded_panel(0.4, 0.2, 0.04, 0.01, 0.02, 1e-3)
    at = a.rows([60, 90, 120, 150])
    spots = Spots(
        tuple(f"{i}:+Z" for i in a.ids[at]), a.ids[at], a.points[at],
        np.tile([0.0, 0, 1], (4, 1)), ("panel",) * 4,
    )  # fmt: skip
    mass = mass_properties(a)[0]
    names = ("panel", "flanges")
    material_axis = np.array([1.0, 0, 0])
    return Site(
        a,
        spots,
        a.points[at[:2]],
        spots.only(np.array([1])),
        mass,
        30.0,
        TOP,
        names,
        material_axis,
        names,
    )


@pytest.fixture(scope="module")
def hemmed(site):
    """A coarse tailgate, measured at two grids of its outer lower panel."""
    a = tailgate(TailgateDesign(size=0.030))
    at = np.unique(a.shells.nodes[a.shells.part == a.part("outer lower")])[[40, 300]]
    spots = Spots(
        tuple(f"{i}:+Z" for i in a.ids[at]), a.ids[at], a.points[at],
        np.tile([0.0, 0, 1], (2, 1)), ("outer lower",) * 2,
    )  # fmt: skip
    mass, sheets = mass_properties(a)[0], ("inner", "outer lower")
    return replace(
        site, article=a, outputs=spots, hangers=a.points[at], drive=spots, mass=mass, sheets=sheets,
        rolled=sheets,
    )  # fmt: skip


def response(site, hidden, damping=0.01):
    """Accelerance of four sensors to a force at the first."""
    foot = still_there(hidden.article, site.article, site.outputs)
    tied = [c.rows for c in hidden.couplings]
    rows = np.concatenate([foot.rows.ravel(), *tied])
    modes = article_modes(hidden.article, rows, rows, TOP)
    phi = seen(modes, foot, site.outputs.directions)
    zeta = np.full(phi.shape[1], damping)
    return accelerance(modes, phi, phi[:1], zeta, LINES, hidden.couplings)


def spring(site, k):
    """A spring across the sheet at one point, as a coupling."""
    row, up = np.array([site.article.rows([100])[0]]), np.array([[[0.0, 0, 1]]])
    return row, Coupling(row, up, lambda s: np.full((len(s), 1, 1), k, dtype=complex))


def test_a_coupled_spring_is_an_assembled_one(site):
    """The same spring in the stiffness matrix and as a dynamic stiffness, without damping.

    (Modal damping belongs to the modes of the whole, so that with it the two are not the same.)
    """
    row, coupling = spring(site, 2e4)
    built = with_ground_bushes(site.article, row, np.array([[0.0, 0, 1]]), 2e4)
    plain = response(site, Hidden(site.article, {}), 0.0)
    one = response(site, Hidden(site.article, {}, (coupling,)), 0.0)
    assert decades_apart(one, plain) > 0.1
    assert decades_apart(one, response(site, Hidden(built, {}), 0.0)) < 2e-3


def test_a_resonator_on_a_rigid_spring_is_a_mass(site):
    """M s² k/(m s² + k) becomes m s² where k is large: the coupling of a lump."""
    m = 0.02
    row = np.array([site.article.rows([100])[0]])
    coupling = Coupling(row, np.eye(3)[:, None], lambda s: (m * s**2)[:, None, None] * np.eye(3))
    one = response(site, Hidden(site.article, {}, (coupling,)), 0.0)
    other = response(site, Hidden(with_lumps(site.article, row, m), {}), 0.0)
    assert decades_apart(one, other) < 2e-3


def test_a_resonator_is_felt_where_it_is_tuned(site):
    """Its dynamic stiffness is that of its mass far below its frequency, and turns sign above."""
    hidden = local_resonator(site, np.random.default_rng(1), 1.0)
    D, f = hidden.couplings[0].stiffness, hidden.truth["f"]
    low, high = 2j * np.pi * np.array([f / 50, 3 * f])
    m = hidden.truth["value"]
    np.testing.assert_allclose(D(np.array([low]))[0, 0, 0], m * low**2, rtol=2e-3)
    assert D(np.array([high]))[0, 0, 0].real > 0
    assert hidden.unweighed == -m


def test_a_rotor_does_no_work_and_breaks_reciprocity(site):
    """D(iω) is Hermitian (no power), but not symmetric: H_ij is not H_ji."""
    hidden = rotor(site, np.random.default_rng(2), 4.0)
    s = 2j * np.pi * np.array([50.0])
    D = hidden.couplings[0].stiffness(s)[0]
    np.testing.assert_allclose(D, D.conj().T)
    assert np.abs(D - D.T).max() > 0
    foot = mesh_transfer(site.article, site.outputs)
    rows = np.concatenate([foot.rows.ravel(), hidden.couplings[0].rows])
    modes = article_modes(site.article, rows, rows, TOP)
    phi = seen(modes, foot, site.outputs.directions)
    H = accelerance(modes, phi, phi, np.full(phi.shape[1], 0.01), LINES, hidden.couplings)
    assert np.abs(H - H.swapaxes(1, 2)).max() > 1e-3 * np.abs(H).max()


def test_foam_is_stiffer_and_lossy_between_its_limits(site):
    """Zener: k at rest, k (1 + Δ) at once, the loss largest at ωτ = (1 + Δ)^½/(1 + Δ) ... > 0."""
    hidden = foam(site, np.random.default_rng(3), 1.0)
    D, n = hidden.couplings[0].stiffness, len(hidden.couplings[0].rows)
    k, relaxed, tau = (hidden.truth[name] for name in ("value", "relaxation", "tau_s"))
    slow, middle, fast = (D(np.array([1j * w / tau]))[0, 0, 0] * n for w in (1e-4, 1.0, 1e4))
    assert slow == pytest.approx(k, rel=1e-3)
    assert abs(fast) == pytest.approx(k * (1 + relaxed), rel=1e-3)
    assert middle.imag / middle.real > 0.5


def test_a_mastic_is_stiffer_and_lossy_between_its_limits():
    """E(s)/E - 1 of a real part that rises, a loss that is positive, and both as told between."""
    a = FORMS["bonded plates"].made(0)
    bonded = Site(a, None, None, None, 1.0, 40.0, TOP, ("lower",), np.zeros(3), ())
    hidden = viscoelastic(bonded, np.random.default_rng(8), 1.0)
    truth, f = hidden.truth, np.geomspace(1, 4000, 50)
    e = 1 + hidden.law(2j * np.pi * f)
    assert (np.diff(e.real) > 0).all()
    assert (e.imag > 0).all()
    middle = 1 + hidden.law(np.array([2j * np.pi * np.sqrt(40.0 * TOP)]))[0]
    assert middle.real == pytest.approx(1.0)
    assert middle.imag == pytest.approx(truth["loss factor"])
    part = hidden.article.parts[hidden.article.part(truth["part"])]
    assert part.section.material.E == truth["E"]
    rows = a.rows([1])
    modes = article_modes(hidden.article, rows, rows, TOP)
    flat = seen_on(modes, hidden.law)
    assert np.abs(flat / seen_on(modes, lambda s: 0 * s) - 1).max() > 0.05


def seen_on(modes, law):
    phi = modes.shapes[0, 2:3]
    return accelerance(modes, phi, phi, np.full(phi.shape[1], 0.01), LINES, law=law)


def test_a_crack_takes_bending_alone(site):
    """Mass and membrane are as they were, and no mode of the article is stiffer."""
    hidden = crack(site, np.random.default_rng(4), 2.0)
    assert hidden.truth["shells"] >= 3
    kept = hidden.article.parts[-1].section.bending_ratio
    mine = hidden.article.shells.part == len(hidden.article.parts) - 1
    area = cell_areas(hidden.article.points, hidden.article.shells.nodes)[mine].sum()
    hinge = hidden.truth["hinge"] * hidden.truth["length_m"]  # m of sheet times m of line
    assert hinge == pytest.approx(area * (1 / kept - 1), rel=0.3)
    assert mass_properties(hidden.article)[0] == pytest.approx(site.mass, rel=1e-12)
    rows = site.article.rows([60])
    f, g = (article_modes(a, rows, rows, TOP).frequency for a in (site.article, hidden.article))
    assert (g[6:16] < f[6:16] * (1 + 1e-9)).all()
    assert (g[6:16] < 0.995 * f[6:16]).any()


def test_the_place_of_a_crack_is_the_middle_of_what_is_cracked(site):
    """Also where an edge cuts it short: no end is farther from it than another."""
    for seed in range(8):
        hidden = crack(site, np.random.default_rng(seed), 3.0)
        a = hidden.article
        X = a.points[a.shells.nodes[a.shells.part == len(a.parts) - 1]].mean(axis=1)
        away = X - hidden.truth["point_m"]
        along = away @ np.linalg.svd(away, full_matrices=False)[2][0]
        assert abs(along.max() + along.min()) < 0.02  # a shell
        assert hidden.truth["length_m"] == pytest.approx(np.linalg.norm(np.ptp(X, axis=0)))


def test_friction_softens_and_damps():
    """Joints of the box: lower modes, and a modal loss no negative motion feeds."""
    form = FORMS["lidded box"]
    a = form.made(0)
    site_ = Site(a, None, None, None, 1.0, 60.0, TOP, ("lid",), np.zeros(3), ())
    hidden = friction(site_, np.random.default_rng(5), 1.5)
    rows = a.rows([1])
    plain, slipping = (article_modes(x, rows, rows, TOP) for x in (a, hidden.article))
    assert not plain.loss.any()
    assert np.linalg.eigvalsh(slipping.loss).min() > -1e-6 * np.abs(slipping.loss).max()
    assert slipping.loss.max() > 0
    assert (slipping.frequency[6:16] <= plain.frequency[6:16] * (1 + 1e-6)).all()


def test_a_pair_of_channels_is_one(site):
    hidden = duplicated(site, np.random.default_rng(6), 1.0)
    values = np.arange(8.0).reshape(2, 4, 1)
    spoilt = hidden.spoil(values)
    one, other = (site.outputs.labels.index(hidden.truth[k]) for k in ("copy_of", "channel"))
    np.testing.assert_array_equal(spoilt[:, other], values[:, one])
    np.testing.assert_array_equal(np.delete(spoilt, other, 1), np.delete(values, other, 1))


@pytest.mark.parametrize("kind", [k for k in CATALOGUED if k not in ("nothing", "sensor-fault")])
def test_more_is_more(site, kind):
    """Twice the size moves the responses farther, and no size leaves them where they were."""
    plain = response(site, Hidden(site.article, {}))
    small, large = (
        decades_apart(response(site, CATALOGUED[kind](site, np.random.default_rng(7), s)), plain)
        for s in (0.1, 0.2)
    )
    assert 0 < small < large


@pytest.mark.parametrize("hide", [stiffness_patch, mass_patch])
def test_sensors_stand_on_a_patch_as_they_stood_on_the_sheet(site, hide):
    """A patch that changes nothing changes no response, though it is a part of its own."""
    a, names = site.article, site.outputs.parts
    idle = hide(replace(site, sheets=("panel",)), np.random.default_rng(3), 0.0)
    patch = a.shells.nodes[idle.article.shells.part == idle.article.part("patch")]
    rows, count = np.unique(patch, return_counts=True)
    rows = rows[np.argsort(-count, kind="stable")[: len(names)]]
    on = replace(site.outputs, grids=a.ids[rows], points=a.points[rows], parts=("panel",) * 4)
    there = replace(site, outputs=on)
    np.testing.assert_allclose(
        response(there, idle), response(there, Hidden(a, {})), rtol=1e-6, atol=1e-9
    )


def test_points_that_moved_are_no_place_of_a_sensor(site):
    """A sensor is found again by the points it stands on, or not at all."""
    a = site.article
    with pytest.raises(ModelError, match="moved"):
        still_there(replace(a, points=a.points + 1e-3), a, site.outputs)


def test_truth_is_what_was_done(site):
    """E of the part, the thinnest spot, the moduli of the grain."""
    rng = np.random.default_rng
    off = calibration(site, rng(8), 1.0)
    section = off.article.parts[off.article.part(off.truth["part"])].section
    assert section.bending.E == pytest.approx(210e9 * off.truth["value"])
    thin = thinning(site, rng(9), 1.0)
    least = thin.article.shells.thickness.min() / 1e-3
    assert least == pytest.approx(1 - thin.truth["value"], abs=0.01)
    for seed in range(4):  # either force may be the larger
        forced = prestress(site, rng(seed), 1.0).truth
        both = forced["N along"], forced["N across"]
        assert max(both, key=abs) == forced["value"]
        assert 0 <= min(both, key=abs) / forced["value"] <= 1
    rolled = orthotropic(site, rng(10), 1.0).article.parts[0].section.membrane
    truth = orthotropic(site, rng(10), 1.0).truth
    assert (rolled.E1, rolled.E2, rolled.G12) == (truth["E1"], truth["E2"], truth["G12"])


def test_scatter_is_as_wide_as_it_says():
    """1 % of E and t, 30 % of each weld, over 200 draws (chi-squared, 4 sd); the names stay."""
    a = FORMS["lidded box"].made(0)
    E, welds = [], []
    for seed in range(200):
        drawn, scales = scattered_parts(a, np.random.default_rng(seed))
        E.append([np.log(scales[n][q]) for n in ("box", "lid") for q in ("E", "t")])
        one = [p for p in drawn.parts if p.name == WELDS][1]
        welds.append(np.log(one.section.material.E / 210e9))
    assert np.std(E) == pytest.approx(0.01, rel=4 / np.sqrt(2 * 800))
    assert np.std(welds) == pytest.approx(0.3, rel=4 / np.sqrt(2 * 200))
    assert [p.name for p in drawn.parts[:3]] == [p.name for p in a.parts]


def test_modes_another_code_was_not_asked_for_are_ours(monkeypatch):
    """Were CalculiX' modes ours, so would be the drive point: no flexibility is lost above them."""
    a = FORMS["tube frame"].made(0)
    rows = a.rows([5, 40])
    ours = article_modes(a, rows, rows[:1], 130.0)
    first = ours.frequency[:8], ours.shapes[..., :8]
    monkeypatch.setattr("chladni_evidence.article_modes.calculix_modes", lambda *_: first)
    both = article_modes(a, rows, rows[:1], 130.0, "calculix")
    np.testing.assert_allclose(both.frequency[6:], ours.frequency[6:])
    np.testing.assert_array_equal(both.shapes, ours.shapes)


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_hem_holds_where_its_truth_says(hemmed, seed):
    """All springs along it together are k times the length that is held, and lie on the line."""
    a, rng = hemmed.article, np.random.default_rng
    line = max(hem_lines(a), key=lambda one: one.length)
    old = len(a.bushes)
    for kind in (hem, hem_stretch):
        hidden = kind(hemmed, rng(seed), 2.0)
        truth, bushes = hidden.truth, hidden.article.bushes
        length = truth.get("L", line.length)
        held = bushes.stiffness[old:].max(axis=1).sum()
        assert held == pytest.approx(truth["K"] * length, rel=0.1)
        assert 2e9 <= truth["value"] <= 2e10
        if "point_m" in truth:
            away = np.linalg.norm(bushes.place[old:] - truth["point_m"], axis=1)
            assert away.max() <= length / 2 + 0.01  # as the crow flies, no farther than along it
            assert away.min() < 0.02
            assert 0.2 <= length / line.length <= 0.5


@pytest.mark.parametrize("seed", [3, 4, 5])
def test_a_run_of_welds_is_gone_and_no_other(hemmed, seed):
    """About one of them, no weld that stands is nearer than the others that are gone."""
    a = hemmed.article
    hidden = weld_run(hemmed, np.random.default_rng(seed), 1.0)
    (before, after) = next(
        (old, new) for old, new in zip(a.solids, hidden.article.solids, strict=True)
        if len(old) != len(new)
    )  # fmt: skip
    stays = np.isin(before.ids, after.ids)
    welds = np.array([a.parts[p].section.material.E > SOFTEST for p in before.part])
    places = a.points[before.nodes].mean(axis=1)
    assert (~stays).sum() == hidden.truth["count"] in (2, 3, 4)
    assert welds[~stays].all()
    far = np.linalg.norm(places[:, None] - places[~stays], axis=2)
    assert (far[~stays].max(axis=0) <= far[stays & welds].min(axis=0)).any()
    np.testing.assert_allclose(hidden.truth["point_m"], places[~stays].mean(axis=0))


def test_a_kind_is_called_as_the_catalogue_calls_it():
    assert [catalogued(kind) for kind in PAIRS] == list(PAIRS)
    assert len({catalogued(kind) for kind in HEMS}) == 1


@pytest.mark.parametrize("kind", [*PAIRS, *HEMS])
def test_effects_at_once_are_each_what_it_is_alone(site, hemmed, kind):
    """What they weigh adds up, on the balance and off it; two places lie apart."""
    alone, site = {}, hemmed if kind in HEMS else site

    def sized(name, seed):
        hidden = HIDDEN[name](site, np.random.default_rng(seed), 1.0)
        _, which, *_ = seed
        alone[which] = hidden  # the last that was drawn stays
        return hidden, 0.1 * (1 + which), 1.0

    made, told, least = together(site, kind, 7, sized)
    used = alone.values()
    assert least == pytest.approx(0.1)
    assert [t["effect"] for t in told] == catalogued(kind).split(" + ")
    assert made.unweighed == pytest.approx(sum(h.unweighed for h in used))
    added = [mass_properties(h.article)[0] - site.mass for h in used]
    assert mass_properties(made.article)[0] - site.mass == pytest.approx(sum(added))
    places = [t["point_m"] for t in told if "point_m" in t]
    if len(places) == 2:
        assert np.linalg.norm(np.subtract(*places)) > APART * site.size


def test_a_stinger_and_its_gauge_are_where_the_site_is_driven(site):
    hidden = HELD["shaker-restraint"](site, np.random.default_rng(4), 1.0)
    a, truth = hidden.article, hidden.truth
    assert mass_properties(a)[0] == pytest.approx(site.mass + truth["m"], rel=1e-12)
    assert hidden.unweighed == truth["m"]
    assert np.linalg.norm(truth["point_m"] - site.drive.points[0]) < 0.02
    assert a.bushes.stiffness[-1, [1, 2, 4, 5]] == pytest.approx(
        [truth["k_lat"]] * 2 + [truth["k_rot"]] * 2
    )


def test_a_clamp_that_gives_lowers_every_mode_that_bends_its_root(site):
    """Of a free article there is none that could."""
    with pytest.raises(ModelError, match="no supports"):
        HELD["compliant-support"](site, np.random.default_rng(4), 1.0)
    bench = panel_bench("clamped plate", 580)
    held = replace(site, article=bench.deck, mass=mass_properties(bench.deck)[0], first=bench.first)
    hidden = HELD["compliant-support"](held, np.random.default_rng(4), 1.0)
    rows = bench.deck.rows([60])
    f, g = (article_modes(a, rows, rows, TOP).frequency for a in (bench.deck, hidden.article))
    assert len(hidden.article.supports) < len(bench.deck.supports)
    assert (g[:6] < f[:6] * (1 + 1e-9)).all()
    assert 0.7 < g[0] / f[0] < 0.99
