"""A limit on address space under which NumPy does not start is one sentence, not its end."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from chladni.address_space import ALONE, EACH, blas_threads, least_space

resource = pytest.importorskip("resource")
COMMANDS = (
    [sys.executable, "-m", "chladni", "--version"],
    [str(Path(sys.executable).with_name("chladni")), "--version"],
)


def limited(command, most, threads=1):
    def limit():
        resource.setrlimit(resource.RLIMIT_AS, (most, most))

    env = {**os.environ, "OPENBLAS_NUM_THREADS": str(threads)}
    return subprocess.run(command, capture_output=True, text=True, preexec_fn=limit, env=env)


@pytest.mark.parametrize("most", [100_000 << 10, 300_000 << 10, ALONE - 1])
def test_a_small_limit_is_one_sentence(most):
    for command in (c for c in COMMANDS if Path(c[0]).exists()):
        done = limited(command, most)
        assert (done.returncode, done.stdout) == (2, "")
        (line,) = done.stderr.splitlines()
        assert line.startswith("chladni: the limit on address space is ")
        assert f"ulimit -v {ALONE >> 10}" in line


SOLVED = "import chladni, numpy as n, scipy.linalg as s; A = n.eye(99); s.eigh(A), n.linalg.eigh(A)"


@pytest.mark.parametrize(
    ("command", "threads"),
    [(COMMANDS[0], 1), ([sys.executable, "-c", SOLVED], 1), ([sys.executable, "-c", SOLVED], 2)],
)
def test_the_limit_that_the_sentence_names_suffices(command, threads):
    """NumPy and SciPy start and solve: nothing is refused that works."""
    done = limited(command, least_space(threads), threads)
    assert done.returncode == 0, done.stderr


def test_threads_that_the_user_forgoes_need_no_room(monkeypatch):
    monkeypatch.setattr("os.sched_getaffinity", lambda _: set(range(8)), raising=False)
    for name in ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS"):
        monkeypatch.delenv(name, raising=False)
    assert blas_threads() == 8
    assert least_space(8) == ALONE + 7 * EACH
    for said, threads in (("3,2", 3), ("0", 8), ("64", 8), ("x", 8)):
        monkeypatch.setenv("OMP_NUM_THREADS", said)
        assert blas_threads() == threads


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
