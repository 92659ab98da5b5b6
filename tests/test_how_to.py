"""What the documents name is there: a how-to that points at nothing stops whoever follows it."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PLACES = (ROOT, ROOT / "src/chladni")


@pytest.mark.parametrize("name", ["docs/extending.md", "docs/architecture.md", "CONTRIBUTING.md"])
def test_every_path_is_there(name):
    """`view/plots.py` and the like, from the root or from the package."""
    text = re.sub(r"```.*?```", "", (ROOT / name).read_text(encoding="utf-8"), flags=re.DOTALL)
    paths = re.findall(r"`((?:[\w.]+/)+[\w.]*)`", text)
    assert paths
    assert not [p for p in paths if not any((place / p).exists() for place in PLACES)]


def test_every_table_it_speaks_of_is_there():
    """`PLOTS` of `tests/view/test_plots.py`."""
    text = (ROOT / "docs/extending.md").read_text(encoding="utf-8")
    named = re.findall(r"`([A-Z_]+)` of\s+`([\w./]+)`", text)
    assert named
    for table, path in named:
        file = next(place / path for place in PLACES if (place / path).exists())
        assert re.search(rf"^{table}\b.* = ", file.read_text(), re.MULTILINE), f"{table} in {path}"
