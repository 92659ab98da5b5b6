"""A structure and its normal modes, solved once and shared by all users."""

from dataclasses import dataclass

import numpy as np

from ..arrays import OneScreen
from ..dynamics.eigen import normal_modes
from ..dynamics.modes import ModalModel
from ..errors import ModelError
from ..model.assembly import Assembly
from ..sparse.freed_memory import give_back_freed_memory
from .assemble import Structure, structure

LARGE = 100_000  # dofs from which it saves memory to return what the assembly has freed
_ROUNDING = 1e-9  # tolerance, because callers compute the same band by different products


@dataclass(frozen=True, eq=False, repr=False)
class Modelled(OneScreen):
    """The matrices of an assembly and all its normal modes up to ``band``, at least the first."""

    structure: Structure
    modes: ModalModel  # undamped, rigid ones included
    band: float  # [Hz]

    @property
    def assembly(self) -> Assembly:
        """The assembly of the structure."""
        return self.structure.assembly

    def up_to(self, frequency: float) -> ModalModel:
        """The modes up to a frequency [Hz].

        Raises
        ------
        ModelError
            If the modes were not solved that far.
        """
        if frequency > self.band * (1 + _ROUNDING):
            raise ModelError(
                f"modes up to {frequency:g} Hz are requested, but they were solved only to "
                f"{self.band:g} Hz"
            )
        return self.modes.sel(self.modes.frequency <= frequency * (1 + _ROUNDING))


def modelled(assembly: Assembly, band: float) -> Modelled:
    """Assemble a structure and solve its modes up to ``band`` [Hz], the first whatever it is."""
    built = structure(assembly)
    if len(built.system.dofs) > LARGE:
        give_back_freed_memory()
    return solved(built, band)


def solved(built: Structure, band: float) -> Modelled:
    """The modes of a structure up to ``band`` [Hz], the first whatever it is."""
    modes = normal_modes(built.system, band=band)
    if not len(modes):
        modes = normal_modes(built.system, 1)
    return Modelled(built, modes, band)


def node_points(built: Structure) -> np.ndarray:
    """Place of the node of each free dof (n, 3) [m]."""
    assembly = built.assembly
    return np.asarray(assembly.points[assembly.rows(built.system.dofs[:, 0])])
