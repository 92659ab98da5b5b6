"""A hypothesis kept as arrays has the evidence that its fit has."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.effect import Effect
from chladni.inference.hypothesis_fit import HypothesisFit, fitted
from chladni.reduced.reduced_model import evaluate
from chladni_evidence.recorded_rows import packed, rows_kept, unpacked


@pytest.fixture
def null(reduced, responses):
    data, E = responses.rebased(reduced.model), [calibration_parameter(reduced.groups, "E", [0])]
    data = data.allowing_errors(evaluate(reduced.model, E, np.zeros(1), False))
    return HypothesisFit(Effect(), fitted(reduced.model, E, data, None, np.zeros(1)), reduced.model)


def test_evidence_of_arrays_is_that_of_the_fit(null):
    found, known = SimpleNamespace(null=null), SimpleNamespace(fits={})
    arrays = {}
    for key, row in rows_kept(known, found, None, "null"):
        arrays |= packed(key, row)
    assert all(a.dtype != object for a in arrays.values())
    row = unpacked(arrays)["null"]
    assert row.neg2_log_evidence(row.spread()) == pytest.approx(null.neg2_log_evidence, abs=1e-4)
    wide = row.spread(lambda data: replace(data, sigma_model=10 * data.sigma_model))
    assert row.neg2_log_evidence(wide) < null.neg2_log_evidence  # up to the widths of the data
