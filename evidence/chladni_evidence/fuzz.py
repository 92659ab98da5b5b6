"""What becomes of injured inputs: each in a process of its own, with limits of time and memory.

Due is a result (exit 0), a result that says it is not to be trusted (3), or one sentence and
nothing written (2). Everything else is a failure; its input is kept with the line that repeats it.
"""

import importlib
import json
import os
import re
import resource
import runpy
import shlex
import shutil
import signal
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from chladni.output import write_json, write_text

from .fuzz_input import SECRET, YOUR_FILES, YOURS, FuzzInput

PATIENCE = 60.0  # of the processor's time [s]
MEMORY = 2e9  # resident at most [bytes]
_MOST = 4_000_000_000  # that a process gets at all
_LIST = re.compile(r"[\[(]'[^']*'[,\])]")  # a list of words as Python writes it
_STAGE = re.compile(r"\[\d+ s\] ")  # how a run that takes long says what it does
_HEAVY = (  # what commands import when they need it: once here, not in every process
    *("chladni.cli.app", "chladni.report.modes_page", "chladni.report.correlation_page"),
    *("matplotlib.backends.backend_agg", "matplotlib.figure", "jinja2", "pyvista", "pyuff"),
    *("scipy.io", "scipy.sparse.linalg", "scipy.optimize", "scipy.signal"),
)
DUE = ("answered", "not trusted", "refused")


@dataclass(frozen=True)
class FuzzOutcome:
    """What became of one input."""

    called: str  # one of DUE, or what is wrong
    said: str
    seconds: float
    bytes: int

    @property
    def good(self) -> bool:
        """Whether it is as due."""
        return self.called in DUE


def outcome(one: FuzzInput, patience: float = PATIENCE) -> FuzzOutcome:
    """Run the command on the files in a folder of their own."""
    with tempfile.TemporaryDirectory(prefix="chladni-fuzz-") as name:
        folder, yours = Path(name) / "input", Path(name) / YOURS
        laid_out(one, folder)
        for file in YOUR_FILES if one.links else ():
            yours.mkdir(exist_ok=True)
            (yours / file).write_bytes(SECRET)
        begun = time.monotonic()
        child = os.fork()
        if child == 0:
            _run(folder, one.arguments, patience)
        _, status, used = os.wait4(child, 0)
        size = used.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
        seconds = used.ru_utime + used.ru_stime
        output, said = (_read(folder / n) for n in ("stdout.txt", "stderr.txt"))
        called = _called(status, output, said, size, folder / "out", bool(one.links))
        if one.sound and called in DUE[1:]:
            called = "sound, and not answered"
        if one.links:
            called = _left_alone(yours, folder, output + said) or called
        if called == "answered" and not re.search(one.cause, output):
            called = "silent"
        return FuzzOutcome(called, said or output, min(seconds, time.monotonic() - begun), size)


def _read(path: Path) -> str:
    return path.read_text(encoding="utf-8", errors="replace") if path.exists() else ""


def _run(folder: Path, arguments: Iterable[str], patience: float) -> None:
    """The command in this process, which ends with it."""
    code = 1
    try:
        os.chdir(folder)
        for number, name in ((1, "stdout.txt"), (2, "stderr.txt")):
            os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), number)
        sys.stdout, sys.stderr = (os.fdopen(k, "w", encoding="utf-8") for k in (1, 2))
        resource.setrlimit(resource.RLIMIT_CPU, (int(patience), int(patience) + 5))
        resource.setrlimit(resource.RLIMIT_DATA, (_MOST, _MOST))
        signal.alarm(int(10 * patience))  # of the clock, for what sleeps
        sys.argv = ["chladni", *arguments, "--out", "out"]
        runpy.run_module("chladni", run_name="__main__")
        code = 0
    except SystemExit as end:
        code = end.code if isinstance(end.code, int) else int(end.code is not None)
    except BaseException:  # noqa: BLE001  whatever it is, it is what the user would see
        sys.excepthook(*sys.exc_info())
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def laid_out(one: FuzzInput, folder: Path) -> None:
    """Write the files of an input and make its links."""
    folder.mkdir(exist_ok=True)
    for file, data in one.files.items():
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_bytes(data)
    for link, target in one.links.items():
        (folder / link).parent.mkdir(parents=True, exist_ok=True)
        (folder / link).unlink(missing_ok=True)
        (folder / link).symlink_to(target)


