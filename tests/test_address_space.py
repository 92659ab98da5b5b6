"""A limit on address space under which NumPy does not start is one sentence, not its end."""

import subprocess
import sys
from pathlib import Path

import pytest

from chladni.address_space import LEAST

resource = pytest.importorskip("resource")
COMMANDS = (
    [sys.executable, "-m", "chladni", "--version"],
    [str(Path(sys.executable).with_name("chladni")), "--version"],
)


def limited(command, most):
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (most, most))

    return subprocess.run(command, capture_output=True, text=True, preexec_fn=limit)


@pytest.mark.parametrize("most", [100_000 << 10, 300_000 << 10, LEAST - 1])
def test_a_small_limit_is_one_sentence(most):
    for command in (c for c in COMMANDS if Path(c[0]).exists()):
        done = limited(command, most)
        assert (done.returncode, done.stdout) == (2, "")
        (line,) = done.stderr.splitlines()
        assert line.startswith("chladni: the limit on address space is ")
        assert f"ulimit -v {LEAST >> 10}" in line


def test_the_limit_that_the_sentence_names_suffices():
    assert limited(COMMANDS[0], LEAST).returncode == 0


def test_a_script_is_given_an_error_it_can_catch():
    code = """
try:
    import chladni
except MemoryError as error:
    print(error)
"""
    done = limited([sys.executable, "-c", code], 300_000 << 10)
    assert done.returncode == 0
    assert done.stdout.startswith("the limit on address space is 293 MiB")
