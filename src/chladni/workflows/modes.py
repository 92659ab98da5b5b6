"""Normal modes of a model: frequencies, shapes, mass, the energy of each part."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from ..arguments import checked
from ..dynamics.modes import ModalModel, rigid_modes
from ..errors import LabelError
from ..fem.energy import (
    effective_masses,
    element_energies,
    element_volumes,
    kinetic_energies,
    mass_properties,
    part_energies,
)
from ..fem.loose_parts import loose_grids
from ..parallel import one_blas_thread
from ..progress import Progress, silent
from ..results import Result
from ..units import Units
from .loaded_model import LEAST_MODES, Model, as_model

if TYPE_CHECKING:
    from ..view.mesh_grid import UnstructuredGrid
    from .given_case import Source


@dataclass(frozen=True, eq=False, repr=False)
class NormalModes(Result):
    """Modes and what they say of the structure.

    Attributes
    ----------
    modal : ModalModel
    generalized_mass : (r,)         φᵀMφ [kg m²], 1 by normalisation
    mass : float                    [kg], or the deck's own unit where none was given
    centre_of_gravity : (3,)        [m], or the deck's own
    rigid : (r,) bool
    strain_energy : (parts, r)      share of each part; nan for rigid modes
    kinetic_energy : (parts, r)     share of each part; the rest is in point masses
    effective_mass : (6, r)         for motions of the base along X, Y, Z [kg], and about them at
                                    the centre of gravity [kg m²]
    parts : ((name, id), ...)
    in_si : False where a bare deck came without its unit system
    """

    modal: ModalModel
    generalized_mass: np.ndarray
    mass: float
    centre_of_gravity: np.ndarray
    rigid: np.ndarray
    strain_energy: np.ndarray
    kinetic_energy: np.ndarray
    effective_mass: np.ndarray
    parts: tuple[tuple[str, int], ...]
    in_si: bool
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.modal)

    @property
    def frequency(self) -> np.ndarray:
        """Natural frequencies (r,) [Hz]."""
        return self.modal.frequency

    @property
    def shapes(self) -> np.ndarray:
        """Mass-normalised shapes Φ (n, r) [1/√kg], over the rows of ``modal.dofs``."""
        return self.modal.shapes

    @checked
    def mesh(self, mode: int) -> "UnstructuredGrid":
        """The mesh of the model with a mode: ``shape`` (n, 3) [1/√kg] and ``frequency`` [Hz].

        Its elements have ``strain_energy_density`` [J/m³] in addition to the arrays of
        ``WorkingModel.mesh``; rigid modes have none.

        Parameters
        ----------
        mode : number from 1, the rigid ones counted
        """
        from ..view.mesh_grid import mesh_grid

        if not 1 <= mode <= len(self):
            raise LabelError(f"no mode {mode}; there are 1 to {len(self)}")
        phi, made = self.shapes[:, [mode - 1]], self.origin.assembly
        density = element_energies(self.origin.structure, phi)[:, 0] / element_volumes(made)
        grid = mesh_grid(
            made,
            {"shape": self.origin.motion(phi)[:, :, 0]},
            {"strain_energy_density": np.where(self.rigid[mode - 1], 0.0, density)},
        )
        grid.field_data["frequency"] = [float(self.frequency[mode - 1])]
        return grid


@checked
@one_blas_thread()
def modes(
    source: "Source",
    count: int = 20,
    *,
    units: str | Units | None = None,
    progress: Progress = silent,
) -> NormalModes:
    """Compute the ``count`` lowest modes, fewer where the model has fewer.

    Parameters
    ----------
    source : a model, a case, an Assembly, or the path of a deck or case
    units : of a deck given by its path; without it numbers stay in the deck's own units, and
        frequencies are Hz in any

    Raises
    ------
    FileError, LabelError, ModelError
        If there is no such file, the deck is wrong, or the count is below 1.
    """
    at_least_one(count)
    model = as_model(source, units=units)
    progress("matrices", 0.1)
    structure = model.structure
    size = len(structure.system.dofs)
    progress(f"modes of {size} degrees of freedom", 0.2)
    whole = model.normal_modes(max(count, LEAST_MODES))
    modal, still = whole.sel(slice(count)), rigid_modes(whole)
    progress("energies", 0.8)
    phi, rigid = modal.shapes, still[:count]
    mass, centre = mass_properties(model.assembly)
    return NormalModes(
        modal,
        np.einsum("nr,nr->r", phi, structure.system.M @ phi),
        mass,
        centre,
        rigid,
        np.where(rigid, np.nan, part_energies(structure, phi)),
        kinetic_energies(structure, phi),
        effective_masses(structure, phi, np.nan_to_num(centre)),
        tuple((part.name, part.id) for part in model.assembly.parts),
        bool(model.unit),
        (*model.notes, *_notes(model, modal, count, int(still.sum())), *loose_parts(model, whole)),
        origin=model,
    )


def at_least_one(count: int) -> int:
    """Return the number of modes, 1 or more; LabelError for others."""
    if count < 1:
        raise LabelError(f"{count} modes were requested; request 1 or more")
    return count


def loose_parts(model: Model, modal: ModalModel) -> list[str]:
    """A sentence where modes without frequency are more than motions of the whole structure."""
    grids = loose_grids(model.structure, modal.shapes[:, rigid_modes(modal)])
    if not grids:
        return []
    motions = "1 motion" if len(grids) == 1 else f"{len(grids)} motions"
    where = ", ".join(map(str, dict.fromkeys(grids)))
    return [
        f"{motions} without stiffness, in addition to those of the whole structure: a part is "
        f"loose, or a stiffness is zero; grid {where} moves most"
    ]


def _notes(model: Model, modal: ModalModel, count: int, rigid: int) -> list[str]:
    notes, size = [], len(model.structure.system.dofs)
    if len(modal) < count:
        notes.append(f"The model has {len(modal)} modes, {count} were requested.")
    motions = "1 mode is a rigid motion" if rigid == 1 else f"{rigid} modes are rigid motions"
    notes.append(f"{size} degrees of freedom are free; {motions}.")
    if not model.unit:
        notes.append(
            "No unit system was given (--units), so mass and lengths are in the deck's units; "
            "frequencies are in Hz in any consistent system."
        )
    return notes
