"""The wheel is complete: built from the sdist, installed where nothing else is, and used."""

import subprocess
from pathlib import Path

import pytest


@pytest.mark.slow
def test_the_wheel_works_in_an_empty_environment(tmp_path):
    """`.ci/wheel` builds and tries it; it needs a package index."""
    script = Path(__file__).parents[1] / ".ci/wheel"
    done = subprocess.run(["bash", script, tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert {p.suffix for p in tmp_path.iterdir()} == {".whl", ".gz"}
    assert "the wheel works in an empty environment" in done.stdout
