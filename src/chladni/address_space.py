"""Address space of this process under a limit (``ulimit -v``), checked as the package is loaded.

OpenBLAS ends the process or waits for ever where it gets no room for its threads. So the limit is
read before NumPy is loaded.
"""

import sys
from itertools import pairwise
from pathlib import Path

LEAST = 1 << 30  # bytes that NumPy, SciPy and their threads need before anything is computed


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


def refuse_small_limit() -> None:
    """Refuse to load the package where the limit is below ``LEAST``.

    Raises
    ------
    MemoryError
        In a script.
    SystemExit
        In the command ``chladni``, with exit code 2 after the sentence.
    """
    if (most := limit()) >= LEAST:
        return
    text = (
        f"the limit on address space is {most / 2**20:.0f} MiB and NumPy needs "
        f"{LEAST / 2**20:.0f} MiB to start; raise it by `ulimit -v {LEAST // 2**10}` or more"
    )
    if not _is_command():
        raise MemoryError(text)
    sys.stderr.write(f"chladni: {text}\n")
    raise SystemExit(2)


def _is_command() -> bool:
    """True for ``chladni`` and ``python -m chladni``."""
    by_module = ("-m", "chladni") in pairwise(sys.orig_argv)
    return by_module or Path(sys.argv[0]).stem == "chladni"


refuse_small_limit()
