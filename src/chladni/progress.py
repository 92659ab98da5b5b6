"""Progress of long work: a callback below, a bar on a terminal above."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

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


@contextmanager
def terminal(patience: float = 2.0) -> Iterator[Progress]:
    """A bar on standard error if that is a terminal and work lasts longer than ``patience`` s."""
    if not sys.stderr.isatty():
        yield silent
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description:<36}"), BarColumn(), TimeElapsedColumn())
    bar = Bar(*columns, console=Console(stderr=True), transient=True)
    task, begun = bar.add_task("", total=1.0), time.monotonic()

    def report(what: str, fraction: float) -> None:
        bar.update(task, description=what, completed=fraction)
        if time.monotonic() - begun > patience and not bar.live.is_started:
            bar.start()

    try:
        yield report
    finally:
        bar.stop()
