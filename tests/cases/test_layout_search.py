"""The worked example of a layout search: short, and ending where theory says."""

import importlib.util
from pathlib import Path

from chladni.io.nastran import write_assembly
from chladni_specimens.plates import folded_panel

SCRIPT = Path(__file__).with_name("layout_search.py")


def test_layout_search(tmp_path):
    """What a user writes: at most thirty lines; random < EFI <= exchange."""
    lines = [line for line in SCRIPT.read_text().splitlines() if line.strip()]
    assert len(lines) <= 30
    spec = importlib.util.spec_from_file_location("layout_search", SCRIPT)
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    deck = write_assembly(folded_panel(), tmp_path / "panel.bdf")
    score = script.search(str(deck))
    assert score["random"] < score["effective independence"] <= score["exchange"] + 1e-9
