"""Sensors along a sheet, which a force across it hardly moves: they say nothing of the model.

A triaxial sensor on a flat sheet measures along it a tilt and its own cross-axis sensitivity. A
sensor that the model does not move but that moves as much as others has a wrong direction instead:
:mod:`..search.silent_dofs` refuses it.
"""

from dataclasses import replace

import numpy as np

from ..case import Case
from ..errors import named
from ..fem.modelled import modelled
from ..search.silent_dofs import silent_sensors
from .case_model import REACH

WEAK = 0.1  # of the strongest output: three degrees of tilt and 5 % of cross-axis sensitivity


def without_silent(case: Case) -> Case:
    """The case without weak outputs that no drive of the model moves, and a note that names them.

    The model is solved only where an output is weak.
    """
    if not case.frfs:
        return case
    frf = case.frfs[0]
    power = (np.abs(frf.values[case.lines(frf.frequency)]) ** 2).sum(axis=(0, 2))
    weak = power < WEAK**2 * power.max(initial=0.0)
    if not weak.any():
        return case
    high = case.band[1] if case.band else float(frf.frequency[-1])
    model = modelled(case.tested(case.assembly), REACH * high)
    silent = np.isin(case.outputs.labels, silent_sensors(model, case.outputs, case.inputs)) & weak
    if not silent.any() or silent.all():
        return case
    kept = [o for o, s in zip(case.outputs.labels, silent, strict=True) if not s]
    gone = sorted(set(case.outputs.labels) - set(kept))
    recordings = tuple(
        r if r.frf is None else replace(r, frf=r.frf.sel(outputs=kept)) for r in case.recordings
    )
    held = case.held_sensors
    if isinstance(held, tuple):
        held = tuple(o for o in held if o in kept)
    one = len(gone) == 1
    note = (
        f"sensor{'s' * (not one)} {named(gone, 6)} {'is' if one else 'are'} left out: no drive of "
        f"the model moves {'it' if one else 'them'}; the recording has less than a tenth of the "
        "strongest output there, which tilt and cross-axis sensitivity explain"
    )
    return replace(
        case, recordings=recordings, outputs=case.outputs.only(~silent), held_sensors=held,
        notes=(*case.notes, note),
    )  # fmt: skip
