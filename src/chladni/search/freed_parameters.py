"""Calibration parameters of a question: those that the user frees, else the default ones."""

from ..effects.calibration_parameters import defaults
from ..effects.effect import Effect
from ..effects.effect_context import EffectContext, Setup
from ..effects.registry import family
from ..effects.user_parameters import (
    UNITS,
    defaults_of_solids,
    freed_effect,
    stiffener_offsets,
    user_parameter,
)
from ..effects.weld_patch import PATCHES, weld_patch
from ..errors import FileError
from ..fem.energy import mass_properties
from ..model.free_parameter import FreeParameter
from ..reduced.reduced_problem import ReducedProblem
from .question import Question


def setup_of(question: Question, f_max: float) -> Setup:
    """The description of the test that effects may use."""
    weight = mass_properties(question.assembly)[0]
    sensors = question.outputs.shares(question.assembly)
    forces = question.inputs.shares(question.assembly)
    ways = question.inputs.directions[~question.inputs.base].tolist()
    drives = tuple((share, (x, y, z)) for share, (x, y, z) in zip(forces, ways, strict=True))
    return Setup(sensors, question.hangers, weight, f_max, drives)


def freed_by(question: Question, reduced: ReducedProblem, f_max: float) -> list[Effect]:
    """Parameters that the user frees; else E and t (wall) of every part, rho of every material.

    Stiffeners also have their distance from the sheet.  This default holds for shells and beams.
    Without either, it is E and rho of every material of solids.
    """
    if question.parameters:
        return [_freed(question, reduced, f_max, p) for p in question.parameters]
    if len(reduced.groups):
        offsets = stiffener_offsets(question.assembly)
        return [*defaults(reduced.groups), *(user_parameter(reduced.groups, p) for p in offsets)]
    return [user_parameter(reduced.groups, p) for p in defaults_of_solids(question.assembly)]


def _freed(question: Question, reduced: ReducedProblem, f_max: float, p: FreeParameter) -> Effect:
    """One number, or an effect of known place, for the parts that the user names.

    Raises
    ------
    FileError
        If deck and test do not determine the place of the effect.
    """
    if p.field in UNITS:
        return user_parameter(reduced.groups, p)
    if p.field in PATCHES:
        return weld_patch(reduced.groups, p)
    placed = family(p.field).placed
    assert placed is not None
    setup = setup_of(question, f_max)
    where = EffectContext(reduced.groups, reduced.grids, reduced.candidates, setup)
    names = {question.assembly.parts[k].name for k in p.positions}
    found = [e for e in placed(where) if not names or set(e.parts) <= names]
    if not found:
        raise FileError(
            f"{p.field} cannot be freed: deck and test do not define its place; "
            "orthotropic-material needs all parts of a material, suspension [test] hangers, "
            "sensor-mass sensors on the structure, shaker-restraint one to three drive points"
        )
    return freed_effect(found[0], p.name)
