"""What every effect promises, ours and those of packages: one table of rules, each applied once."""

import json
from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose
from tests.builders.commands import ran, refused

import chladni
from chladni.effects import Weight, channels, masses, registry, springs, strength
from chladni.effects.calibration_parameters import calibration_parameter, random_field
from chladni.effects.effect import Effect, Parameter
from chladni.effects.element_groups import element_groups
from chladni.effects.joint_stiffness import model_families
from chladni.effects.model_errors import (
    BeamTheory,
    FoldBending,
    HalvedMesh,
    JointFootprint,
    mesh_errors,
    modal_discrepancy,
)
from chladni.effects.orthotropy import material_axes
from chladni.effects.sheets import MassPatch, StiffnessPatch, ThicknessDistribution
from chladni.effects.unknown_cords import unknown_cords
from chladni.effects.user_parameters import user_parameter
from chladni.effects.weld_patch import RigidPatch, WeldPatch
from chladni.errors import AccuracyError, LabelError
from chladni.fem.modelled import solved
from chladni.geometry.refine import refined
from chladni.io.nastran import write_assembly
from chladni.model.free_parameter import FreeParameter
from chladni.model.point_masses import with_masses
from chladni.model.properties import BeamSection
from chladni.reduced.reduced_model import evaluate
from chladni_contract import effect_check
from chladni_contract.effect_check import PROPOSES, RULES, checked_rules
from chladni_contract.effect_ground import TOP, usual_grounds
from chladni_contract.effect_rules import (
    ActingEffect,
    acts,
    exact_slopes,
    idle_at_nominal,
    reports_in_json,
    survives_pickling,
    symmetric_operators,
)
from chladni_contract.effect_visibility import visibility
from chladni_contract.family_rules import tried, weighed, written
from chladni_specimens import STEEL, folded_panel

from .conftest import EXAMPLES, FLEXIBLE, full, installed_examples

NAMES = (*(family.name for family in registry.BUILT_IN), *EXAMPLES.values())
CONTRACT = {  # names that issue texts, cases and other programs may use
    *("global-stiffness", "global-density", "part-stiffness", "stiffness-patch"),
    *("doubler", "stiffener", "open-joint", "thickness-scale", "thickness-distribution"),
    *("orthotropic-material", "membrane-prestress"),
    *("adhesive-stiffness", "viscoelastic-joint", "hem-contact", "weld-missing"),
    *("weld-compliance", "over-constraint", "contact-stiffness", "rattle", "joint-friction"),
    *("point-mass", "mass-patch", "sensor-mass", "local-resonator", "suspension"),
    *("shaker-restraint", "extra-support", "compliant-support", "sensor-fault", "crack"),
    *("rotating-part", "solid-patch"),
}


@pytest.fixture(scope="module", autouse=True)
def packages(tmp_path_factory):
    """All example packages, installed."""
    with installed_examples(tmp_path_factory.mktemp("site")):
        yield


def ground_of(name):
    """Name of the structure that has what a family needs."""
    if name == "slipping-bolts":
        return "two plates on bushes"
    return usual_grounds(registry.family(name))[0]


@pytest.fixture(scope="module")
def on_plate(grounds):
    return grounds("plate")


@pytest.fixture(scope="module")
def case(grounds):
    """Families with two of their candidates, by name, on the ground that has what they need."""

    def made(name):
        found = tried(registry.family(name), grounds(ground_of(name)))
        return replace(found, acting=found.acting[:2])

    return cache(made)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("rule", RULES)
def test_a_family_keeps_the_contract(case, name, rule):
    """A broken rule raises its sentence."""
    RULES[rule](case(name))


def test_names_are_unique_and_ours_are_in_the_contract():
    names = registry.names()
    assert len(set(names)) == len(names) == len(NAMES)
    assert {family.name for family in registry.BUILT_IN} <= CONTRACT


EXACT_WEIGHTS = (
    "point-mass", "extra-support", "orthotropic-material", "local-resonator", "stiffness-patch",
    "mass-patch", "sensor-mass", "edge-mass", "stringer",
)  # fmt: skip


@pytest.mark.parametrize("name", EXACT_WEIGHTS)
def test_weight_is_exactly_what_the_written_structure_weighs(name, case):
    for acting in case(name).acting:
        weighed(acting, case(name).ground.deck, 1e-9)


# Effects that no family proposes, and fields of a sheet at a place and a size of their own ----


