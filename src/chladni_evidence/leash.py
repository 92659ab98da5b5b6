"""Processes that end when whoever started them does, however that ended.

Without it a killed run leaves diagnoses behind that go on for minutes, in the way of the next.
"""

import multiprocessing
import os
import runpy
import signal
import sys
import threading
from collections.abc import Callable
from multiprocessing.connection import wait


def leash_to_parent() -> None:
    """Of a worker of a pool: watch the process that started it, which alone is interrupted."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = multiprocessing.parent_process()
    if parent is not None:
        _end_after(lambda: wait([parent.sentinel]))


def main() -> None:
    """``python -m chladni_evidence.leash``: chladni, until its standard input ends."""
    _end_after(lambda: os.read(sys.stdin.fileno(), 1))
    runpy.run_module("chladni", run_name="__main__", alter_sys=True)


def _end_after(waited: Callable[[], object]) -> None:
    def watch() -> None:
        waited()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


if __name__ == "__main__":
    main()
