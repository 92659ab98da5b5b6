"""A case: one ``case.toml`` that names the deck, the recordings and what to do with them.

Everything is resolved here once: files are read, labels become grids or places on the nearest
shell, bands are compared with the data. Contradictions are refused in one sentence.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import get_args

import numpy as np

from ..arguments import checked
from ..dynamics.frf import FRF, Quantity
from ..ema.setup import Recording, Sensor, SensorAccuracy, TestSetup
from ..errors import ChladniError, FileError, did_you_mean, named, shortened
from ..fem.measured_dofs import MeasuredDofs
from ..io.file_size import LEADS_OUT, files_within, lies_within
from ..io.nastran import Deck, assembly, read_deck
from ..io.nastran.read.analysis_requests import STRUCTURAL, remarks
from ..io.tables.read_tables import read_recordings
from ..io.tables.sensor_table import read_sensors
from ..model.assembly import Assembly
from ..model.free_parameter import FreeParameter
from ..model.point_masses import with_mass_pairs
from ..units import HERTZ, UNITS, Units
from .bands import bands, held_out, searched_effects
from .free_parameters import free_parameters
from .mapped_thickness import PLACES, formed_thickness
from .mended_recordings import mended, read_as, record_length, with_frf
from .recording_groups import described, refuse_copies, stacked
from .recordings import compared_first, notes_of, without_dead_channels
from .schema import key, known, sections, unread
from .sensor_places import ROLES, grid_row, labels, places, sensor_masses, unrecorded
from .sensor_places import weight_of_sensors as weight
from .toml_sections import KeyFile, TomlSection, read_keys

OUTSIDE = "[model] outside: files of the case may lie outside of its folder"  # as a note
_MASS_SD = 0.002  # of the mass, where the user gives none


@dataclass(frozen=True, eq=False)
class Case:
    """The resolved request of the user.

    Attributes
    ----------
    path : Path               of case.toml
    deck, assembly, units     the model, SI
    as_deck : Assembly        the deck's own, where `assembly` has other thickness, or the same
    damping : float           fraction of critical the model is given, where nothing else says
    recordings : tuple        one per file, article and level; FRFs share labels and quantity
    setup : TestSetup         sensors as the user describes them, hangers, weighed mass
    outputs, inputs : MeasuredDofs  of the FRFs' dofs, in the FRFs' order
    band : (low, high) or None   to fit [Hz]; None: all
    exclude : bands left out [Hz]
    held_sensors : int, labels or None   None: chosen automatically
    held_band : (low, high) or None
    parameters : tuple        freed by the user; empty: a default set
    gain_known : bool         else one real factor common to all channels is free
    notes : tuple of str      what was read otherwise than it stands there
    given : (section, key)    every word the file holds
    keys : KeyFile            the same with what they say
    sensor_masses : (grid, kg) pairs of known mass: on the article while it was measured
    effects : names           that a diagnosis tries; empty: all
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
    band: tuple[float, float] | None = None
    exclude: tuple[tuple[float, float], ...] = ()
    held_sensors: int | tuple[str, ...] | None = None
    held_band: tuple[float, float] | None = None
    parameters: tuple[FreeParameter, ...] = ()
    gain_known: bool = True
    notes: tuple[str, ...] = field(default=())
    given: tuple[tuple[str, str], ...] = ()
    keys: KeyFile = field(default_factory=lambda: KeyFile(Path(), {}))
    sensor_masses: tuple[tuple[int, float], ...] = ()
    effects: tuple[str, ...] = ()

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
        if self.sensor_masses and command in key("sensors.csv", "mass").used:
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
    return resolved(path, read_keys(path, sections()))


@dataclass(frozen=True, eq=False)
class InMemory:
    """Parts of a case that a program holds already, in place of the files that it would name.

    Attributes
    ----------
    deck : the deck, and ``assembly`` the structure where it differs from the deck's
    recordings : by the names under which the keys list them
    sensors : the table of sensors
    anywhere : whether files may lie anywhere, as where a program names them
    """

    deck: Deck | None = None
    assembly: Assembly | None = None
    recordings: Mapping[str, tuple[Recording, ...]] = field(default_factory=dict)
    sensors: tuple[Sensor, ...] | None = None
    anywhere: bool = False