@pytest.fixture(scope="module")
def others(on_plate):
    """Name: an effect on the plate, where it acts and where it does nothing."""
    reduced, where = on_plate.reduced, on_plate.by_responses.where
    groups, own = reduced.groups, solved(reduced.structure, 2 * TOP)
    over = mesh_errors(own, TOP)[0]
    jitter, waves = modal_discrepancy(own, TOP, over), random_field(groups, "t", 0.03)
    r, n = len(jitter.omega), len(waves.parameters)
    local, ortho = np.array([-1.0, np.log(0.3), 0.1, 0.05, 0.3]), material_axes(where)[0]
    means = np.array([p.mean for p in ortho.parameters])
    ones = (Parameter("k", "-", 0.0, 0.4),)
    half = np.full((len(groups), 1), 0.5)
    number = FreeParameter("E", "E", ("sheet",), 0.1, 0.8, 1.3, positions=(0,))
    seen = on_plate.by_responses.data
    tilts = tuple(Parameter(f"tilt {k}", "-", 0.0, 1.0, kind="linear") for k in range(2))
    at = np.eye(len(seen.a) + len(seen.b))[:, [-1]]
    rows = tuple(seen.outputs[[k]] for k in range(2))
    gauge = channels.GaugeErrors(tilts, "gauge", rows=rows, shapes=at)
    (cords,) = unknown_cords(reduced.structure, np.array([10.0]), np.eye(3)[2:])
    by_mesh = dict(rows=over.rows, omega=over.omega, log=over.log)
    found = {
        **{
            name: (calibration_parameter(groups, name, [0]), [x], [0])
            for name, x in (("E", 0.07), ("rho", -0.05), ("t", 0.04))
        },
        "user parameter": (user_parameter(groups, number), [0.2], [0]),
        "scatter": (waves, np.cos(1 + np.arange(n)), np.zeros(n)),
        "gain": (channels.channel_gain(4, 0.5), [0.3], [0]),
        "gauge-errors": (gauge, [0.3, -0.2], [0, 0]),
        "mesh-error": (over, [1.0], [0]),
        "joint-footprint": (JointFootprint(over.parameters, over.text, **by_mesh), [1.0], [0]),
        "beam-theory": (BeamTheory(over.parameters, over.text, **by_mesh), [1.0], [0]),
        "unknown-cords": (cords, [0.1, -0.2, 0.3], [-40, -40, -40]),
        "jitter": (jitter, 0.01 * np.sin(np.arange(r) + 1), np.zeros(r)),
        "fold-bending": (
            FoldBending(ones, "folds", quantity="bending", functions=half), [0.3], [0],
        ),
        "family": (model_families(reduced.structure)[0], [0.3], [0]),
        "orthotropic-material": (ortho, [0.18, -0.22, 0.1, means[3] + 0.1], means),
        "thickness-distribution": (
            ThicknessDistribution.on(groups, 0, 9), local, [-40, *local[1:]],
        ),
        "stiffness-patch": (StiffnessPatch.on(groups, 0, 9), [-0.6, *local[1:]], [-40, *local[1:]]),
        "mass-patch": (MassPatch.on(groups, 0, 9), [0.4, *local[1:]], [-30, *local[1:]]),
    }  # fmt: skip
    return {
        name: ActingEffect(
            e, np.array(x, float), np.array(idle, float),
            reduced.model_for(e, np.array(x, float)), FLEXIBLE,
        )
        for name, (e, x, idle) in found.items()
    }  # fmt: skip


OTHERS = (
    "E", "rho", "t", "user parameter", "scatter", "gain", "mesh-error", "joint-footprint",
    "beam-theory", "unknown-cords", "jitter", "fold-bending", "family", "orthotropic-material",
    "thickness-distribution", "stiffness-patch", "mass-patch",
)  # fmt: skip
EFFECT_RULES = {
    "idle": idle_at_nominal, "acts": partial(acts, least=1e-3), "symmetric": symmetric_operators,
    "slopes": exact_slopes, "reports": reports_in_json, "pickles": survives_pickling,
}  # fmt: skip
WRITTEN = {  # no deck holds the others: largest difference of a frequency
    **dict.fromkeys(("E", "rho", "t", "user parameter"), 0.003), "orthotropic-material": 0.005,
    **dict.fromkeys(("thickness-distribution", "stiffness-patch", "mass-patch"), 0.003),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHERS)
@pytest.mark.parametrize("rule", EFFECT_RULES)
def test_an_effect_keeps_the_contract(others, name, rule):
    EFFECT_RULES[rule](others[name])


