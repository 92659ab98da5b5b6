"""What every family promises, ours and those of packages: physics, candidates, bench and deck."""

import json
import pickle
from dataclasses import dataclass, replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose

from chladni.dynamics.eigen import normal_modes
from chladni.effects import registry
from chladni.effects.calibration_parameters import calibration_parameter, random_field
from chladni.effects.effect import ChannelChange, Effect, of
from chladni.effects.effect_context import Setup
from chladni.effects.extra_support import ExtraSupport
from chladni.effects.family import Article
from chladni.effects.identified_damping import IdentifiedDamping
from chladni.effects.joints import beads, stiffness
from chladni.effects.local_resonator import LocalResonator
from chladni.effects.model_families import model_families
from chladni.effects.point_mass import PointMass
from chladni.effects.rigid_ties import on_firm_springs
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.geometry.sampling import farthest_point_sample
from chladni.inference.hypothesis_fit import HypothesisFit, UpdatingProblem, fitted
from chladni.inference.likelihood import Responses
from chladni.inference.pole_data import Poles
from chladni.io.nastran import assembly, read_deck, write_assembly, write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.assembly import Assembly
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import ReducedProblem, reduced_problem
from chladni.search import pole_starts
from chladni.search.candidates import UpdatingContext
from chladni.units import UNITS
from chladni_specimens.plates import plate

TOP = 300.0  # Hz; six flexible modes of the plate lie below
FLEXIBLE = slice(6, 12)
SENSORS = [1, 7, 57, 63, 25, 39]
NAMES = (*(family.name for family in registry.BUILT_IN), "edge-mass")
CONTRACT = {  # names that issue texts, cases and other programs may use
    *("global-stiffness", "global-density", "part-stiffness", "stiffness-patch"),
    *("thickness-scale", "thickness-distribution", "orthotropic-material", "membrane-prestress"),
    *("adhesive-stiffness", "viscoelastic-joint", "hem-contact", "weld-missing"),
    *("weld-compliance", "over-constraint", "contact-stiffness", "rattle", "joint-friction"),
    *("point-mass", "mass-patch", "sensor-mass", "local-resonator", "suspension"),
    *("shaker-restraint", "extra-support", "compliant-support", "sensor-fault", "crack"),
}


@dataclass(frozen=True, eq=False)
class Ground:
    """A deck, what is known of its test, two recordings of it, and an article of a finer mesh."""

    deck: Assembly
    reduced: ReducedProblem
    sensors: list[int]
    by_responses: UpdatingContext
    by_poles: UpdatingContext
    article: Article


def updating_context(reduced, data, setup, sensors):
    """A search with E free, and its null."""
    base = (
        calibration_parameter(reduced.groups, "E", [0]), random_field(reduced.groups, "t", 0.01),
        *(e for e in model_families(reduced.structure) if "shear" not in e.text),
    )  # fmt: skip
    labels = tuple(f"{g}:+Z" for g in sensors)
    problem = UpdatingProblem(reduced, data, None, base, (), setup, labels)
    fit = fitted(reduced.model, base, data, None, problem.mean())
    return UpdatingContext(problem, HypothesisFit(Effect(), fit, reduced.model))


def recorded(reduced, sensors):
    """A structure 4 % stiffer than the model, with one sensor at half its level."""
    rows = reduced.grids.rows[[reduced.grids.position(g) for g in sensors]]
    s = 2 * np.pi * np.linspace(30, TOP, 50) * (0.05 + 1j)
    use = np.ones((50, len(sensors)), bool)
    empty = Responses(np.ones((50, len(sensors), 1), complex), s, rows, rows[[4]], use)
    data = empty.rebased(reduced.model)
    stiffer = evaluate(
        reduced.model, [calibration_parameter(reduced.groups, "E", [0])], np.array([0.04])
    )
    gains = np.where(np.arange(len(sensors)) == 2, 0.5, 1.0)[:, None]
    return replace(data, values=data.model(stiffer) * gains)


def damped_at_beads(reduced):
    """1 % of damping, and more by what the adhesive has of each mode's strain energy."""
    f, phi = reduced.frequency[FLEXIBLE], reduced.model.basis[:, FLEXIBLE]
    K = sum(stiffness(reduced.structure, bead) for bead in beads(reduced.structure)[:1])
    energy = np.einsum("nr,nr->r", phi, K @ phi) if sp.issparse(K) else 0 * f
    ratio = 0.01 + 0.1 * energy / f**2 / max((energy / f**2).max(), 1e-300)
    return IdentifiedDamping(f, ratio, np.full(len(f), 0.02))


