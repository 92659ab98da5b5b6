"""Sound inputs that are injured: decks, universal files, tables, archives, cases, finished runs."""

import json
import random
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from chladni.effects.estimate import Estimate, Location
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_csv, write_npz
from chladni.io.uff.write_uff import write_uff
from chladni.output import plain
from chladni.report.diagnosis_json import diagnosis_json
from chladni.units import units
from chladni.updating.result import NamedEffect
from chladni.workflows.diagnosis_result import DiagnosisResult
from chladni.workflows.frf import frf as evaluated
from chladni.workflows.loaded_model import load_model
from chladni_specimens.plates import box, plate

from .mutations import WORDS, injured_archive, injured_text

DECKS = {
    "chain.bdf": """SOL 103
CEND
SPC = 1
METHOD = 3
BEGIN BULK
EIGRL,3,,,4
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,2.,0.,0.
GRID,4,,2.,1.,0.
CELAS2,1,4000.,1,1,2,1
CBUSH,2,7,2,3,,,,0
PBUSH,7,K,1.+4,2.+4,3.+4,10.,20.,30.
CDAMP2,3,2.0,2,1,3,1
CONM2,4,2,,0.1,,,,,1.-4,,1.-4,,,1.-4
CONM2,5,3,,0.2,,,,,1.-4,,1.-4,,,1.-4
RBE2,6,3,123456,4
CONM2,7,4,,0.05
SPC1,1,123456,1
SPC1,1,23456,2
ENDDATA
""",
    "frame.bdf": """SOL 103
CEND
BEGIN BULK
MAT1*                  12.1000000000+11                             3.0E-1
*                  7850.
PBAR,1,1,1.-4,1.-9,2.-9,2.-9
PBEAML,2,1,,TUBE
,.012,.010
GRID    1               0.      0.      0.
GRID    2               .2      0.      0.
GRID    3               .4      0.      0.
GRID    4               .4      .2      0.
GRID    5               .4      .4      0.
CBAR    1       1       1       2       0.      0.      1.
CBAR    2       1       2       3       0.      0.      1.
CBEAM   3       2       3       4       0.      0.      1.
CBEAM   4       2       4       5       0.      0.      1.
CONROD  5       1       5       1-1-4
RBE3,7,,9,123456,1.,123,1,3
,5
GRID,9,,.2,.1,.1
CONM2,8,9,,.3
ENDDATA
""",
    "bricks.bdf": """BEGIN BULK
CORD2R,3,,0.,0.,0.,0.,0.,1.
,1.,0.,0.
MAT1,1,7.+10,,.33,2700.
PSOLID,1,1
GRID,1,3,0.,0.,0.
GRID,2,3,.1,0.,0.
GRID,3,3,.1,.1,0.
GRID,4,3,0.,.1,0.
GRID,5,3,0.,0.,.1
GRID,6,3,.1,0.,.1
GRID,7,3,.1,.1,.1
GRID,8,3,0.,.1,.1
GRID,9,3,.05,.05,.2
CHEXA,1,1,1,2,3,4,5,6
,7,8
CTETRA,2,1,5,6,7,9
CTETRA,3,1,5,7,8,9
SPC1,1,123,1,THRU,4
MPC,2,9,1,1.,8,1,-1.
ENDDATA
""",
    "sets.bdf": """SOL 103
CEND
TEMPERATURE(LOAD) = 4
SPC = 7
MPC = 8
METHOD = 3
BEGIN BULK
EIGRL,3,,,4
MAT1,1,7.+10,2.6316+10,.33,2700.
MATT1,1,5
TABLEM1,5
,20.,7.+10,100.,6.5+10,ENDT
TEMPD,4,80.
PBARL,1,1,,BOX
,.03,.02,.002,.003
PBEAML,2,1,,I
,.03,.02,.02,.002,.003,.003
PBAR,3,1,1.-4,1.-9,2.-9,2.-9
,,,,,,,,
,,,.5-9
GRID,1,,0.,0.,0.
GRID,2,,.2,0.,0.
GRID,3,,.4,0.,0.
GRID,4,,.4,.2,0.
CBAR,1,1,1,2,0.,0.,1.
CBEAM,2,2,2,3,0.,0.,1.
CBAR,3,3,3,4,0.,0.,1.
CONM2,4,4,,.3
,2.-4,.5-4,2.-4,,,3.-4
PSOLID,9,1
GRID,11,,0.,0.,.1
GRID,12,,.1,0.,.1
GRID,13,,0.,.1,.1
GRID,14,,0.,0.,.2
GRID,15,,.1,0.,.2
GRID,16,,0.,.1,.2
CPENTA,9,9,11,12,13,14,15,16
SPC1,1,123456,1
SPC1,2,123,11,12,13
SPCADD,6,2
SPCADD,7,1,6
MPC,3,4,3,1.,3,3,-1.
MPCADD,8,3
ENDDATA
""",
}
_SMALL = 60_000  # bytes of a deck of the user's that is taken
SENSORS = ("label", "grid", "x", "y", "z", "direction", "role", "mass", "position_sd")


