"""A case: one ``case.toml`` that names the deck, the recordings and what to do with them.

Everything is resolved here once: files are read, labels become grids or places on the nearest
shell, bands are compared with the data. Contradictions are refused in one sentence.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..arguments import checked
from ..arrays import OneScreen
from ..dofs import positions
from ..dynamics.frf import FRF
from ..ema.setup import Recording, Sensor, SensorAccuracy, TestSetup
from ..errors import ChladniError, FileError, named
from ..fem.measured_dofs import MeasuredDofs
from ..io.file_size import files_within, lies_within
from ..io.nastran import Deck, assembly, read_deck
from ..io.nastran.read.analysis_requests import STRUCTURAL, remarks
from ..io.tables.read_tables import read_recordings
from ..io.tables.sensor_table import read_sensors
from ..model.assembly import Assembly
from ..model.free_parameter import FreeParameter
from ..model.point_masses import with_mass_pairs
from ..units import UNITS, Units
from .bands import covered, held_out, searched_effects
from .case_file import request_of
from .free_parameters import free_parameters
from .key import Band, refuse_beyond
from .mapped_thickness import PLACES, formed_thickness
from .mended_recordings import mended, read_as, record_length, with_frf
from .recording_groups import described, refuse_copies, stacked
from .recordings import compared_first, notes_of, without_dead_channels
from .request import Request
from .schema import KEYS, unread
from .sensor_places import ROLES, grid_row, places, sensor_masses, unrecorded
from .sensor_places import weight_of_sensors as weight

OUTSIDE = "[model] outside: files of the case may lie outside of its folder"  # as a note
_MASS_SD = 0.002  # of the mass, where the user gives none


@dataclass(frozen=True, eq=False, repr=False)
class Case(OneScreen):
    """The resolved request of the user: a model in SI, and what was measured on it.

    Attributes
    ----------
    path : Path               of case.toml
    deck, assembly, units     the model, SI
    as_deck : Assembly        the deck's own, where `assembly` has other thickness, or the same
    damping : float           fraction of critical the model is given, where nothing else says
    recordings : tuple        one per file, article and level; FRFs share labels and quantity
    setup : TestSetup         sensors as the user describes them, hangers, weighed mass
    outputs, inputs : MeasuredDofs  of the FRFs' dofs, in the FRFs' order
    asked : Request           the words of the case, and where each stands
    band : (low, high) or None   to fit [Hz]; None: all
    exclude : bands left out [Hz]
    held_sensors : int, labels or None   None: chosen automatically
    held_band : (low, high) or None
    parameters : tuple        freed by the user; empty: a default set
    gain_known : bool         else one real factor common to all channels is free
    notes : tuple of str      what was read otherwise than it stands there
    given : (section, key)    of every word
    sensor_masses : (grid, kg) pairs of known mass: on the article while it was measured
    effects : names           that a diagnosis tries; empty: all
    shape_sd : float or None  standard deviation of measured shapes, of their rms
    """

    path: Path
    deck: Deck
    assembly: Assembly
    as_deck: Assembly
    units: Units
    damping: float | None
    recordings: tuple[Recording, ...]
    setup: TestSetup
    outputs: MeasuredDofs
    inputs: MeasuredDofs
    asked: Request
    band: Band | None
    exclude: tuple[Band, ...]
    held_sensors: int | tuple[str, ...] | None
    held_band: Band | None
    parameters: tuple[FreeParameter, ...]
    gain_known: bool
    notes: tuple[str, ...]
    given: tuple[tuple[str, str], ...]
    sensor_masses: tuple[tuple[int, float], ...]
    effects: tuple[str, ...]
    shape_sd: float | None = None

    @property
    def frfs(self) -> tuple[FRF, ...]:
        """The FRFs of all recordings that hold one, the compared first; none where poles are."""
        if self.recordings and self.recordings[0].frf is None:
            return ()
        return tuple(r.frf for r in self.recordings if r.frf is not None)

    def tested(self, assembly: Assembly) -> Assembly:
        """An article with the sensors of known mass on it, as it was measured."""
        return with_mass_pairs(assembly, self.sensor_masses)

    def said(self, command: str) -> list[str]:
        """Notes of what was read and how, and of what this command makes no use of."""
        out = [*self.notes, *unread(self.given, command)]
        if self.sensor_masses and command in KEYS["sensors.csv", "mass"].used:
            said = weight(self.assembly, self.outputs, self.inputs, "sensors.csv")
            out.append(f"{said}, at {len(self.sensor_masses)} grids; weighed mass excludes them.")
        return out

    def lines(self, frequency: np.ndarray) -> np.ndarray:
        """Which of these frequencies are to be fitted (n_f,) bool: in the band, not left out."""
        low, high = self.band or (0.0, np.inf)
        use = (low <= frequency) & (frequency <= high) & (frequency > 0)
        for a, b in self.exclude:
            use &= ~((a <= frequency) & (frequency <= b))
        return np.asarray(use)


@checked
def load_case(path: str | Path) -> Case:
    """Read a case from its folder or its case.toml.

    Raises
    ------
    FileError, LabelError, ModelError
        One sentence naming file, line, offender and alternatives.
    """
    path = Path(path)
    if path.is_dir() and not (path / "case.toml").is_file():
        raise FileError(
            f"no case.toml in the folder {path}; chladni init DECK RECORDING --out {path} drafts "
            "one"
        )
    if not path.exists():
        raise FileError(f"no file or folder {path}")
    path = path / "case.toml" if path.is_dir() else path
    if not lies_within(path, path.parent):
        raise FileError(f"{path} is a link out of the folder of the case; copy the file into it")
    return resolved(request_of(path))


def resolved(asked: Request) -> Case:
    """Read what a case names, and resolve it.

    Raises
    ------
    FileError, LabelError, ModelError
        One sentence naming file and line or argument, offender and alternatives.
    """
    words, at = asked.said.words, asked.said.places
    units = UNITS[words["units"]]
    allow = words.get("allow", ())
    deck = asked.deck
    with files_within(None if asked.anywhere else asked.path.parent):
        if deck is None:
            deck = read_deck(asked.file(words["deck"], at["deck"]), allow)
        as_deck = assembly(deck, units)
        made, notes = _thickness(asked, asked.assembly or as_deck, units)
        setup = _setup(asked, made)
        recordings = _recordings(asked, (*setup.outputs, *setup.inputs))
    notes += notes_of(recordings, "use" in words)
    notes += remarks(deck, STRUCTURAL)
    if allow:
        notes.append(f"ignored by [model] allow: {named(allow, 20)}")
    if "shape_sd" in words and (not recordings or recordings[0].modal is None):
        notes.append(
            f"{at['shape_sd']} = {words['shape_sd']:g} is not used: no shapes are compared"
        )
    if words.get("outside"):
        notes.append(OUTSIDE)
    band = covered(words.get("band"), "[band] fit", at["band"], recordings, notes)
    held_band = covered(
        words.get("held_out_band"), "[held_out] band", at["held_out_band"], recordings, notes
    )
    outputs, inputs = (
        places(at["recordings"], setup, made, recordings, role, notes) for role in ROLES
    )
    _base_and_quantity(at, recordings, inputs)
    notes += unrecorded(setup, outputs, inputs)
    tried = searched_effects(asked.said, notes)
    return Case(
        path=asked.path,
        deck=deck,
        assembly=made,
        as_deck=as_deck,
        units=units,
        damping=words.get("damping"),
        recordings=recordings,
        setup=setup,
        outputs=outputs,
        inputs=inputs,
        band=band,
        exclude=tuple(words.get("exclude", ())),
        held_sensors=held_out(asked.said, recordings),
        held_band=held_band,
        parameters=free_parameters(asked.parameters, made, deck),
        gain_known=words.get("gain") != "unknown",
        effects=tried,
        notes=tuple(notes),
        given=asked.given,
        asked=asked,
        sensor_masses=sensor_masses(made, outputs, inputs),
        shape_sd=words.get("shape_sd"),
    )


def _thickness(asked: Request, made: Assembly, units: Units) -> tuple[Assembly, list[str]]:
    """The deck's structure with the thickness of a file, where the case names one."""
    words, at = asked.said.words, asked.said.places
    if "thickness" not in words:
        for word in ("thickness_units", "thickness_place"):
            if word in words:
                raise FileError(f"{at[word]} needs a file of thickness, but none is named")
        return made, []
    path = asked.file(str(words["thickness"]), at["thickness"])
    own = UNITS[words["thickness_units"]] if "thickness_units" in words else units
    try:
        found = formed_thickness(made, path, own, words.get("thickness_place", PLACES[0]))
    except ChladniError as error:
        raise type(error)(f"{at['thickness']}: {error}") from error
    return found.mapped.assembly, found.said()


