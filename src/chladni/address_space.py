"""Address space of this process under a limit (``ulimit -v``), checked as the package is loaded.

OpenBLAS ends the process or waits for ever where it gets no room for its threads. So the limit is
read before NumPy is loaded.
"""

import os
import sys
from itertools import pairwise
from pathlib import Path

ALONE = 384 << 20  # bytes that NumPy and SciPy take with one thread before anything is computed
EACH = 96 << 20  # more for each further thread: 41 MiB and its stack, in the OpenBLAS of both
_THREADS = ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS")  # the first one holds


def limit() -> float:
    """Bytes of address space this process may have; infinite where there is no limit."""
    try:
        import resource
    except ImportError:  # not on this system
        return float("inf")
    held = resource.getrlimit(resource.RLIMIT_AS)[0]
    return float("inf") if held == resource.RLIM_INFINITY else float(held)


def address_space_left() -> float:
    """Bytes that the limit leaves this process; infinite without a limit."""
    if (most := limit()) == float("inf"):
        return most
    import resource

    try:
        taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    except OSError:  # not on this system
        return float("inf")
    return most - taken


def blas_threads() -> int:
    """Threads that OpenBLAS starts: one a core, or fewer where the environment says so."""
    cores = os.cpu_count() or 1
    if hasattr(os, "sched_getaffinity"):
        cores = len(os.sched_getaffinity(0))
    said = (os.environ.get(name, "").split(",")[0].strip() for name in _THREADS)
    return next((min(int(n), cores) for n in said if n.isdigit() and int(n)), cores)


def least_space(threads: int) -> int:
    """Bytes of address space that NumPy and SciPy need to start with so many threads."""
    return ALONE + (threads - 1) * EACH


def refuse_small_limit() -> None:
    """Refuse to load the package where the limit is below ``least_space``.

    Raises
    ------
    MemoryError
        In a script.
    SystemExit
        In the command ``chladni``, with exit code 2 after the sentence.
    """
    threads = blas_threads()
    least = least_space(threads)
    if (most := limit()) >= least:
        return
    text = (
        f"the limit on address space is {most / 2**20:.0f} MiB and NumPy needs {least >> 20} MiB "
        f"to start with {threads} thread{'s' * (threads > 1)}; raise it by "
        f"`ulimit -v {least >> 10}` or more"
    )
    if most >= ALONE:
        text += ", or set OPENBLAS_NUM_THREADS=1"
    if not _is_command():
        raise MemoryError(text)
    sys.stderr.write(f"chladni: {text}\n")
    raise SystemExit(2)


def _is_command() -> bool:
    """True for ``chladni`` and ``python -m chladni``."""
    by_module = ("-m", "chladni") in pairwise(sys.orig_argv)
    return by_module or Path(sys.argv[0]).stem == "chladni"


refuse_small_limit()
