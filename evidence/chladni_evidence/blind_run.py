"""Answers to the cases of a blind benchmark, from their folders alone."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path
from threading import Event
from typing import Any

from chladni.errors import FileError
from chladni.output import locked, own_version, write_json
from chladni.own_folder import own_folder

from .blind_diagnosis import Answer, answered
from .blind_folder import BlindFolder, Seals, hash_of, published, unchanged_cases

Say = Callable[[str], object]


def run(
    out: Path, workers: int, say: Say, limit: float = 3600.0, calibrated: bool = True
) -> list[str]:
    """Diagnose every case without an answer; return the names of these cases.

    After a kill at any instant the same call continues, because answers are written whole. A case
    that is refused, crashes or takes too long has that as its answer.

    Parameters
    ----------
    workers : processes
    limit : seconds a diagnosis may take
    calibrated : calibrate each case as well, for comparison with the diagnosis

    Raises
    ------
    FileError
        If the cases are not the published ones, or their truths have been opened.
    """
    place = BlindFolder(out)
    seals = published(place)
    with locked(out):
        unchanged_cases(place, seals)
        names = [n for n in seals.truths if not place.answer(n).exists()]
        if names and seals.purpose == "report" and place.opened.exists():
            raise FileError(
                f"{out}: the truths were opened, so {names[0]} cannot be answered blindly; make "
                "cases with other seeds"
            )
        say(f"{len(seals.truths)} cases, {len(seals.truths) - len(names)} answered before")
        commands = ("diagnose", "calibrate") if calibrated else ("diagnose",)

        def one(name: str, stop: Event) -> str:
            return _one(place, seals, name, commands, limit, stop)

        _each(names, workers, one, say)
    return names


def _each(names: Sequence[str], workers: int, one: Callable[[str, Event], str], say: Say) -> None:
    """Run all cases in turn or in parallel and report each; they end when this call ends."""
    stop = Event()
    with ThreadPoolExecutor(workers) as pool:
        jobs = {pool.submit(one, name, stop): name for name in names}
        try:
            for done, job in enumerate(as_completed(jobs), 1):
                say(f"{jobs[job]}: {job.result()}, {done} of {len(names)}")
        except BaseException:
            stop.set()
            pool.shutdown(cancel_futures=True)
            raise


def _one(
    place: BlindFolder, seals: Seals, name: str, commands: Sequence[str], limit: float, stop: Event
) -> str:
    """Answer a case, write the answer with the hashes of its files; return it in words."""
    given = {
        "seals": hash_of(place.seals),
        "files": seals.files[name],
        "version": own_version(),
    }
    answers: dict[str, Any] = {}
    for command in commands:
        work = place.work(name, command)
        with own_folder(place.out) as here:
            here.make("answers")
            for remains in (work.name, f"{work.name}.log"):  # of a run that was killed
                here.remove(f"answers/{remains}")
        answer = answered(command, place.case(name), work, limit, stop)
        if stop.is_set():
            return "stopped"
        answers[command] = vars(answer)
        if command != "diagnose":  # its pages take megabytes that are not needed
            with own_folder(place.out) as here:
                here.remove(f"answers/{work.name}")
    write_json(place.answer(name), {**given, **answers})
    return in_words(Answer(**answers["diagnose"]))


def in_words(answer: Answer) -> str:
    """An answer in a line."""
    effects = [str(e.get("name")) for e in answer.result.get("effects") or ()]
    verdict = str(answer.result.get("verdict", ""))
    called = ", ".join([verdict, *effects]) if verdict else f"exit {answer.code}: {answer.said}"
    return f"{called} ({answer.seconds:.0f} s, {answer.gigabytes:.1f} GB)"
