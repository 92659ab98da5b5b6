"""Comparison of answers with their truths, which are opened only when all answers are on disk."""

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path

from chladni.errors import AccuracyError, FileError, LabelError, named
from chladni.output import locked, write_json, write_text

from .blind_diagnosis import Answer
from .blind_folder import (
    BlindFolder,
    Seals,
    hash_of,
    opened_truth,
    published,
    read_json,
    unchanged_cases,
)
from .evidence_sets import MEANT
from .outcome_row import Row, line, row
from .outcome_table import tables

Say = Callable[[str], object]


def score(outs: Sequence[Path], say: Say) -> list[Row]:
    """Score all cases of some folders; ``score.json`` and ``table.txt`` go to the first.

    Raises
    ------
    LabelError
        If some of the folders tune and others report, or hold the same case.
    FileError
        If a case has no answer, or one to other files or seals than the published ones.
    AccuracyError
        If a truth is not the published one, or an answer was changed after truths were opened.
    """
    every = [(BlindFolder(out), published(BlindFolder(out))) for out in outs]
    if len({seals.purpose for _, seals in every}) > 1:
        purposes = ", ".join(
            f"{place.out} has the purpose {seals.purpose}" for place, seals in every
        )
        raise LabelError(
            f"{purposes}; cases that tune and cases that report are never scored together"
        )
    sealed = Counter(h for _, seals in every for h in seals.truths.values())
    if sealed and max(sealed.values()) > 1:
        raise LabelError("some cases are in two of the folders and would count twice")
    for place, seals in every:
        _answers_hold(place, seals)
    rows = [r for place, seals in every for r in _rows(place, seals)]
    text = f"{MEANT[every[0][1].purpose]}\n\n{tables(rows)}"
    with locked(outs[0]):
        write_json(outs[0] / "score.json", rows)
        write_text(outs[0] / "table.txt", text + "\n")
    for r in rows:
        say(f"{r['case']}: {line(r)}")
    for place, seals in every:
        if seals.failed:
            say(f"{place.out}: {seals.failed} cases could not be made, and are not counted")
    say(f"\n{text}")
    return rows


def _answers_hold(place: BlindFolder, seals: Seals) -> None:
    """Check that every case was answered, from the published files, between sealing and opening.

    An answer holds the hash of the seals, so it is not older than the seals. The hashes of answers
    are written before the first truth is opened, so no answer is newer than that.
    """
    unanswered = [n for n in seals.truths if not place.answer(n).exists()]
    if unanswered:
        raise FileError(
            f"{place.out}: {named(unanswered)} has no answer yet, so no truth is opened; continue "
            f"with `chladni blind run {place.out}`"
        )
    unchanged_cases(place, seals)
    due = hash_of(place.seals)
    for name in seals.truths:
        given = read_json(place.answer(name), "")
        _answers(given, place.answer(name))
        if (given.get("seals"), given.get("files")) != (due, seals.files[name]):
            raise FileError(
                f"{place.answer(name)} does not belong to the published case: it is older than "
                "the seals, or from another folder; remove it and run again"
            )
    now = {name: hash_of(place.answer(name)) for name in seals.truths}
    if seals.purpose == "report" and place.opened.exists():
        before = read_json(place.opened, "")
        changed = [n for n in now if before.get(n) != now[n]]
        if changed:
            raise AccuracyError(
                f"{place.out}: answers to {named(changed)} are younger than the opening of their "
                "truths; a report allows one answer, further cases need further seeds"
            )
    write_json(place.opened, now)


def _rows(place: BlindFolder, seals: Seals) -> list[Row]:
    found = []
    for name in seals.truths:
        path = place.answer(name)
        answer, plain = _answers(read_json(path, ""), path)
        truth = opened_truth(place, seals, name)
        try:
            scored = row(answer, truth, plain)
        except KeyError as error:
            raise FileError(
                f"{place.truth(name)} holds no {error}; it was made by chladni {seals.version}"
            ) from error
        found.append({"case": name, "purpose": seals.purpose, **scored})
    return found


def _answers(given: Row, path: Path) -> tuple[Answer, Answer | None]:
    """Answer of the diagnosis, and of plain calibration where it was run."""
    try:
        plain = given.get("calibrate")
        return Answer(**given["diagnose"]), Answer(**plain) if plain else None
    except (KeyError, TypeError) as error:
        raise FileError(f"{path} does not have the form of an answer: {error}") from error
