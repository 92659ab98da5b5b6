"""Convert a model or mesh of another program to a deck."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ..errors import ChladniError, FileError
from ..io.abaqus.read_abaqus import read_abaqus
from ..io.damage import DAMAGED
from ..io.mesh_format import ABAQUS, foreign_format
from ..io.meshes.foreign_model import ForeignModel, foreign_model
from ..io.meshes.mesh_files import mesh_of, read_mesh
from ..io.meshes.part_statement import PartStatement, part_statement, statements_of_table
from ..io.nastran import Deck, write_assembly
from ..units import Units
from ..units import units as unit_system
from .loaded_model import DeckModels, exported_deck
from .unit_guess import guessed_units

PartWords = Mapping[str, str] | Sequence[str] | Path | str
"""Properties of parts: {"door": "t=0.8 mm, steel"}, statements, or the path of a CSV."""


@dataclass(frozen=True, eq=False)
class ConvertedModel:
    """A model of another program as a deck.

    Attributes
    ----------
    source : Path
    model : ForeignModel       in the numbers of its file
    units : of these; None where they are not known
    """

    source: Path
    model: ForeignModel
    units: Units | None

    @property
    def _as_written(self) -> Units:
        """The system as the head of the deck names it; its numbers stay as they are."""
        return Units("SI" if self.units is None else self.units.name, 1.0, 1.0)

    def write(self, path: Path | str) -> Path:
        """Write the deck with the numbers of the file."""
        return write_assembly(self.model.assembly, path, self._as_written)

    @property
    def deck(self) -> Deck:
        """The deck that :meth:`write` writes."""
        name = Path(f"{self.source.stem}.bdf")
        return exported_deck(self.model.assembly, self._as_written, name)

    @property
    def models(self) -> DeckModels:
        """The deck and what was left out of it, for all that takes a model."""
        return DeckModels(self.source, self.deck, self.units, self.model.said())


def converted(
    source: Any, units: str | Units | None = None, parts: PartWords = ()
) -> ConvertedModel | None:
    """Read a model of another program; None for a deck, a case and all that holds a structure.

    Parameters
    ----------
    source : path of a file, a data set of pyvista or a ``meshio.Mesh``
    units : of its numbers
    parts : properties of its parts, where it has none itself

    Raises
    ------
    FileError
        One sentence that names file, line or part, and the alternatives.
    """
    system = None if units is None else unit_system(units)
    path = Path(source) if isinstance(source, str | Path) else None
    kind = "" if path is None else foreign_format(path)
    if not kind and not (hasattr(source, "points") and hasattr(source, "cell_data")):
        if parts:
            raise FileError(f"{source} is no mesh of another program, so its parts are not stated")
        return None
    stated, name = _statements(parts, system), path or Path("mesh")
    try:
        if kind == ABAQUS:
            return ConvertedModel(name, read_abaqus(name, stated), system)
        given = mesh_of(source) if path is None else read_mesh(path)
        return ConvertedModel(name, foreign_model(given, stated, system), system)
    except FileError:
        raise
    except (*DAMAGED, ChladniError) as error:
        raise FileError(f"{name} cannot be read as {kind or 'a mesh'}: {error}") from error


def with_guessed_units(found: ConvertedModel) -> tuple[ConvertedModel, str]:
    """The model in the system in which its materials are known ones, and the reason.

    Raises
    ------
    FileError
        If more than one system fits, or no material shows it.
    """
    if found.units is not None:
        return found, ""
    guess = guessed_units(found.model.assembly, str(found.source))
    if not guess.sure:
        raise FileError(f"{found.source}: {guess.why}; state it by --units")
    return replace(found, units=guess.units), f"units = {guess.units.name}: {guess.why}"


def _statements(parts: PartWords, units: Units | None) -> list[PartStatement]:
    """Statements in words, and those of tables."""
    if isinstance(parts, Mapping):
        parts = [f"{name}: {words}" for name, words in parts.items()]
    every = [parts] if isinstance(parts, str | Path) else parts
    found: list[PartStatement] = []
    for one in every:
        if Path(one).suffix.lower() == ".csv":
            found += statements_of_table(Path(one), units)
        else:
            found.append(part_statement(str(one), units))
    return found
