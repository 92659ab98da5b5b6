"""What every family promises, ours and those of packages: physics, candidates, bench and deck."""

import pickle

import numpy as np
import pytest

from chladni.effects import registry
from chladni.effects.extra_support import ExtraSupport
from chladni.effects.local_resonator import LocalResonator
from chladni.effects.point_mass import PointMass
from chladni.reduced.reduced_model import evaluate
from chladni_contract.effect_check import RULES
from chladni_contract.effect_ground import usual_grounds
from chladni_contract.family_rules import tried

FLEXIBLE = slice(6, 12)
NAMES = (*(family.name for family in registry.BUILT_IN), "edge-mass")
CONTRACT = {  # names that issue texts, cases and other programs may use
    *("global-stiffness", "global-density", "part-stiffness", "stiffness-patch"),
    *("thickness-scale", "thickness-distribution", "orthotropic-material", "membrane-prestress"),
    *("adhesive-stiffness", "viscoelastic-joint", "hem-contact", "weld-missing"),
    *("weld-compliance", "over-constraint", "contact-stiffness", "rattle", "joint-friction"),
    *("point-mass", "mass-patch", "sensor-mass", "local-resonator", "suspension"),
    *("shaker-restraint", "extra-support", "compliant-support", "sensor-fault", "crack"),
}


@pytest.fixture(scope="module")
def on_plate(grounds):
    return grounds("plate")


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
def on(family, grounds):
    """The ground that has what a family needs."""
    return grounds(usual_grounds(family)[0])


@pytest.fixture(scope="module")
def case(family, on):
    """A family with its candidates."""
    return tried(family, on)


def lam(model, effect, x):
    return evaluate(model, [effect], x, False).lam[FLEXIBLE]


def test_names_are_unique_and_ours_are_in_the_contract(example_edge_mass):
    names = registry.names()
    assert len(set(names)) == len(names)
    assert {family.name for family in registry.BUILT_IN} <= CONTRACT


@pytest.mark.parametrize("rule", RULES)
def test_keeps_the_contract(case, rule):
    """A broken rule raises its sentence."""
    RULES[rule](case)


def test_known_places_are_candidates_by_frequencies_alone(family, on):
    """Of effects with places of their own; the contract holds the others to it."""
    if family.candidates is None:
        assert family.proposed(on.by_poles)


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
    effect = kind.near(where, where.grids.position(1250))
    rest = np.zeros(len(effect.parameters) - 3)
    closer = next(f.closer for f in registry.BUILT_IN if f.effect is kind)
    assert closer(by_responses, effect, np.array([0.3, 0.5, -0.5, *rest])) is None
    size = effect.patch.size
    step = (
        where.grids.point[where.grids.position(1260)] - effect.patch.origin
    ) @ effect.patch.plane.T
    x = np.array([0.3, *(step / size), *rest])
    found = closer(by_responses, effect, x)
    again, start = found.effect, found.start
    assert found.base is by_responses.bases[-1]
    assert again.grids == (1260,)
    assert again.trials_factor == len(where.places)
    model = reduced.model_for(effect, x)
    moved, anew, old = (
        lam(model, effect, x),
        lam(model, again, start),
        np.array([0.3, 0.0, 0.0, *rest]),
    )
    assert np.abs(anew - moved).max() < 0.5 * np.abs(lam(model, effect, old) - moved).max()


def test_pickles(family, case):
    """Processes hand families and effects to one another."""
    assert pickle.loads(pickle.dumps(family)).name == family.name
    for c in case.candidates:
        again = pickle.loads(pickle.dumps(c.effect))
        assert again.location(c.start) == c.effect.location(c.start)
