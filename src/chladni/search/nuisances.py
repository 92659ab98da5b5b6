"""Nuisances that every fit allows for: scatter, mesh error, joints, shear and folds."""

import scipy.sparse as sp

from ..effects.calibration_parameters import random_field
from ..effects.effect import Effect
from ..effects.joint_stiffness import model_families
from ..effects.model_errors import MeshError, Places, fold_bending, mesh_errors, modal_discrepancy
from ..fem.assemble import Structure
from ..fem.modelled import Modelled
from ..reduced.reduced_problem import ReducedProblem
from ..sparse.freed_memory import give_back_freed_memory
from .question import Question

SCATTER_T, SCATTER_E = 0.008, 0.010  # prior sd of smooth scatter within a part


def measured_on(question: Question) -> Places:
    """Rows of outputs and inputs on any mesh of the structure."""

    def rows(built: Structure) -> sp.csr_array:
        return sp.csr_array(sp.vstack([question.outputs.rows(built), question.inputs.rows(built)]))

    return rows


def mesh_hidden(model: Modelled, f_max: float, measured: Places | None = None) -> list[MeshError]:
    """Errors of the mesh, from a mesh twice as fine.

    Call it first, because the finer mesh takes more memory than everything else.

    Parameters
    ----------
    measured : places where responses were measured; None where only frequencies were
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
    bending at folds by parts.

    Parameters
    ----------
    poles_to : the highest natural frequency [Hz], where these alone are compared
    """
    out: list[Effect] = [
        random_field(reduced.groups, "t", SCATTER_T), random_field(reduced.groups, "E", SCATTER_E),
        *mesh,
    ]  # fmt: skip
    if poles_to is not None:
        return [*out, modal_discrepancy(model, poles_to, mesh[0] if mesh else None)]
    return [*out, *model_families(model.structure), *fold_bending(reduced.groups)]
