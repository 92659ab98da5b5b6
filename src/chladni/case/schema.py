"""Every word a case may hold, in one table: what reads it, its unit, its default, an example.

The reader takes its known words and choices from here, and ``docs/case.md`` is written from here.
A test checks the table, so an unused word cannot be added unnoticed.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import get_args

from ..dynamics.frf import Quantity
from ..ema.setup import Control
from ..units import HERTZ, UNITS
from .mapped_thickness import PLACES

COMMANDS = ("test", "identify", "correlate", "calibrate", "diagnose",
            "frf", "modes", "render", "plan", "study", "bench")  # fmt: skip
_FIT = ("calibrate", "diagnose")
_TEST = ("correlate", *_FIT)
_SCORE = ("study", *_TEST)  # what Q is taken by
_FRF = ("frf", *_SCORE)
_READ = ("test", "identify", *_FRF)
_VARIED = ("study", *_FIT)
_PLACED = (*_FRF, "bench")


@dataclass(frozen=True)
class Key:
    """One word of a section, or one column of a table.

    ``kind`` is what is written there; ``default`` says what holds where it is missing; ``used`` are
    the commands it matters to.
    """

    section: str
    name: str
    kind: str
    unit: str
    default: str
    meaning: str
    example: str
    used: tuple[str, ...]
    choices: tuple[str, ...] = ()


FIELDS = ("E", "rho", "nu", "t", "wall", "E1", "E2", "G12", "nu12", "K", "M")
ALIASES = {  # effects that are a calibration parameter by another name
    "global-stiffness": "E",
    "part-stiffness": "E",
    "global-density": "rho",
    "thickness-scale": "t",
    "adhesive-stiffness": "E",
}
PLACED = (  # where they act is known
    "orthotropic-material", "sensor-mass", "suspension", "shaker-restraint", "weld-patch",
    "rigid-patch",
)  # fmt: skip
PLANNED = (  # names of the public contract that no model stands behind yet
    "rattle", "joint-friction",
)  # fmt: skip
FREEABLE = (*FIELDS, *ALIASES, *PLACED)

SCHEMA = (
    Key("model", "deck", "file", "", "needed", "The Nastran deck.", '"tailgate.bdf"', COMMANDS),
    Key("model", "units", "word", "", "needed", "The deck's unit system.", '"mm-t-s"', COMMANDS,
        tuple(UNITS)),
    Key("model", "thickness", "file", "", "the deck's own",
        "Thickness after forming: LS-DYNA keyword file, VTU or CSV, or a scan of both faces "
        "(STL, PLY, OBJ). It is mapped onto the shells first, and every written deck contains it.",
        '"formed.k"', COMMANDS),
    Key("model", "thickness_units", "word", "", "the deck's", "The unit system of that file.",
        '"mm-t-s"', COMMANDS, tuple(UNITS)),
    Key("model", "thickness_place", "word", "", "as it lies",
        "Place of its sheets: on the deck's, brought onto them first, or brought onto them as a "
        "mirror image.", '"aligned"', COMMANDS, PLACES),
    Key("model", "damping", "number, 0 to 0.5", "of critical", "0.01",
        "Damping of the model for drawn or scored responses.", "0.01", _FRF),
    Key("model", "allow", "list of cards", "", "none",
        "Unknown cards and case control commands that are ignored.",
        '["CWELD"]', COMMANDS),
    Key("model", "outside", "true or false", "", "false",
        "True: files of the case may lie outside of its folder (`../`, a whole path or a link). "
        "Leave it "
        "false in a case from somebody else.", "true", COMMANDS),
    Key("test", "recordings", "list of files", "", "none",
        "Universal files, .npz, .csv, .mat or .wav: FRFs, poles or time data. FRFs of time data "
        "are estimated as in `chladni test`. One file may have several articles or levels. The "
        "first (or the one `use` names) is compared with the model. Recordings of the same "
        "article, level and state with other drive points are stacked with it; the others are "
        "held out and scored. `identify` reads all.",
        '["article_A.uff", "article_B.uff"]', (*_READ, "bench")),
    Key("test", "use", "text", "", "the first",
        "Recording that is compared: the name of its file, its article, its level or its state.",
        '"article_B.uff"', _READ),
    Key("test", "quantity", "word", "", "as in the file", "Quantity of the FRFs.",
        '"accelerance"', _READ, get_args(Quantity)),
    Key("test", "gain", "word", "", "known",
        "Unknown: one real factor common to all channels is free, its sign included.",
        '"unknown"', _SCORE, ("known", "unknown")),
    Key("test", "factor", "number, not 0", "", "1",
        "Factor on all FRFs: 9.80665 where g were read as m/s².", "9.80665", _READ),
    Key("test", "delay", "number", "s", "0",
        "Delay of all responses after the forces, which is removed. At most 1 / Δf of the lines.",
        "0.0005", _READ),
    Key("test", "frequency_unit", "word", "", "Hz",
        "Unit of frequency in the recordings; all other frequencies of a case are in Hz.",
        '"rad/s"', _READ, tuple(HERTZ)),
    Key("test", "conjugated", "true or false", "", "false",
        "True: the FRFs were computed with exp(-iωt), so their phase has the wrong sign.",
        "true", _READ),
    Key("test", "sensors", "file", "",
        "labels name grids of the deck, unless their coordinates are elsewhere or they only "
        "count 1, 2, 3",
        "Places of sensors and shakers, excluded channels and gains: the table below.",
        '"sensors.csv"', (*_READ, "bench")),
    Key("test", "mass", "number", "kg", "not weighed",
        "Weighed mass of the article without sensors.", "10.508", _TEST),
    Key("test", "mass_sd", "number above 0, up to the mass", "kg", "0.2 % of the mass",
        "Standard deviation of the weighing.", "0.005", _FIT),
    Key("test", "gain_sd", "number, 0 to 1", "", "0.01",
        "Standard deviation of the gain of each sensor and force gauge, relative.", "0.005", _FIT),
    Key("test", "direction_sd", "number, 0 to 90", "deg", "1",
        "Standard deviation of the direction of each, about each transverse axis.", "0.5", _FIT),
    Key("test", "position_sd", "number, 0 to the size of the structure", "m", "0.0015",
        "Standard deviation of the place of each, in each direction of the sheet, if the table "
        "of sensors gives none.", "0.003", _FIT),
    Key("test", "hangers", "list of grids", "", "none",
        "Grids of the cords: places of the springs of `suspension`.", "[101, 102]",
        ("diagnose", "bench")),
    Key("recording", "file", "file", "", "needed",
        "A further recording, or one of `recordings` with further words.",
        '"article_B.uff"', _READ),
    Key("recording", "article", "text", "", "what the file says",
        "Which of several nominally equal objects it is. Repeats and articles give the spread "
        "below which no fit has to go.", '"B"', _READ),
    Key("recording", "level", "number", "N or m/s²", "as in the file",
        "Controlled amplitude of the force, the base or the response, as `control` states. "
        "`identify` and `diagnose` show frequency and damping over it.", "2.0", _READ),
    Key("recording", "control", "word", "", "force",
        "Quantity kept at `level` on every line: the force (or the motion of the base), or the "
        "response. The response is that of the drive point, else of the first output, in the "
        "unit of the recording.",
        '"response"', _READ, get_args(Control)),
    Key("recording", "state", "text", "", "one state",
        "Change of the article before this measurement. `calibrate` and `diagnose` use every "
        "state (or the one `use` names). States share E, rho and t; an effect belongs to one "
        "state. The deck and `mass` are those of the first state, or of the one used.",
        '"with the bracket"', _READ),
    Key("recording", "mass", "number", "kg", "not weighed in this state",
        "Weighed mass in this state.", "1.95", _FIT),
    Key("band", "fit", "[low, high]", "Hz", "the whole recording",
        "Band that is identified, scored and fitted.", "[26.0, 195.0]",
        ("identify", *_SCORE, "bench")),
    Key("band", "exclude", "list of [low, high]", "Hz", "none",
        "Excluded bands within it.", "[[23.0, 27.5]]", ("identify", *_SCORE)),
    Key("held_out", "sensors", "number, or list of labels", "", "a fifth of the outputs",
        "Held-out outputs. Every third reports the gain of a name; the others choose it.",
        '["412:+Z"]', _FIT),
    Key("held_out", "band", "[low, high]", "Hz", "the upper fifth of the band",
        "Held-out band. Every third output reports there; the others choose.",
        "[200.0, 300.0]", (*_FIT, "bench")),
    Key("search", "effects", "list of effects", "", "all of the catalogue",
        "Effects that are tried; no other effect is named. Faults of the recording are always "
        "tried.", '["point-mass", "stiffness-patch"]', ("diagnose",)),
    Key("parameter", "name", "text", "", "the field", "Name on the page.", '"E steel"',
        _VARIED),
    Key("parameter", "parts", "list of parts", "", "all that have the field",
        "Names or property ids of parts; of joints and masses the card: `PBUSH 7`, `PELAS 3`, "
        "`CELAS2 12`, `CONM2 5`.", '["inner", "outer upper"]', _VARIED),
    Key("parameter", "field", "word", "", "needed",
        "The free number, one factor for all its parts; or an effect with a known place.",
        '"E"', _VARIED, FREEABLE),
    Key("parameter", "sd", "number, 0.001 to 2", "of the deck's value",
        "0.06 (E, rho), 0.05 (t, wall), 0.1 (nu), 0.3 (others)",
        "Tolerance: standard deviation of the prior of ln(value / deck's value). `study` uses "
        "two of them where `low` or `high` is missing.", "0.03", _VARIED),
    Key("parameter", "low", "number below 1", "of the deck's value", "none",
        "Bound: the value stays above low times the deck's.", "0.8", _VARIED),
    Key("parameter", "high", "number above 1", "of the deck's value", "none",
        "Bound: the value stays below high times the deck's.", "1.25", _VARIED),
)  # fmt: skip

COLUMNS = (
    Key("sensors.csv", "label", "text", "", "needed",
        "The output or input of the recording, as `412:+Z` or `412:n`.", "412:+Z", _PLACED),
    Key("sensors.csv", "grid", "whole number, or base", "", "the node of the label",
        "Grid of the deck; `base`: it measures the motion of all supports together, the input of "
        "a transmissibility.", "412", _PLACED),
    Key("sensors.csv", "x", "number", "m", "", "Place, basic frame, in place of a grid.", "0.25",
        _PLACED),
    Key("sensors.csv", "y", "number", "m", "", "Place.", "0.1", _PLACED),
    Key("sensors.csv", "z", "number", "m", "", "Place.", "0.0", _PLACED),
    Key("sensors.csv", "direction", "+X -X +Y -Y +Z -Z n", "", "the direction of the label",
        "Direction of the sensor, basic frame; `n` is the normal of the surface.", "+Z", _PLACED),
    Key("sensors.csv", "nx", "number", "", "", "Direction as three numbers.", "0.0", _PLACED),
    Key("sensors.csv", "ny", "number", "", "", "Direction.", "0.6", _PLACED),
    Key("sensors.csv", "nz", "number", "", "", "Direction.", "0.8", _PLACED),
    Key("sensors.csv", "role", "word", "", "output", "Role of the channel.", "input", _PLACED,
        ("output", "input")),
    Key("sensors.csv", "mass", "number", "kg", "0",
        "Mass on the article during the measurement. The model contains it from the start, but "
        "written decks do not. Rows of one place and role are one device.", "0.005", _PLACED),
    Key("sensors.csv", "gain", "number, not 0", "", "1",
        "Ratio of recorded to true motion; the channel is divided by it.", "0.5",
        _READ),
    Key("sensors.csv", "use", "word", "", "yes", "Use of the output.", "no", _READ,
        ("yes", "no")),
    Key("sensors.csv", "position_sd", "number", "m", "0",
        "Uncertainty of the place. Above 5 mm natural frequencies are compared, not FRFs.",
        "0.01", (*_FIT, "bench")),
)  # fmt: skip


def sections() -> tuple[str, ...]:
    """Names of all sections."""
    return tuple(dict.fromkeys(k.section for k in SCHEMA))


def known(section: str) -> tuple[str, ...]:
    """Keys of a section."""
    return tuple(k.name for k in SCHEMA if k.section == section)


def key(section: str, name: str) -> Key:
    """One word of the table."""
    return next(k for k in (*SCHEMA, *COLUMNS) if (k.section, k.name) == (section, name))


def unread(given: Sequence[tuple[str, str]], command: str) -> list[str]:
    """A sentence that names the given words a command makes no use of; none where it uses all."""
    idle: dict[str, list[str]] = {}
    for section, name in given:
        if command not in key(section, name).used:
            names = idle.setdefault(section, [])
            names += [name] * (name not in names)
    said = [f"[{section}] {', '.join(names)}" for section, names in idle.items()]
    return [f"Not used by {command}: {'; '.join(said)}."] if said else []
