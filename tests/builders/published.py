"""Published benchmarks, read where the folder of references is beside the checkout."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.model.assembly import Assembly

FILE = Path(__file__).resolve().parents[2] / "../shared/anchors/benchmarks.json"


@cache
def benchmarks() -> dict[str, dict[str, Any]]:
    """Entries by their ids; the test is skipped where the file is absent."""
    if not FILE.exists():
        pytest.skip(f"no reference values at {FILE}")
    return {entry["id"]: entry for entry in json.loads(FILE.read_text())["benchmarks"]}


def held(assembly: Assembly, *groups: tuple[np.ndarray, tuple[int, ...]]) -> Assembly:
    """The assembly with components held at the rows each mask selects."""
    supports = [
        [row, c] for mask, components in groups for row in np.flatnonzero(mask) for c in components
    ]
    return replace(assembly, supports=np.unique(supports, axis=0))
