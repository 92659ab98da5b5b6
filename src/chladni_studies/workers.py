"""Samples computed in this process, in local processes, or on any Dask cluster."""

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from chladni.errors import FileError
from chladni.parallel import cores

from .sample import SampleResult, StudyModel, computed
from .worker_memory import keep_freed_memory

PATIENCE = 15  # seconds a scheduler may take to answer
MOST_PER_CORE = 4  # local processes a core
STARTS = 3  # of local workers, of which one may be killed in its start
WORTH = 10.0  # seconds in one process above which others are started
ENDED = "its worker ended without a message in every attempt; there may be too little memory"
NO_WORKER = "the scheduler has no worker yet; waiting until one joins it"
ALONE = 3.0  # seconds without a sample after which the cluster is checked for workers
_AHEAD = 2  # samples per thread that are on the cluster at a time
_GLANCE = 0.05  # seconds between two checks for a finished sample
_COUNTED = 5.0  # seconds after which the threads of a cluster, which may grow, are counted again


def refuse_many(workers: int) -> None:
    """Refuse impossible numbers of local processes."""
    if workers < 1:
        raise FileError(f"workers = {workers}; at least one is needed")
    if workers > MOST_PER_CORE * cores():
        raise FileError(
            f"workers = {workers}; more than {MOST_PER_CORE * cores()} bring no gain on {cores()} "
            "cores"
        )


def affordable(samples: int, seconds: float) -> int:
    """Number of local processes worth starting for these samples of ``seconds`` each."""
    if samples * seconds < WORTH:
        return 1
    return max(1, min(cores(), samples))


def results(
    study: StudyModel, X: np.ndarray, todo: Sequence[int], workers: int, scheduler: Any = None,
    report: Callable[[str], None] = lambda text: None,
) -> Iterator[SampleResult]:  # fmt: skip
    """Samples ``todo`` of X in the order in which they finish.

    Parameters
    ----------
    workers : local processes; with one, and no scheduler, samples are computed in this process
    scheduler : a ``distributed.Client`` instead of local processes
    report : called with the reason of a wait
    """
    if not todo:
        return
    if scheduler is not None:
        yield from _distributed(scheduler, study, X, todo, report)
    elif workers > 1:
        with _local_cluster(workers) as client:
            yield from _distributed(client, study, X, todo, report)
    else:
        keep_freed_memory()
        yield from (computed(study, k, X[k]) for k in todo)


@contextmanager
def _local_cluster(workers: int) -> Iterator[Any]:
    """A client of processes of this machine, one thread each; one that ends is started again."""
    from distributed import Client, LocalCluster

    options = {"threads_per_worker": 1, "memory_limit": None, "dashboard_address": None}
    with _quiet("distributed", "distributed.nanny", "distributed.scheduler", "distributed.worker"):
        for left in range(STARTS - 1, -1, -1):
            try:
                cluster = LocalCluster(workers, silence_logs=logging.CRITICAL, **options)
                break
            except (OSError, RuntimeError, TimeoutError) as error:  # one may be killed in its start
                if not left:
                    raise FileError(
                        f"{workers} local workers could not be started in {STARTS} tries; "
                        "--workers 1 needs none, and a script with more workers needs if "
                        '__name__ == "__main__":'
                    ) from error
        with cluster, Client(cluster) as client:
            yield client


@contextmanager
def client_of(scheduler: Any) -> Iterator[Any]:
    """A client of the scheduler at an address; a ``distributed.Client`` or None as it is.

    Raises
    ------
    FileError
        If no scheduler answers there.
    """
    if scheduler is None:
        yield None
        return
    from distributed import Client

    if isinstance(scheduler, Client):
        yield scheduler
        return
    with _quiet("distributed", "distributed.client"), _connected(str(scheduler)) as client:
        yield client


@contextmanager
def _quiet(*names: str) -> Iterator[None]:
    """Suppress Dask's log: dead workers and lost schedulers have messages of their own."""
    loggers = [logging.getLogger(name) for name in names]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def _connected(address: str) -> Any:
    from distributed import Client
    from distributed.comm.addressing import parse_address
    from distributed.comm.registry import get_backend

    try:
        get_backend(parse_address(address)[0])  # check the address before a loop is started
        return Client(address, timeout=PATIENCE)
    # AssertionError arises where the loop of an earlier client is just ending
    except (OSError, ValueError, TypeError, RuntimeError, AssertionError) as error:
        why = " ".join(str(error).split()) or type(error).__name__
        raise FileError(
            f"no Dask scheduler answers at {address!r} ({why[:120]}); give its address as "
            "tcp://host:8786"
        ) from error


def _distributed(
    client: Any, study: StudyModel, X: np.ndarray, todo: Sequence[int],
    report: Callable[[str], None],
) -> Iterator[SampleResult]:  # fmt: skip
    """Compute few samples at a time, so that a lost worker or a kill costs only these.

    The model is a task of its own: the scheduler repeats it where the worker that held it dies.
    A worker that ends is counted against every sample it had; the suspects are tried one by one.
    """
    from distributed import as_completed

    held = client.submit(_itself, study, pure=False)
    running: dict[Any, int] = {}
    waiting = list(reversed(todo))
    suspects: list[int] = []
    ready, counted, ahead = as_completed(), -np.inf, 1
    while waiting or running or suspects:
        if not waiting and not running:
            waiting, counted, ahead = [suspects.pop()], np.inf, 1
        if time.monotonic() - counted > _COUNTED:
            counted = time.monotonic()
            ahead = _AHEAD * max(1, sum(_workers_of(client).values()))
        while waiting and len(running) < ahead:
            k = waiting.pop()
            future = client.submit(_on_worker, held, k, X[k], pure=False)
            running[future] = k
            ready.add(future)
        _wait(ready, client, report)
        future = next(ready)
        k = running.pop(future)
        found = _result(future, k)
        if found.why == ENDED and ahead > 1:
            suspects.append(k)
        else:
            yield found


def _wait(ready: Any, client: Any, report: Callable[[str], None]) -> None:
    """Wait until a sample is finished; report once if the cluster has no workers."""
    looked, said = time.monotonic(), False
    while not ready.has_ready():
        time.sleep(_GLANCE)
        if not said and time.monotonic() - looked > ALONE:
            looked, said = time.monotonic(), not _workers_of(client)
            if said:
                report(NO_WORKER)


def _workers_of(client: Any) -> dict[str, int]:
    """Present threads of the cluster by address of the worker."""
    try:
        return dict(client.nthreads())
    except OSError as error:
        raise FileError("the connection to the scheduler was lost") from error


def _itself(study: StudyModel) -> StudyModel:
    return study


def _on_worker(study: StudyModel, number: int, values: np.ndarray) -> SampleResult:
    """Compute a sample in a process that does nothing else."""
    keep_freed_memory()
    return computed(study, number, values)


def _result(future: Any, k: int) -> SampleResult:
    """Result of a worker; a sample that kills its workers fails, other errors end the study."""
    from distributed import KilledWorker
    from distributed.client import FutureCancelledError

    try:
        found = future.result()
    except KilledWorker:
        return SampleResult(k, {}, ENDED)
    except (FutureCancelledError, OSError) as error:
        raise FileError("the connection to the scheduler was lost") from error
    except Exception as error:
        why = " ".join(str(error).split())[:200]
        raise FileError(
            f"the workers could not run a sample ({type(error).__name__}: {why}); they need the "
            "same chladni as this process"
        ) from error
    assert isinstance(found, SampleResult)
    return found
