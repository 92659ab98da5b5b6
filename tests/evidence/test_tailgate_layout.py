"""Thirty sensors on the tailgate see all modes, those of an article with a real hem and of draws.

Layouts are planned on the nominal deck at 20 mm. The article has another hem and another mesh
(16 mm); the fifty drawn models, thickness of every part off by 10 % (1 sd), are not those the
robust layout was made for.
"""

import numpy as np
import pytest

import chladni_planning as pretest
from chladni.fem.assemble import structure
from chladni.fem.locate import rows_at
from chladni.geometry.nearest import ShellSurface
from chladni_planning import PlanSettings, plan_test
from chladni_planning.drawn_models import drawn, ensemble
from chladni_planning.whole_plan import recovered, seen_at, target_modes
from chladni_specimens.tailgate.design import TailgateDesign
from chladni_specimens.tailgate.tailgate import tailgate

pytestmark = pytest.mark.slow

SETTINGS = PlanSettings(sensors=30, modes=15)
SIZE, DRAWS = 0.020, 20


@pytest.fixture(scope="module")
def deck():
    assembly = tailgate(TailgateDesign(size=SIZE))
    return assembly, structure(assembly)


@pytest.fixture(scope="module")
def robust(deck):
    assembly, built = deck
    return plan_test(assembly, PlanSettings(sensors=30, modes=15, draws=DRAWS), built=built)


@pytest.fixture(scope="module")
def plain(deck):
    """By log det alone, on the nominal model alone: what the textbook does."""
    assembly, built = deck
    return plan_test(assembly, PlanSettings(sensors=30, modes=15, alike=1.0), built=built)


@pytest.fixture(scope="module")
def told(deck):
    """On the nominal model alone, modes told apart as in the robust plan."""
    assembly, built = deck
    return plan_test(assembly, SETTINGS, built=built)


def alike(phi):
    """Highest AutoMAC off the diagonal of shapes at the sensors (..., m, r)."""
    return pretest.likeness(phi.mT @ phi).max(axis=(-2, -1))


def test_all_modes_are_seen(robust, plain):
    """Fifteen modes, each seen with a fifth of its largest motion at least."""
    for planned in (robust, plain):
        assert len(planned.modal) == 15
        assert planned.modal.frequency[13] < 200.0
        assert planned.visible.min() >= 0.2
        assert planned.observable == (30, 30)


def test_exchange_beats_efi_beats_qr(plain):
    values = [plain.log_det[k] for k in ("with exchange", "effective independence", "pivoted QR")]
    assert values == sorted(values, reverse=True)


@pytest.mark.parametrize("size", [0.020, 0.016])
def test_the_modes_of_the_real_hem_are_told_apart(robust, plain, size):
    """Worst AutoMAC of the article's modes at the sensors at most 0.2, and less than at the
    textbook's layout.
    """
    article = tailgate(TailgateDesign(size=size, hem="real"))
    built = structure(article)
    modal, _, _ = target_modes(built, SETTINGS)
    worst = []
    for planned in (robust, plain):
        at = planned.mounts.points[planned.layout]
        located = ShellSurface.whole(article).closest_points(at)
        assert located.distance.max() < 1e-3
        rows = rows_at(built, located, planned.mounts.directions[planned.layout])
        worst.append(float(alike(rows @ modal.shapes)))
    assert worst[0] <= 0.2
    assert worst[0] < worst[1]


def test_the_robust_layout_wins_on_the_worst_of_fifty_draws(deck, robust, plain, told):
    """On the worst draw its modes look less alike than at either layout of the nominal model."""
    _, built = deck
    models = ensemble(built, float(robust.modal.frequency[-1]), 0.1)
    basis = seen_at(robust.places, robust.mounts, recovered(built, models.basis))
    _, shapes = drawn(models, basis, 15, 50, 0.1, seed=1234)
    worst = [alike(shapes[:, p.layout]).max() for p in (robust, told, plain)]
    assert worst[0] < 0.35
    assert worst[0] < worst[1] < worst[2]
    assert np.linalg.slogdet(shapes[:, robust.layout].mT @ shapes[:, robust.layout])[0].min() > 0
