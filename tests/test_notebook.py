"""The notebook runs from top to bottom, and what it says of its results is so."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest
from tests.builders.quick_runs import coarse_pictures

NOTEBOOK = Path(__file__).parents[1] / "docs/first_day.ipynb"


def run(cells, names):
    """Values of the last expression of every code cell, as a notebook would show them."""
    for k, cell in enumerate(cells):
        body = ast.parse("".join(cell["source"]))
        last = body.body.pop() if isinstance(body.body[-1], ast.Expr) else None
        exec(compile(body, f"cell {k + 1}", "exec"), names)
        if last is not None:
            yield eval(compile(ast.Expression(last.value), f"cell {k + 1}", "eval"), names)


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    book = json.loads(NOTEBOOK.read_text(encoding="utf-8"))
    cells = [c for c in book["cells"] if c["cell_type"] == "code"]
    assert not any(c["outputs"] for c in cells), "outputs are not kept in the repository"
    with pytest.MonkeyPatch.context() as patch, coarse_pictures():
        patch.chdir(tmp_path_factory.mktemp("notebook"))
        yield [*run(cells, {})], Path.cwd()


def test_every_cell_shows_what_its_text_says(shown):
    values, folder = shown
    parts, frequency, picture, response, ratio, pairs = values
    assert parts == ["panel", "flanges"]
    assert (np.diff(frequency) > 0).all()
    assert frequency[0] > 1
    assert picture._repr_png_().startswith(b"\x89PNG")
    assert np.isclose(frequency, response[1], rtol=0.02).any(), "a peak is near a mode"
    np.testing.assert_allclose(ratio[:3], 2, rtol=0.1)
    assert (folder / "thick.bdf").is_file()
    off = np.abs(pairs[:, 1] / pairs[:, 0] - 1)
    assert np.median(off) < 0.02
    assert (pairs[:, 2] > 0.5).all()
