"""Output of a command to the terminal and, on request, to a log; its reader may close early."""

import os
import shlex
import sys
import threading
import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import IO

import typer

from ..errors import FileError, plain_line
from ..progress import Progress, terminal
from ..report.blocks import Table
from ..report.text_tables import table_lines

QUIET = 10.0  # seconds after which a run without a terminal says what it does
AGAIN = 60.0  # and how often from then on


@dataclass
class Console:
    """Further targets of lines in addition to standard output."""

    verbose: bool = False  # every stage, note and warning on standard error
    log: IO[str] | None = None  # the same and all that was said, with the time, in a file
    shows: bool = False  # whether a page that was written is opened in the browser
    begun: float = field(default_factory=time.monotonic)

    def aside(self, text: str) -> None:
        """A line for who wants to know more."""
        if self.verbose:
            _echo(f"[{time.monotonic() - self.begun:.1f} s] {text}", True)
        self.logged(text)

    def logged(self, text: str) -> None:
        """A line of the log; a log that can no longer be written ends, the work goes on."""
        if self.log is None:
            return
        try:
            self._append(text)
        except OSError as error:
            full, self.log = self.log, None
            _close(full)
            _echo(f"--log {full.name} ends here: {error.strerror}", True)

    def _append(self, text: str) -> None:
        assert self.log is not None
        self.log.write(f"{datetime.now().isoformat(timespec='seconds')} {plain_line(text)}\n")
        self.log.flush()


_used: list[Console] = [Console()]  # the last one speaks


@contextmanager
def opened_console(
    verbose: bool = False, log: Path | None = None, shows: bool = False
) -> Iterator[Console]:
    """The console of a command; warnings of libraries go aside.

    Raises
    ------
    FileError
        If the log cannot be written.
    """
    file = None if log is None else _opened_log(log)
    one = Console(verbose, file, shows)
    _used.append(one)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = lambda message, category, *_, **__: one.aside(
                f"{category.__name__}: {message}"
            )
            yield one
    finally:
        _used.pop()
        if file is not None:
            _close(file)


def _close(file: IO[str]) -> None:
    with suppress(OSError):  # what it could not write was reported
        file.close()


def _opened_log(path: Path) -> IO[str]:
    """The log with its first line, so that a place that takes no line is refused at once."""
    file = None
    try:
        file = path.open("a", encoding="utf-8", errors="replace")
        Console(log=file)._append(shlex.join(["chladni", *sys.argv[1:]]))
    except OSError as error:
        if file is not None:
            _close(file)
        raise FileError(f"--log {path} cannot be written: {error.strerror}") from error
    return file


def console() -> Console:
    """The one that speaks."""
    return _used[-1]


def say(text: str, error: bool = False) -> None:
    """A line on standard output or standard error, and in the log."""
    console().logged(text)
    _echo(text, error)


def say_results(place: Path) -> None:
    """Where the results are, or their page, which is opened if that was asked for."""
    import webbrowser

    say(f"results in {place}")
    if console().shows and not (place.is_file() and webbrowser.open(place.resolve().as_uri())):
        say(f"note: no browser opened {place}", error=True)


def _echo(text: str, error: bool) -> None:
    try:
        typer.echo(plain_line(text), err=error)
    except BrokenPipeError:  # as of `| head`: who reads has gone, the work goes on
        stream = sys.stderr if error else sys.stdout
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def say_table(table: Table) -> None:
    """A table in columns, its first rows where it is long."""
    for line in table_lines(table):
        say(line)


@contextmanager
def watched() -> Iterator[Progress]:
    """Progress: a bar on a terminal; elsewhere a line now and then once it takes long."""
    stage = [("at work", 0.0)]
    one, done = console(), threading.Event()

    def report_progress(what: str, fraction: float) -> None:
        if what != stage[0][0]:
            one.aside(what)
        stage[0] = (what, fraction)
        bar(what, fraction)

    def speak() -> None:
        wait = QUIET
        while not done.wait(wait):
            spent, wait = time.monotonic() - one.begun, AGAIN
            what, fraction = stage[0]
            _echo(f"[{spent:.0f} s] {what}, {100 * fraction:.0f} %", True)

    with terminal() as bar:
        if not sys.stderr.isatty() and not one.verbose:
            threading.Thread(target=speak, daemon=True).start()
        try:
            yield report_progress
        finally:
            done.set()
