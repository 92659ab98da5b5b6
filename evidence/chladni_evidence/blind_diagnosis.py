"""The only interface to diagnosis and calibration: it turns a case folder into an answer, blindly.

It calls the command line in a process of its own, so that time and memory are those of a user and a
crash counts as an answer. Only this file depends on the form of a diagnosis.
"""

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from threading import Event
from typing import Any

EVERY = 0.2  # interval between two checks of the process [s]
_ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")


@dataclass(frozen=True, eq=False)
class Answer:
    """Result of a diagnosis."""

    code: int  # exit code of the command, negative where it was ended by a signal
    # seconds, gigabytes: by the clock; highest resident memory
    seconds: float
    gigabytes: float
    said: str  # its last output
    # diagnosis.json; empty where none was written
    result: dict[str, Any] = field(default_factory=dict)

    @property
    def crashed(self) -> bool:
        """True unless it ended with an answer or a refusal in one sentence."""
        return self.code not in (0, 2, 3) or (self.code == 0 and not self.result)


def answered(
    command: str, case: Path, out: Path, limit: float = 3600.0, stop: Event | None = None
) -> Answer:
    """Diagnose (or ``calibrate``) a case into ``out``, from its folder alone.

    Output goes to ``out``.log. The run ends with this process, at ``stop``, and after ``limit`` s.
    """
    out.parent.mkdir(parents=True, exist_ok=True)
    log, start = out.with_name(f"{out.name}.log"), time.monotonic()
    arguments = [command, str(case), "--out", str(out)]
    with log.open("wb") as words:
        process = subprocess.Popen(
            [sys.executable, "-m", "chladni_evidence.leash", *arguments],
            stdin=subprocess.PIPE, stdout=words, stderr=subprocess.STDOUT,
            env={**os.environ, **_ONE_THREAD},
        )  # fmt: skip
        assert process.stdin is not None
        with process.stdin:
            code, kilobytes = _ended(process, start + limit, stop or Event())
    answer = out / "diagnosis.json"
    result = json.loads(answer.read_text(encoding="utf-8")) if answer.exists() else {}
    said = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    last = f"ended after {limit:g} s" if code < 0 and not result else (said or [""])[-1]
    return Answer(code, time.monotonic() - start, kilobytes / 2**20, last, result)


def _ended(process: subprocess.Popen[bytes], deadline: float, stop: Event) -> tuple[int, int]:
    """Exit code and highest resident memory [kB] of a process, which is killed at the deadline."""
    while True:
        pid, status, usage = os.wait4(process.pid, os.WNOHANG)
        if pid:
            process.returncode = os.waitstatus_to_exitcode(status)
            return process.returncode, usage.ru_maxrss
        if time.monotonic() > deadline or stop.is_set():
            process.kill()
        stop.wait(EVERY)