def ground(deck, fine, sensors):
    reduced = reduced_problem(on_firm_springs(deck), TOP)
    hangers = sensors[1], sensors[3]
    shares = tuple(((int(g), 1.0),) for g in sensors)
    drive = int(sensors[4]), (0.0, 0.0, 1.0)
    drives = ((((drive[0], 1.0),), drive[1]),)
    damping = damped_at_beads(reduced)
    setup = Setup(shares, hangers, mass_properties(deck)[0], TOP, drives, damping)
    f = reduced.frequency[FLEXIBLE] * 1.02
    every = np.ones(len(f), bool)
    poles = Poles(f, 1e-3 + 0 * f, every, every + 0.0, (5.0, TOP))
    ones = np.ones(len(sensors))
    return Ground(
        deck, reduced, sensors,
        updating_context(reduced, recorded(reduced, sensors), setup, sensors),
        updating_context(reduced, poles, setup, sensors),
        Article(fine, deck, np.array(sensors), np.array(hangers), ones, drive=drive),
    )  # fmt: skip


@pytest.fixture(scope="module")
def on_plate():
    fine = plate(0.4, 0.3, 16, 12, 1.5e-3)
    return ground(plate(0.4, 0.3, 8, 6, 1.5e-3), fine, SENSORS)


@pytest.fixture(scope="module")
def on_joints(jointed):
    """Two plates joined, for what acts on joints."""
    return of_plates(jointed)


@pytest.fixture(scope="module")
def on_ties(tied):
    """The same with a rigid element between them."""
    return of_plates(tied)


def of_plates(build):
    """Ground on two plates; what is searched has firm springs in its rigid ties."""
    deck = build()
    lower = np.unique(deck.shells.nodes[deck.shells.part == 0])
    spread = lower[farthest_point_sample(deck.points[lower], 6)]
    return ground(deck, build(0.03), deck.ids[spread].tolist())


def cantilever(nx, ny):
    """The plate with all of its edge x = 0 held."""
    free = plate(0.4, 0.3, nx, ny, 1.5e-3)
    edge = np.flatnonzero(free.points[:, 0] == 0)
    return replace(free, supports=np.array([(row, c) for row in edge for c in range(1, 7)]))


@pytest.fixture(scope="module")
def on_held():
    """A plate in a clamp, for what acts on supports."""
    return ground(cantilever(8, 6), cantilever(16, 12), [57, 10, 63, 40, 25, 39])


@pytest.fixture
def reduced(on_plate):
    return on_plate.reduced


@pytest.fixture
def by_responses(on_plate):
    return on_plate.by_responses


@pytest.fixture(scope="module", params=NAMES)
def family(request, example_edge_mass):
    return registry.family(request.param)


@pytest.fixture(scope="module")
def on(family, request):
    """The ground a family has what it needs on."""
    if family.name == "over-constraint":
        return request.getfixturevalue("on_ties")
    grounds = {"": "on_plate", "supports": "on_held", "a shaker": "on_plate"}
    return request.getfixturevalue(grounds.get(family.needs, "on_joints"))


@pytest.fixture(scope="module")
def proposed(family, on):
    return family.proposed(on.by_responses)


def acting(candidate):
    """X off every symmetry, near the candidate's start."""
    step = np.array([0.1 * p.sd for p in candidate.effect.parameters])
    return candidate.start + step * np.cos(1 + np.arange(len(step)))


def lam(model, effect, x):
    return evaluate(model, [effect], x, False).lam[FLEXIBLE]


def test_names_are_unique_and_ours_are_in_the_contract(example_edge_mass):
    names = registry.names()
    assert len(set(names)) == len(names)
    assert {family.name for family in registry.BUILT_IN} <= CONTRACT


