"""Independent work on all cores of a machine, in threads: arrays are shared and nothing is copied.

Products of numpy let other threads work while they do; what scipy wraps of LAPACK does not, so that
factorisations and their solves gain nothing here.
"""

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from threading import Lock
from typing import TypeVar

from threadpoolctl import threadpool_limits

A = TypeVar("A")
B = TypeVar("B")

MOST_THREADS = 4  # at once: each has matrices of its own
_ENTERED: list[threadpool_limits] = []  # one for each that asks for one thread of BLAS
_LOCK = Lock()


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """One thread for BLAS within, as a block or as a decorator; after the last, as many as before.

    Many small products follow each other here. Threads that share one of them wait for each other
    longer than they work, on a busy machine twenty times as long. The number belongs to the whole
    process, so threads that ask for it at the same time share it: the last to leave gives it back.
    """
    with _LOCK:
        _ENTERED.append(_ENTERED[0] if _ENTERED else threadpool_limits(1))
    try:
        yield
    finally:
        with _LOCK:
            limits = _ENTERED.pop()
            if not _ENTERED:
                limits.restore_original_limits()


def cores() -> int:
    """Of this machine, as many as this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def threads() -> int:
    """As many as there are cores, four at most; fewer where OMP_NUM_THREADS says so.

    That variable is where users and batch systems say how many cores a process may keep busy.
    """
    said = os.environ.get("OMP_NUM_THREADS", "").split(",")[0]
    most = int(said) if said.isdecimal() and int(said) else MOST_THREADS
    return min(cores(), most, MOST_THREADS)


def in_parallel(
    work: Callable[[A], B], items: Iterable[A], at_once: int | None = None
) -> Iterator[B]:
    """``work`` of each item, in their order; no more than one result for each thread waits.

    What ``work`` raises is raised here, once what has begun is done. ``at_once`` threads, or as
    many as :func:`threads` says; with one, the thread that asks does it all. Meanwhile BLAS has one
    thread for each.

    >>> list(in_parallel(abs, [-1, 2, -3], 2))
    [1, 2, 3]
    """
    count = threads() if at_once is None else at_once
    if count < 2:
        yield from map(work, items)
        return
    pool = ThreadPoolExecutor(count)
    begun: deque[Future[B]] = deque()
    with one_blas_thread():
        try:
            for item in items:
                begun.append(pool.submit(copy_context().run, work, item))
                if len(begun) > count:
                    yield begun.popleft().result()
            while begun:
                yield begun.popleft().result()
        finally:
            pool.shutdown(cancel_futures=True)
