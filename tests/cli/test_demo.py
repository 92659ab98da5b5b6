"""README shows what the demonstration prints, word for word."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

README = Path(__file__).parents[2] / "README.md"


@pytest.mark.slow
def test_the_demonstration_says_what_readme_shows(tmp_path):
    """Its name, place, value and scores; a tie with another effect once replaced the name."""
    words = [sys.executable, "-m", "chladni", "demo", "--out", str(tmp_path / "demo")]
    done = subprocess.run(words, capture_output=True, text=True, check=True, timeout=900)
    said = " ".join(done.stdout.split())
    section = README.read_text(encoding="utf-8").split("## What the demo shows")[1]
    block = re.search(r"```\n(.*?)```", section, re.DOTALL)[1]
    sentence, *rows = re.split(r"\n(?=  )", block.strip())
    for shown in (sentence, *rows):
        assert " ".join(shown.split()) in said
