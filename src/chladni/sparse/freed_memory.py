"""Freed memory given back to the system between the stages of a long run.

glibc hands back what lies at the top of its heap. After the modes of a fine mesh are solved some
hundreds of megabytes of freed arrays lie below what was made beside them and stays, and threads
leave as much each to itself; malloc_trim(3) gives these back as well. It takes 0.02 to 0.1 s: for
stages and candidates, not for loops.
"""

import ctypes


def give_back_freed_memory() -> bool:
    """Whether anything was given back; False as well where the C library has no such function."""
    try:
        return bool(ctypes.CDLL(None).malloc_trim(0))
    except (OSError, AttributeError, TypeError):  # no glibc: macOS, Windows, musl
        return False
