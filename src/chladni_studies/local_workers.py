"""Samples on processes of this machine: a pipe to each, and nothing between.

A worker waits for its pipe and costs nothing while it does. It has the next sample at hand when it
ends one. A pipe that closes is a worker that ended: another is started, and has its samples.
"""

import signal
from collections import Counter, deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from multiprocessing import get_context
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

import numpy as np

from chladni.errors import FileError

from .sample import SampleResult, StudyModel, computed
from .worker_memory import keep_freed_memory

STARTS = 3  # workers in turn that may end before they are ready
TRIES = 4  # workers that may end in one sample
AHEAD = 2  # samples a worker has: one is computed, one waits
ENDED = "its worker ended without a message in every attempt; there may be too little memory"


@dataclass(eq=False)
class _Worker:
    """A process, the pipe to it, and the samples it has, in their order."""

    process: BaseProcess
    pipe: Connection
    queued: deque[int] = field(default_factory=deque)
    ready: bool = False


def local_results(
    study: StudyModel, X: np.ndarray, todo: Sequence[int], workers: int
) -> Iterator[SampleResult]:
    """Samples ``todo`` of X in whatever order they are finished.

    Raises
    ------
    FileError
        If workers end in their start again and again.
    """
    waiting, ends = deque(todo), Counter[int]()
    alive: dict[Connection, _Worker] = {}
    failed = 0
    try:
        while waiting or any(worker.queued for worker in alive.values()):
            while waiting and len(alive) < workers:
                worker = _started(study)
                alive[worker.pipe] = worker
            for pipe in wait(list(alive)):
                assert isinstance(pipe, Connection)
                worker = alive[pipe]
                try:
                    found = pipe.recv()
                except (EOFError, OSError):
                    failed += not worker.ready
                    if failed >= STARTS:
                        raise FileError(_no_start(workers)) from None
                    yield from _given_back(alive.pop(pipe), waiting, ends)
                    continue
                failed = 0
                if isinstance(found, Exception):
                    raise found
                if found is not None:
                    worker.queued.popleft()
                    yield found
                worker.ready = True
                _fed(worker, X, waiting)
    finally:
        for worker in alive.values():
            _ended(worker)


def _started(study: StudyModel) -> _Worker:
    """A process that says when it is ready."""
    context = get_context("spawn")  # the only way there is on every system, and safe with threads
    ours, theirs = context.Pipe()
    process = context.Process(target=_work, args=(theirs, study), daemon=True)
    process.start()
    theirs.close()
    return _Worker(process, ours)


def _work(pipe: Connection, study: StudyModel) -> None:
    """Compute what comes until the pipe is closed; Ctrl-C is the business of the study."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    keep_freed_memory()
    with suppress(EOFError, OSError):  # the study has ended
        pipe.send(None)
        while True:
            number, values = pipe.recv()
            try:
                pipe.send(computed(study, number, values))
            except Exception as error:  # a fault of chladni ends the study, not a sample
                pipe.send(error)
                raise SystemExit(1) from error


def _fed(worker: _Worker, X: np.ndarray, waiting: deque[int]) -> None:
    """Samples for a worker; one that has just ended is seen by its pipe."""
    with suppress(OSError):
        while waiting and len(worker.queued) < AHEAD:
            worker.pipe.send((waiting[0], X[waiting[0]]))
            worker.queued.append(waiting.popleft())


def _given_back(worker: _Worker, waiting: deque[int], ends: Counter[int]) -> Iterator[SampleResult]:
    """Samples of a worker that ended go to others; one that ended every worker has failed."""
    _ended(worker)
    if worker.queued:
        first = worker.queued[0]
        ends[first] += 1
        if ends[first] >= TRIES:
            yield SampleResult(worker.queued.popleft(), {}, ENDED)
    waiting.extendleft(reversed(worker.queued))


def _ended(worker: _Worker) -> None:
    worker.pipe.close()
    worker.process.terminate()
    worker.process.join()
    worker.process.close()


def _no_start(workers: int) -> str:
    return (
        f"{workers} local workers could not be started in {STARTS} tries; --workers 1 needs none, "
        'and a script with more workers needs if __name__ == "__main__":'
    )
