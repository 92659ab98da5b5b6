"""A search keeps many hypotheses: what each of them holds for itself is little."""

import gc
import weakref
from dataclasses import fields, is_dataclass

import numpy as np
import pytest
import scipy.sparse as sp
from tests.builders.recorded_plate import with_attachments

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.inference.hypothesis_fit import fitted
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import plate


def arrays(value, found=None, met=None):
    """{id: array} of all arrays that a value holds, views as what they look at."""
    found, met = ({} if x is None else x for x in (found, met))
    if isinstance(value, np.ndarray):
        while isinstance(value.base, np.ndarray):
            value = value.base
        found[id(value)] = value
    elif id(value) not in met:
        met[id(value)] = value
        if sp.issparse(value):
            inside = [value.data, value.indices, value.indptr]
        elif is_dataclass(value):
            inside = [getattr(value, f.name) for f in fields(value)]
        elif isinstance(value, dict):
            inside = list(value.values())
        else:
            inside = list(value) if isinstance(value, tuple | list) else []
        for one in inside:
            arrays(one, found, met)
    return found


def own(value, beside):
    """Arrays of a value that another one does not hold."""
    shared = arrays(beside)
    return [a for key, a in arrays(value).items() if key not in shared]


@pytest.mark.parametrize("cells", [8, 24])
def test_a_grown_model_holds_its_new_vectors_alone(cells):
    """Whatever the mesh: n k numbers of k new vectors and their borders, never n r."""
    reduced = reduced_problem(plate(0.4, 0.3, cells, cells, 1.5e-3), 250.0, groups=6)
    model, rows = reduced.model, reduced.grids.rows[[3, 20]]
    model.operator(reduced.structure.system.M)
    grown = with_attachments(reduced, rows)
    grown.operator(reduced.structure.system.M)
    (n, r), k = model.vectors.shape, grown.vectors.shape[1] - model.vectors.shape[1]
    assert k == 2
    mine, g = sum(a.nbytes for a in own(grown, model)) / 8, len(model.groups)
    borders, squares = 3 * g * (r + 2 * k) * k, 4 * (r + k) ** 2
    assert mine <= n * k + borders + squares


def test_a_fit_that_is_kept_has_let_go_of_slopes(reduced, responses):
    effects = [
        calibration_parameter(reduced.groups, "E", [0]),
        calibration_parameter(reduced.groups, "t", [0]),
    ]
    data = responses.allowing_errors(evaluate(reduced.model, effects, np.zeros(2), False))
    found = fitted(reduced.model, effects, data, None, np.zeros(2), 2)
    m = len(found.state.lam)
    of_parameters = [a for a in own(found, data) if a.shape[-2:] == (m, m) and a.ndim == 3]
    assert not of_parameters
    assert evaluate(reduced.model, effects, found.x).dK.times(np.eye(m)).shape == (2, m, m)


def test_a_model_is_split_once_while_it_is_held(reduced):
    """Components weigh four times as much: hypotheses share them, and none stays without one."""
    split = reduced.model.with_components()
    assert reduced.model.with_components() is split
    known = weakref.ref(split)
    del split
    gc.collect()
    assert known() is None
