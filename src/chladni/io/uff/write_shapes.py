"""Mode shapes as a universal file: header, units, nodes, then one dataset 55 for each mode.

Format: SDRC universal file dataset 55, normal modes (analysis type 2), three translations a node
in the basic frame; the format keeps six digits.
"""

from pathlib import Path

import numpy as np

from ...arguments import checked
from .write_uff import uff_text, write_sets


@checked
def write_shapes(
    path: str | Path,
    frequency: np.ndarray,
    motion: np.ndarray,
    ids: np.ndarray,
    places: np.ndarray,
    damping: float = 0.0,
    title: str = "NONE",
) -> Path:
    """Normal modes as datasets 151, 164, 2411 and 55; SI.

    Parameters
    ----------
    path : file, replaced if there
    frequency : (r,) [Hz]
    motion : (n, 3, r)     translation of every node in the basic frame [1/√kg], modal masses are 1
    ids, places : (n,), (n, 3) [m]
    damping : fraction of critical of every mode
    title : first line of the header
    """
    nodes = dict(zip(ids.tolist(), places, strict=True))
    shapes = (
        _shape(k + 1, float(f), damping, ids, motion[:, :, k], uff_text(title))
        for k, f in enumerate(frequency)
    )
    return write_sets(path, nodes, title, shapes)


def _shape(
    number: int, f: float, damping: float, ids: np.ndarray, motion: np.ndarray, title: str
) -> bytes:
    """One dataset 55."""
    lines = [f"{'    -1':80}", f"{'    55':80}", f"{title[:80]:80}", *(4 * [f"{'NONE':80}"])]
    kind = (1, 2, 2, 8, 2, 3)  # structural, normal mode, three translations, displacement, real
    lines.append("".join(f"{v:10d}" for v in kind))
    lines.append("".join(f"{v:10d}" for v in (2, 4, 1, number)))  # 2 integers, 4 reals follow
    lines.append("".join(f"{v:13.5e}" for v in (f, 1.0, damping, 0.0)))
    rows = np.column_stack([ids.astype(float), motion])
    body = ("%10d\n%13.5e%13.5e%13.5e\n" * len(rows)) % tuple(rows.ravel())
    return ("\n".join(lines) + "\n" + body + f"{'    -1':80}\n").encode()
