"""K and M of shells and beams by KratosMultiphysics: a script for the Python that has it.

It needs NumPy and Kratos, and nothing of this project. ``kratos_matrices.py IN.npz OUT.npz`` reads

points, moved (n, 3)    places and imposed displacements [m]
shells (m, 4)           rows of points; a triangle repeats its third
shell_values (m, 4)     E, nu, rho, t
beams (k, 2)            rows of points
beam_values (k, 9)      E, nu, rho, A, J, I1 = I2, and areas in shear (0: rigid)

and writes both matrices in compressed rows, and the equation (n, 6) of every degree of freedom.
"""

import sys
from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np

LEVELS = {"M": 1, "K": 2}  # Kratos' BUILD_LEVEL of an eigenvalue problem
KINDS = {  # elements by their number of nodes
    2: "CrLinearBeamElement3D2N",
    3: "ShellThinElementCorotational3D3N",
    4: "ShellThinElementCorotational3D4N",
}
MATERIAL = ("YOUNG_MODULUS", "POISSON_RATIO", "DENSITY")
SHELL = (*MATERIAL, "THICKNESS")
SECTION = ("CROSS_AREA", "TORSIONAL_INERTIA", "I22", "I33")
BEAM = (*MATERIAL, *SECTION, "AREA_EFFECTIVE_Y", "AREA_EFFECTIVE_Z")
MOTIONS = {"DISPLACEMENT": "REACTION", "ROTATION": "REACTION_MOMENT"}


def main(given: str, out: str) -> None:
    """Read the mesh, write the matrices."""
    kratos = import_module("KratosMultiphysics")
    structural = import_module("KratosMultiphysics.StructuralMechanicsApplication")
    kratos.Logger.GetDefaultOutput().SetSeverity(kratos.Logger.Severity.WARNING)
    model, space = kratos.Model(), kratos.UblasSparseSpace()
    with np.load(given, allow_pickle=False) as mesh:
        part = _model_part(kratos, model, mesh)
        _elements(kratos, part, mesh["shells"], mesh["shell_values"], SHELL)
        _elements(kratos, part, mesh["beams"], mesh["beam_values"], BEAM)
        moved = mesh["moved"].tolist()
    builder = kratos.ResidualBasedBlockBuilderAndSolver(kratos.LinearSolver())
    scheme = structural.EigensolverDynamicScheme()
    strategy = kratos.ResidualBasedLinearStrategy(part, scheme, builder, *4 * [False])
    strategy.Initialize()
    strategy.InitializeSolutionStep()
    for node, u in zip(part.Nodes, moved, strict=True):  # forces and geometric stiffness follow
        node.SetSolutionStepValue(kratos.DISPLACEMENT, u)
        node.X, node.Y, node.Z = np.add((node.X, node.Y, node.Z), u).tolist()
    found: dict[str, Any] = {}
    for name, level in LEVELS.items():
        part.ProcessInfo[structural.BUILD_LEVEL] = level
        matrix, load = strategy.GetSystemMatrix(), space.CreateEmptyVectorPointer()
        space.ResizeVector(load, space.Size1(matrix))
        space.SetToZeroVector(load)
        space.SetToZeroMatrix(matrix)
        builder.Build(scheme, part, matrix, load)
        found[f"{name}_data"] = np.array(matrix.value_data())
        found[f"{name}_columns"] = np.array(matrix.index2_data())
        found[f"{name}_rows"] = np.array(matrix.index1_data())
    axes = [getattr(kratos, f"{name}_{axis}") for name in MOTIONS for axis in "XYZ"]
    equation = [[node.GetDof(axis).EquationId for axis in axes] for node in part.Nodes]
    np.savez(out, equation=equation, **found)


def _model_part(kratos: Any, model: Any, mesh: Mapping[str, np.ndarray]) -> Any:
    """Nodes with six degrees of freedom each."""
    part = model.CreateModelPart("structure")
    for name in (*MOTIONS, *MOTIONS.values()):
        part.AddNodalSolutionStepVariable(getattr(kratos, name))
    part.ProcessInfo[kratos.DOMAIN_SIZE] = 3
    for k, x in enumerate(mesh["points"].tolist(), start=1):
        part.CreateNewNode(k, *x)
    for name, reaction in MOTIONS.items():
        for axis in "XYZ":
            pair = (getattr(kratos, f"{kind}_{axis}") for kind in (name, reaction))
            kratos.VariableUtils().AddDof(*pair, part)
    return part


def _elements(
    kratos: Any, part: Any, cells: np.ndarray, values: np.ndarray, names: tuple[str, ...]
) -> None:
    """Elements (m, k) with a property for each different row of values."""
    structural = kratos.StructuralMechanicsApplication
    law = (
        structural.LinearElasticPlaneStress2DLaw
        if names is SHELL
        else structural.BeamConstitutiveLaw
    )
    rows, which = np.unique(values, axis=0, return_inverse=True)
    first, groups = part.NumberOfProperties() + 1, []
    for k, row in enumerate(rows.tolist(), start=first):
        group = part.CreateNewProperties(k)
        for name, value in zip(names, row, strict=True):
            group[kratos.KratosGlobals.GetVariable(name)] = value
        group.SetValue(kratos.CONSTITUTIVE_LAW, law())
        groups.append(group)
    start = part.NumberOfElements() + 1
    for k, (cell, g) in enumerate(zip((cells + 1).tolist(), which.ravel().tolist(), strict=True)):
        nodes = list(dict.fromkeys(cell))
        part.CreateNewElement(KINDS[len(nodes)], start + k, nodes, groups[g])


if __name__ == "__main__":
    main(*sys.argv[1:])
