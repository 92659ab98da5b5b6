"""Effects concealed, cases diagnosed blindly, seals opened: who was called what."""

import json
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from chladni.case import load_case
from chladni.errors import ChladniError, LabelError
from chladni.output import write_json
from chladni.report.diagnosis_json import diagnosis_json
from chladni.workflows.diagnose import diagnose
from chladni.workflows.diagnosis_result import DiagnosisResult

from .concealed import SPECIMENS, concealable, made, write
from .score import Row, scored

CODE = {"nothing": "n", "calibration": "c"}  # a folder's name must not say whether there is any


@dataclass(frozen=True)
class Blind:
    """One case to be made and diagnosed, and the folder of the run it belongs to."""

    specimen: str
    effect: str
    seed: int
    place: Path

    @property
    def folder(self) -> Path:
        """What the diagnosis is given."""
        code = CODE.get(self.effect, self.effect)
        return self.place / "cases" / f"{self.specimen}-{code}-{self.seed}"

    @property
    def seal(self) -> Path:
        """The truth, opened when the answer is on disk."""
        return self.place / "sealed" / f"{self.folder.name}.json"


def blinds(
    place: Path,
    seeds: Iterable[int],
    effects: Iterable[str] = (),
    specimens: Iterable[str] = tuple(SPECIMENS),
) -> list[Blind]:
    """Every one of these effects (all, where none is given) in every structure with every seed.

    Raises
    ------
    LabelError
        If there is no such effect or structure.
    """
    effects, specimens = list(effects) or list(concealable()), list(specimens)
    for what, given, known in (
        ("effect", effects, concealable()), ("structure", specimens, tuple(SPECIMENS))
    ):  # fmt: skip
        if unknown := sorted(set(given) - set(known)):
            raise LabelError(f"no {what} {unknown}; there are {', '.join(known)}")
    return [Blind(s, e, seed, place) for seed in seeds for s in specimens for e in effects]


def answered_rows(
    cases: list[Blind], workers: int = 1, told: Callable[[Row], None] = lambda row: None
) -> list[Row]:
    """Diagnose every case by :func:`chladni.diagnose` and score it against its seal.

    Parameters
    ----------
    workers : processes
    told : called with every row as soon as it is known
    """
    rows = []
    for row in _mapped(cases, workers):
        rows.append(row)
        told(row)
    return rows


def _mapped(cases: list[Blind], workers: int) -> Iterator[Row]:
    if workers == 1:
        yield from map(blind_row, cases)
        return
    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(blind_row, cases)


def blind_row(blind: Blind) -> Row:
    """Make the case, diagnose its folder, write the answer, then open the seal and score."""
    return scored(*answered(blind))


def answered(blind: Blind) -> tuple[DiagnosisResult, Row]:
    """The answer to a case, and its truth, which is read when the answer is on disk."""
    specimen = SPECIMENS[blind.specimen]
    write(made(specimen, blind.effect, blind.seed), blind.folder, blind.seal)
    try:
        found = diagnose(load_case(blind.folder))
    except ChladniError as error:
        found = DiagnosisResult(verdict=f"error: {error}")
    write_json(blind.folder / "diagnosis.json", diagnosis_json(found))
    truth: Row = json.loads(blind.seal.read_text(encoding="utf-8"))
    return found, truth


def line(row: Row) -> str:
    """One case in one line."""
    place = "" if row["place_mm"] is None else f", {row['place_mm']:.0f} mm off"
    ratio = "" if row["ratio"] is None else f", held-out Q x {row['ratio']:.2f}"
    return (
        f"{row['specimen']} {row['seed']}: {row['effect']} -> {row['called']} "
        f"(gain {row['gain']:.0f}{place}{ratio})"
    )
