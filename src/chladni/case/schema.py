"""Every word that a case may hold, once: its type, its section, its unit, its default, an example.

All that speaks of words derives from here: the file, the arguments of Python, ``docs/case.md``, the
draft of ``chladni init`` and the hints at misspelt words. The name of a field is that of the
argument. A test checks the model, so an unused word cannot be added unnoticed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal, TypedDict, get_args, get_origin

from ..dynamics.frf import Recorded
from ..ema.setup import Control, Sensor
from ..units import HERTZ, UNITS
from .key import NEEDED, Band, File, Key
from .mapped_thickness import PLACES

COMMANDS = ("test", "identify", "correlate", "calibrate", "diagnose",
            "frf", "modes", "render", "plan", "study", "bench")  # fmt: skip
_FIT = ("calibrate", "diagnose")
_TEST = ("correlate", *_FIT)
_SCORE = ("study", *_TEST)  # what Q is taken by
_FRF = ("frf", *_SCORE)
_READ = ("test", "identify", *_FRF)
_RIG = (*_READ, "bench")
_VARIED = ("study", *_FIT)
_PLACED = (*_FRF, "bench")
_PLANNED = ("diagnose", "plan")

FIELDS = ("E", "rho", "nu", "t", "wall", "offset", "E1", "E2", "G12", "nu12", "K", "M")
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
SECTIONS = ("model", "test", "recording", "band", "held_out", "search", "plan", "parameter")


# fmt: off
class FileWords(TypedDict, total=False):
    """Words for which Python has arguments of other forms."""

    deck: Annotated[str, Key("model", '"tailgate.bdf"', COMMANDS, NEEDED, "",
        "The Nastran deck.", kind="file")]
    outside: Annotated[bool, Key("model", "true", COMMANDS, "false", "",
        "True: files of the case may lie outside of its folder (`../`, a whole path or a link). "
        "Leave it false in a case from somebody else.")]
    recordings: Annotated[Sequence[str], Key("test",
        '["article_A.uff", "article_B.uff"]', _RIG, "none", "",
        "Universal files, .npz, .csv, .mat or .wav: FRFs, modes with shapes, poles or time data; "
        ".op2 or .pch: modes. FRFs of time data are estimated as in `chladni test`. One file may "
        "have several articles or levels. The first (or the one `use` names) is compared with the "
        "model. Recordings of the same article, level and state with other drive points are "
        "stacked with it, and those with shapes are merged. The others are held out and scored. "
        "`identify` reads all.", kind="list of files")]
    regions: Annotated[Sequence[str], Key("plan", '["inner", "box 0 0 0 0.4 0.3 0.1"]', _PLANNED,
        "everywhere", "m",
        "Where sensors, shakers and cords may be: parts, boxes by two opposite corners, or labels. "
        "The measurements that a diagnosis advises obey it too. "
        "A CSV file with a column `label` or `part` lists some. A place with a label need not be "
        "flat.", kind="list of places")]
    fixed: Annotated[Sequence[str], Key("plan", '["412:+Z", "sensors.csv"]', _PLANNED, "none", "",
        "Sensors of every layout and next measurement: labels, or tables of sensors.",
        kind="list of labels")]
    forbidden: Annotated[Sequence[str], Key("plan", '["outer", "507:n"]', _PLANNED, "none", "m",
        "Places for no sensor, shaker or cord, written as `regions`.", kind="list of places")]
    cost: Annotated[Sequence[str], Key("plan", '["inner=3", "costs.csv"]', _PLANNED, "1", "",
        "Cost of a sensor by place: a word of `regions`, `=` and a number. A CSV file of places "
        "has a column `cost`. The last of several holds. The information of a place is divided by "
        "its cost.", kind="list of costs")]


class RecordingWords(TypedDict, total=False):
    """Words of a [[recording]]."""

    file: Annotated[str, Key("recording", '"article_B.uff"', _READ, NEEDED, "",
        "A further recording, or one of `recordings` with further words.", kind="file")]
    article: Annotated[str, Key("recording", '"B"', _READ, "what the file says", "",
        "Which of several nominally equal objects it is. Repeats and articles give the spread "
        "below which no fit has to go.")]
    level: Annotated[float, Key("recording", "2.0", _READ, "as in the file", "N or m/s²",
        "Controlled amplitude of the force, the base or the response, as `control` states. "
        "`identify` and `diagnose` show frequency and damping over it.", least=0.0)]
    control: Annotated[Control, Key("recording", '"response"', _READ, "force", "",
        "Quantity kept at `level` on every line: the force (or the motion of the base), or the "
        "response. The response is that of the drive point, else of the first output, in the unit "
        "of the recording.")]
    state: Annotated[str, Key("recording", '"with the bracket"', _READ, "one state", "",
        "Change of the article before this measurement. `calibrate` and `diagnose` use every state "
        "(or the one `use` names). States share E, rho and t; an effect belongs to one state. The "
        "deck and `mass` are those of the first state, or of the one used.")]
    mass: Annotated[float, Key("recording", "1.95", _FIT, "not weighed in this state", "kg",
        "Weighed mass in this state.", least=1e-9)]


class ParameterWords(TypedDict, total=False):
    """Words of a [[parameter]]."""

    name: Annotated[str, Key("parameter", '"E steel"', _VARIED, "the field", "",
        "Name on the page.")]
    parts: Annotated[Sequence[str | int], Key("parameter", '["inner", "outer upper"]', _VARIED,
        "all that have the field", "",
        "Names or property ids of parts; of joints and masses the card: `PBUSH 7`, `PELAS 3`, "
        "`CELAS2 12`, `CONM2 5`.", kind="list of parts")]
    field: Annotated[str, Key("parameter", '"E"', _VARIED, NEEDED, "",
        "The free number, one factor for all its parts; or an effect with a known place.",
        choices=FREEABLE, more=True)]
    sd: Annotated[float, Key("parameter", "0.03", _VARIED,
        "by material", "of the deck's value",
        "Tolerance: standard deviation of the prior of ln(value / deck's value). `study` uses two "
        "of them where `low` or `high` is missing.", least=0.001, most=2.0)]
    low: Annotated[float, Key("parameter", "0.8", _VARIED, "none", "of the deck's value",
        "Bound: the value stays above low times the deck's.",
        kind="number below 1", least=1e-6, most=0.999)]
    high: Annotated[float, Key("parameter", "1.25", _VARIED, "none", "of the deck's value",
        "Bound: the value stays below high times the deck's.",
        kind="number above 1", least=1.001, most=1e6)]


class CaseWords(TypedDict, total=False):
    """Keyword arguments that describe a case, each a word of ``case.toml``."""

    units: Annotated[str, Key("model", '"mm-t-s"', COMMANDS, NEEDED, "",
        "The deck's unit system.", choices=tuple(UNITS))]
    thickness: Annotated[File, Key("model", '"formed.k"', COMMANDS, "the deck's own", "",
        "Thickness after forming: LS-DYNA keyword file, VTU or CSV, or a scan of both faces (STL, "
        "PLY, OBJ). It is mapped onto the shells first, and every written deck contains it.")]
    thickness_units: Annotated[str, Key("model", '"mm-t-s"', COMMANDS, "the deck's", "",
        "The unit system of that file.", choices=tuple(UNITS))]
    thickness_place: Annotated[str, Key("model", '"aligned"', COMMANDS, "as it lies", "",
        "How its sheets lie on the deck's: as they are, moved onto them first, or moved as a "
        "mirror image.", choices=PLACES)]
    damping: Annotated[float, Key("model", "0.01", _FRF, "0.01", "of critical",
        "Damping of the model for drawn or scored responses.", least=0.0, most=0.5)]
    allow: Annotated[Sequence[str], Key("model", '["CWELD"]', COMMANDS, "none", "",
        "Unknown cards and case control commands that are ignored.", kind="list of cards")]
    use: Annotated[str, Key("test", '"article_B.uff"', _READ, "the first", "",
        "Recording that is compared: the name of its file, its article, its level or its state.")]
    quantity: Annotated[Recorded, Key("test", '"accelerance"', _READ, "as in the file", "",
        "Quantity of the FRFs. Force over motion of one force at a time is turned into its "
        "reciprocal.")]
    gain: Annotated[str, Key("test", '"unknown"', _SCORE, "known", "",
        "Unknown: one real factor common to all channels is free, its sign included.",
        choices=("known", "unknown"))]
    factor: Annotated[float, Key("test", "9.80665", _READ, "1", "",
        "Factor on all FRFs: 9.80665 where g were read as m/s².", kind="number, not 0")]
    delay: Annotated[float, Key("test", "0.0005", _READ, "0", "s",
        "Delay of all responses after the forces, which is removed. At most 1 / Δf of the lines.")]
    frequency_unit: Annotated[str, Key("test", '"rad/s"', _READ, "Hz", "",
        "Unit of frequency in the recordings; all other frequencies of a case are in Hz.",
        choices=tuple(HERTZ))]
    conjugated: Annotated[bool, Key("test", "true", _READ, "false", "",
        "True: the FRFs were computed with exp(-iωt), so their phase has the wrong sign.")]
    sensors: Annotated[File | Sequence[Sensor], Key("test", '"sensors.csv"', _RIG,
        "labels name grids of the deck, unless their coordinates are elsewhere or they only count "
        "1, 2, 3", "",
        "Places of sensors and shakers, excluded channels and gains: the table below.")]
    mass: Annotated[float, Key("test", "10.508", _TEST, "not weighed", "kg",
        "Weighed mass of the article without sensors.", least=1e-9)]
    mass_sd: Annotated[float, Key("test", "0.005", _FIT, "0.2 % of the mass", "kg",
        "Standard deviation of the weighing.", kind="number above 0, up to the mass")]
    gain_sd: Annotated[float, Key("test", "0.005", _FIT, "0.01", "",
        "Standard deviation of the gain of each sensor and force gauge, relative.",
        least=0.0, most=1.0)]
    direction_sd: Annotated[float, Key("test", "0.5", _FIT, "1", "deg",
        "Standard deviation of the direction of each, about each transverse axis.",
        least=0.0, most=90.0)]
    position_sd: Annotated[float, Key("test", "0.003", _FIT, "0.0015", "m",
        "Standard deviation of the place of each, in each direction of the sheet, if the table of "
        "sensors gives none.", kind="number, 0 to the size of the structure")]
    shape_sd: Annotated[float, Key("test", "0.01", _FIT, "as in the file; else learned", "",
        "Standard deviation of each entry of measured mode shapes, of the rms of the shape.",
        least=1e-4, most=1.0)]
    hangers: Annotated[Sequence[int], Key("test", "[101, 102]", (*_FIT, "bench"), "none", "",
        "Grids of the cords: places of the springs of `suspension`. Without them a free deck is "
        "compared above the modes of the suspension.")]
    band: Annotated[Band, Key("band", "[26.0, 195.0]", ("identify", *_SCORE, "bench"),
        "the whole recording", "Hz", "Band that is identified, scored and fitted.",
        name="fit")]
    exclude: Annotated[Sequence[Band], Key("band", "[[23.0, 27.5]]",
        ("identify", *_SCORE), "none", "Hz", "Excluded bands within it.")]
    held_out_sensors: Annotated[int | Sequence[str], Key("held_out", '["412:+Z"]', _FIT,
        "a fifth of the outputs", "",
        "Held-out outputs. Every third reports the gain of a name; the others choose it.",
        name="sensors")]
    held_out_band: Annotated[Band, Key("held_out", "[200.0, 300.0]", (*_FIT, "bench"),
        "the upper fifth of the band", "Hz",
        "Held-out band. Every third output reports there; the others choose.",
        name="band")]
    effects: Annotated[Sequence[str], Key("search",
        '["point-mass", "stiffness-patch"]', ("diagnose",), "all of the catalogue", "",
        "Effects that are tried; no other effect is named. Faults of the recording are always "
        "tried.", kind="list of effects")]
    parameters: Sequence[Mapping[str, Any]]


# fmt: on
class OnceWords(FileWords, CaseWords, total=False):
    """Words that a case holds once."""


def _keys(words: type) -> tuple[Key, ...]:
    """The keys of a class of words, each with its name and its type."""
    out = []
    for argument, hint in words.__annotations__.items():
        if get_origin(hint) is Annotated:
            type, key = get_args(hint)
            if get_origin(type) is Literal:
                key, type = replace(key, choices=get_args(type)), str
            out.append(replace(key, name=key.name or argument, argument=argument, type=type))
    return tuple(out)


ONCE, RECORDING, PARAMETER = map(_keys, (OnceWords, RecordingWords, ParameterWords))
SCHEMA = tuple(sorted((*ONCE, *RECORDING, *PARAMETER), key=lambda k: SECTIONS.index(k.section)))
ARGUMENTS = tuple(CaseWords.__annotations__)
COLUMNS = (
    Key("sensors.csv", "412:+Z", _PLACED, NEEDED, "",
        "The output or input of the recording, as `412:+Z` or `412:n`.", name="label"),
    Key("sensors.csv", "412", _PLACED, "the node of the label", "",
        "Grid of the deck; `base`: it measures the motion of all supports together, the input of a "
        "transmissibility.", kind="whole number, or base", name="grid"),
    Key("sensors.csv", "0.25", _PLACED, "", "m",
        "Place, basic frame, in place of a grid.", type=float, name="x"),
    Key("sensors.csv", "0.1", _PLACED, "", "m", "Place.", type=float, name="y"),
    Key("sensors.csv", "0.0", _PLACED, "", "m", "Place.", type=float, name="z"),
    Key("sensors.csv", "+Z", _PLACED, "the direction of the label", "",
        "Direction of the sensor, basic frame; `n` is the normal of the surface.",
        kind="+X -X +Y -Y +Z -Z n", name="direction"),
    Key("sensors.csv", "0.0", _PLACED, "", "",
        "Direction as three numbers.", type=float, name="nx"),
    Key("sensors.csv", "0.6", _PLACED, "", "", "Direction.", type=float, name="ny"),
    Key("sensors.csv", "0.8", _PLACED, "", "", "Direction.", type=float, name="nz"),
    Key("sensors.csv", "input", _PLACED, "output", "", "Role of the channel.",
        choices=("output", "input"), name="role"),
    Key("sensors.csv", "0.005", _PLACED, "0", "kg",
        "Mass on the article during the measurement. The model contains it from the start, but "
        "written decks do not. Rows of one place and role are one device.",
        type=float, name="mass"),
    Key("sensors.csv", "0.5", _READ, "1", "",
        "Ratio of recorded to true motion; the channel is divided by it.",
        kind="number, not 0", name="gain"),
    Key("sensors.csv", "no", _READ, "yes", "", "Use of the output.",
        choices=("yes", "no"), name="use"),
    Key("sensors.csv", "0.01", (*_FIT, "bench"), "0", "m",
        "Uncertainty of the place. Above 5 mm natural frequencies are compared, not FRFs.",
        type=float, name="position_sd"),
)  # fmt: skip
KEYS = {(k.section, k.name): k for k in (*SCHEMA, *COLUMNS)}


def unread(given: Sequence[tuple[str, str]], command: str) -> list[str]:
    """A sentence that names the given words a command makes no use of; none where it uses all."""
    idle: dict[str, list[str]] = {}
    for section, name in dict.fromkeys(given):
        if command not in KEYS[section, name].used:
            idle.setdefault(section, []).append(name)
    said = [f"[{section}] {', '.join(names)}" for section, names in idle.items()]
    return [f"Not used by {command}: {'; '.join(said)}."] if said else []


CaseWords.__doc__ = "\n".join(
    [
        f"{CaseWords.__doc__}\n\nAttributes\n----------",
        *(f"{k.argument} : {k.in_words}\n    {k.meaning}" for k in ONCE if k.argument in ARGUMENTS),
        "parameters : dicts with the keys of a [[parameter]]\n    "
        + ", ".join(k.argument for k in PARAMETER),
    ]
)
