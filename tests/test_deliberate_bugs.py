"""The suite fails on each deliberate bug of a list.

Each is put into a copy of the tree, and the tests of its room run there in a process of their own:
``.venv/bin/pytest -m slow tests/test_deliberate_bugs.py``.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from tests.deliberate_bugs import BUGS

ROOT = Path(__file__).parents[1]
TREE = (
    "src",
    "envs",
    "evidence",
    "meshes",
    "tests",
    "docs",
    "conftest.py",
    "pyproject.toml",
    "README.md",
)
FAILED = 1  # of pytest: tests ran, and some failed


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    copy, unwanted = tmp_path_factory.mktemp("tree"), shutil.ignore_patterns("_build", "*.pyc")
    for name in TREE:
        if (ROOT / name).is_dir():
            shutil.copytree(ROOT / name, copy / name, ignore=unwanted)
        else:
            shutil.copy(ROOT / name, copy)
    return copy


@pytest.mark.parametrize("bug", BUGS, ids=lambda bug: bug.file)
def test_the_text_of_a_bug_stands_once(bug):
    """The list follows the source; what it names is there."""
    assert (ROOT / bug.file).read_text(encoding="utf-8").count(bug.old) == 1
    assert (ROOT / bug.tests).exists()


@pytest.mark.slow
@pytest.mark.parametrize("bug", BUGS, ids=lambda bug: bug.file)
def test_the_suite_fails_on_it(bug, tree):
    sound = (tree / bug.file).read_text(encoding="utf-8")
    (tree / bug.file).write_text(sound.replace(bug.old, bug.new), encoding="utf-8")
    path = os.pathsep.join(str(tree / name) for name in ("src", "envs", "evidence"))
    env = {**os.environ, "PYTHONPATH": path}
    command = [sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider", bug.tests]
    try:
        done = subprocess.run(command, cwd=tree, env=env, capture_output=True, text=True)
    finally:
        (tree / bug.file).write_text(sound, encoding="utf-8")
    assert done.returncode == FAILED, done.stdout[-3000:]
