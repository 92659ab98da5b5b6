"""Sound inputs that are injured: files cut, doubled or misspelt, and those of contradictions."""

import json
import random
from collections.abc import Iterator, Sequence
from pathlib import Path

from .contradictions import CONTRADICTIONS
from .contradictory_recordings import contradictory
from .fuzz_input import YOURS, FuzzInput, Maker
from .mutations import WORDS, injured_archive, injured_bytes, injured_text
from .recoded_text import recoded
from .sound_files import Files, sound_files


def fuzz_inputs(
    count: int, seed: int, kinds: Sequence[str], more: Path | None = None
) -> Iterator[FuzzInput]:
    """So many injured inputs; each is the same for the same seed and number."""
    for k in range(count):
        rng = random.Random(f"{seed}:{k}")
        kind = rng.choice(list(kinds))
        yield _MAKERS[kind](rng, sound_files(more))


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


def _punch(rng: random.Random, sound: Files) -> FuzzInput:
    files = {"plate.bdf": sound["plate.bdf"], "modes.pch": injured_text(sound["modes.pch"], rng)}
    words = ("correlate", "plate.bdf", "--modes", "modes.pch", "--units", "mm-t-s")
    return FuzzInput("punch", files, words)


def _wav(rng: random.Random, sound: Files) -> FuzzInput:
    """Sound without its end or of another head, or a table of channels that is not its own."""
    wav, table = sound["run.wav"], sound["run.channels.csv"]
    what = rng.choice(("head", "bytes", "table"))
    if what == "head":
        wav = injured_bytes(wav[:48], rng) + wav[48:]
    elif what == "bytes":
        wav = injured_bytes(wav, rng)
    else:
        table = injured_text(table, rng)
    return FuzzInput("wav", {"run.wav": wav, "run.channels.csv": table}, ("test", "run.wav"))


MESHES = ("formed.k", "formed.vtu", "formed.csv", "scan.stl", "scan.ply", "scan.obj",
          "packed.vtu", "packed.stl", "packed.ply")  # fmt: skip


def _mesh(rng: random.Random, sound: Files) -> FuzzInput:
    name = rng.choice(MESHES)
    injure = injured_bytes if name.startswith("packed") else injured_text
    files = {"plate.bdf": sound["plate.bdf"], name: injure(sound[name], rng)}
    words = ("map", "plate.bdf", name, "--units", "mm-t-s", *rng.choice(((), (), ("--align",))))
    return FuzzInput("mesh", files, words)


def _page(rng: random.Random, sound: Files) -> FuzzInput:
    files = {"diagnosis.json": injured_text(sound["diagnosis.json"], rng)}
    return FuzzInput("page", files, ("report", "."))


def _links(rng: random.Random, sound: Files) -> FuzzInput:
    """A case or an output folder of which links lead to files of yours, by files and by folders."""
    names = ("case.toml", "plate.bdf", "frf.npz", "frf.uff", "sensors.csv")
    files, links = {name: sound[name] for name in names}, dict[str, str]()
    wanted = rng.choice(("plate.bdf", "frf.npz", "sensors.csv", "case.toml"))
    way = rng.choice(("file", "folder", "include", "results"))
    if way == "file":
        links[wanted] = f"../{YOURS}/{wanted}"
    elif way == "folder":
        links["sub"] = f"../{YOURS}"
        text = files["case.toml"].replace(f'"{wanted}"'.encode(), f'"sub/{wanted}"'.encode())
        files["case.toml"] = text
    elif way == "include":
        links["more.inc"] = f"../{YOURS}/plate.bdf"
        text = files["plate.bdf"].replace(b"BEGIN BULK", b"BEGIN BULK\nINCLUDE 'more.inc'", 1)
        files["plate.bdf"] = text
    else:
        at = rng.choice(("s", "s/t", "v"))
        links[f"out/{at}"] = f"{'../' * (2 + at.count('/'))}{YOURS}" + "/v1" * (at == "v")
        held = {"command": "modes", "files": [at if at == "v" else f"{at}/v1", "report.html"]}
        files["out/run.json"] = json.dumps(held).encode()
    command, *options = ("modes",) if way == "results" else rng.choice(CASE_COMMANDS)
    return FuzzInput("links", files, (command, ".", *options), links)


_MAKERS: dict[str, Maker] = {
    "deck": _deck,
    "uff": _recording("uff", "frf.uff"),
    "table": _recording("table", "frf.csv", "poles.csv", "time.csv"),
    "archive": _recording("archive", "frf.npz"),
    "case": _case,
    "page": _page,
    "options": _options,
    "punch": _punch,
    "wav": _wav,
    "mesh": _mesh,
    "recoded": recoded,
    "links": _links,
    **CONTRADICTIONS,
    "contradictory": contradictory,
}
KINDS = tuple(_MAKERS)
