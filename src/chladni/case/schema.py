"""Every word a case may hold, in one table: what reads it, its unit, its default, an example.

The reader takes its known words and choices from here, ``docs/case.md`` is written from here and a
test goes over it: a word that nobody reads cannot be added without being noticed.
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
        "Thickness after forming: LS-DYNA keyword file, VTU or CSV, or a scan of both faces (STL, "
        "PLY, OBJ). It is mapped onto the shells before anything is asked, and stands in every "
        "deck that is written.", '"formed.k"', COMMANDS),
    Key("model", "thickness_units", "word", "", "the deck's", "The unit system of that file.",
        '"mm-t-s"', COMMANDS, tuple(UNITS)),
    Key("model", "thickness_place", "word", "", "as it lies",
        "Place of its sheets: on the deck's, brought onto them first, or brought onto them as a "
        "mirror image.", '"aligned"', COMMANDS, PLACES),
    Key("model", "damping", "number, 0 to 0.5", "of critical", "0.01",
        "Damping the model is given where its responses are drawn or scored.", "0.01", _FRF),
    Key("model", "allow", "list of cards", "", "none",
        "Cards and case control commands that are passed over although they are not understood.",
        '["CWELD"]', COMMANDS),
    Key("model", "outside", "true or false", "", "false",
        "True: files of the case may lie outside of its folder (`../`, or a whole path). Leave it "
        "false in a case from somebody else.", "true", COMMANDS),
    Key("test", "recordings", "list of files", "", "none",
        "Universal files, .npz, .csv, .mat or .wav: FRFs, poles or time data, whose FRFs are "
        "estimated as `chladni test` does. One file may hold several articles or levels. The "
        "first is compared with the model (or the one `use` names). Recordings of one article, "
        "level and state that were driven at other places are stacked with it; the rest is held "
        "out and scored. `identify` reads all.",
        '["article_A.uff", "article_B.uff"]', (*_READ, "bench")),
    Key("test", "use", "text", "", "the first",
        "Which recording is compared: the name of its file, its article, its level or its state.",
        '"article_B.uff"', _READ),
    Key("test", "quantity", "word", "", "what the file says", "What the FRFs are.",
        '"accelerance"', _READ, get_args(Quantity)),
    Key("test", "gain", "word", "", "known",
        "Unknown: one real factor common to all channels is free.", '"unknown"', _SCORE,
        ("known", "unknown")),
    Key("test", "factor", "number, not 0", "", "1",
        "What the FRFs are multiplied by: 9.80665 where g were taken for m/s².", "9.80665", _READ),
    Key("test", "delay", "number", "s", "0",
        "By how much all responses lag the forces; it is taken off. At most 1 / Δf of the lines.",
        "0.0005", _READ),
    Key("test", "frequency_unit", "word", "", "Hz",
        "Unit of frequency in the recordings; all other frequencies of a case are in Hz.",
        '"rad/s"', _READ, tuple(HERTZ)),
    Key("test", "conjugated", "true or false", "", "false",
        "True: the FRFs were computed with exp(-iωt), their phases turn the wrong way.",
        "true", _READ),
    Key("test", "sensors", "file", "",
        "labels name grids of the deck, unless their coordinates lie elsewhere or they just count "
        "1, 2, 3",
        "Where sensors and shakers sit, which channels are left out or of a wrong gain: the table "
        "below.", '"sensors.csv"', (*_READ, "bench")),
    Key("test", "mass", "number", "kg", "not weighed",
        "Weighed mass of the article, its sensors taken off.", "10.508", _TEST),
    Key("test", "mass_sd", "number above 0, up to the mass", "kg", "0.2 % of the mass",
        "Standard deviation of the weighing.", "0.005", _FIT),
    Key("test", "gain_sd", "number, 0 to 1", "", "0.01",
        "Standard deviation of the gain of each sensor and force gauge, relative.", "0.005", _FIT),
    Key("test", "direction_sd", "number, 0 to 90", "deg", "1",
        "Standard deviation of the direction of each, either way.", "0.5", _FIT),
    Key("test", "position_sd", "number, 0 to the size of the structure", "m", "0.0015",
        "Standard deviation of the place of each, either way along the sheet, where the table of "
        "sensors gives none.", "0.003", _FIT),
    Key("test", "hangers", "list of grids", "", "none",
        "Where cords hold the article: the springs of `suspension` sit there.", "[101, 102]",
        ("diagnose", "bench")),
    Key("recording", "file", "file", "", "needed",
        "One more recording, or one of `recordings` of which more is to be said.",
        '"article_B.uff"', _READ),
    Key("recording", "article", "text", "", "what the file says",
        "Which of several nominally equal objects it is. Repeats and articles give the spread "
        "below which no fit has to go.", '"B"', _READ),
    Key("recording", "level", "number", "N or m/s²", "what the file says",
        "Amplitude that was held: of the force, of the base, or of the response as `control` says. "
        "`identify` and `diagnose` hold frequency and damping against it.", "2.0", _READ),
    Key("recording", "control", "word", "", "force",
        "What was held at `level` from line to line: the force (or the motion of the base), or the "
        "response of the drive point (else of the first output) in the unit of the recording.",
        '"response"', _READ, get_args(Control)),
    Key("recording", "state", "text", "", "one state",
        "What was done to the object before this was measured. `calibrate` and `diagnose` take "
        "every state (or the one `use` names): E, rho, t are shared, an effect is a state's own. "
        "The deck and `mass` are those of the first, or of the one used.",
        '"with the bracket"', _READ),
    Key("recording", "mass", "number", "kg", "not weighed in this state",
        "Weighed mass in this state.", "1.95", _FIT),
    Key("band", "fit", "[low, high]", "Hz", "all the recording holds",
        "Band that is identified, scored and fitted.", "[26.0, 195.0]",
        ("identify", *_SCORE, "bench")),
    Key("band", "exclude", "list of [low, high]", "Hz", "none",
        "Bands within it that are left out.", "[[23.0, 27.5]]", ("identify", *_SCORE)),
    Key("held_out", "sensors", "number, or list of labels", "", "a fifth of the outputs",
        "Outputs no fit may see.", '["412:+Z"]', _FIT),
    Key("held_out", "band", "[low, high]", "Hz", "the upper fifth of the band",
        "Band no fit may see.", "[200.0, 300.0]", (*_FIT, "bench")),
    Key("search", "effects", "list of effects", "", "all of the catalogue",
        "The effects that are tried; a cause that is not among them is not named. Faults of the "
        "recording are always looked for.", '["point-mass", "stiffness-patch"]', ("diagnose",)),
    Key("parameter", "name", "text", "", "the field", "What the page calls it.", '"E steel"',
        _VARIED),
    Key("parameter", "parts", "list of parts", "", "all that have the field",
        "Names or property ids of parts; of joints and masses the card: `PBUSH 7`, `PELAS 3`, "
        "`CELAS2 12`, `CONM2 5`.", '["inner", "outer upper"]', _VARIED),
    Key("parameter", "field", "word", "", "needed",
        "The number that is free, one factor for all its parts; or an effect's name, where it "
        "acts being known.", '"E"', _VARIED, FREEABLE),
    Key("parameter", "sd", "number, 0.001 to 2", "of the deck's value",
        "0.06 (E, rho), 0.05 (t, wall), 0.1 (nu), 0.3 (others)",
        "Tolerance: standard deviation of the prior of ln(value / deck's value). `study` goes two "
        "of them far where `low` or `high` is missing.", "0.03", _VARIED),
    Key("parameter", "low", "number below 1", "of the deck's value", "none",
        "Bound: the value stays above low times the deck's.", "0.8", _VARIED),
    Key("parameter", "high", "number above 1", "of the deck's value", "none",
        "Bound: the value stays below high times the deck's.", "1.25", _VARIED),
)  # fmt: skip

COLUMNS = (
    Key("sensors.csv", "label", "text", "", "needed",
        "The output or input of the recording, as `412:+Z` or `412:n`.", "412:+Z", _PLACED),
    Key("sensors.csv", "grid", "whole number, or base", "", "the node of the label",
        "Grid of the deck it sits at; `base`: it measures the motion of all supports together, "
        "the input of a transmissibility.", "412", _PLACED),
    Key("sensors.csv", "x", "number", "m", "", "Place, basic frame, in place of a grid.", "0.25",
        _PLACED),
    Key("sensors.csv", "y", "number", "m", "", "Place.", "0.1", _PLACED),
    Key("sensors.csv", "z", "number", "m", "", "Place.", "0.0", _PLACED),
    Key("sensors.csv", "direction", "+X -X +Y -Y +Z -Z n", "", "the direction of the label",
        "Which way it points, basic frame; `n` is the normal of the surface.", "+Z", _PLACED),
    Key("sensors.csv", "nx", "number", "", "", "Direction as three numbers.", "0.0", _PLACED),
    Key("sensors.csv", "ny", "number", "", "", "Direction.", "0.6", _PLACED),
    Key("sensors.csv", "nz", "number", "", "", "Direction.", "0.8", _PLACED),
    Key("sensors.csv", "role", "word", "", "output", "What it does.", "input", _PLACED,
        ("output", "input")),
    Key("sensors.csv", "mass", "number", "kg", "0",
        "Mass on the article while it is measured. It is in the model before anything is asked and "
        "in no deck that is written. Rows of one place and role are one device.", "0.005", _PLACED),
    Key("sensors.csv", "gain", "number, not 0", "", "1",
        "The recording shows this many times what was there; the channel is divided by it.", "0.5",
        _READ),
    Key("sensors.csv", "use", "word", "", "yes", "Whether the output is used.", "no", _READ,
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
