"""Files of recorded cases: all rows of a decision and the truth, without any fit.

A file is a compressed ``.npz``: arrays, and a JSON text for numbers and names. Nothing is pickled.
"""

import json
from dataclasses import asdict, dataclass, field
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from chladni.decision.hypothesis_table import (
    AlternativeRow,
    CalibratedDeck,
    HypothesisTable,
    Left,
    Row,
    SetRow,
    Votes,
)
from chladni.errors import FileError

TEXT = "text"
Json = dict[str, Any]


@dataclass(frozen=True, eq=False)
class RecordedCase:
    """Record of a case."""

    name: str  # of its folder
    truth: Json  # the hidden effects; empty where unknown
    table: HypothesisTable  # of all hypotheses, with all numbers that any rule may request
    # verdict, names, one_of: of the decision when it was recorded
    verdict: str
    names: tuple[str, ...]
    one_of: tuple[str, ...]
    arrays: dict[str, np.ndarray] = field(default_factory=dict)  # of the reduced problem, by name


def write_case(case: RecordedCase, path: Path) -> None:
    """Write a recorded case."""
    table = asdict(case.table)
    table["decks"] = {d.name: Q for d, Q in case.table.decks.items()}
    text = {
        "name": case.name, "truth": case.truth, "verdict": case.verdict, "names": case.names,
        "one_of": case.one_of, "table": table,
    }  # fmt: skip
    packed = np.frombuffer(json.dumps(text, default=_plain).encode(), np.uint8)
    with path.open("wb") as file:
        np.savez_compressed(file, allow_pickle=False, **{TEXT: packed, **case.arrays})


def read_case(path: Path) -> RecordedCase:
    """Read a recorded case.

    Raises
    ------
    FileError
        If the file is not a recorded case.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            text = json.loads(file[TEXT].tobytes())
            arrays = {k: file[k] for k in file.files if k != TEXT}
        table = _table(text["table"])
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise FileError(f"{path}: no recorded case ({error}); `record` writes them") from None
    return RecordedCase(
        text["name"], text["truth"], table, text["verdict"], tuple(text["names"]),
        tuple(text["one_of"]), arrays,
    )  # fmt: skip


def _plain(value: object) -> object:
    """A plain value of a numpy number, or the name of an enum."""
    return value.name if isinstance(value, Enum) else np.asarray(value).tolist()


def _table(given: Json) -> HypothesisTable:
    rows = {k: _row(r) for k, r in given["rows"].items()}
    sets = tuple(_set(s) for s in given["sets"])
    decks = {CalibratedDeck[k]: tuple(Q) for k, Q in given["decks"].items()}
    return HypothesisTable(
        **{**given, "rows": rows, "sets": sets, "decks": decks, "singles": tuple(given["singles"])}
    )


def _row(given: Json) -> Row:
    votes, left = given["votes"], given["left"]
    return Row(
        **{
            **given, "names": tuple(given["names"]),
            "votes": None if votes is None else Votes(**votes),
            "left": None if left is None else Left(*(tuple(q) for q in left.values())),
        }
    )  # fmt: skip


def _set(given: Json) -> SetRow:
    alternatives = tuple(
        tuple(AlternativeRow(**r) for r in alternatives) for alternatives in given["alternatives"]
    )
    kept = {k: tuple(given[k]) for k in ("members", "gains")}
    return SetRow(**{**given, **kept, "alternatives": alternatives})