def test_candidates_fit_the_search(family, proposed, on, monkeypatch):
    """Starts of the right length about either base; with poles all but faults of the test."""
    monkeypatch.setattr(pole_starts, "DRAWS", 64)  # where they end is no part of it
    monkeypatch.setattr(pole_starts, "WALKED", 2)
    assert proposed
    frequencies = family.proposed(on.by_poles)
    assert bool(frequencies) == (family.effect.kind != "test")
    for c in (*proposed, *frequencies):
        assert isinstance(c.effect, family.effect)
        assert len(c.start) == len(c.effect.parameters)
        assert len(c.base) == len(on.by_responses.null)
        assert c.effect.trials_factor >= 1


def test_one_channel_at_half_its_level_is_the_first_candidate(by_responses):
    first = registry.family("sensor-fault").proposed(by_responses)[0]
    assert first.effect.channel == 2
    assert first.start[0] < np.log(0.5) / 2  # nearer to the truth than to no fault


def test_candidates_begin_at_the_nominal_and_at_the_calibrated_model(by_responses):
    """Scatter is idle in both: it would have taken what an effect is to explain."""
    nominal, calibrated = by_responses.bases
    assert not nominal.any()
    assert calibrated[0] == by_responses.null[0] != 0
    assert by_responses.null[1:].any()
    assert not calibrated[1:].any()


@pytest.mark.parametrize("kind", [PointMass, ExtraSupport, LocalResonator])
def test_begins_anew_where_it_moved_to(reduced, by_responses, kind):
    """Half a patch off its start it stays; a grid off, it begins at the grid it moved to."""
    where = by_responses.where
    effect = kind.near(where, where.grids.position(25))
    rest = np.zeros(len(effect.parameters) - 3)
    closer = next(f.closer for f in registry.BUILT_IN if f.effect is kind)
    assert closer(by_responses, effect, np.array([0.3, 0.5, -0.5, *rest])) is None
    size = effect.patch.size
    step = (
        where.grids.point[where.grids.position(26)] - effect.patch.origin
    ) @ effect.patch.plane.T
    x = np.array([0.3, *(step / size), *rest])
    found = closer(by_responses, effect, x)
    again, start = found.effect, found.start
    assert found.base is by_responses.bases[-1]
    assert again.grids == (26,)
    assert again.trials_factor == len(where.places)
    model = reduced.model_for(effect, x)
    moved, anew, old = (
        lam(model, effect, x),
        lam(model, again, start),
        np.array([0.3, 0.0, 0.0, *rest]),
    )
    assert np.abs(anew - moved).max() < 0.5 * np.abs(lam(model, effect, old) - moved).max()


def test_does_nothing_at_its_nominal_parameters(on, proposed):
    for c in proposed:
        idle = np.array([p.nominal for p in c.effect.parameters])
        model = on.reduced.model_for(c.effect, c.start)
        state = evaluate(model, [c.effect], idle, False)
        without = evaluate(model, [], np.zeros(0), False)
        assert_allclose(state.lam[FLEXIBLE], without.lam[FLEXIBLE], rtol=1e-6)
        assert_allclose(state.weight, without.weight, rtol=1e-9)
        sign = getattr(c.effect, "sign", 1)
        if state.offset is not None and sign > 0:
            assert_allclose(state.offset, 0, atol=1e-12)


def test_acts_elsewhere(on, proposed):
    for c in proposed:
        model, x = on.reduced.model_for(c.effect, c.start), acting(c)
        moved = np.abs(lam(model, c.effect, x) / lam(model, Effect(), x[:0]) - 1).max() > 1e-4
        changes = of(ChannelChange, c.effect.terms(x))
        assert moved != any(np.abs(change.value).max() > 0.01 for change in changes)


def test_leaves_stiffness_and_mass_positive_wherever_the_prior_reaches(on, proposed):
    rng = np.random.default_rng(3)
    c = proposed[0]
    model = on.reduced.model_for(c.effect, c.start)
    mean, sd = (np.array([getattr(p, q) for p in c.effect.parameters]) for q in ("mean", "sd"))
    for _ in range(20):
        x = mean + sd * rng.uniform(-3, 3, len(sd))
        state = evaluate(model, [c.effect], x, False)  # raises without positive M
        assert state.lam[0] > -1e-6 * state.lam[FLEXIBLE][0]


