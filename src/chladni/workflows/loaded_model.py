"""Load a model for any command: from a path to its assembly, its modes, its pictures."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from ..dofs import parse
from ..dynamics.modes import ModalModel
from ..errors import ArgumentError, FileError
from ..fem.assemble import Structure, structure
from ..fem.modelled import Modelled, node_points, solved
from ..geometry.grid_normals import normals_at
from ..io.nastran.text.deck import Deck
from ..model.analysis import Analysis
from ..model.assembly import Assembly
from ..results import ShownBriefly
from ..units import UNITS, Units
from ..units import units as unit_system
from ..view.surface import Surface, surface
from .unit_guess import doubt_of_units, guessed_units

if TYPE_CHECKING:
    from ..case import Case


LEAST_MODES = 7  # separate six rigid motions of a free structure from the first elastic mode
SOURCES = "the path of a deck or case, what chladni.load or load_case returned, or an Assembly"


@dataclass(frozen=True, eq=False, repr=False)
class Model(ShownBriefly):
    """An assembly with its matrices, built at first use."""

    source: Path
    assembly: Assembly
    unit: str = "m"  # of length; "" where a bare deck came without its unit system
    notes: tuple[str, ...] = ()  # what of the deck was left out
    length: float = 1.0  # the deck's own unit of length [m]
    units: Units | None = None  # the deck's own
    deck: Deck | None = None  # it was read from

    @cached_property
    def structure(self) -> Structure:
        """Matrices of the free degrees of freedom."""
        return structure(self.assembly)

    @cached_property
    def places(self) -> np.ndarray:
        """Place of the node of each row of the system (n, 3) [m]."""
        return node_points(self.structure)

    def solved(self, band: float) -> Modelled:
        """Compute its modes up to a frequency [Hz]."""
        return solved(self.structure, band)

    @cached_property
    def seen(self) -> Surface:
        """The surface that a picture shows."""
        return surface(self.assembly, self.unit)

    def normal_modes(self, count: int) -> ModalModel:
        """Compute the lowest normal modes, fewer if the model has fewer."""
        from ..dynamics.eigen import normal_modes

        count = min(count, len(self.structure.system.dofs))
        return normal_modes(self.structure.system, count)

    def directions(self, labels: Sequence[str], free: bool = True) -> sp.csr_array:
        """Motion at labels as 12:+Z or 12:n (the surface normal) over the free dofs: (k, n_free).

        Without ``free`` over all motions of all points (k, 6 n_points).
        """
        built = self.structure
        if not free:
            built = replace(built, T=sp.csr_array(sp.eye_array(built.T.shape[0])))
        return sp.csr_array(sp.vstack([self._direction(built, text) for text in labels]))

    def _direction(self, built: Structure, text: str) -> sp.csr_array:
        point, _, axis = text.partition(":")
        if axis.strip() == "n" and point.strip().isdecimal():
            ids = np.array([int(point)])
            return built.along(ids, normals_at(self.assembly, ids))
        point_id, component, sign = parse(text)
        return sp.csr_array(sign * built.rows(np.array([[point_id, component]])))

    def motion(self, shapes: np.ndarray) -> np.ndarray:
        """Translation of every point in the basic frame, u = T q: (n, r) -> (n_points, 3, r)."""
        u = self.structure.T @ shapes
        return np.asarray(u.reshape(len(self.assembly.points), 6, -1)[:, :3])


def load_model(
    source: str | Path,
    units: str | Units | None = None,
    allow: Sequence[str] = (),
    subcase: int | None = None,
    command: str = "modes",
) -> Model:
    """Load the model of a bare deck, or of a case (folder or case.toml), for a command.

    Raises
    ------
    FileError
        If there is no such file, or it is neither a deck nor a case.
    """
    found = opened(source, units, allow)
    return found.model(subcase) if isinstance(found, DeckModels) else as_model(found, command)


@dataclass(frozen=True, eq=False, repr=False)
class DeckModels(ShownBriefly):
    """A bare deck, its analysis requests, and its model under each subcase."""

    source: Path
    deck: Deck
    units: Units | None
    notes: tuple[str, ...] = ()  # on the file that the deck was made of

    @cached_property
    def analysis(self) -> Analysis:
        """Loads, frequencies and damping, read at first use."""
        from ..io.nastran.read.analysis_requests import analysis

        return analysis(self.deck, self.units)

    def model(self, subcase: int | None = None) -> Model:
        """Build the model with supports and equations of a subcase, or of the one for modes.

        Raises
        ------
        FileError
            If the deck is wrong, or its materials are known only in another unit system.
        """
        from ..io.nastran import assembly
        from ..io.nastran.read.analysis_requests import STRUCTURAL, remarks

        made = assembly(self.deck, self.units, subcase)
        notes = (*self.notes, *remarks(self.deck, STRUCTURAL))
        if self.units is None:
            return Model(self.source, made, "", notes, deck=self.deck)
        if doubt := doubt_of_units(made, str(self.source), self.units):
            notes = (doubt, *notes)
        return Model(self.source, made, "m", notes, self.units.length, self.units, self.deck)


def opened(
    source: "Case | Model | DeckModels | Assembly | Deck | str | Path",
    units: str | Units | None = None,
    allow: Sequence[str] = (),
) -> "Case | Model | DeckModels":
    """Read what a path names; take a deck that was read, or a structure in SI, as a model.

    Parameters
    ----------
    units : of a deck; everything else has its own, and no others may be named
    allow : cards of the deck at a path to leave out although they carry stiffness
    """
    found: Case | Model | DeckModels
    if isinstance(source, str | Path):
        path = Path(source)
        if not path.exists():
            raise FileError(f"no file or folder {path}{similar_names(path)}")
        if not is_case(path):
            return load_deck(path, units, allow)
        from ..case import load_case

        found = load_case(path)
    elif isinstance(source, Deck):
        return DeckModels(source.path, source, None if units is None else unit_system(units))
    elif isinstance(source, Assembly):
        found = Model(Path("assembly"), source, units=UNITS["SI"])
    elif isinstance(source, Model | DeckModels):
        found = source
    else:
        found = _loaded_case(source)
    if units is not None and (found.units is None or found.units != unit_system(units)):
        path = found.source if isinstance(found, Model | DeckModels) else found.path
        known = "none" if found.units is None else found.units.name
        raise FileError(f"argument units: {path} was loaded before, with units {known}")
    return found


def _loaded_case(source: object) -> "Case":
    from ..case import Case

    if not isinstance(source, Case):
        raise ArgumentError(f"a model is no {type(source).__name__}; give {SOURCES}")
    return source


def as_model(
    source: "Case | Model | DeckModels | Assembly | Deck | str | Path",
    command: str = "modes",
    units: str | Units | None = None,
    allow: Sequence[str] = (),
) -> Model:
    """Convert whatever holds a structure to a model; return a model unchanged."""
    found = opened(source, units, allow)
    if isinstance(found, Model):
        return found
    if isinstance(found, DeckModels):
        return found.model()
    notes, own = tuple(found.said(command)), found.units
    return Model(found.path, found.assembly, "m", notes, own.length, own, found.deck)


def model_in_si(
    source: "Case | Model | DeckModels | Assembly | Deck | str | Path",
    command: str,
    units: str | Units | None = None,
    allow: Sequence[str] = (),
) -> tuple[Model, str]:
    """Convert to a model in SI, with a sentence where the unit system of a deck was guessed."""
    found = opened(source, units, allow)
    if not isinstance(found, Model | DeckModels) or found.units is not None:
        return as_model(found, command), ""
    bare = as_model(found)
    guess = guessed_units(bare.assembly, bare.source.name)
    known = guess.units.name
    if not guess.sure:
        raise FileError(f"{bare.source}: {guess.why}; state it by --units")
    if isinstance(found, DeckModels):
        return replace(found, units=guess.units).model(), f"units = {known}: {guess.why}"
    if known != "SI":
        raise FileError(f"{bare.source}: load it with units = {known}: {guess.why}")
    return replace(bare, unit="m", units=guess.units), f"units = {known}: {guess.why}"


def load_deck(
    source: Path, units: str | Units | None = None, allow: Sequence[str] = ()
) -> DeckModels:
    """Read a bare deck and its requests; cards named in ``allow`` are skipped."""
    from ..io.nastran import read_deck

    if source.is_dir():
        raise FileError(f"{source} is a folder; give a deck")
    if not source.is_file():
        raise FileError(f"no file {source}{similar_names(source)}")
    system = None if units is None else unit_system(units)
    return DeckModels(source, read_deck(source, allow), system)


def exported_deck(
    made: Assembly, units: Units | None = None, name: Path = Path("assembly.bdf")
) -> Deck:
    """The deck that would be written of a structure in SI, or in numbers that units scale."""
    from ..io.nastran import read_deck, write_assembly

    with TemporaryDirectory(prefix="chladni-") as folder:
        deck = read_deck(write_assembly(made, Path(folder) / name, units))
    return replace(
        deck,
        path=name,
        sources=tuple(replace(s, path=name) for s in deck.sources),
        cards={n: replace(cards, files=(name,)) for n, cards in deck.cards.items()},
    )


def on_faces(seen: Surface, of_shells: np.ndarray) -> np.ndarray:
    """Extend values of shells to all faces; skins of solids get nan."""
    values = np.full(len(seen.faces), np.nan)
    values[: len(of_shells)] = of_shells
    return values


def is_case(source: Path) -> bool:
    """Return True for a folder or a .toml file; a folder may still lack its case.toml."""
    return source.is_dir() or source.suffix == ".toml"


def refuse_exchanged(source: Path, recordings: Sequence[Path]) -> None:
    """Refuse a recording in the place of the deck.

    Raises
    ------
    FileError
        If the first file has the ending of a recording, and another one has not.
    """
    from ..io.tables.read_tables import ENDINGS

    deck = next((p for p in recordings if p.suffix.lower() not in ENDINGS), None)
    if deck is not None and source.is_file() and source.suffix.lower() in ENDINGS:
        raise FileError(
            f"{source} is a recording by its name: the deck comes first, as in {deck} {source}"
        )


def similar_names(source: Path) -> str:
    """List names similar to a missing one, else files and cases with the same ending."""
    if not source.parent.is_dir():
        return f"; there is no folder {source.parent} either"
    there = (p for p in source.parent.iterdir() if p.is_file() or (p / "case.toml").is_file())
    names = sorted(p.name for p in there if not p.name.startswith("."))
    alike = [n for n in names if Path(n).suffix == source.suffix]
    near = get_close_matches(source.name, names, 4) or alike[:4]
    return f"; the same folder has {', '.join(near)}" if near else ""
