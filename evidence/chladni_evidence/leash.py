"""Processes that end when their parent process ends, for whatever reason.

Otherwise a killed run leaves diagnoses that continue for minutes and disturb the next run.
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
    """Watch the parent process from a worker of a pool; only the parent is interrupted."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = multiprocessing.parent_process()
    if parent is not None:
        _end_after(lambda: wait([parent.sentinel]))


def main() -> None:
    """Run chladni until standard input ends, as ``python -m chladni_evidence.leash``."""
    _end_after(lambda: os.read(sys.stdin.fileno(), 1))
    runpy.run_module("chladni", run_name="__main__", alter_sys=True)


def _end_after(waited: Callable[[], object]) -> None:
    def watch() -> None:
        waited()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


if __name__ == "__main__":
    main()