def resolved(path: Path, keys: KeyFile, held: InMemory = InMemory()) -> Case:
    """Read what the keys of a case name, and resolve it.

    Parameters
    ----------
    path : of the case, as messages name it
    held : what need not be read

    Raises
    ------
    FileError, LabelError, ModelError
        One sentence naming file, line, offender and alternatives.
    """
    model, test = (
        keys.section("model", known("model"), due=True),
        keys.section("test", known("test")),
    )
    units = UNITS[model.text("units", due=True, among=key("model", "units").choices) or "SI"]
    outside = model.flag("outside") or held.anywhere
    allow = model.list("allow", str) or []
    deck = held.deck
    with files_within(None if outside else path.parent):
        if deck is None:
            name = str(model.text("deck", due=True))
            deck = read_deck(_file(model, "deck", name, outside), allow)
        as_deck = assembly(deck, units)
        made, notes = _thickness(model, held.assembly or as_deck, units, outside)
        setup = _setup(test, made, outside, held.sensors)
        sensors = (*setup.outputs, *setup.inputs)
        more = keys.sections("recording", known("recording"))
        recordings = _recordings(test, more, sensors, outside, held.recordings)
    notes += notes_of(recordings, "use" in test)
    notes += remarks(deck, STRUCTURAL)
    if allow:
        notes.append(f"ignored by [model] allow: {named(allow, 20)}")
    if "outside" in model and outside:
        notes.append(OUTSIDE)
    band, exclude = bands(keys, recordings, notes)
    held_sensors, held_band = held_out(keys, recordings, notes)
    outputs, inputs = (
        places(test, setup, made, labels(recordings, setup, role), role, recordings[:1], notes)
        for role in ROLES
    )
    _base_and_quantity(test, recordings, inputs)
    notes += unrecorded(setup, outputs, inputs)
    tried = searched_effects(keys, notes)
    return Case(
        path=path,
        deck=deck,
        assembly=made,
        as_deck=as_deck,
        units=units,
        damping=model.number("damping", low=0.0, high=0.5),
        recordings=recordings,
        setup=setup,
        outputs=outputs,
        inputs=inputs,
        band=band,
        exclude=exclude,
        held_sensors=held_sensors,
        held_band=held_band,
        parameters=free_parameters(keys.sections("parameter", known("parameter")), made, deck),
        gain_known=test.text("gain", among=key("test", "gain").choices) != "unknown",
        notes=tuple(notes),
        given=keys.given(),
        keys=keys,
        sensor_masses=sensor_masses(made, outputs, inputs),
        effects=tried,
    )


def _file(section: TomlSection, key: str, name: str, outside: bool) -> Path:
    """A file the case names, in its folder unless others are allowed."""
    if "\0" in name:
        raise FileError(f"{section.at(key)} = {shortened(repr(name))} is not a file name")
    folder = section.file.parent
    path = folder / name
    if not outside and not lies_within(path, folder):
        raise FileError(f"{section.at(key)} = {shortened(repr(name))} {LEADS_OUT}")
    try:
        exists = path.is_file()
    except OSError:
        raise FileError(f"{section.at(key)} = {shortened(repr(name))} is no file name") from None
    if not exists:
        there = sorted(p.name for p in folder.glob("*") if p.is_file())
        hint = did_you_mean(Path(name).name, there)
        said = f"there is no file {shortened(repr(name))}; {hint}there are {named(there, 8)}"
        raise FileError(f"{section.at(key)}: {said}")
    return path


def _thickness(
    model: TomlSection, made: Assembly, units: Units, outside: bool
) -> tuple[Assembly, list[str]]:
    """The deck's structure with the thickness of a file, where the case names one."""
    name = model.text("thickness")
    own = model.text("thickness_units", among=tuple(UNITS))
    place = model.text("thickness_place", among=PLACES)
    if name is None:
        for word, value in (("thickness_units", own), ("thickness_place", place)):
            if value is not None:
                raise FileError(f"{model.at(word)} needs a file of thickness, but none is named")
        return made, []
    path = _file(model, "thickness", name, outside)
    try:
        found = formed_thickness(made, path, UNITS[own] if own else units, place or PLACES[0])
    except ChladniError as error:
        raise type(error)(f"{model.at('thickness')}: {error}") from error
    return found.mapped.assembly, found.said()


