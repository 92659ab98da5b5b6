"""Freed memory that a worker keeps for its next sample.

Dask starts its workers with MALLOC_TRIM_THRESHOLD_=65536. Then glibc returns every freed array to
the system and keeps the threshold for separately mapped arrays at 128 KiB. A solve frees and
allocates the same megabytes hundreds of times. On a tailgate of 32 mm a sample has 395 000 page
faults, where a process of its own has 36 000, and takes 1.5 to 1.7 times its processor time.
mallopt(3), M_MMAP_THRESHOLD and M_TRIM_THRESHOLD.
"""

import ctypes
from functools import cache

_TRIM, _MMAP = -1, -3  # names of the options in malloc.h
MAPPED = 32 * 2**20  # bytes from which an array is mapped separately: the most glibc allows
KEPT = 256 * 2**20  # free bytes that may remain at the top of the heap


@cache
def keep_freed_memory() -> bool:
    """Keep freed arrays in this process; False where the C library has no such option."""
    try:
        mallopt = ctypes.CDLL(None).mallopt
    except (OSError, AttributeError, TypeError):  # no glibc: macOS, Windows, musl
        return False
    return bool(mallopt(_MMAP, MAPPED)) and bool(mallopt(_TRIM, KEPT))
