"""Progress of long work: a callback below, a bar on a terminal above."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from .errors import plain_line

Progress = Callable[[str, float], None]  # what is being done, and how far it is (0 to 1)


def silent(what: str, fraction: float) -> None:
    """Say nothing."""


def within(progress: Progress, low: float, high: float) -> Progress:
    """The part of a progress from ``low`` to ``high``, for a stage that counts from 0 to 1.

    >>> seen = []
    >>> within(lambda what, x: seen.append((what, x)), 0.5, 1.0)("fit", 0.5)
    >>> seen
    [('fit', 0.75)]
    """
    return lambda what, fraction: progress(what, low + (high - low) * fraction)


def counted(progress: Progress, what: str, n: int) -> Callable[[int], None]:
    """Return what reports that so many of ``n`` steps are done, with the time that is left.

    >>> step = counted(lambda what, x: print(what, x), "band", 4)
    band 0 of 4 0.0
    >>> step(4)
    band 4 of 4 1.0
    """
    begun = time.monotonic()

    def step(done: int) -> None:
        progress(f"{what} {done} of {n}{time_left(begun, done / n)}", done / n)

    step(0)
    return step


def time_left(begun: float, fraction: float) -> str:
    """Words on the rest of work that began at ``begun`` (monotonic clock) and is so far.

    >>> time_left(time.monotonic(), 0.0), time_left(time.monotonic() - 20, 0.5)
    ('', ', about 20 s left')
    """
    left = (time.monotonic() - begun) * (1 - fraction) / fraction if fraction > 0 else 0.0
    return f", about {remaining(left)} left" if left >= 1 else ""


def remaining(seconds: float) -> str:
    """A duration in words, in the most readable unit.

    >>> remaining(40), remaining(200), remaining(9000)
    ('40 s', '3 min', '2.5 h')
    """
    if seconds < 100:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


@contextmanager
def terminal(patience: float = 2.0) -> Iterator[Progress]:
    """A bar on standard error if that is a terminal and work lasts longer than ``patience`` s."""
    if not sys.stderr.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description:<36}", markup=False), BarColumn(), TimeElapsedColumn())
    bar = Bar(*columns, console=Console(stderr=True), transient=True)
    task, begun = bar.add_task("", total=1.0), time.monotonic()

    def report(what: str, fraction: float) -> None:
        bar.update(task, description=plain_line(what), completed=fraction)
        if time.monotonic() - begun > patience and not bar.live.is_started:
            bar.start()

    try:
        yield report
    finally:
        bar.stop()
