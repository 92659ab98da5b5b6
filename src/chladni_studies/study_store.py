"""The folder of a study, which survives a kill at any instant; the study can continue from it.

``study_begun.json`` identifies the study, ``design.csv`` holds its points. ``samples.jsonl`` gets
one line per finished sample, complete and on the disk before the next is requested. The line marks
a sample as finished, so a whole response, if kept (``frf/000012.npz``), is written before it. A
kill can damage only the last line, which is removed when the study continues.

Only one process writes, so one growing text file suffices. It needs no database, no locks between
machines and no shared memory (as SQLite's write-ahead log does). It works on the network file
systems of clusters without a file per sample, and can be read while it grows.
"""

import json
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np

from chladni.errors import FileError
from chladni.io.tables.csv_table import csv_text
from chladni.output import lock, make_folder, plain, write_arrays, write_json, write_text
from chladni.own_folder import OwnFolder, own_folder

from .sample import SampleResult

BEGUN, DESIGN, ROWS, FRFS, LOCK = (
    "study_begun.json", "design.csv", "samples.jsonl", "frf", ".study.lock",
)  # fmt: skip
OWN = ("sample", "status", "why", "seconds")  # columns in addition to parameters and results
_WORDS = {
    "model": "the deck, the case or the recording",
    "parameters": "the parameters and their ranges",
    "settings": "the results of a sample",
}


@dataclass
class StudyStore:
    """An open folder of a study."""

    folder: Path
    rows: dict[int, dict[str, Any]]  # {number: row} of the finished samples, failed ones included
    file: IO[bytes]
    held: OwnFolder
    notes: list[str] = field(default_factory=list)  # notes on the folder for the user

    def keep(self, result: SampleResult, values: Mapping[str, float]) -> dict[str, Any]:
        """Write a finished sample; it is safe from a kill when this returns."""
        if result.frf is not None:
            frf = result.frf
            arrays = dict(
                values=frf.values, frequency_hz=frf.frequency, outputs=np.array(frf.outputs),
                inputs=np.array(frf.inputs), quantity=np.array(frf.quantity),
            )  # fmt: skip
            write_arrays(self.folder / FRFS / f"{result.number:06d}.npz", arrays, self.held)
        row = row_of(result, values)
        line = json.dumps(row, ensure_ascii=False, allow_nan=False) + "\n"
        self.file.write(line.encode())
        self.file.flush()
        os.fsync(self.file.fileno())
        self.rows[result.number] = row
        return row


def write_samples(path: Path, table: Mapping[str, list[Any]]) -> Path:
    """Write one line per sample, as ``pandas.read_csv`` reads it; missing values are empty."""
    rows = (
        ["" if v is None else v for v in plain(row)] for row in zip(*table.values(), strict=True)
    )
    return write_text(path, csv_text([table, *rows]))


def row_of(result: SampleResult, values: Mapping[str, float]) -> dict[str, Any]:
    """A sample as one flat row: number, status, sentence, parameters, results."""
    status = "failed" if result.why else "done"
    own = (result.number, status, result.why, round(result.seconds, 4))
    return dict(plain({**dict(zip(OWN, own, strict=True)), **values, **result.columns}))


@contextmanager
def opened_store(
    folder: Path, identity: dict[str, Any], made: dict[str, Any], names: list[str], X: np.ndarray
) -> Iterator[StudyStore]:
    """The store of this study, new or begun earlier, locked against a second process.

    Parameters
    ----------
    identity : identity of the study, by the words that an error message uses
    made : provenance for the record: files and their hashes, versions
    X : (n, d)   values of the parameters ``names``
    """
    make_folder(folder)
    begun = folder / BEGUN
    if not begun.exists() and any(p.name != LOCK for p in folder.iterdir()):
        raise FileError(f"{folder} has files that are not a study; give an empty or a new folder")
    with own_folder(folder) as held, held.open(LOCK, "a+b") as locking:
        notes = []
        if not lock(locking.fileno(), folder):
            notes = [f"The file system of {folder} has no locks: start no second process there."]
        if begun.exists():
            _refuse_another(begun, identity)
        else:
            design = [["sample", *names], *([k, *x] for k, x in enumerate(X.tolist()))]
            write_text(folder / DESIGN, csv_text(design))
            write_json(begun, {"identity": identity, **made})
        rows, good = finished(folder / ROWS, len(X))
        with held.open(ROWS, "ab") as file:
            file.truncate(good)
            yield StudyStore(folder, rows, file, held, notes)


def _refuse_another(begun: Path, identity: dict[str, Any]) -> None:
    try:
        there = json.loads(begun.read_text(encoding="utf-8"))["identity"]
        names = [key for key in identity if there.get(key) != plain(identity[key])]
    except (ValueError, KeyError, AttributeError, TypeError) as error:
        raise FileError(f"{begun} is damaged ({error}); give another --out") from error
    if names:
        said = "; ".join(
            f"{_WORDS.get(key, key)} "
            + (f"({there.get(key)} there, {identity[key]} now)" if key not in _WORDS else "differs")
            for key in names
        )
        raise FileError(f"{begun.parent} has another study: {said}; give another --out")


def finished(path: Path, n: int) -> tuple[dict[int, dict[str, Any]], int]:
    """Rows of finished samples by number, and their bytes; an incomplete last line is dropped."""
    if not path.exists():
        return {}, 0
    data = path.read_bytes()
    whole = data.rfind(b"\n") + 1
    rows: dict[int, dict[str, Any]] = {}
    for k, line in enumerate(data[:whole].splitlines(), start=1):
        try:
            row = json.loads(line)
            number = row["sample"]
            good = isinstance(number, int) and 0 <= number < n and row["status"] in _STATUS
        except (ValueError, KeyError, TypeError):
            good = False
        if not good:
            raise FileError(f"{path}, line {k} is damaged; delete it, and its sample runs again")
        rows[number] = row
    return rows, whole


_STATUS = ("done", "failed")
