"""Base effects of every fit: calibration parameters, freed by the user or by default; nuisances."""

from ..effects.calibration_parameters import defaults, random_field
from ..effects.effect import Effect
from ..effects.effect_context import EffectContext, Setup
from ..effects.joint_stiffness import model_families
from ..effects.model_errors import MeshError, Places, fold_bending, mesh_errors, modal_discrepancy
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
from ..fem.modelled import Modelled
from ..model.free_parameter import FreeParameter
from ..reduced.reduced_problem import ReducedProblem
from ..sparse.freed_memory import give_back_freed_memory
from .question import Question

SCATTER_T, SCATTER_E = 0.008, 0.010  # prior sd of smooth scatter within a part


def setup_of(question: Question, f_max: float) -> Setup:
    """The description of the test that effects may use."""
    weight = mass_properties(question.assembly)[0]
    sensors = question.outputs.shares(question.assembly)
    forces = question.inputs.shares(question.assembly)
    ways = question.inputs.directions[~question.inputs.base].tolist()
    drives = tuple((share, (x, y, z)) for share, (x, y, z) in zip(forces, ways, strict=True))
    return Setup(sensors, question.hangers, weight, f_max, drives)


def freed_by(question: Question, reduced: ReducedProblem) -> list[Effect]:
    """Parameters that the user frees; else E and t (wall) of every part, rho of every material.

    Stiffeners also have their distance from the sheet.  This default holds for shells and beams.
    Without either, it is E and rho of every material of solids.
    """
    if question.parameters:
        return [_freed(question, reduced, p) for p in question.parameters]
    if len(reduced.groups):
        offsets = stiffener_offsets(question.assembly)
        return [*defaults(reduced.groups), *(user_parameter(reduced.groups, p) for p in offsets)]
    return [user_parameter(reduced.groups, p) for p in defaults_of_solids(question.assembly)]


def _freed(question: Question, reduced: ReducedProblem, p: FreeParameter) -> Effect:
    """One number, or an effect of known place, for the parts that the user names."""
    if p.field in UNITS:
        return user_parameter(reduced.groups, p)
    if p.field in PATCHES:
        return weld_patch(reduced.groups, p)
    placed = family(p.field).placed
    assert placed is not None
    setup = setup_of(question, reduced.f_max)
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


def mesh_hidden(model: Modelled, f_max: float, measured: Places | None = None) -> list[MeshError]:
    """Errors of the mesh, from a mesh twice as fine; by frequencies alone without ``measured``.

    Call it first, because the finer mesh takes more memory than everything else.
    """
    give_back_freed_memory()
    errors = mesh_errors(model, f_max, measured)
    give_back_freed_memory()
    return errors


def nuisances(
    reduced: ReducedProblem, model: Modelled, mesh: list[MeshError], poles_to: float | None = None
) -> list[Effect]:
    """Scatter within parts, mesh error, joints, shear and folds: errors calibration cannot remove.

    Responses need no modal discrepancy: their likelihood allows any small error of modal stiffness
    and mass. Structured errors have effects of their own: joints and the shells' shear by families,
    bending at folds by parts. Where frequencies alone are compared, ``poles_to`` is the highest.
    """
    out: list[Effect] = [
        random_field(reduced.groups, "t", SCATTER_T), random_field(reduced.groups, "E", SCATTER_E),
        *mesh,
    ]  # fmt: skip
    if poles_to is not None:
        return [*out, modal_discrepancy(model, poles_to, mesh[0] if mesh else None)]
    return [*out, *model_families(model.structure), *fold_bending(reduced.groups)]