def test_slopes_leave_a_remainder_of_second_order(on, proposed):
    """|λ(x + hd) - λ(x) - h λ'd| falls as h²."""
    for c in proposed:
        model, x = on.reduced.model_for(c.effect, c.start), acting(c)
        d = np.cos(2 + np.arange(len(x)))
        state = evaluate(model, [c.effect], x)
        phi = state.vectors
        moved = phi.T @ state.dK @ phi - state.lam * (phi.T @ state.dM @ phi)
        slope = np.einsum("prr,p->r", moved, d)[FLEXIBLE]
        if not np.abs(slope).max() > 1e-9 * state.lam[FLEXIBLE].max():
            continue
        for h in (0.01, 0.1):  # a larger step where the rounding of the highest λ would show
            left = [
                np.abs(lam(model, c.effect, x + s * d) - state.lam[FLEXIBLE] - s * slope).max()
                for s in (h, h / 2)
            ]
            if left[1] > 30 * np.finfo(float).eps * state.lam.max():
                break
        assert left[0] / left[1] == pytest.approx(4, rel=0.15)


def test_what_remakes_the_structure_is_idle_where_it_has_been_remade(on, proposed):
    for c in proposed:
        if c.effect.traits.remakes_structure:
            x = acting(c)
            model = on.reduced.model_for(c.effect, x)
            again = replace(c.effect, in_structure=x)
            assert_allclose(lam(model, again, x), lam(model, Effect(), x[:0]), rtol=1e-12)


def test_is_concealed_in_the_article_or_its_recording(family, on, proposed):
    """The deck stays; the truth speaks of parameters the effect reports; a seed repeats it."""
    one, two = (family.conceal(on.article, np.random.default_rng(5)) for _ in range(2))
    assert one.deck is on.article.deck
    assert one.truth == two.truth
    c = proposed[0]
    reported = {row.name for row in c.effect.reported(c.start, np.zeros(len(c.start)))}
    assert one.truth["parameters"]
    assert set(one.truth["parameters"]) <= reported
    before, after = (normal_modes(structure(a.assembly).system, 12).frequency[6:]
                     for a in (on.article, one))  # fmt: skip
    moved = np.abs(after / before - 1).max() > 1e-5
    assert moved != bool((one.gains != on.article.gains).any())
    assert moved == (family.effect.kind == "physics")


def cards_that_differ(path, other):
    """Names of the cards that have a line the first deck has not, in included files as well."""
    old, name, out = set(path.read_text().splitlines()), "", set()
    lines = [
        line for source in read_deck(other).sources for line in source.path.read_text().splitlines()
    ]
    for line in lines:
        if line.startswith("INCLUDE"):
            continue
        word = line[:8].strip(" *")
        name = word if word.isalnum() else name
        if line not in old and not line.startswith("$"):
            out.add(name)
    return out


def test_goes_into_the_deck_by_its_cards_and_no_others(family, on, proposed, tmp_path):
    """What was written, read again, is the structure the effect makes; else it says why not."""
    path = write_assembly(on.deck, tmp_path / "deck.bdf", UNITS["mm-t-s"])
    read = read_deck(path)
    before = assembly(read, UNITS["mm-t-s"])
    after = proposed[0].effect.apply(before, acting(proposed[0]))
    if family.no_cards:
        assert after is before
        return
    write_deck(read, tmp_path / "new.bdf", changes(read, before, after, UNITS["mm-t-s"]))
    touched = cards_that_differ(path, tmp_path / "new.bdf")
    assert touched
    assert touched <= set(family.cards)
    again = assembly(read_deck(tmp_path / "new.bdf"), UNITS["mm-t-s"])
    found, due, was = (normal_modes(structure(a).system, 12).frequency[6:]
                       for a in (again, after, before))  # fmt: skip
    assert_allclose(found, due, rtol=1e-6)
    assert np.abs(due / was - 1).max() > 1e-5


def test_pickles(family, proposed):
    """Processes hand families and effects to one another."""
    assert pickle.loads(pickle.dumps(family)).name == family.name
    for c in proposed:
        again = pickle.loads(pickle.dumps(c.effect))
        assert again.location(c.start) == c.effect.location(c.start)


def test_says_of_itself_what_json_holds(proposed):
    for c in proposed:
        sd = np.full(len(c.start), 0.1)
        said = *c.effect.reported(c.start, sd), c.effect.location(c.start), c.effect.where()
        json.dumps([vars(one) for one in said], allow_nan=False)
        assert all(row.low <= row.value <= row.high for row in c.effect.reported(c.start, sd))
