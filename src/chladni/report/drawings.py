"""Numbers and names of drawings, packed into a page and read from it again."""

import gzip
import json
import re
from base64 import b64decode, b64encode
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

_NUMBERS = re.compile(r'<script type="text/plain" class="numbers">([A-Za-z0-9+/=]*)</script>')


@dataclass(frozen=True)
class Drawing:
    """Numbers for one function of ``page.js``.

    Attributes
    ----------
    draw : name of the function
    place : section of the page
    data : plain numbers and texts
    instead_of : names of the pictures that stand for it on paper and where no script runs
    caption : str
    """

    draw: str
    place: str
    data: Mapping[str, Any]
    instead_of: Sequence[str] = ()
    caption: str = ""


@dataclass(frozen=True)
class Drawings:
    """All drawings of a page by name, and what they share: the mesh."""

    by_name: Mapping[str, Drawing] = field(default_factory=dict)
    shared: Mapping[str, Any] = field(default_factory=dict)

    def packed(self) -> list[str]:
        """The shared data, then each drawing: words that a browser reads when they are needed."""
        each = ({"name": name, **vars(d)} for name, d in self.by_name.items())
        return [_packed(_json(data)) for data in (self.shared, *each)]


def drawings_of(page: Path) -> Drawings:
    """The drawings of a page that was written before; none where it holds none."""
    try:
        words = _NUMBERS.findall(page.read_text(encoding="utf-8"))
        shared, *each = (json.loads(gzip.decompress(b64decode(word))) for word in words)
        return Drawings({d.pop("name"): Drawing(**d) for d in each}, shared)
    except (OSError, EOFError, ValueError, TypeError, KeyError, AttributeError):
        return Drawings()  # damaged: its pictures stand for them


@cache
def library() -> str:
    """Plotly's script, compressed to 2 MB."""
    script = files("plotly") / "package_data" / "plotly.min.js"
    return _packed(script.read_text(encoding="utf-8"))


def rounded(values: np.ndarray, step: float) -> list[Any]:
    """Values over ``step`` as whole numbers, nan as None: short when compressed."""
    finite = np.isfinite(values)
    whole = np.rint(np.where(finite, values, 0.0) / step).astype(int).astype(object)
    whole[~finite] = None
    return list(whole.tolist())


def _listed(value: Any) -> Any:
    """Arrays as lists."""
    return value.tolist()


def _json(data: Any) -> str:
    return json.dumps(data, default=_listed, allow_nan=False, separators=(",", ":"))


def _packed(text: str) -> str:
    return b64encode(gzip.compress(text.encode(), 6, mtime=0)).decode("ascii")
