"""Mode shapes as a universal file: header, units, nodes, then one dataset 55 for each mode.

Format: SDRC universal file dataset 55, normal modes (analysis type 2) or complex ones (3), three
translations a node in the basic frame; the format keeps six digits.
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
    """Modes, normal or complex, as datasets 151, 164, 2411 and 55; SI.

    Parameters
    ----------
    path : file, replaced if there
    frequency : (r,) [Hz]
    motion : (n, 3, r)     translation of every node in the basic frame [1/√kg], modal masses are 1;
        complex shapes are written with their poles p = ω (-ζ + i √(1 - ζ²))
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
    if np.iscomplexobj(motion):
        kind, numbers = (1, 3, 2, 8, 5, 3), _pole(f, damping)
    else:
        kind, numbers = (1, 2, 2, 8, 2, 3), (f, 1.0, damping, 0.0)
    # structural, analysis, three translations, displacement, real or complex
    lines.append("".join(f"{v:10d}" for v in kind))
    lines.append("".join(f"{v:10d}" for v in (2, len(numbers), 1, number)))  # integers, reals
    lines.append("".join(f"{v:13.5e}" for v in numbers))
    parts = np.ascontiguousarray(motion).view(float) if np.iscomplexobj(motion) else motion
    rows = np.column_stack([ids.astype(float), parts])
    row = "%10d\n" + parts.shape[1] * "%13.5e" + "\n"
    body = (row * len(rows)) % tuple(rows.ravel())
    return ("\n".join(lines) + "\n" + body + f"{'    -1':80}\n").encode()


def _pole(f: float, damping: float) -> tuple[float, ...]:
    """Pole p, modal A = 2i Im p and modal B = -A p of a shape of modal mass 1, as real numbers."""
    p = 2 * np.pi * f * (-damping + 1j * np.sqrt(1 - damping**2))
    a = 2j * p.imag
    return tuple(float(x) for z in (p, a, -a * p) for x in (z.real, z.imag))
