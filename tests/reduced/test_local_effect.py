"""Scores of effects added to a state are those over a basis with the effect's own responses."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose
from tests.builders.recorded_plate import with_attachments

from chladni.effects.attachments import AtPoints
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import Effect, MatrixTerm, Parameter, PointTerm, Rise, Weight, Within
from chladni.inference.map_fit import MassMeasurement
from chladni.inference.scan import baseline
from chladni.reduced import local_effect as module
from chladni.reduced.local_effect import LocalEffect
from chladni.reduced.reduced_model import evaluate

WEIGHED = MassMeasurement(1.45, 0.01)
STARTS = [np.array([x]) for x in (-3.0, 0.0, 2.5)]


class Patch(Effect):
    """A stiffness and a mass on some dofs, both times e^x."""

    def __init__(self, terms, **more):
        unknown = (Parameter("c", "-", 0.0, 1.0),)
        object.__setattr__(self, "of", terms)
        super().__init__(unknown, **more)

    def terms(self, x):
        """All grow alike."""
        return tuple(replace(t, coefficient=t.coefficient * float(np.exp(x[0]))) for t in self.of)

    def weight(self, x):
        """A little on the scales."""
        m = 0.002 * float(np.exp(x[0]))
        return Weight(m, np.array([m]))


def operator(reduced, k, size, rng):
    """A positive operator on the dofs of a few neighbouring places."""
    some = reduced.candidates.only(np.arange(k, k + 3)).rows
    at = np.unique(some.indices)
    B = rng.standard_normal((4, len(at)))
    A = sp.csr_array((len(reduced.structure.system.dofs),) * 2).tolil()
    A[np.ix_(at, at)] = size * B.T @ B
    return sp.csr_array(A)


@pytest.fixture(scope="module")
def base(reduced, responses):
    effects = [calibration_parameter(reduced.groups, q, [0]) for q in ("E", "rho")]
    return baseline(reduced.model, effects, responses, WEIGHED, np.array([0.02, -0.03]))


def local_scores(base, reduced, data, effect):
    """Scores of the effect at its starts, added to the state of the base; None: it cannot be."""
    local = LocalEffect.of(reduced, base.effects, effect, base.state, base.x, STARTS[0])
    if local is None:
        return None
    states = [local.added(base.state, base.x, x) for x in STARTS]
    r = [data.scaled(s, False)[0][:, None] for s in states]
    return np.array([
        base.score(replace(base, state=s).with_mass(r_s, 0.0))[0]
        for s, r_s in zip(states, r, strict=True)
    ])  # fmt: skip


def over_a_basis(base, reduced, data, effect, at, wide=True):
    """Scores by evaluations, over a basis with the static responses of these dofs if ``wide``."""
    rows = sp.eye_array(len(reduced.structure.system.dofs), format="csr")[at]
    model = with_attachments(reduced, sp.csr_array(rows)) if wide else reduced.model
    data, out = data.rebased(model), []
    for x in STARTS:
        state = evaluate(model, [*base.effects, effect], np.append(base.x, x), False)
        r, _ = data.scaled(state, False)
        out.append(base.score(replace(base, state=state).with_mass(r[:, None], 0.0))[0])
    return np.array(out)


def test_operators_of_stiffness_and_mass(reduced, responses, base):
    rng = np.random.default_rng(3)
    stiff, heavy = operator(reduced, 20, 3e4, rng), operator(reduced, 20, 2e-5, rng)
    effect = Patch((
        MatrixTerm("K", stiff, 1.0, np.ones(1)), MatrixTerm("M", heavy, 1.0, np.ones(1))
    ))  # fmt: skip
    at = np.unique(stiff.nonzero()[0])
    due = over_a_basis(base, reduced, responses, effect, at)
    blind = over_a_basis(base, reduced, responses, effect, at, wide=False)
    found = local_scores(base, reduced, responses, effect)
    assert_allclose(found, due, rtol=0.02)
    assert np.all(np.abs(found - due)[1:] < 0.1 * np.abs(blind - due)[1:])


def test_points_and_a_basis_that_has_them_agree_to_rounding(reduced, responses, base):
    """Without flexibility beyond the basis nothing is left out."""
    place = reduced.candidates.only(np.array([31]))
    grown = replace(reduced, model=with_attachments(reduced, place.rows))
    data = responses.rebased(grown.model)
    base = baseline(grown.model, base.effects, data, WEIGHED, base.x)
    effect = AtPoints((Parameter("K", "N/m", 0.0, 1.0, 2e3),), rows=place.rows)
    due = over_a_basis(base, grown, data, effect, np.zeros(0, int), wide=False)
    assert_allclose(local_scores(base, grown, data, effect), due, rtol=1e-5)


def test_a_share_counts_as_the_base_left_its_whole(reduced, responses):
    """The base doubles a joint: what is added to one of its pieces is doubled too."""
    rng = np.random.default_rng(5)
    one, other = operator(reduced, 8, 2e4, rng), operator(reduced, 40, 2e4, rng)
    both = Within(frozenset((("joint", 1), ("joint", 2))))
    whole = Patch((MatrixTerm("K", sp.csr_array(one + other), 1.0, np.ones(1), within=both),))
    base = baseline(reduced.model, [whole], responses, WEIGHED, np.zeros(1))
    term = MatrixTerm("K", one, 0.5, np.ones(1))
    own = replace(term, within=Within(frozenset((("joint", 1),))))
    plain, shared = (local_scores(base, reduced, responses, Patch((t,))) for t in (term, own))
    twice = local_scores(base, reduced, responses, Patch((replace(term, coefficient=1.0),)))
    assert_allclose(shared, twice, rtol=1e-9)
    assert np.all(np.abs(plain - twice) > 1e-6 * twice)


def test_other_effects_have_no_local_score(reduced, responses, base, monkeypatch):
    """Fields, rising stiffness, places that move, loads on the base, or too many rows."""
    stiff = operator(reduced, 20, 3e4, np.random.default_rng(3))
    term = MatrixTerm("K", stiff, 1.0, np.ones(1))
    rising = Rise(0.1, np.zeros(1), 50.0, (1.0, 1e3), 0.0, np.zeros(1))

    def none(effect, base=base, reduced=reduced):
        return local_scores(base, reduced, responses, effect) is None

    assert not none(Patch((term,)))
    assert none(calibration_parameter(reduced.groups, "t", [0]))
    assert none(Patch((replace(term, rise=rising),)))
    assert none(Patch((replace(term, geometric=True),)))
    idle = replace(term, operator=operator(reduced, 40, 3e4, np.random.default_rng(3)))
    monkeypatch.setattr(module, "MOST_ROWS", len(np.unique(stiff.indices)))
    assert not none(Patch((term,)))
    assert none(Patch((term, replace(idle, coefficient=0.0))))  # it counts as soon as y moves
    monkeypatch.undo()
    row, unit = reduced.candidates.rows[:1], np.ones(1)
    assert not none(Patch((PointTerm("K", row, unit, unit[None]),)))
    assert none(Patch((PointTerm("K", row, unit, unit[None], {0: row}),)))
    driven = replace(base, state=replace(base.state, drive=np.zeros((1, 1))))
    assert none(Patch((term,)), driven)
    clamped = replace(reduced.model, following=np.zeros((len(reduced.structure.system.dofs), 1)))
    assert none(Patch((term,)), reduced=replace(reduced, model=clamped))
    monkeypatch.setattr(module, "MOST_ROWS", 2)
    assert none(Patch((term,)))
