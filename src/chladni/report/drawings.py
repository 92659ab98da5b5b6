"""Numbers and names of drawings, packed into a page and read from it again."""

import gzip
import json
import re
from base64 import b64decode, b64encode
from collections.abc import Sequence
from functools import cache, partial
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from ..view.chart import Chart
from ..view.chart_page import page
from .blocks import Drawing, Spatial
from .live_mesh import mesh

_NUMBERS = re.compile(r'<script type="text/plain" class="numbers">([A-Za-z0-9+/=]*)</script>')


def packed(drawn: Sequence[Drawing], shared: Any = None) -> list[str]:
    """The shared data, then each drawing: texts that a browser reads when it needs them.

    ``shared`` is what an earlier page held of it.
    """
    meshes = [d.content.shown for d in drawn if isinstance(d.content, Spatial)]
    own = {"mesh": mesh(meshes[0])} if meshes else shared or {}
    return [_packed(_json(data)) for data in (own, *(_entry(d) for d in drawn))]


def _entry(d: Drawing) -> dict[str, Any]:
    held: Any = d.content
    if isinstance(held, Chart):
        held = {"draw": "chart", **page(held)}
    elif isinstance(held, Spatial):
        held = {"draw": held.draw, "data": held.data}
    about = {"name": d.name, "place": d.place, "caption": d.caption, "wide": d.wide,
             "stills": list(d.pictures)}  # fmt: skip
    return {**held, "about": about}


def drawings_of(path: Path) -> tuple[dict[str, Any], list[Drawing]]:
    """The drawings of a page and the data that they share; empty for a page without drawings."""
    try:
        words = _NUMBERS.findall(path.read_text(encoding="utf-8"))
        shared, *each = (json.loads(gzip.decompress(b64decode(word))) for word in words)
        return shared, [_drawing(held) for held in each]
    except (OSError, EOFError, ValueError, TypeError, KeyError, AttributeError):
        return {}, []  # damaged: its pictures stand for them


def _drawing(held: dict[str, Any]) -> Drawing:
    about = held.pop("about")
    stills = {str(name): partial(_lost, name) for name in about.pop("stills")}
    return Drawing(**about, content={**held, "draw": str(held["draw"])}, stills=stills)


def _lost(name: str, path: Path) -> Path:
    """A page holds no structure to draw again."""
    raise ValueError(f"{name} is drawn by its command alone")


@cache
def library() -> str:
    """Plotly's script, compressed to 2 MB."""
    script = files("plotly") / "package_data" / "plotly.min.js"
    return _packed(script.read_text(encoding="utf-8"))


def _listed(value: Any) -> Any:
    """Arrays as lists."""
    return value.item() if isinstance(value, np.generic) else value.tolist()


def _json(data: Any) -> str:
    return json.dumps(data, default=_listed, allow_nan=False, separators=(",", ":"))


def _packed(text: str) -> str:
    return b64encode(gzip.compress(text.encode(), 6, mtime=0)).decode("ascii")