def _recordings(asked: Request, sensors: Sequence[Sensor]) -> tuple[Recording, ...]:
    """All recordings, what is one test stacked, the FRFs with the labels of the first."""
    words, at = asked.said.words, asked.said.places
    if words.get("factor") == 0:
        raise FileError(f"{at['factor']} = 0 removes the recording")
    names = words.get("recordings", ())
    listed = [(name, at["recordings"]) for name in names]
    more = {each.words["file"]: each.places["file"] for each in reversed(asked.recordings)}
    listed += [(name, place) for name, place in reversed(more.items()) if name not in names]
    read: list[Recording] = []
    paths: list[Path] = []
    for name, place in listed:
        if name in asked.held:
            found: Sequence[Recording] = (asked.held[name],)
        else:
            paths.append(asked.file(name, place).resolve())
            if paths[-1] in paths[:-1]:
                said = f"lists {name!r} twice; a repeat is a measurement of its own"
                raise FileError(f"{place} {said}")
            found = read_recordings(paths[-1], words.get("quantity"))
        for r in described(asked.recordings, name, [with_frf(r)[0] for r in found]):
            alive = read_as(
                without_dead_channels(r),
                words.get("frequency_unit", "Hz"),
                words.get("conjugated", False),
            )
            longest, delay = record_length(alive), words.get("delay", 0.0)
            refuse_beyond(at["delay"], delay, -longest, longest)
            read.append(mended(alive, words.get("factor", 1.0), delay, sensors))
    ranked = compared_first(asked.said, stacked(read))
    first = next((r for r in ranked if r.frf is not None), None)
    alike = tuple(
        r if first is None or r.frf is None else _like(first, r, at["recordings"]) for r in ranked
    )
    if ranked and ranked[0].modal is not None:
        alike = tuple(_with_dofs(ranked[0], r, at["recordings"]) for r in ranked)
    refuse_copies(alike, at["recordings"])
    return alike