@pytest.mark.parametrize("name", WRITTEN)
def test_the_deck_of_a_field_has_its_frequencies(others, on_plate, name):
    written(others[name], on_plate.deck, WRITTEN[name])
    if name in ("E", "rho", "t", "stiffness-patch", "mass-patch"):
        weighed(others[name], on_plate.deck, 1e-9)


def test_every_kind_is_held_to_the_contract(others):
    """All classes in chladni.effects with a name of their own; patches about joints have a file."""

    def kinds(kind):
        below = {c for sub in kind.__subclasses__() for c in {sub, *kinds(sub)}}
        return {c for c in below if c.__module__.startswith("chladni.") and "name" in vars(c)}

    held = {type(one.effect) for one in others.values()} | {f.effect for f in registry.BUILT_IN}
    assert kinds(Effect) == held | {WeldPatch, RigidPatch, HalvedMesh}


def test_scatter_and_mesh_error_agree_with_the_full_structure(others, on_plate):
    """The same thickness in every shell; the whole mesh error leads to the refined mesh."""
    deck, one = on_plate.deck, others["scatter"]
    factor = np.exp(one.effect.functions @ one.x)[on_plate.reduced.groups.group]
    shells = replace(deck.shells, thickness=deck.shells.thickness * factor[:, None])
    for acting, due in ((one, replace(deck, shells=shells)), (others["mesh-error"], refined(deck))):
        got = np.sqrt(acting.lam(acting.x)) / (2 * np.pi)
        assert_allclose(got, full(due, 12)[FLEXIBLE], rtol=0.003)


def test_modal_discrepancy_moves_every_mode_by_itself(others):
    one = others["jitter"]
    due = np.sort(one.effect.omega**2 * np.exp(one.x))
    assert_allclose(due, one.state(one.x).lam[6 : 6 + len(one.x)], rtol=1e-8)


# Candidates ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [f.name for f in registry.BUILT_IN if f.candidates is None])
def test_known_places_are_candidates_by_frequencies_alone(grounds, name, monkeypatch):
    """Each from the lowest minima of its prior where it has many parameters."""
    family = registry.family(name)
    search = grounds(ground_of(name)).by_poles
    monkeypatch.setattr(type(search), "optima", lambda self, e: [np.zeros(len(e.parameters))])
    assert family.proposed(search)


def test_one_channel_at_half_its_level_is_the_first_candidate(on_plate):
    first = channels.FAMILY.proposed(on_plate.by_responses)[0]
    assert first.effect.channel == 2
    assert first.start[0] < np.log(0.5) / 2  # nearer to the truth than to no fault


def test_candidates_begin_at_the_nominal_and_at_the_calibrated_model(on_plate):
    """Scatter is idle in both: it would have taken what an effect is to explain."""
    search = on_plate.by_responses
    nominal, calibrated = search.bases
    assert not nominal.any()
    assert calibrated[0] == search.null[0] != 0
    assert search.null[1:].any()
    assert not calibrated[1:].any()


@pytest.mark.parametrize("family", [masses.POINT, springs.SUPPORT, masses.RESONATOR])
def test_begins_anew_where_it_moved_to(on_plate, family):
    """Half a patch off its start it stays; a grid off, it begins at the grid it moved to."""
    search, where = on_plate.by_responses, on_plate.by_responses.where
    effect = family.effect.near(where, where.grids.position(1250))
    rest = np.zeros(len(effect.parameters) - 3)
    assert family.closer(search, effect, np.array([0.3, 0.5, -0.5, *rest])) is None
    step = where.grids.point[where.grids.position(1260)] - effect.patch.origin
    x = np.array([0.3, *(effect.patch.plane @ step / effect.patch.size), *rest])
    found = family.closer(search, effect, x)
    assert found.base is search.bases[-1]
    assert found.effect.grids == (1260,)
    assert found.effect.trials_factor == len(where.places)
    model, old = on_plate.reduced.model_for(effect, x), np.array([0.3, 0.0, 0.0, *rest])
    moved, anew, was = (
        evaluate(model, [e], y, False).lam[FLEXIBLE]
        for e, y in ((effect, x), (found.effect, found.start), (effect, old))
    )
    assert np.abs(anew - moved).max() < 0.5 * np.abs(was - moved).max()


# An effect that breaks each rule ---------------------------------------------------------------


@pytest.fixture(scope="module")
def stringer():
    """The effect of the page on extensions."""
    return registry.family("stringer")


def broken(family, **methods):
    """The family with a class in which some methods and attributes are others."""
    made = dataclass(frozen=True, eq=False)(type("Broken", (family.effect,), methods))

    def placed(where):
        return [made(**vars(effect)) for effect in family.placed(where)]

    return replace(family, effect=made, placed=placed)


