"""The reduced problem of a recorded case, row by row, and its evidence under another likelihood.

A row holds the deviations of its responses with their slopes, and the prior information on the
parameters. Evidence takes the parameters as linear about the existing fit, as in
:mod:`chladni.inference.held_out_evidence`; nothing is fitted again.
"""

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from chladni.errors import ModelError
from chladni.inference.hypothesis_fit import HypothesisFit
from chladni.inference.likelihood import Responses
from chladni.inference.linear_model import LinearModel
from chladni.inference.map_fit import MassMeasurement, constants, prior_residuals
from chladni.inference.sensor_errors import SensorErrors, Side
from chladni.reduced.frequency_dependent_stiffness import Dissipated
from chladni.reduced.reduced_model import State, evaluate
from chladni.search.deciding import Measured
from chladni.search.diagnosis import Diagnosis

Arrays = dict[str, np.ndarray]
Likelihood = Callable[[Responses], Responses]
KEPT = {c.__name__: c for c in (Responses, State, SensorErrors, Side, Dissipated)}
LEFT_OUT = {"error", "known", "bent"}  # computed again from the state that errors spread from
CLASS = "class"


@dataclass(frozen=True, eq=False)
class RecordedRow:
    """One hypothesis at its fit."""

    deviation: np.ndarray  # (n_f, n_out, n_in) complex: log10 of model over test
    slopes: np.ndarray  # (n_p, n_f, n_out, n_in) complex: by the parameters
    # r0, J0: residuals and slopes of the information on the parameters besides the data
    r0: np.ndarray
    J0: np.ndarray
    constants: float  # of -2 ln evidence
    # of calibration alone, whose state gives the errors of form for all rows
    data: Responses | None = None

    def neg2_log_evidence(self, data: Responses) -> float:
        """-2 ln evidence of some data, which include the errors of the model's form."""
        assert data.error is not None
        sd = data.std()
        r = data.stacked(self.deviation[None] / sd)[:, 0]
        J = data.stacked(self.slopes / sd[None])
        return (
            LinearModel(data.error, J, self.J0).learned(r, self.r0).neg2_log_evidence
            + self.constants
        )

    def spread(self, likelihood: Likelihood = lambda data: data) -> Responses:
        """The data under a likelihood, with errors of form from calibration alone."""
        assert self.data is not None
        assert self.data.about is not None
        return likelihood(self.data).allowing_errors(self.data.about)


def rows_kept(
    known: Measured, found: Diagnosis, mass: MassMeasurement | None, null: str
) -> Iterator[tuple[str, RecordedRow]]:
    """The rows of a decision on responses; natural frequencies have none.

    A family far behind keeps no model of its own.  It has no row where the common model cannot
    represent its effect.
    """
    for key, hypothesis in {null: found.null, **known.fits}.items():
        data = hypothesis.data
        if isinstance(data, Responses) and data.error is not None:
            with suppress(ModelError):
                yield key, _row(hypothesis, data, mass)


def _row(hypothesis: HypothesisFit, data: Responses, mass: MassMeasurement | None) -> RecordedRow:
    fit = hypothesis.fit
    bare = replace(data, outputs=None, inputs=None)
    state = evaluate(hypothesis.model, fit.effects, fit.x)
    # unit standard deviation, unwhitened, every line: any likelihood can be applied later
    plain = replace(data.exactly(), use=np.ones_like(data.use))
    sd = plain.std()
    J = plain.scaled(state, True)[1]
    shape = (*data.use.shape, data.values.shape[2])
    half = len(J) // 2
    each = (J[:half] + 1j * J[half:]).T.reshape(-1, *shape) * sd
    r0, J0 = prior_residuals(fit.effects, mass, fit.x, state)
    return RecordedRow(
        plain.deviation(state), each.astype(np.complex64), r0, J0, constants(fit.effects),
        None if hypothesis.effect in fit.effects else bare,
    )  # fmt: skip


def packed(key: str, row: RecordedRow) -> Arrays:
    """The arrays of a row, each under its path."""
    out: Arrays = {}
    _pack(f"{key}|", row, out)
    return out


def _pack(path: str, value: Any, out: Arrays) -> None:
    if isinstance(value, np.ndarray):
        out[path] = value
    elif isinstance(value, (float, int, str)):
        out[path] = np.array(value)
    elif is_dataclass(value):
        out[f"{path}{CLASS}"] = np.array(type(value).__name__)
        for f in fields(value):
            if f.name not in LEFT_OUT and not f.name.startswith("_"):
                _pack(f"{path}{f.name}/", getattr(value, f.name), out)
    elif isinstance(value, tuple) and value and sp.issparse(value[0]):
        out[f"{path}{CLASS}"] = np.array("()")  # rows of the structure are in the basis


def unpacked(arrays: Mapping[str, np.ndarray]) -> dict[str, RecordedRow]:
    """The rows of a recorded case."""
    keys = dict.fromkeys(name.split("|")[0] for name in arrays)
    return {key: _unpacked(f"{key}|", arrays) for key in keys}


def _unpacked(path: str, arrays: Mapping[str, np.ndarray]) -> Any:
    if path in arrays:
        value = arrays[path]
        return value.item() if value.ndim == 0 else value
    name = str(arrays.get(f"{path}{CLASS}", "None"))
    if name in ("None", "()"):
        return () if name == "()" else None
    made = RecordedRow if name == RecordedRow.__name__ else KEPT[name]
    named = (f.name for f in fields(made) if any(k.startswith(f"{path}{f.name}/") for k in arrays))
    given = {n: _unpacked(f"{path}{n}/", arrays) for n in named}
    if made is Responses:
        given = {"outputs": None, "inputs": None, **given}
    if made is State:
        given = {**dict.fromkeys(("dK", "dM", "offset", "doffset")), **given}
    return made(**given)
