"""What data can tell of parameters, where the theory of plates and springs says it in advance."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.effects.calibration_parameters import SPREAD, calibration_parameter, defaults
from chladni.effects.effect import Effect, Parameter
from chladni.effects.user_parameters import user_parameter
from chladni.inference.hypothesis_fit import UpdatingProblem
from chladni.inference.identifiability import collinearity, identifiability
from chladni.inference.map_fit import APART, MassMeasurement
from chladni.inference.pole_data import Poles
from chladni.model.free_parameter import FreeParameter
from chladni.model.ground_springs import with_springs
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni.search.preparation import carrying, off_the_scales
from chladni_specimens.plates import plate

TOP = 200.0
E, RHO, T = "E of plate", "rho of plate", "t of plate"


@pytest.fixture(scope="module")
def bare():
    return reduced_problem(plate(0.4, 0.3, 8, 6, 1.5e-3), TOP)


def problem(reduced, effects, weighed=False):
    """The flexible modes of a plate that is as its model says."""
    state = evaluate(reduced.model, effects, np.zeros(sum(len(e.parameters) for e in effects)))
    f = np.sqrt(np.maximum(state.lam, 0)) / (2 * np.pi)
    f = f[(f > 5) & (f < TOP)]
    one = np.ones(len(f))
    data = Poles(f, 1e-3 * one, one.astype(bool), one, (10.0, TOP))
    mass = MassMeasurement(state.weight, 0.002 * state.weight) if weighed else None
    return UpdatingProblem(reduced, data, mass, tuple(effects), (), None)


def rows(found):
    return {row.name: row for row in found.parameters}


def sheet(reduced, quantities):
    return [calibration_parameter(reduced.groups, q, [0], SPREAD[q]) for q in quantities]


def test_frequencies_of_a_thin_plate_tell_e_times_t_squared_and_no_more(bare):
    """ω² is proportional to E t³ / (ρ t): the direction left is dE/E = -2 dt/t."""
    found = identifiability(problem(bare, sheet(bare, "Et")))
    ((first, second),) = found.directions
    assert first == (E, 1.0)
    assert second[0] == T
    assert second[1] == pytest.approx(-0.5, abs=0.01)
    assert found.frozen == (E,)
    assert 170e9 < rows(found)[E].low < 210e9 < rows(found)[E].high < 260e9
    assert "alloy" in rows(found)[E].reason
    assert "E of plate changes by +1 % and t of plate by -0.50 %" in rows(found)[E].why
    assert "weighing the article would settle it" in rows(found)[E].why
    assert found.collinearity > 100


def test_the_weighed_mass_settles_e_and_t(bare):
    """The mass is ρ t: with ρ known it gives t, and the frequencies give E."""
    found = rows(identifiability(problem(bare, sheet(bare, "Et"), weighed=True)))
    assert not any(row.frozen for row in found.values())
    assert found[T].sd_after == pytest.approx(0.002, rel=0.05)
    assert found[E].why == "the weighed mass settles it"


def test_weighing_leaves_e_rho_and_t_one_direction(bare):
    """E t³ and ρ t are known, so that 1 % of E is undone by 1/3 % of ρ and -1/3 % of t."""
    found = identifiability(problem(bare, sheet(bare, ("E", "rho", "t")), weighed=True))
    (direction,) = (dict(d) for d in found.directions)
    assert_allclose([direction[k] for k in (E, RHO, T)], [1, 1 / 3, -1 / 3], atol=0.01)
    assert found.frozen == (E,)
    assert "weighing" not in rows(found)[E].why


@pytest.mark.parametrize(("off", "said"), [(0.03, ""), (0.2, "more than the deck")])
def test_a_weight_beyond_what_density_and_thickness_allow_is_said(bare, off, said):
    """Their variances add, (0.06² + 0.05²) m²."""
    weighed = problem(bare, sheet(bare, ("E", "rho", "t")), weighed=True)
    mass = weighed.mass_measurement
    given = replace(weighed, mass_measurement=replace(mass, mass=(1 + off) * mass.mass))
    text = off_the_scales(given)
    assert said in text
    assert bool(text) == bool(said)
    allowed = APART * np.hypot(0.06, 0.05) * mass.mass
    assert not said or text.endswith(f"allow {allowed:.2g} kg")


def test_a_spring_that_no_mode_strains_is_unknown(bare):
    """Bending of a flat plate does not move its grids in its plane."""
    model = with_springs(plate(0.4, 0.3, 8, 6, 1.5e-3), (7,), np.eye(3)[:1], 400.0)
    reduced = reduced_problem(model, TOP)
    spring = user_parameter(reduced.groups, FreeParameter("K", "K", springs=(0,), sd=0.2))
    row = rows(identifiability(problem(reduced, [*sheet(reduced, "E"), spring])))[spring.text]
    assert row.frozen
    assert row.sd_single is None or row.sd_single > 1
    assert row.sd_after == pytest.approx(0.2)
    assert "not at all" in row.why


@dataclass(frozen=True, eq=False)
class InOtherUnits(Effect):
    """An effect whose parameters are counted in another unit: x = c y."""

    kind = "calibration"

    of: Effect = field(default_factory=Effect)
    c: float = 1.0

    def terms(self, x):
        return tuple(replace(t, gradient=self.c * t.gradient) for t in self.of.terms(self.c * x))


def in_other_units(effect, c):
    p = effect.parameters[0]
    unknown = Parameter(p.name, p.unit, p.mean / c, p.sd / c, kind="linear")
    return InOtherUnits((unknown,), effect.text, of=effect, c=c)


@dataclass(frozen=True, eq=False)
class Scatter(InOtherUnits):
    """The same change as a nuisance."""

    kind = "nuisance"


@pytest.mark.parametrize(("sd", "frozen"), [(1e-4, ()), (0.5, (E,))])
def test_a_nuisance_that_does_the_same_hides_a_parameter(bare, sd, frozen):
    """What the data tell of the sum of both is told of neither, unless the nuisance is small."""
    (effect,) = sheet(bare, "E")
    same = Scatter((Parameter("s", "-", 0.0, sd, kind="linear"),), "scatter", of=effect)
    assert identifiability(problem(bare, [effect, same])).frozen == frozen


def test_the_judgement_does_not_depend_on_units(bare):
    plain = identifiability(problem(bare, defaults(bare.groups), weighed=True))
    scales = (1e-3, 40.0, 2.5)
    others = [in_other_units(e, c) for e, c in zip(defaults(bare.groups), scales, strict=True)]
    other = identifiability(problem(bare, others, weighed=True))
    assert other.frozen == plain.frozen
    assert_allclose(other.correlation, plain.correlation, atol=1e-6)
    assert other.collinearity == pytest.approx(plain.collinearity, rel=1e-3)
    for a, b, c in zip(plain.parameters, other.parameters, scales, strict=True):
        assert_allclose([b.sd_single * c, b.sd_after * c], [a.sd_single, a.sd_after], rtol=1e-5)


def test_a_joint_is_flat_where_stiff_and_steep_where_soft(bare):
    """A spring to ground far stiffer than the plate acts as rigid; a soft one moves the modes."""
    model = with_springs(plate(0.4, 0.3, 8, 6, 1.5e-3), (1,), np.eye(3)[2:], 1e7)
    reduced = reduced_problem(model, TOP)
    spring = user_parameter(reduced.groups, FreeParameter("K", "K", springs=(0,), sd=4.0))
    reduced = carrying(reduced, [spring])
    found = identifiability(problem(reduced, [*sheet(reduced, "E"), spring]))
    row = rows(found)[spring.text]
    softest, *_, stiffest = row.along
    assert softest.value < 1e7 < stiffest.value
    assert softest.sd_data < 1 < 100 * softest.sd_data < stiffest.sd_data
    assert not row.frozen  # the data know it where it is soft
    assert [p.known for p in row.along] == sorted((p.known for p in row.along), reverse=True)


def test_collinearity_of_two_slopes_at_an_angle():
    """λ_min of [[1, c], [c, 1]] is 1 - |c|."""
    J = np.array([[3.0, 0.1 * np.cos(0.2)], [0.0, 0.1 * np.sin(0.2)]])
    assert collinearity(J.T @ J) == pytest.approx(1 / np.sqrt(1 - np.cos(0.2)))
    assert collinearity(np.diag([1.0, 0.0])) is None