def _like(first: Recording, other: Recording, at: str) -> Recording:
    """The recording with the labels of the first, in its order."""
    a, b = first.frf, other.frf
    assert a is not None
    assert b is not None
    for word, ours, theirs in (("outputs", a.outputs, b.outputs), ("inputs", a.inputs, b.inputs)):
        if set(ours) != set(theirs):
            only = sorted(set(ours) ^ set(theirs))
            raise FileError(
                f"{at}: {first.name} and {other.name} disagree on {word}: only one of them has "
                f"{named(only)}"
            )
    if a.quantity != b.quantity:
        raise FileError(f"{at}: {first.name} holds {a.quantity}, {other.name} {b.quantity}")
    return replace(other, frf=b.sel(a.outputs, a.inputs))


def _with_dofs(first: Recording, other: Recording, at: str) -> Recording:
    """Shapes of another state at the dofs of the first."""
    a, b = first.modal, other.modal
    if a is None or b is None or other.state == first.state:
        return other
    if lacks := [label for label in a.dofs if label not in b.dofs]:
        raise FileError(f"{at}: {other.name} has no shapes at {named(lacks)}, as {first.name} has")
    return replace(other, shapes=b.sel(np.arange(len(b.frequency)), positions(a.dofs, b.dofs)))


def _setup(asked: Request, made: Assembly) -> TestSetup:
    """Sensors, hangers and weighing as the user gives them."""
    words, at = asked.said.words, asked.said.places
    sensors = asked.sensors
    if "sensors" in words:
        sensors = read_sensors(asked.file(str(words["sensors"]), at["sensors"]))
    mass, hangers = words.get("mass"), words.get("hangers", ())
    mass_sd = words.get("mass_sd", _MASS_SD * (mass or 0.0))
    if "mass_sd" in words:
        if mass is None:
            raise FileError(f"{at['mass_sd']} needs a mass, but [test] has none")
        refuse_beyond(at["mass_sd"], mass_sd, 1e-6 * mass, mass)
    for grid in hangers:
        grid_row(made, grid, at["hangers"])
    usual = SensorAccuracy()
    position = words.get("position_sd", usual.position)
    if "position_sd" in words:
        refuse_beyond(at["position_sd"], position, 0.0, float(np.ptp(made.points, axis=0).max()))
    turn = float(np.radians(words["direction_sd"])) if "direction_sd" in words else usual.direction
    return TestSetup(
        outputs=tuple(s for s in sensors if s.role == "output"),
        inputs=tuple(s for s in sensors if s.role == "input"),
        hangers=tuple(hangers),
        mass=mass,
        mass_sd=mass_sd,
        accuracy=SensorAccuracy(words.get("gain_sd", usual.gain), turn, position),
    )


def _base_and_quantity(
    at: Mapping[str, str], recordings: Sequence[Recording], inputs: MeasuredDofs
) -> None:
    """Refuse a moving base that is no transmissibility, and the other way round."""
    frf = recordings[0].frf if recordings else None
    if frf is None:
        return
    base, quantity = inputs.base, frf.quantity
    if base.any() and not base.all():
        raise FileError(f"{at['recordings']}: forces and a moving base cannot both be inputs")
    if base.any() != (quantity == "transmissibility"):
        due = (
            "its input must be base:+X, +Y or +Z"
            if not base.any()
            else ('the quantity of a moving base is quantity = "transmissibility"')
        )
        raise FileError(
            f"{at['quantity']}: {recordings[0].name} is {quantity} from "
            f"{', '.join(frf.inputs[:3])}; {due}"
        )
