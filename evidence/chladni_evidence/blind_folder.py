"""The folder of a blind benchmark: cases, sealed truths, their published hashes, answers.

A diagnosis receives ``cases/NAME`` alone. ``sealed/NAME.json`` is the truth. ``seals.json`` holds
its SHA-256 and that of the case's files, one line a case, and is written before any answer.
``answers/NAME.json`` is the answer.
"""

import hashlib
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from chladni.errors import AccuracyError, FileError, named
from chladni.output import write_json

from .evidence_sets import PURPOSES, REPORTING, Purpose


@dataclass(frozen=True)
class BlindFolder:
    """Paths within the folder of a benchmark."""

    out: Path

    def case(self, name: str) -> Path:
        """The case folder, which the diagnosis receives."""
        return self.out / "cases" / name

    def truth(self, name: str) -> Path:
        """The truth of a case, written when the case is made and read only by the score."""
        return self.out / "sealed" / f"{name}.json"

    def answer(self, name: str) -> Path:
        """The answer to a case; the file exists only when it is complete."""
        return self.out / "answers" / f"{name}.json"

    def work(self, name: str, command: str) -> Path:
        """The folder for a command's deck, page and output."""
        return self.out / "answers" / f"{name}.{command}"

    @property
    def seals(self) -> Path:
        """The published hashes."""
        return self.out / "seals.json"

    @property
    def opened(self) -> Path:
        """Hashes of the answers on disk when the truths were first opened."""
        return self.out / "opened.json"


@dataclass(frozen=True)
class Seals:
    """Hashes and settings that are published before any answer."""

    purpose: Purpose  # tune or report
    # set, seeds: of the cases, as they were requested
    set: str
    seeds: str
    version: str  # of the chladni that made them
    failed: int  # number of cases that could not be made
    # truths, files: SHA-256 of each case's truth, and of its own files together
    truths: dict[str, str]
    files: dict[str, str]

    def write(self, path: Path) -> None:
        """Write the seals, one line a case."""
        head = {k: v for k, v in vars(self).items() if k not in ("truths", "files")}
        lines = {n: f"truth {self.truths[n]} files {self.files[n]}" for n in self.truths}
        write_json(path, {**head, "cases": lines})


def published(place: BlindFolder) -> Seals:
    """The seals of a folder.

    Raises
    ------
    FileError
        If there are none, or they have another format.
    """
    held = read_json(
        place.seals, "`chladni blind make` writes it once all cases are made, before any answer"
    )
    try:
        lines = {str(n): str(line).split() for n, line in held.pop("cases").items()}
        truths, files = ({n: words[k] for n, words in lines.items()} for k in (1, 3))
        found = Seals(**held, truths=truths, files=files)
        if strange := [n for n in truths if not re.fullmatch(r"[\w-]+", n)]:
            raise ValueError(f"{strange[0]!r} is not a case name")
        if found.purpose not in PURPOSES:
            raise ValueError(f"purpose {found.purpose!r}; there are {', '.join(PURPOSES)}")
    except (KeyError, IndexError, AttributeError, TypeError, ValueError) as error:
        raise FileError(f"{place.seals} does not have the form of seals: {error}") from error
    return found


def hash_of(path: Path) -> str:
    """SHA-256 of a file.

    Raises
    ------
    FileError
        If it cannot be read.
    """
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}") from error


def hash_of_case(folder: Path) -> str:
    """SHA-256 of the names and hashes of a case's files."""
    files = sorted(p for p in folder.rglob("*") if p.is_file())
    lines = [f"{p.relative_to(folder).as_posix()} {hash_of(p)}\n" for p in files]
    return hashlib.sha256("".join(lines).encode()).hexdigest()


def unchanged_cases(place: BlindFolder, seals: Seals) -> None:
    """Refuse cases that are not the published ones.

    Raises
    ------
    FileError
        With their names.
    """
    changed = [n for n, due in seals.files.items() if hash_of_case(place.case(n)) != due]
    if changed:
        raise FileError(
            f"{place.out}: the files of {named(changed)} are not those whose hash was published; "
            "restore them, or make the cases again in another --out"
        )


def opened_truth(place: BlindFolder, seals: Seals, name: str) -> dict[str, Any]:
    """The truth of a case whose answer is on disk.

    Raises
    ------
    AccuracyError
        If its hash is not the published one, or its seed is for another purpose.
    """
    path = place.truth(name)
    if hash_of(path) != seals.truths[name]:
        raise AccuracyError(f"{path} is not the truth whose hash was published in {place.seals}")
    truth = read_json(path, "")
    if (truth["seed"] < REPORTING) != (seals.purpose == "tune"):
        raise AccuracyError(
            f"{path}: seed {truth['seed']} in a folder with the purpose {seals.purpose}; seeds "
            f"below {REPORTING} tune, from {REPORTING} they report"
        )
    return truth


def read_json(path: Path, made_by: str) -> dict[str, Any]:
    """An object of a JSON file.

    Raises
    ------
    FileError
        If there is none; the message uses ``made_by`` to say how to make it.
    """
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise FileError(f"{path}: {error.strerror}" + f"; {made_by}" * bool(made_by)) from error
    except ValueError as error:
        raise FileError(f"{path} is not JSON: {error}") from error
    if not isinstance(found, dict):
        raise FileError(f"{path} has no object")
    return found
