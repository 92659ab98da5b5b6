"""Parts that a next calibration could free, against deviations that a known part causes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.fem.modelled import modelled
from chladni.inference.calibration_result import (
    CalibrationStudy,
    Identifiability,
    ParameterKnowledge,
)
from chladni.inference.result import FrequencyRow
from chladni.model.assembly import Assembly
from chladni.search.left_frequencies import regions_to_free, stiffness_for, worst_modes
from chladni_specimens.plates import plate

SOFTER = np.log(0.8)


def two_parts(factor=1.0) -> Assembly:
    """A plate of two parts, E of the right one by a factor."""
    whole = plate(0.4, 0.3, 12, 8, 1.5e-3)
    middle = whole.points[whole.shells.nodes].mean(axis=1)
    (left,) = whole.parts
    material = left.section.membrane
    other = replace(material, E=factor * material.E)
    changed = {k: other for k in ("membrane", "bending", "shear")
               if getattr(left.section, k) is not None}  # fmt: skip
    right = replace(left, id=left.id + 1, name="right", section=replace(left.section, **changed))
    part = (middle[:, 0] > 0.25).astype(int)
    return replace(
        whole, parts=(replace(left, name="left"), right), shells=replace(whole.shells, part=part)
    )


@pytest.fixture(scope="module")
def found():
    """The deck is uniform; the article's right part is 20 % softer."""
    deck, article = (modelled(two_parts(k), 400.0) for k in (1.0, np.exp(SOFTER)))
    f, true = (m.modes.frequency[6:14] for m in (deck, article))
    rows = tuple(FrequencyRow(t, after_hz=m, mac_after=1.0) for t, m in zip(true, f, strict=True))
    return deck, rows


def regions(found, effects=(), frozen=()):
    known = tuple(ParameterKnowledge(n, 1.0, "Pa", 0.1, None, None, 0.1, True) for n in frozen)
    study = CalibrationStudy(Identifiability(known))
    return regions_to_free(found[1], found[0], SimpleNamespace(effects=tuple(effects)), study)


def test_the_part_that_is_softer_comes_first_with_its_stiffness(found):
    """Rayleigh's quotient is of first order: 20 % is found to a fifth of it."""
    right, left = regions(found).regions[:2]
    assert (right.part, left.part) == ("right", "left")
    assert np.log(right.factor) == pytest.approx(SOFTER, rel=0.2)
    assert right.removed > 0.95
    assert right.worst > right.good


def test_the_words_free_it_in_the_next_case(found):
    assert regions(found).words[:3] == ("[[parameter]]", 'parts = ["right"]', 'field = "E"')


def test_what_is_free_or_frozen_is_not_proposed(found):
    free = SimpleNamespace(
        kind="calibration", parts=("right",), parameters=[SimpleNamespace(name="E")]
    )
    assert [r.part for r in regions(found, [free]).proposed] != ["right"]
    assert regions(found, [free]).regions[0].state == "free"
    named = regions(found, frozen=["E of right"])
    assert named.regions[0].state == "frozen"
    assert "right" not in [r.part for r in named.proposed]
    thick = SimpleNamespace(
        kind="calibration", parts=("right",), parameters=[SimpleNamespace(name="t")]
    )
    both = regions(found, [thick], frozen=["E of right"])
    assert both.regions[0].state == "free"  # its stiffness was fitted by t


def test_two_modes_say_nothing(found):
    assert regions((found[0], found[1][:2])) is None


def test_deviations_of_one_part_are_removed_whole():
    share = np.array([[0.7, 0.1, 0.4], [0.3, 0.9, 0.6]])
    change, removed = stiffness_for(share, 0.5 * 0.1 * share[0])
    assert_allclose((change[0], removed[0]), (-0.1, 1.0))
    assert removed[1] < 1.0


def test_a_mode_is_worst_by_its_frequency_or_its_mac():
    away, mac = np.array([0.0, -0.1, 0.01, 0.02, 0.0]), np.array([0.2, 0.99, 0.9, 0.95, 0.99])
    assert_allclose(np.flatnonzero(worst_modes(away, mac)), [0, 1, 2, 3])
    assert_allclose(np.flatnonzero(worst_modes(away[:4], mac[:4])), [0, 1])
