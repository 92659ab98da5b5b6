"""Return of freed memory to the system between the stages of a long run.

glibc returns only freed memory at the top of its heap. After the solution of the modes of a fine
mesh, some hundreds of megabytes of freed arrays lie below memory in use. The heap of each thread
keeps as much. malloc_trim(3) returns these too. It takes 0.02 to 0.1 s, so that it is suitable for
stages and candidates, not for loops.
"""

import ctypes


def give_back_freed_memory() -> bool:
    """Return freed memory; False if nothing was returned or the C library has no such function."""
    try:
        return bool(ctypes.CDLL(None).malloc_trim(0))
    except (OSError, AttributeError, TypeError):  # no glibc: macOS, Windows, musl
        return False