def _recordings(
    test: TomlSection, more: Sequence[TomlSection], sensors: Sequence[Sensor], outside: bool,
    held: Mapping[str, tuple[Recording, ...]],
) -> tuple[Recording, ...]:  # fmt: skip
    """All recordings, what is one test stacked, the FRFs with the labels of the first."""
    quantity = test.text("quantity", among=get_args(Quantity))
    if (factor := test.number("factor")) == 0:
        raise FileError(f"{test.at('factor')} = 0 removes the recording")
    how = test.text("frequency_unit", among=tuple(HERTZ)) or "Hz", test.flag("conjugated")
    listed = [(test, "recordings", name) for name in test.list("recordings", str) or []]
    named = {name for _, _, name in listed}
    for section in more:
        name = str(section.text("file", due=True))
        if name not in named:
            named.add(name)
            listed.append((section, "file", name))
    read: list[Recording] = []
    paths: list[Path] = []
    for section, word, name in listed:
        if name in held:
            found = held[name]
        else:
            paths.append(_file(section, word, name, outside).resolve())
            if paths[-1] in paths[:-1]:
                said = f"lists {name!r} twice; a repeat is a measurement of its own"
                raise FileError(f"{section.at(word)} {said}")
            found = read_recordings(paths[-1], quantity)
        for r in described(more, name, [with_frf(r)[0] for r in found]):
            alive = read_as(without_dead_channels(r), *how)
            longest = record_length(alive)
            delay = test.number("delay", low=-longest, high=longest) or 0.0
            read.append(mended(alive, 1.0 if factor is None else factor, delay, sensors))
    ranked = compared_first(test, stacked(read))
    first = next((r for r in ranked if r.frf is not None), None)
    alike = tuple(r if first is None or r.frf is None else _like(first, r, test) for r in ranked)
    refuse_copies(alike, test.at("recordings"))
    return alike


def _like(first: Recording, other: Recording, test: TomlSection) -> Recording:
    """The recording with the labels of the first, in its order."""
    a, b = first.frf, other.frf
    assert a is not None
    assert b is not None
    for word, ours, theirs in (("outputs", a.outputs, b.outputs), ("inputs", a.inputs, b.inputs)):
        if set(ours) != set(theirs):
            only = sorted(set(ours) ^ set(theirs))
            raise FileError(
                f"{test.at('recordings')}: {first.name} and {other.name} disagree on {word}: only "
                f"one of them has {named(only)}"
            )
    if a.quantity != b.quantity:
        raise FileError(
            f"{test.at('recordings')}: {first.name} holds {a.quantity}, {other.name} {b.quantity}"
        )
    return replace(other, frf=b.sel(a.outputs, a.inputs))


def _setup(
    test: TomlSection, made: Assembly, outside: bool, held: tuple[Sensor, ...] | None
) -> TestSetup:
    """Sensors, hangers and weighing as the user gives them."""
    name = test.text("sensors")
    sensors = held or ()
    if name:
        sensors = read_sensors(_file(test, "sensors", name, outside))
    mass = test.number("mass", low=1e-9)
    mass_sd = test.number("mass_sd", low=1e-6 * (mass or 0.0), high=mass or 1e300)
    if mass is None and mass_sd is not None:
        raise FileError(f"{test.at('mass_sd')} needs a mass, but [test] has none")
    hangers = test.list("hangers", int) or []
    for grid in hangers:
        grid_row(made, grid, test.at("hangers"))
    return TestSetup(
        outputs=tuple(s for s in sensors if s.role == "output"),
        inputs=tuple(s for s in sensors if s.role == "input"),
        hangers=tuple(hangers),
        mass=mass,
        mass_sd=_MASS_SD * (mass or 0.0) if mass_sd is None else mass_sd,
        accuracy=_accuracy(test, float(np.ptp(made.points, axis=0).max())),
    )


def _accuracy(test: TomlSection, size: float) -> SensorAccuracy:
    """How well sensors are known on a structure of this size, the usual where nothing is said."""
    usual = SensorAccuracy()
    most = {"gain_sd": 1.0, "direction_sd": 90.0, "position_sd": size}
    gain, turn, place = (test.number(key, low=0.0, high=high) for key, high in most.items())
    return SensorAccuracy(
        usual.gain if gain is None else gain,
        usual.direction if turn is None else float(np.radians(turn)),
        usual.position if place is None else place,
    )


def _base_and_quantity(
    test: TomlSection, recordings: Sequence[Recording], inputs: MeasuredDofs
) -> None:
    """Refuse a moving base that is no transmissibility, and the other way round."""
    frf = recordings[0].frf if recordings else None
    if frf is None:
        return
    base, quantity = inputs.base, frf.quantity
    if base.any() and not base.all():
        raise FileError(f"{test.at('recordings')}: forces and a moving base cannot both be inputs")
    if base.any() != (quantity == "transmissibility"):
        due = (
            "its input must be base:+X, +Y or +Z"
            if not base.any()
            else ('the quantity of a moving base is quantity = "transmissibility"')
        )
        raise FileError(
            f"{test.at('quantity')}: {recordings[0].name} is {quantity} from "
            f"{', '.join(frf.inputs[:3])}; {due}"
        )