def _left_alone(yours: Path, folder: Path, said: str) -> str:
    """Name the misuse of the files that links lead to; "" if they are as before and not shown."""
    if {p.name: p.read_bytes() for p in yours.iterdir()} != dict.fromkeys(YOUR_FILES, SECRET):
        return "touched outside"
    written = [p for p in folder.rglob("*") if p.is_file() and not p.is_symlink()]
    told = SECRET.decode() in said or any(SECRET in p.read_bytes() for p in written)
    return "told of outside" if told else ""


def _called(status: int, output: str, said: str, size: int, out: Path, there: bool = False) -> str:
    """The name of what happened; ``there``: the output folder was there before."""
    if os.WIFSIGNALED(status):
        number = os.WTERMSIG(status)
        slow = (signal.SIGXCPU, signal.SIGALRM, signal.SIGKILL)
        return "hang" if number in slow else f"ended by signal {number}"
    code = os.WEXITSTATUS(status)
    if "Traceback" in said or code not in (0, 2, 3):
        return "traceback"
    if size > MEMORY:
        return "memory"
    lines = [line for line in said.strip().splitlines() if not _STAGE.match(line)]
    if code == 0:
        return "noise" if lines else _whole(out)
    if len(lines) != 1 or not lines[0].startswith("chladni: "):
        usage = lines and lines[0].startswith("Usage:")
        return "refused" if usage and code == 2 else "no sentence"
    if _LIST.search(said):
        return "programmer's words"
    if code == 2 and out.exists() and not there:
        return "half-written"
    return "refused" if code == 2 else "not trusted"


def _whole(out: Path) -> str:
    """Check that every JSON of a result is one, and that its numbers are finite."""
    no_number: list[str] = []
    for path in out.rglob("*.json"):
        try:
            json.loads(path.read_text(encoding="utf-8"), parse_constant=no_number.append)
        except ValueError:
            return "half-written"
    if no_number:
        return "nan written"
    return "answered" if any(out.iterdir()) else "nothing written"


def until(inputs: Iterable[FuzzInput], minutes: float) -> Iterator[FuzzInput]:
    """Inputs for so long and no longer, so that the table of what was tried is written."""
    begun = time.monotonic()
    for one in inputs:
        if time.monotonic() - begun > 60 * minutes:
            return
        yield one


def fuzz(
    inputs: Iterable[FuzzInput], out: Path, say: Callable[[str], object]
) -> dict[str, Counter[str]]:
    """Try all; counts by kind, failures kept below ``out``."""
    for name in _HEAVY:
        importlib.import_module(name)
    counts: dict[str, Counter[str]] = {}
    slowest = largest = 0.0
    for k, one in enumerate(inputs):
        found = outcome(one)
        counts.setdefault(one.kind, Counter())[found.called] += 1
        slowest, largest = max(slowest, found.seconds), max(largest, found.bytes / 1e9)
        if not found.good:
            _keep(one, found, out / f"{k:05d}-{one.kind}-{found.called.replace(' ', '-')}")
            tail = (found.said.strip().splitlines() or [""])[-1]
            say(f"{k} {one.kind}: {found.called}, {tail[:160]}")
    write_json(out / "fuzz.json", counts)
    say(table(counts))
    say(f"{sum(c.total() for c in counts.values())} inputs")
    say(f"slowest {slowest:.1f} s of the processor, largest {largest:.2f} GB")
    return counts


def table(counts: dict[str, Counter[str]]) -> str:
    """Kinds of input against outcomes."""
    heads = [*DUE, *sorted({name for c in counts.values() for name in c} - {*DUE})]
    width = max(map(len, heads)) + 2
    lines = [" " * 10 + "".join(h.rjust(width) for h in heads)]
    for kind, count in sorted(counts.items()):
        lines.append(kind.ljust(10) + "".join(str(count[h]).rjust(width) for h in heads))
    return "\n".join(lines)


def _keep(one: FuzzInput, found: FuzzOutcome, place: Path) -> None:
    """The files of a failure, what was said and the line that makes it again."""
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True)
    laid_out(one, place)
    line = shlex.join(["chladni", *one.arguments, "--out", "out"])
    write_text(place / "command.txt", f"{line}\n\n{found.called}\n{found.said}")