@dataclass(frozen=True)
class FuzzInput:
    """Files of one input, which of them was injured, and the command that is given it."""

    kind: str
    files: dict[str, bytes]
    arguments: tuple[str, ...]


Files = Mapping[str, bytes]
Maker = Callable[[random.Random, Files], FuzzInput]
CASE = """\
[model]
deck = "plate.bdf"
units = "mm-t-s"
damping = 0.01

[test]
recordings = ["frf.npz"]
quantity = "accelerance"
gain = "known"
sensors = "sensors.csv"
mass = 0.518
mass_sd = 0.001
hangers = [1, 49]

[[recording]]
file = "frf.uff"
article = "B"
level = 2.0

[band]
fit = [25.0, 170.0]
exclude = [[49.0, 51.0]]

[held_out]
sensors = 2
band = [150.0, 180.0]

[[parameter]]
name = "E of the sheet"
field = "E"
sd = 0.05
low = 0.8
high = 1.3
"""


def fuzz_inputs(
    count: int, seed: int, kinds: Sequence[str], more: Path | None = None
) -> Iterator[FuzzInput]:
    """So many injured inputs; each is the same for the same seed and number."""
    for k in range(count):
        rng = random.Random(f"{seed}:{k}")
        kind = rng.choice(list(kinds))
        yield _MAKERS[kind](rng, _sound(more))


@cache
def _sound(more: Path | None) -> dict[str, bytes]:
    """Sound files by name: decks, recordings of a plate in every format, tables, a finished run."""
    found = {name: text.encode() for name, text in DECKS.items()}
    with TemporaryDirectory() as name:
        folder = Path(name)
        made = plate(0.3, 0.22, 6, 6, 1e-3)
        write_assembly(made, folder / "plate.bdf", units("mm-t-s"))
        write_assembly(box(h=0.05), folder / "box.bdf", units("SI"))
        ends = [f"{grid}:+Z" for grid in (2, 4, 7, 18, 30, 43)]
        model = load_model(folder / "plate.bdf", "mm-t-s")
        f = np.linspace(20.0, 180.0, 161)
        frf = evaluated(model, ends, ["2:+Z"], f).frfs[0].to("accelerance")
        places = dict(zip(made.ids.tolist(), made.points, strict=True))
        write_uff(folder / "frf.uff", frf, places)
        write_npz(folder / "frf.npz", frf)
        write_csv(folder / "frf.csv", frf)
        found |= {p.name: p.read_bytes() for p in folder.iterdir()}
    found["poles.csv"] = b"mode,frequency_hz,frequency_sd_hz,damping\n" + b"".join(
        b"%d,%.4f,0.05,0.01\n" % (k + 1, hz) for k, hz in enumerate((58.1, 91.3, 130.2, 155.7))
    )
    found["time.csv"] = _time_table()
    found["sensors.csv"] = _sensor_table(ends).encode()
    found["case.toml"] = CASE.encode()
    found["diagnosis.json"] = json.dumps(plain(diagnosis_json(_finished())), indent=1).encode()
    paths = sorted(more.rglob("*")) if more else []
    for path in (p for p in paths if p.suffix in (".bdf", ".dat", ".nas") and p.is_file()):
        if path.stat().st_size < _SMALL:
            found[f"{path.parent.name}_{path.stem}.bdf"] = path.read_bytes()
    return found


