"""A chart as a value: series over axes, marks, a matrix; two renderers draw it, none describes it.

:mod:`.chart_png` draws it with matplotlib, :mod:`.chart_page` gives it to Plotly in a page.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, Self

import numpy as np

from ..errors import ShapeError

Shades = tuple[Sequence[int], tuple[float, float]]  # series of each sample, ends of the scale
Ends = tuple[np.ndarray, np.ndarray]
TINTS = {  # name: colour on paper; a page has its own for a light and a dark screen
    "ink": "#111111", "before": "#d55e00", "after": "#0072b2", "calm": "#009e73",
    "neutral": "#0b5b94", "soft": "#8a8f98", "steel": "#aab4bf", "line": "#c9c9c9",
    "found": "#b3261e",
}  # fmt: skip
_TINTS = ("neutral", "before", "calm", "#cc79a7", "#e69f00", "#56b4e9", "soft", "ink")
_DASHES: tuple["Dash", ...] = ("solid", "dash", "dot")
Dash = Literal["solid", "dash", "dot"]


@dataclass(frozen=True, eq=False)
class Series:
    """Values y over x (n,); not finite: a gap."""

    name: str  # in the legend, once for all panels; "": not in it
    x: np.ndarray
    y: np.ndarray
    kind: Literal["line", "points", "both", "bars", "area", "shape"] = "line"
    tint: str = ""  # of TINTS or a colour; "": the next one for its name
    dash: Dash | None = None
    symbol: Literal["circle", "cross", "up", "down", "diamond", "tick", "dot"] = "circle"
    width: float = 1.3  # of a line [points]
    size: float = 5.0  # of a point [points]
    opacity: float = 1.0
    base: np.ndarray | None = None  # (n,) where bars and areas begin; None: at zero
    ends: Ends | None = None  # interval of every value
    lying: bool = False  # True: bars grow along x, and intervals lie along x
    right: bool = False  # True: on the panel's right axis
    tips: Sequence[str] = ()  # words of each point under the pointer
    labels: Sequence[str] = ()  # words at the end of each bar
    values: np.ndarray | None = None  # (n,) shown by the colours of the points
    sample: np.ndarray | None = None  # (n,) number of the sample that a point belongs to
    opens: str = ""  # drawing of the page that a click on a bar opens at its place

    def __post_init__(self) -> None:
        if np.shape(self.x) != np.shape(self.y) or np.ndim(self.x) != 1:
            raise ShapeError(f"{self.name!r}: x is {np.shape(self.x)}, y is {np.shape(self.y)}")


@dataclass(frozen=True)
class ChartAxis:
    """Title with unit, scale and ticks of an axis."""

    title: str = ""
    log: bool = False
    limits: tuple[float, float] | None = None
    zero: bool = False  # True: it begins at zero
    ticks: Mapping[float, str] | None = None  # place: text; None: numbers
    down: bool = False  # True: values grow downwards
    bare: bool = False  # True: no numbers


@dataclass(frozen=True)
class Mark:
    """A line across a panel at a value, or a part of it between two values of the other axis."""

    at: float
    along: Literal["x", "y"] = "y"  # "y": an upright line at x = at
    tint: str = "soft"
    dash: Dash = "solid"
    name: str = ""  # in the legend


@dataclass(frozen=True)
class Note:
    """Words at a place of a panel."""

    x: float
    y: float
    text: str
    lift: int = 0  # 1: a little above the place; -1: below it; 0: over it


@dataclass(frozen=True, eq=False)
class Matrix:
    """Values (rows, columns) as squares, the first row on top."""

    values: np.ndarray
    rows: Sequence[str]
    columns: Sequence[str]
    limits: tuple[float, float]
    title: str = ""  # of the colours
    colours: Literal["Viridis", "RdBu", "Magma"] = "Viridis"
    digits: int | None = None  # after the point, of the number in a square; None: no numbers
    least: float = 0.0  # size from which a square has its number
    tips: Sequence[Sequence[str]] = ()
    frames: Sequence[tuple[int, int]] = ()  # (row, column) with a frame
    # drawing of modes that a click on a square opens, and what its rows and its columns are there
    opens: tuple[str, str, str] | None = None

    def __post_init__(self) -> None:
        due = (len(self.rows), len(self.columns))
        if self.values.shape != due:
            raise ShapeError(f"{self.title or 'matrix'} is {self.values.shape}, labels say {due}")


@dataclass(frozen=True, eq=False)
class Panel:
    """Series on a pair of axes."""

    series: Sequence[Series] = ()
    x: ChartAxis = ChartAxis()
    y: ChartAxis = ChartAxis()
    title: str = ""
    marks: Sequence[Mark] = ()
    grey: Sequence[tuple[float, float]] = ()  # bands of x that were not fitted
    notes: Sequence[Note] = ()
    matrix: Matrix | None = None
    right: ChartAxis | None = None
    equal: bool = False  # True: one unit is as long on both axes
    share: float = 1.0  # of the height, relative to other panels


@dataclass(frozen=True)
class Column:
    """A column of a table of samples: a parameter or a result."""

    name: str
    values: np.ndarray
    log: bool = False
    nominal: float = np.nan


@dataclass(frozen=True, eq=False)
class Chart:
    """Panels from left to right and from top to bottom; ``None`` leaves a place empty.

    Several ``views`` hold panels of the same form: a page shows the chosen one.
    """

    views: Mapping[str, Sequence[Panel | None]]
    columns: int = 1
    one_x: bool = False  # True: panels of a column share the axis x, which the last one names
    size: tuple[float, float] | None = None  # on paper [inches]
    height: float | None = None  # on a page [rem]
    choice: str = ""  # what a view is: "channel"
    marked: Mapping[str, int] = field(default_factory=dict)  # word on a button: its view
    pick: str = ""  # command that a click on a point adds its x to
    table: Sequence[Column] = ()  # columns that a reader may put on the axes
    tints_of: Mapping[str, Shades] = field(default_factory=dict)  # that samples may have, by name

    @classmethod
    def of(cls, *panels: Panel | None, columns: int = 1, **more: object) -> Self:
        """A chart without a choice."""
        return cls({"": panels}, columns, **more)  # type: ignore[arg-type]

    @property
    def panels(self) -> Sequence[Panel | None]:
        """Of the first view."""
        return next(iter(self.views.values()))

    def at(self, view: str) -> Self:
        """One view, its name as the title."""
        first, *rest = self.views[view]
        assert first is not None
        return replace(self, views={"": [replace(first, title=view), *rest]}, choice="", marked={})

    def grid(
        self, views: Sequence[str] = (), columns: int = 2, tile: tuple[float, float] = (4.6, 2.2)
    ) -> Self:
        """The first panels of some or of all views as small pictures, ``tile`` inches each."""
        views = views or list(self.views)
        columns = min(columns, len(views))
        panels = [replace(p, title=v) for v in views if (p := self.views[v][0]) is not None]
        rows = -(-len(panels) // columns)
        size = (tile[0] * columns, tile[1] * rows + 0.5)
        return replace(self.at(views[0]), views={"": panels}, columns=columns, size=size,
                       one_x=False, height=None)  # fmt: skip

    def looks(self) -> Mapping[str, tuple[str, Dash]]:
        """Tint and dash of every name of which no series states its own, in order."""
        names = [s.name for p in self.panels if p for s in p.series if not s.tint]
        return {
            name: (_TINTS[k % len(_TINTS)], _DASHES[k // len(_TINTS) % len(_DASHES)])
            for k, name in enumerate(dict.fromkeys(names))
        }
