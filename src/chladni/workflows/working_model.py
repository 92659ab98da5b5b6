"""A model to work with from a script: modes, responses, pictures, variants, in one object."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Self, cast

import numpy as np

from ..arguments import checked
from ..case.free_parameters import fields_of
from ..case.schema import FIELDS
from ..dynamics.frf import FRF, Quantity
from ..dynamics.statespace import StateSpace, state_space
from ..effects.calibration_parameters import value as value_of
from ..effects.user_parameters import UNITS, why_implausible, with_factor
from ..errors import LabelError, ModelError
from ..io.nastran import Deck, assembly, write_assembly, write_deck
from ..io.nastran.edit.model_changes import changes
from ..io.nastran.edit.unwritten import refuse_regrouped, refuse_unwritten
from ..io.nastran.edit.written_assembly import written_assembly
from ..model.assembly import Assembly
from ..model.free_parameter import FreeParameter
from ..results import DrawnPicture
from ..units import Units
from .frf import frf
from .loaded_model import DeckModels, Model, as_model, opened
from .modes import NormalModes, at_least_one, modes

if TYPE_CHECKING:
    from ..io.meshes.mesh_files import MeshObject
    from ..view.mesh_grid import UnstructuredGrid
    from .convert import PartWords
    from .given_case import Source

OF_PARTS = tuple(name for name in FIELDS if name not in ("K", "M", "offset"))


class WorkingModel(Model):
    """A model of a deck; nothing in it changes, :meth:`variant` makes another one.

    Modes are numbered from 1 with the rigid ones counted, as Nastran does.

    Attributes
    ----------
    source : Path             of the deck or case
    assembly : Assembly       the structure, SI (in the deck's own units without ``units``)
    structure : Structure     its matrices, built at first use
    units, length : of the deck, and its unit of length [m]
    unit : of lengths, "m"; "" where the unit system is not known
    notes : cards of the deck that were left out
    deck : Deck               that was read
    """

    @property
    def mesh(self) -> "UnstructuredGrid":
        """Shells, solids and beams [m] with ``grid`` ids, ``element`` ids, ``part``, ``thickness``.

        Elements with nodes on their edges are drawn by their corners.
        """
        from ..view.mesh_grid import mesh_grid

        return mesh_grid(self.assembly)

    @checked
    def modes(self, count: int = 20) -> NormalModes:
        """Compute the ``count`` lowest modes, as :func:`chladni.modes` does."""
        return modes(self, count)

    @checked
    def frf(
        self,
        output: str | Sequence[str],
        input: str | Sequence[str],
        frequency: np.ndarray,
        damping: float = 0.01,
        quantity: Quantity = "accelerance",
    ) -> FRF:
        """H = Σ_r φ φᵀ / (ω_r² - ω² + 2 i ζ ω_r ω) and the static rest of the modes not solved.

        Parameters
        ----------
        output, input : labels as ``55:+Z``, ``55:n`` (the surface's normal); ``base:+Z`` moves all
            supports
        frequency : (n_f,) [Hz]
        damping : ratio of every mode

        Raises
        ------
        LabelError
            If the model has no such grid.
        """
        outputs, inputs = ((x,) if isinstance(x, str) else tuple(x) for x in (output, input))
        (found,) = frf(self, outputs, inputs, np.atleast_1d(frequency), damping).frfs
        return found if found.quantity == "transmissibility" else found.to(quantity)

    @checked
    def state_space(
        self,
        output: str | Sequence[str],
        input: str | Sequence[str],
        modes: int = 20,
        damping: float = 0.01,
        quantity: Quantity = "receptance",
    ) -> StateSpace:
        """x' = A x + B u, y = C x + D u of the lowest modes; higher modes are left out.

        Parameters
        ----------
        output, input : labels as ``55:+Z`` or ``55:n``; forces u [N]
        modes : how many; two states each
        damping : ratio of every mode
        quantity : of y, receptance [m], mobility [m/s] or accelerance [m/s²]

        Raises
        ------
        LabelError
            If the model has no such grid, or the quantity has no state space.
        """
        outputs, inputs = ((x,) if isinstance(x, str) else tuple(x) for x in (output, input))
        if not outputs or not inputs:
            raise LabelError("a state space needs at least one output and one input")
        modal = self.normal_modes(at_least_one(modes)).with_damping(damping)
        phi_out, phi_in = (self.directions(side) @ modal.shapes for side in (outputs, inputs))
        return state_space(
            modal, phi_out, phi_in, outputs=outputs, inputs=inputs, quantity=quantity
        )

    @checked
    def show(self, mode: int) -> DrawnPicture:
        """The shape of a mode, drawn."""
        from tempfile import TemporaryDirectory

        from ..view.scene import mode_shape

        most = len(self.structure.system.dofs)
        if not 1 <= mode <= most:
            raise ModelError(f"no mode {mode}; the modes of this model are 1 to {most}")
        modal = self.normal_modes(mode)
        motion = self.motion(modal.shapes[:, mode - 1 :])[:, :, 0]
        with TemporaryDirectory(prefix="chladni-") as folder:
            path = Path(folder) / "mode.png"
            mode_shape(path, self.seen, motion, float(modal.frequency[mode - 1]), f"mode {mode}")
            return DrawnPicture(path.read_bytes())

    @checked
    def variant(self, **values: float | Mapping[str, float]) -> Self:
        """The model with other numbers, as ``variant(t={"inner": 0.8e-3}, E=2.0e11)``.

        Parameters
        ----------
        values : E, rho, nu, t, E1, E2, G12 or nu12 [SI], one number for all parts that have it, or
            part -> number; at most 20 times the model's own, and at least a 20th. Formed thickness
            keeps its distribution: its nominal value becomes t.

        Raises
        ------
        LabelError
            If there is no such field or part, or the part has no such field.
        ModelError
            If a value is impossible, or so far from the deck's own that its unit must be another.
        """
        made = self.assembly
        for field, value in values.items():
            if field not in OF_PARTS:
                raise LabelError(f"no field {field!r}; there are {', '.join(OF_PARTS)}")
            for k, wanted in _wanted(made, field, value).items():
                own = value_of(made.parts[k], field)
                if why := why_implausible(field, wanted, own):
                    unit = f"SI ({UNITS[field]})" if self.unit else "units of the deck"
                    raise ModelError(
                        f"{field} of {made.parts[k].name}: {why}; values are in {unit}, and a "
                        "larger change takes several variants"
                    )
                free = FreeParameter(field, field, positions=(k,))
                made = with_factor(made, free, wanted / own)
        return replace(self, assembly=made)

    @checked
    def write(self, path: Path | str) -> Path:
        """Write its deck: the cards that changed are edited, every other line stays as it was.

        An Assembly, which no deck holds, is written as a new deck in SI.

        Raises
        ------
        ModelError
            If the deck as it would be read again is another structure; the sentence names what it
            cannot hold. Nothing is written then.
        """
        if self.deck is None:
            return write_assembly(self.assembly, path)
        before, subcase = self._as_read(self.deck)
        refuse_regrouped(before, self.assembly)
        edits = changes(self.deck, before, self.assembly, self.units)
        found = written_assembly(self.deck, edits, self.units, subcase) if edits else before
        refuse_unwritten(before, self.assembly, found)
        return write_deck(self.deck, path, edits)

    def _as_read(self, deck: Deck) -> tuple[Assembly, int | None]:
        """The deck's assembly, and the subcase whose supports this one has; None: the first."""
        default = assembly(deck, self.units)
        held = self.assembly.supports
        if not np.array_equal(default.supports, held):
            for case in deck.case.subcases:
                made = assembly(deck, self.units, case.id)
                if np.array_equal(made.supports, held):
                    return made, case.id
        return default, None


@checked
def load(
    source: "Source | MeshObject",
    units: str | Units | None = None,
    *,
    allow: Sequence[str] = (),
    subcase: int | None = None,
    parts: "PartWords" = (),
) -> WorkingModel:
    """Load a model, converted to SI: of a deck, of a case, of another program.

    Parameters
    ----------
    source : a deck; or a case (folder or case.toml), which says its units itself; or an Assembly,
        which is in SI; or a file that ``chladni convert`` reads, a data set of pyvista or a mesh of
        meshio with the arrays ``part``, ``thickness`` and ``material`` as far as it has them
    allow : cards of the deck to leave out although they carry stiffness
    subcase : whose supports hold; default the first that seeks modes
    parts : properties of a mesh without them, as {"door": "t=0.8 mm, steel"}, ["t=1 mm, steel"] for
        all parts, or the path of a CSV
    units : the deck's consistent system: SI, mm-t-s, mm-kg-ms, mm-kg-s or in-lb-s; without it its
        numbers are kept as they are (frequencies are Hz in any system that counts seconds)

    Raises
    ------
    FileError, ModelError
        One sentence naming file, line, card and the alternatives.
    """
    from .convert import converted

    other = converted(source, units, parts)
    found = opened(cast("Source", source), units, allow) if other is None else other.models
    model = found.model(subcase) if isinstance(found, DeckModels) else as_model(found)
    return WorkingModel(**{each.name: getattr(model, each.name) for each in fields(model)})


def _wanted(made: Assembly, field: str, value: float | Mapping[str, float]) -> dict[int, float]:
    """Position of each part that takes a value -> the value; none may be zero or below."""
    if isinstance(value, Mapping):
        out = {made.part(name): float(v) for name, v in value.items()}
        for k in out:
            if field not in (has := fields_of(made, k)):
                have = ", ".join(has) or "no field that can be changed"
                raise LabelError(f"part {made.parts[k].name} has no {field}; it has {have}")
    else:
        having = [k for k in range(len(made.parts)) if field in fields_of(made, k)]
        out = dict.fromkeys(having, float(cast(float, value)))
    if not out:
        raise LabelError(f"no part of the model has {field}, or none was named")
    for k, v in out.items():
        if not 0 < v < np.inf or not value_of(made.parts[k], field) > 0:
            raise ModelError(f"{field} of {made.parts[k].name} cannot become {v:g}")
    return out
