"""Universal files as other programs write them, line by line from the SDRC text of the format.

Neither our writer nor pyuff has a part in it: records 1 to 13 of dataset 58 are put together from
their Fortran formats here.
"""

import re
from collections.abc import Sequence

import numpy as np

F = np.array([10.0, 11.5, 13.0, 14.5, 16.0, 17.5, 19.0])  # [Hz]
H = np.exp(1j * np.arange(7)) * (1.0 + np.arange(7))


def fortran(x: float, width: int, digits: int, letter: str = "E") -> str:
    """1PEw.d: the exponent loses its letter where it has three digits, as Fortran does."""
    if not np.isfinite(x):
        return f"{x!s:>{width}}"
    text = f"{x:.{digits}E}"
    mantissa, exponent = text.split("E")
    sign, size = exponent[0], int(exponent[1:])
    tail = f"{letter}{sign}{size:02d}" if size < 100 else f"{sign}{size:03d}"
    return f"{mantissa.strip() + tail:>{width}}"


def values(x: np.ndarray, y: np.ndarray, even: bool, double: bool, letter: str = "E") -> list[str]:
    """Record 12: 6E13.5, 4E20.12, or abscissas in E13.5 before values in either."""
    cells = []
    for a, b in zip(x, y, strict=True):
        pair = [b.real, b.imag] if np.iscomplexobj(y) else [b]
        cells += [] if even else [fortran(a, 13, 5, letter)]
        cells += [fortran(v, 20, 12, letter) if double else fortran(v, 13, 5, letter) for v in pair]
    width = len(cells) // len(x)
    per_line = {(True, False): 6, (False, False): 6}.get((even, double), 4 if even else 2 * width)
    if double and not even:
        per_line = width if np.iscomplexobj(y) else 2 * width
    return ["".join(cells[k : k + per_line]) for k in range(0, len(cells), per_line)]


def function(
    x: np.ndarray = F, y: np.ndarray = H, *, response: tuple[int, int] = (1, 3),
    reference: tuple[int, int] = (2, 3), even: bool = True, double: bool = False, kind: int = 4,
    names: tuple[str, str] = ("NONE", "NONE"), title: Sequence[str] = ("NONE",) * 5,
    numerator: tuple[int, str] = (12, "NONE"), denominator: tuple[int, str] = (13, "NONE"),
    abscissa: tuple[int, str] = (18, "NONE"), letter: str = "E", count: int | None = None,
) -> list[str]:  # fmt: skip
    """Dataset 58 as lines, its end marks with it."""
    real = not np.iscomplexobj(y)
    code = {(True, False): 2, (True, True): 4, (False, False): 5, (False, True): 6}[real, double]
    start, step = (x[0], x[1] - x[0]) if even else (0.0, 0.0)
    lines = ["    -1", "    58", *title]
    lines.append(
        f"{kind:5d}{1:10d}{0:5d}{0:10d} {names[0]:>10}{response[0]:10d}{response[1]:4d}"
        f" {names[1]:>10}{reference[0]:10d}{reference[1]:4d}"
    )
    n = len(x) if count is None else count
    lines.append(
        f"{code:10d}{n:10d}{int(even):10d}" + "".join(fortran(v, 13, 5) for v in (start, step, 0.0))
    )
    for data_type, unit in (abscissa, numerator, denominator, (0, "NONE")):
        lines.append(f"{data_type:10d}{0:5d}{0:5d}{0:5d} {'NONE':>20} {unit:>20}")
    return [*lines, *values(x, y, even, double, letter), "    -1"]


def units(code: int, length: float, force: float, letter: str = "D") -> list[str]:
    """Dataset 164: I10, 20A1, I10, then 3D25.17 and D25.17."""
    row = "".join(fortran(v, 25, 17, letter) for v in (length, force, 1.0))
    return ["    -1", "   164", f"{code:10d}{'some units':20}{2:10d}", row,
            fortran(0.0, 25, 17, letter), "    -1"]  # fmt: skip


def nodes(places: dict[int, tuple[float, float, float]], letter: str = "D") -> list[str]:
    """Dataset 2411: 4I10, then 1P3D25.16."""
    lines = ["    -1", "  2411"]
    for node, place in places.items():
        lines.append(f"{node:10d}{1:10d}{1:10d}{11:10d}")
        lines.append("".join(fortran(v, 25, 16, letter) for v in place))
    return [*lines, "    -1"]


def old_nodes(places: dict[int, tuple[float, float, float]]) -> list[str]:
    """Dataset 15: 4I10, 1P3E13.5."""
    rows = (
        f"{n:10d}{0:10d}{0:10d}{8:10d}" + "".join(fortran(v, 13, 5) for v in x)
        for n, x in places.items()
    )
    return ["    -1", "    15", *rows, "    -1"]


def other(code: int, *lines: str) -> list[str]:
    """Any other dataset."""
    return ["    -1", f"{code:6d}", *lines, "    -1"]


def file(*datasets: list[str], end: str = "\n", last: str = "\n") -> bytes:
    """Lines as bytes of Latin-1."""
    lines = [line for dataset in datasets for line in dataset]
    return (end.join(lines) + last).encode("latin-1")


def strict(text: str) -> list[dict]:
    """Datasets 58 of a file by the columns of their Fortran formats, as a strict reader does."""
    parts, found = re.split(r"(?m)^    -1 *\n", text), []
    for part in parts:
        lines = part.split("\n")
        if lines[0].rstrip() != "    58":
            continue
        six, seven = lines[6:8]
        code, count, even = (int(seven[k : k + 10]) for k in (0, 10, 20))
        start, step = (float(seven[k : k + 13]) for k in (30, 43))
        width, body = (20 if code in (4, 6) else 13), "".join(lines[12:])
        size = (1 if code in (2, 4) else 2) * width + (0 if even else 13)
        x, y = [], []
        for k in range(count):
            row = body[k * size : (k + 1) * size]
            x.append(start + k * step if even else float(row[:13]))
            cells = row[0 if even else 13 :]
            y.append([float(cells[j : j + width]) for j in range(0, len(cells), width)])
        found.append({
            "function": int(six[0:5]), "response": (int(six[41:51]), int(six[51:55])),
            "reference": (int(six[66:76]), int(six[76:80])), "x": np.array(x), "y": np.array(y),
            "types": [int(line[:10]) for line in lines[8:11]],
        })  # fmt: skip
    return found
