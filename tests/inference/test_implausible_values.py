"""What a fit took into its nuisances is said where joints could not be that far off."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.calibration_parameters import PartScale
from chladni.effects.effect import Parameter
from chladni.effects.joint_stiffness import ADHESIVE, ModelFamily
from chladni.effects.model_errors import MeshError
from chladni.inference.implausible_values import FAR, error_of_mesh, in_doubt, strained


def fitted(text, away):
    family = ModelFamily((Parameter("k", "-", 0.0, ADHESIVE),), text)
    x = np.array([away * ADHESIVE])
    return SimpleNamespace(effects=(family,), of=lambda effect: x)


@pytest.mark.parametrize("sign", [-1, 1])
def test_adhesive_that_took_more_than_it_scatters_is_told(sign):
    assert strained(fitted("adhesive", 0.9 * FAR * sign)) == []
    (said,) = strained(fitted("adhesive", 1.2 * FAR * sign))
    assert f"{np.exp(1.2 * FAR * sign * ADHESIVE):.2g} times the deck's" in said
    assert "3.6 standard deviations" in said


def test_the_shear_of_a_sheet_is_no_joint():
    assert strained(fitted("shear of inner", 2 * FAR)) == []


def found(effects, x, sd):
    """A fit of effects of one parameter each, at x with standard deviations of its own."""
    at = {id(e): slice(k, k + 1) for k, e in enumerate(effects)}
    return SimpleNamespace(
        effects=tuple(effects), of=lambda e: np.asarray(x)[at[id(e)]],
        sd=lambda e: np.asarray(sd)[at[id(e)]],
    )  # fmt: skip


@pytest.mark.parametrize("sign", [-1, 1])
def test_calibration_that_took_what_no_deck_is_off_by_is_in_doubt(sign):
    """A number far from the deck's may hold what is missing; one that scatters so may not."""
    E = PartScale((Parameter("E", "Pa", 0.0, 0.06),), "E of strip")
    for away in (0.9 * FAR, 1.2 * FAR):
        x = np.array([sign * away * 0.06])
        fit = found([E], x, [0.01])
        said = in_doubt(fit, fit)
        assert bool(said) == (away > FAR)
    assert "E of strip" in said[0]
    assert "measure it first" in said[0]


def test_numbers_that_only_a_coarse_mesh_takes_far_off_are_said_to_be_the_mesh():
    """The null has the error of the mesh and plausible numbers; else the numbers are in doubt."""
    E = PartScale((Parameter("E", "Pa", 0.0, 0.06),), "E of shell")
    stiffer = np.diag(2 * np.log([0.99, 0.92]))
    mesh = MeshError((Parameter("mesh", "-", 1.0, 0.3),), omega=np.array([600.0, 900]), log=stiffer)
    plain = found([E], [1.5 * FAR * 0.06], [0.01])
    near, far = (found([E, mesh], [away * 0.06, 1.0], [0.01, 0.1]) for away in (0.5, 1.5 * FAR))
    coarse = error_of_mesh(near)
    assert coarse == pytest.approx(0.08)
    (said,) = in_doubt(plain, near, coarse)
    assert "off by up to 8 %; refine it" in said
    assert "E of shell" in said
    assert in_doubt(near, near, coarse) == ()
    assert in_doubt(plain, near) == in_doubt(plain, far, coarse)
    assert "measure it first" in in_doubt(plain, near)[0]


@pytest.mark.parametrize(
    ("away", "doubt"), [(0.9 * FAR, False), (1.1 * FAR, True), (-1.1 * FAR, True)]
)
def test_numbers_that_are_far_together_are_in_doubt(away, doubt):
    """E t²/rho alone is told: ln of it is N(0, 3s²) before, and in doubt beyond FAR of its sd.

    Each number takes a third of the square, so that none is beyond 2 of its own.
    """
    s = 0.06
    effects = [PartScale((Parameter(n, "-", 0.0, s),), f"{n} of strip") for n in ("E", "rho", "t")]
    z = away / np.sqrt(3) * np.array([1.0, -1.0, 1.0])
    left = s * np.sqrt(2 / 3)  # the two directions that nothing tells keep their prior
    fit = found(effects, s * z, [left] * 3)
    said = in_doubt(fit, fit)
    assert bool(said) == doubt
    assert not doubt or "E of strip, rho of strip, t of strip together ended 3.3" in said[0]


def test_joints_that_no_joint_is_like_leave_calibration_in_doubt():
    """Whether a deck holds them or the null alone; said once."""
    idle, null = fitted("welds", 0.0), fitted("adhesive", 1.2 * FAR)
    assert in_doubt(idle, fitted("adhesive", 0.9 * FAR)) == ()
    for deck in (idle, null):
        (said,) = in_doubt(deck, null)
        assert said.count("the stiffness of adhesive as a whole") == 1