def with_terms(family, of_coefficient, of_gradient=None, **more):
    """The family with other coefficients and gradients of all its terms."""

    def terms(self, x):
        return tuple(
            replace(
                t, coefficient=of_coefficient(t.coefficient),
                gradient=(of_gradient or of_coefficient)(t.gradient),
            )
            for t in family.effect.terms(self, x)
        )  # fmt: skip

    return broken(family, terms=terms, **more)


def same(c):
    return c


@pytest.fixture(scope="module")
def breakages(stringer):
    """Rule: effects that break it, and words of the sentence."""
    kind, conceal = stringer.effect, stringer.conceal

    def one_sided(self, x):
        first, *rest = kind.terms(self, x)
        operator = first.operator + 1e-3 * sp.triu(first.operator, 1)
        return (replace(first, operator=sp.csr_array(operator)), *rest)

    def along_rows(where):
        """Rows of points in place of the ids of grids."""
        a = strength("a", "m", 3e-3, 0.5, (0.0,))
        return [kind.along(where, [0, 1, 2], BeamSection(STEEL, 1e-5), a, "along an edge")]

    def infinite(self, x, sd):
        return (replace(kind.reported(self, x, sd)[0], high=float("inf")),)

    def place(**where):
        return lambda self, x, sd=None: replace(self.where(), **where)

    def truth(**parameters):
        def drawn(article, rng):
            made = conceal(article, rng)
            return replace(made, truth={**made.truth, "parameters": parameters})

        return replace(stringer, conceal=drawn)

    unseeded = replace(stringer, conceal=lambda a, rng: conceal(a, np.random.default_rng()))
    nothing = replace(stringer, conceal=lambda a, rng: a.with_hidden(a.assembly, {"a": 4e-3}))
    remade = replace(kind.traits, remakes_structure=True)
    return {
        "proposes candidates": [
            (replace(stringer, placed=lambda where: []), "proposes no candidate"),
            (replace(stringer, placed=lambda where: 1 / 0), "ZeroDivisionError in <lambda>"),
            (replace(stringer, effect=registry.family("crack").effect), "the family is of Crack"),
            (replace(stringer, placed=along_rows), "LabelError in along_rows"),
            (broken(stringer, starts=lambda self: [np.zeros(2)]), "begins at 2 numbers"),
        ],
        "describes itself": [
            (broken(stringer, claim="The sheet carries a stringer."), "without a full stop"),
            (replace(stringer, settled_by=" "), "settled_by is empty"),
        ],
        "lies in the structure": [
            (broken(stringer, location=place(point_m=(30.0, 0.0, 0.0))), "29.6 m outside"),
            (broken(stringer, location=place(grids=(0,))), "grid 0, which the deck lacks"),
        ],
        "does nothing at its nominal values": [
            (with_terms(stringer, lambda c: c + 0.5, same), "its terms must vanish there"),
        ],
        "acts at other values": [
            (with_terms(stringer, lambda c: 1e-6 * c), "raise Parameter.scale"),
        ],
        "has symmetric operators": [(broken(stringer, terms=one_sided), "not symmetric")],
        "keeps K and M positive": [(with_terms(stringer, lambda c: -c), "within the prior")],
        "has exact slopes": [
            (with_terms(stringer, same, lambda g: 0.5 * g), "derivatives of the coeff"),
        ],
        "does nothing where it is in the structure": [
            (with_terms(stringer, same, traits=remade), "relative to in_structure"),
        ],
        "applies what its terms say": [
            (with_terms(stringer, lambda c: 2 * c), "the same physics"),
        ],
        "weighs what it writes": [
            (broken(stringer, weight=lambda self, x: Weight(0.0, 0 * x)), "from weight(x)"),
        ],
        "writes its cards": [
            (replace(stringer, cards=("CBAR",)), "has MAT1, PBAR, which"),
            (broken(stringer, apply=lambda self, made, x: made), "leaves the frequencies"),
        ],
        "reports plain numbers": [(broken(stringer, reported=infinite), "what JSON does not")],
        "survives pickling": [(broken(stringer), "cannot be pickled")],
        "is concealed on the bench": [
            (truth(a=4.0), "use one unit (SI)"),
            (truth(side=4e-3), "the names that it reports"),
            (unseeded, "draw every number from rng"),
            (nothing, "with the changed assembly"),
        ],
    }  # fmt: skip


