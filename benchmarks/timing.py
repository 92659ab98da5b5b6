"""The clock of the benchmarks: processor time, so that other work on the machine counts little."""

from collections.abc import Callable
from time import process_time
from typing import Any


def timed(run: Callable[[], Any], repeats: int) -> tuple[float, Any]:
    """Shortest processor time of some repeats [s], and the last result."""
    times = []
    for _ in range(repeats):
        begin = process_time()
        result = run()
        times.append(process_time() - begin)
    return min(times), result
