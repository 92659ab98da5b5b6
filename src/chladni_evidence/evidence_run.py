"""Cases of a set made, diagnosed blindly and scored; what is finished is never done again."""

import json
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from threadpoolctl import threadpool_limits

from chladni.errors import AccuracyError
from chladni.output import write_json, write_text

from .blind_diagnosis import Answer, diagnosed
from .evidence_sets import Order
from .made_case import made_case, opened, seal_hash, write_case
from .outcome_row import Row, line, row, table


@dataclass(frozen=True)
class RunFolders:
    """Folders of a run: case folders, sealed truths, answers; the cache of solved modes."""

    out: Path

    def of(self, room: str, order: Order, ending: str = "") -> Path:
        """A place of one case."""
        return self.out / room / f"{order.name}{ending}"


def made(order: Order, places: RunFolders) -> str:
    """The case on disk, and the hash of its sealed truth; one that is there is kept.

    Raises
    ------
    AccuracyError
        If the sealed truth of a case made before is not the one whose hash was said then.
    """
    sealed, said = (places.of("sealed", order, ending) for ending in (".json", ".sha256"))
    if not said.exists():
        with threadpool_limits(1):
            case = made_case(
                order.bench(),
                order.kind,
                order.seed,
                order.mesh,
                places.out / "cache",
                order.recorder,
            )
        write_text(said, write_case(case, places.of("cases", order), sealed) + "\n")
    mark = said.read_text(encoding="ascii").strip()
    _held(sealed, mark)
    return mark


def _held(sealed: Path, mark: str) -> None:
    if seal_hash(sealed) != mark:
        raise AccuracyError(f"{sealed.name} has changed since its hash was said")


def answered(order: Order, places: RunFolders, limit: float) -> Answer:
    """The answer to a case; one that was given before, crash or not, is kept."""
    kept = places.of("answers", order, ".answer.json")
    if kept.exists():
        return Answer(**json.loads(kept.read_text(encoding="utf-8")))
    answer = diagnosed(places.of("cases", order), places.of("answers", order), limit)
    write_json(kept, vars(answer))
    return answer


def judged_blindly(order: Order, places: RunFolders, expected: str, limit: float) -> Row:
    """Diagnose a case, then break its seal.

    Raises
    ------
    AccuracyError
        If the sealed truth is not the one whose hash was said before.
    """
    answer = answered(order, places, limit)
    sealed = places.of("sealed", order, ".json")
    _held(sealed, expected)
    return {"case": order.name, "hash": expected, **row(answer, opened(sealed))}


Say = Callable[[str], object]


def one(order: Order, places: RunFolders, limit: float, say: Say) -> Row | None:
    """The row of a case, and a line of it said; None where it could not be made.

    The hash of its truth is said before the diagnosis begins.
    """
    try:
        mark = made(order, places)
    except Exception:  # noqa: BLE001  a maker that fails is a line too, and the others go on
        text = traceback.format_exc()
        write_text(places.of("failed", order, ".txt"), text)
        say(f"{order.name}: NOT MADE, {text.strip().splitlines()[-1]}")
        return None
    say(f"{order.name} sealed with {mark}")
    found = judged_blindly(order, places, mark, limit)
    say(f"{order.name}: {line(found)}")
    return found


def run(
    chosen: Sequence[Order], out: Path, workers: int, say: Say, limit: float = 3600.0
) -> list[Row]:
    """All cases; the table is written and said at the end."""
    found = [row for row in _each(chosen, RunFolders(out), workers, limit, say) if row]
    write_json(out / "rows.json", found)
    text = table(found)
    write_text(out / "table.txt", text + "\n")
    say(text)
    return found


def _each(
    chosen: Sequence[Order], places: RunFolders, workers: int, limit: float, say: Say
) -> Iterator[Row | None]:
    if workers == 1:
        yield from (one(order, places, limit, say) for order in chosen)
        return
    with ProcessPoolExecutor(workers) as pool:
        jobs = [pool.submit(one, order, places, limit, say) for order in chosen]
        yield from (job.result() for job in as_completed(jobs))