def _time_table() -> bytes:
    """A hammer test of one degree of freedom: force and acceleration, three blocks."""
    t = np.arange(256) / 512.0
    force = np.where(np.arange(256) == 8, 10.0, 0.0)
    h = np.exp(-6 * t) * np.sin(2 * np.pi * 40 * t)
    answer = np.convolve(force, h)[:256]
    rows = [b"time_s,block,1:+Z [N],2:+Z [m/s^2]\n"]
    for block in range(3):
        rows += [b"%.6f,%d,%.5g,%.5g\n" % (t[k], block, force[k], answer[k]) for k in range(256)]
    return b"".join(rows)


def _sensor_table(ends: Sequence[str]) -> str:
    rows = [f"{e},{e.split(':')[0]},,,,+Z,output,0.001," for e in ends]
    return "\n".join([",".join(SENSORS), *rows, "2:+Z,2,,,,+Z,input,,", ""])


def _finished() -> DiagnosisResult:
    where = Location("at the corner", ("sheet",), (43,), (0.1, 0.2, 0.0), 0.02)
    mass = Estimate("M", 0.02, "kg", 0.018, 0.022)
    effect = NamedEffect("point-mass", "a lump", 12.0, where, (mass,))
    return DiagnosisResult(verdict="missing physics", effects=(effect,), notes=("one note",))


DECK_COMMANDS = (
    ("modes", "--count", "8"),
    ("modes", "--units", "SI"),
    ("frf", "--input", "2:+Z", "--output", "3:+Z", "--lines", "20"),
    ("frf",),
    ("init",),
    ("plan", "--sensors", "3", "--modes", "3", "--candidates", "12", "--drawn", "2"),
    ("study", "--vary", "E=90%:110%", "--samples", "3", "--modes", "3", "--workers", "1"),
)


def _deck(rng: random.Random, sound: Files) -> FuzzInput:
    name = rng.choice([n for n in sound if n.endswith(".bdf")])
    command, *options = rng.choice(DECK_COMMANDS)
    return FuzzInput("deck", {name: injured_text(sound[name], rng)}, (command, name, *options))


def _options(rng: random.Random, sound: Files) -> FuzzInput:
    """A sound deck, and one word of the command line another."""
    command, *options = rng.choice(DECK_COMMANDS)
    words = [command, "plate.bdf", *options, "--units", "mm-t-s"]
    words[rng.randrange(1, len(words))] = rng.choice([w for w in WORDS if "\0" not in w])
    return FuzzInput("options", {"plate.bdf": sound["plate.bdf"]}, tuple(words))


def _recording(kind: str, *names: str) -> Maker:
    def made(rng: random.Random, sound: Files) -> FuzzInput:
        name = rng.choice(names)
        injure = injured_archive if name.endswith(".npz") else injured_text
        said = name in ("frf.uff", "frf.npz")
        quantity = rng.choice(((), () if said else ("--quantity", "accelerance")))
        ask = "test" if name == "time.csv" else rng.choice(("identify", "test"))
        return FuzzInput(kind, {name: injure(sound[name], rng)}, (ask, name, *quantity))

    return made


CASE_COMMANDS = (
    *(("check",), ("correlate",), ("modes",), ("frf",)),
    *((name, *options) for name, *options in DECK_COMMANDS if name in ("plan", "study")),
)


def _case(rng: random.Random, sound: Files) -> FuzzInput:
    """A case of which the case file or the table of sensors is injured."""
    names = ("case.toml", "plate.bdf", "frf.npz", "frf.uff", "sensors.csv")
    files = {name: sound[name] for name in names}
    bad = rng.choice(("case.toml", "case.toml", "case.toml", "sensors.csv"))
    files[bad] = injured_text(files[bad], rng)
    command, *options = rng.choice(CASE_COMMANDS)
    return FuzzInput("case", files, (command, ".", *options))


def _page(rng: random.Random, sound: Files) -> FuzzInput:
    files = {"diagnosis.json": injured_text(sound["diagnosis.json"], rng)}
    return FuzzInput("page", files, ("report", "."))


_MAKERS: dict[str, Maker] = {
    "deck": _deck,
    "uff": _recording("uff", "frf.uff"),
    "table": _recording("table", "frf.csv", "poles.csv", "time.csv"),
    "archive": _recording("archive", "frf.npz"),
    "case": _case,
    "page": _page,
    "options": _options,
}
KINDS = tuple(_MAKERS)
