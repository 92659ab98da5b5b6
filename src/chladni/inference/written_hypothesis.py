"""The form of a hypothesis that a deck can hold: no mesh error, no scatter of parts or joints."""

from contextlib import suppress
from dataclasses import replace

import numpy as np

from ..effects.effect import Effect
from ..effects.joint_stiffness import calibrated_family
from ..effects.model_errors import MeshError
from ..errors import ModelError
from .hypothesis_fit import HypothesisFit, fitted
from .implausible_values import is_strained
from .map_fit import MassMeasurement, fit, posterior
from .pole_data import Poles


def as_written(
    hypothesis: HypothesisFit, mass_measurement: MassMeasurement | None, halved: bool = False
) -> HypothesisFit:
    """Fit what a deck can hold: calibrated numbers and the effects of the hypothesis.

    The fit begins at the found or at the given values, where its residual is smaller. If the deck
    is ``halved``, so is every shell.

    Every deck is a fit of its own and is judged as its file stands. Mesh error, folds and scatter
    are no numbers of a deck. Joints whose change exceeds their usual scatter are calibrated, too:
    without them a deck whose adhesive is six times too soft stays 4 % off in frequency.

    A named effect that no card can hold stays in the fit, and so does the learned error of the
    model. Otherwise the numbers of the deck would compensate for them. On a coarse plate with a
    concealed crack E went to 264 GPa for 210 without that error, and to 212 with it.
    """
    found = hypothesis.fit
    named = hypothesis.effects
    kept = [
        e for e in found.effects if e in named or e.traits.writable or is_strained(e, found.of(e))
    ]
    numbers = [calibrated_family(e) if is_strained(e, found.of(e)) else e for e in kept]
    mesh = [e.halved for e in found.effects if type(e) is MeshError] if halved else []
    data, starts = hypothesis.data, list[tuple[float, np.ndarray]]()
    made = fitted if isinstance(data, Poles) else fit  # poles have the spread of the deck itself
    if isinstance(data, Poles) and data.listed and data.shapes is None:
        data = data.all_paired()
    every = hypothesis.model, [*numbers, *mesh], data, mass_measurement
    for given in (False, True):
        x = [_given(e) if given and e.kind == "calibration" else found.of(e) for e in kept]
        start = np.concatenate([np.zeros(0), *x])
        with suppress(ModelError):
            starts.append((posterior(*every, start).cost, start))
    for _, start in sorted(starts, key=lambda each: each[0]):
        with suppress(ModelError):
            return replace(hypothesis, fit=made(*every, start).kept(), optima=())
    raise ModelError("neither the calibrated nor the given values belong to a structure")


def preferred_mesh(
    hypothesis: HypothesisFit, written: HypothesisFit, mass_measurement: MassMeasurement | None
) -> HypothesisFit | None:
    """The deck of a hypothesis with every shell halved, if it is more probable than ``written``."""
    if not any(type(e) is MeshError for e in hypothesis.fit.effects):
        return None
    try:
        made = as_written(hypothesis, mass_measurement, halved=True)
    except ModelError:
        return None
    return made if made.neg2_log_evidence < written.neg2_log_evidence else None


def _given(effect: Effect) -> np.ndarray:
    """The deck's own values of a calibration parameter."""
    return np.array([p.nominal for p in effect.parameters])
