"""Samples of a study: lines across axes, points over a parameter, the influence of each."""

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np

from .live_panels import short

Measures = Mapping[str, tuple[np.ndarray, np.ndarray | None]]  # values, half of the interval
MOST = 1000  # samples: a line and a hover text for each


def samples(
    columns: Mapping[str, np.ndarray],
    labels: Mapping[str, str],
    nominal: Mapping[str, float],
    logarithmic: Collection[str] = (),
) -> dict[str, Any]:
    """The first samples, which the drawings of a page share.

    Parameters
    ----------
    columns : {name: (n,)} of parameters and results
    labels : {name: its label}
    nominal : {name: value of the deck}
    logarithmic : names of columns that run over decades
    """
    number = np.arange(len(next(iter(columns.values()))))[:MOST]
    return {
        "number": number,
        "columns": [
            {
                "name": labels[name],
                "values": short(values[:MOST]),
                "log": name in logarithmic,
                "nominal": short(np.array([nominal.get(name, np.nan)]))[0],
            }
            for name, values in columns.items()
        ],
    }


def influences(values: np.ndarray, rows: Sequence[str], columns: Sequence[str]) -> dict[str, Any]:
    """Signed values (rows, columns) as squares."""
    return {"values": [short(row) for row in values], "rows": rows, "columns": columns}


def indices(
    results: Mapping[str, Measures],
    parameters: Sequence[str],
    axis: str,
) -> dict[str, Any]:
    """Measures (d,) of each result with half of their intervals, by result and measure."""
    return {
        "axis": axis,
        "parameters": parameters,
        "results": [
            {
                "name": result,
                "series": [
                    {"name": m, "values": short(v), "half": None if half is None else short(half)}
                    for m, (v, half) in measures.items()
                ],
            }
            for result, measures in results.items()
        ],
    }