@pytest.mark.parametrize("rule", RULES)
def test_a_broken_effect_breaks_its_rule(breakages, on_plate, rule):
    assert breakages[rule]
    for family, words in breakages[rule]:
        (found,) = checked_rules(family, on_plate, [rule])
        assert (found.rule, found.passed) == (rule, False)
        assert words in found.text


def test_what_needs_a_candidate_is_not_tried_without_one(stringer, on_plate):
    first, *rest = checked_rules(replace(stringer, placed=lambda where: []), on_plate)
    assert (first.rule, first.passed) == (PROPOSES, False)
    assert {one.passed for one in rest} == {None}
    assert [one.rule for one in rest] == [name for name in RULES if name != PROPOSES]


# The check of an effect ------------------------------------------------------------------------


@pytest.fixture
def prepared(grounds, monkeypatch):
    """The check takes the structures that are prepared already."""
    ready = {name: partial(grounds, name) for name in effect_check.GROUNDS}
    monkeypatch.setattr(effect_check, "GROUNDS", ready)


@pytest.mark.parametrize("name", EXAMPLES.values())
def test_an_effect_of_a_package_is_visible(grounds, name):
    """Each example conceals more than the scatter of articles."""
    assert visibility(registry.family(name), grounds(ground_of(name))).seen


def test_it_is_checked_on_a_given_deck(tmp_path):
    panel = folded_panel(0.3, 0.2, 0.04, 0.01, 0.05, 1e-3)
    deck = write_assembly(panel, tmp_path / "p.bdf", "mm-t-s")
    found = chladni.check_effect("stringer", deck, "mm-t-s")
    assert not found.broken, found.summary()
    assert found.structure == "p.bdf"
    assert found.trusted() is found
    words = ("check-effect", "stringer", "--deck", deck, "--out", tmp_path / "x")
    assert "--units" in refused(*words)


def test_an_invisible_effect_is_said_to_be_so(on_plate, stringer, prepared):
    """A stringer of a tenth of the side moves the responses less than scatter does."""

    def thin(article, rng):
        made = with_masses(article.assembly, (article.assembly.ids[0],), 1e-6)
        return article.with_hidden(made, {"a": 3e-3})

    loud, faint = (visibility(f, on_plate) for f in (stringer, replace(stringer, conceal=thin)))
    assert loud.scatter == faint.scatter > 0
    assert faint.seen == 0 < loud.seen
    assert max(faint.moved) < 0.01 * loud.scatter
    found = chladni.check_effect(replace(stringer, settled_by=" "))
    assert "rules are broken" in found.summary()
    assert "note: no draw is visible" in replace(found, visibility=faint, unseen="").summary()
    with pytest.raises(AccuracyError, match="describes itself: settled_by is empty"):
        found.trusted()


def test_the_command_says_every_rule_and_ends_by_them(stringer, tmp_path, monkeypatch, prepared):
    done = ran("check-effect", "stringer", "--out", tmp_path / "good")
    for rule in RULES:
        assert rule in done.output
    held = json.loads((tmp_path / "good" / "effect.json").read_text())
    assert {row["outcome"] for row in held["rules"]} == {"passes"}
    assert held["visibility"]["seen"] > 0
    assert (tmp_path / "good" / "report.html").exists()

    monkeypatch.setattr(registry, "family", lambda name: replace(stringer, cards=("CBAR",)))
    done = ran("check-effect", "stringer", "--out", tmp_path / "bad", code=3)
    assert "stringer breaks 1 of 15 rules; the first, writes its cards" in done.stderr
    assert (tmp_path / "bad" / "effect.json").exists()


def test_an_unknown_name_is_refused_with_the_nearest(tmp_path):
    said = refused("check-effect", "stringr", "--out", tmp_path / "x")
    assert "did you mean 'stringer'?" in said
    with pytest.raises(LabelError, match="did you mean 'stringer'"):
        chladni.check_effect("stringr")


# Details ----------------------------------------------------------------------------------------


def test_reversed_channel_is_reported_with_its_sign():
    fault = channels.sensor_fault("7+Z", 1, 4, -1, 0.0)
    row = fault.reported(np.array([np.log(2.0)]), np.array([0.1]))[0]
    assert_allclose(row.value, -2.0)
    assert row.low <= row.value <= row.high
    assert_allclose(fault.terms(np.zeros(1))[0].value[1], 1j * np.pi / np.log(10))


def test_groups_hold_all_of_the_shells(on_plate):
    groups = element_groups(on_plate.reduced.structure, 16)
    assert len(groups) == 16
    assert_allclose(groups.area.sum(), 0.12)
    assert_allclose(groups.weight.sum(), 7850 * 0.12 * 1.5e-3)
