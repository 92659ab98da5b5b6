"""The whole site builds without a warning, and every tutorial does what it says."""

import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("sphinx", reason="Sphinx is not installed; it comes with the extra docs")

ROOT = Path(__file__).parents[2]


@pytest.mark.slow
def test_the_site_builds_and_its_tutorials_run(tmp_path):
    """The command of CONTRIBUTING, into another folder."""
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-W", "--keep-going", "docs", str(tmp_path)],
        cwd=ROOT, capture_output=True, text=True,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "tutorials/first_day.html").read_text(encoding="utf-8")
    assert "The model lacks point-mass" in page
    assert (tmp_path / "searchindex.js").is_file()
    links = subprocess.run(
        [sys.executable, "docs/links.py", str(tmp_path)], cwd=ROOT, capture_output=True, text=True
    )
    assert links.returncode == 0, links.stdout
