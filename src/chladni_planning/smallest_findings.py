"""Predict the smallest mass, softening and thinning that the test of a layout would find."""

from dataclasses import replace
from pathlib import Path

from chladni.case.sensor_places import sensor_masses
from chladni.errors import FileError
from chladni.fem.energy import mass_properties
from chladni.inference.map_fit import MassMeasurement
from chladni.progress import Progress, silent
from chladni.search.question import Question
from chladni.search.simulated_test import NOISE
from chladni.workflows.frf import layout_places
from chladni.workflows.loaded_model import Model
from chladni.workflows.question_of_case import MASS_SD

from .detectable import Detectable, detectable


def smallest_findings(
    model: Model,
    layout: Path,
    band: tuple[float, float],
    noise: float = NOISE,
    progress: Progress = silent,
) -> Detectable:
    """Predict the evidence of a layout, with the article weighed to 0.2 %.

    Parameters
    ----------
    layout : a table of sensors, or ``plan.json``
    band : to be measured [Hz]
    noise : of |H|, at every compared line
    """
    if not model.unit:
        raise FileError(f"{model.source}: smallest findings need the unit system (--units)")
    if not len(model.assembly.shells):
        raise FileError(
            f"{model.source} has no shells, and smallest findings are predicted for shells"
        )
    progress("predicted evidence", 0.1)
    outputs, inputs = layout_places(model, layout)
    if inputs.base.any():
        raise FileError(
            f"{layout}: smallest findings are predicted for a force, not for a moving base"
        )
    plain_question = Question(
        model.assembly, outputs, inputs, band=band,
        sensor_masses=sensor_masses(model.assembly, outputs, inputs),
    )  # fmt: skip
    mass = float(mass_properties(model.assembly)[0])
    weighed = MassMeasurement(mass, MASS_SD * mass)
    return detectable(replace(plain_question, mass_measurement=weighed), noise)
