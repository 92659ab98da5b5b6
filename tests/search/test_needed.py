"""What has to be gained before a name: the chance of a false alarm, where naming it may be one."""

from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.element_groups import element_groups
from chladni.effects.orthotropy import orthotropic
from chladni.effects.registry import families
from chladni.fem.assemble import structure
from chladni.inference.likelihood import Responses
from chladni.inference.pole_data import Poles
from chladni.model.properties import Isotropic
from chladni.search.decision_rules import RULES, required_gain
from chladni.search.diagnosis import Diagnosis
from chladni_specimens.plates import plate

TIED = RULES.tied
DATA = object.__new__(Poles), object.__new__(Responses)


def threshold(data, tried):
    return required_gain(isinstance(data, Poles), tried)


def orthotropy_of(E, rho):
    groups = element_groups(structure(plate(0.4, 0.3, 4, 3, 3e-3, Isotropic(E, 0.3, rho))))
    return orthotropic(groups, (0,), np.array([1.0, 0, 0]))


@pytest.mark.parametrize("data", DATA)
def test_along_its_grain_wood_is_stiffer_as_a_rule(data):
    """Another leader needs the whole price, however many families were tried."""
    others = (SimpleNamespace(effect=SimpleNamespace(expected=False)),) * 12
    wood, steel = (
        SimpleNamespace(effect=orthotropy_of(E, rho)) for E, rho in ((5e9, 420.0), (2.1e11, 7850.0))
    )
    null = SimpleNamespace(data=data, effect=SimpleNamespace(expected=False))

    def due(*hypotheses):
        return Diagnosis(null, null, null, hypotheses).due

    assert due(wood, *others) == TIED < threshold(data, 13)
    assert due(steel, *others) == threshold(data, 13)
    assert due(others[0], wood) == threshold(data, 2)
    assert due() == threshold(data, len(families()))


@pytest.mark.parametrize("data", DATA)
def test_what_is_told_of_another_is_what_it_needs(data):
    wood, other = (SimpleNamespace(effect=SimpleNamespace(expected=e)) for e in (True, False))
    null = SimpleNamespace(data=data)
    found = Diagnosis(null, null, null, (wood, other), "calibration only")
    assert found.due == found.due_of(wood) == TIED
    assert found.due_of(other) == threshold(data, 2)
