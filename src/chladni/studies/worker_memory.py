"""Freed memory that a worker keeps for its next sample.

Dask starts its workers with MALLOC_TRIM_THRESHOLD_=65536, so that glibc hands every freed array
back to the system, and holds the threshold above which arrays are mapped one by one at 128 KiB. A
solve frees and asks for the same megabytes hundreds of times: on a tailgate of 32 mm 395 000 page
faults a sample where a process of its own has 36 000, and 1.5 to 1.7 times its processor time.
mallopt(3), M_MMAP_THRESHOLD and M_TRIM_THRESHOLD.
"""

import ctypes
from functools import cache

_TRIM, _MMAP = -1, -3  # names of the options in malloc.h
MAPPED = 32 * 2**20  # bytes from which an array is mapped by itself: the most glibc takes
KEPT = 256 * 2**20  # bytes that may lie free at the top


@cache
def keep_freed_memory() -> bool:
    """Once a process: freed arrays stay with it; False where the C library has no such option."""
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError, TypeError):  # no glibc: macOS, Windows, musl
        return False
    return bool(mallopt(_MMAP, MAPPED)) and bool(mallopt(_TRIM, KEPT))
