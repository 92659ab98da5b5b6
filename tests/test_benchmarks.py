"""Every benchmark still finds what it measures; their figures are nobody's test."""

import runpy
from pathlib import Path

import pytest

ROOM = Path(__file__).parents[1] / "benchmarks"


@pytest.mark.parametrize("name", sorted(p.name for p in ROOM.glob("*.py")))
def test_it_can_be_started(name, monkeypatch):
    """Read to its end, short of running: a name that has moved is told here."""
    monkeypatch.syspath_prepend(str(ROOM))
    runpy.run_path(str(ROOM / name), run_name="read")
