"""Commands as a user gives them, and how they end."""

import re
from pathlib import Path
from typing import Any

from click.testing import Result
from typer.testing import CliRunner

from chladni.cli.app import application


def call(*words: Any) -> Result:
    """Run ``chladni`` with these words: exit code, output and standard error."""
    return CliRunner().invoke(application(), [str(word) for word in words])


def spoken(stderr: str) -> list[str]:
    """Lines of standard error, without the progress of a run that takes long on a busy machine."""
    return [line for line in stderr.splitlines() if not re.match(r"\[\d+ s\] .*, \d+ %$", line)]


def ran(*words: Any, code: int = 0) -> Result:
    """Run a command that must end with this exit code."""
    done = call(*words)
    assert done.exit_code == code, (done.output, done.exception)
    return done


def refused(*words: Any) -> str:
    """Run a command that must be refused: one sentence, exit code 2, no file written.

    Returns the sentence.
    """
    out = Path(words[words.index("--out") + 1])
    before = {p: p.stat().st_mtime_ns for p in out.rglob("*")}, out.exists()
    (sentence,) = spoken(ran(*words, code=2).stderr)
    assert sentence.startswith("chladni: ")
    assert ({p: p.stat().st_mtime_ns for p in out.rglob("*")}, out.exists()) == before
    return sentence
