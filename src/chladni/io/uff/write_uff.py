"""Universal files out: header, units, nodes, then one dataset 58 for each FRF and coherence.

The text of dataset 58 is laid out here because pyuff's own writer takes quadratic time in the
number of records, keeps six digits of an uneven abscissa and raises on an optional key left out.
Format: SDRC universal file dataset 58; columns stay apart by a blank, so that readers by column
and readers by blanks both find the numbers.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ...arguments import checked
from ...dofs import parse
from ...dynamics.frf import FRF
from ...errors import FileError, LabelError
from ...output import atomic
from .uff_function import Axis, FunctionSet

NEWTON = Axis(13, "N")
MOTION = {
    "receptance": Axis(8, "m"),
    "mobility": Axis(11, "m/s"),
    "accelerance": Axis(12, "m/s^2"),
    "transmissibility": Axis(12, "m/s^2"),
}


@checked
def write_uff(
    path: str | Path,
    frf: FRF,
    nodes: Mapping[int, np.ndarray] | None = None,
    title: str = "NONE",
    binary: bool = False,
) -> None:
    """FRF (and coherence) as datasets 151, 164, 2411 and 58, or 58b where ``binary``; SI.

    Text keeps 13 digits of the values and 8 of the frequencies, 58b keeps every bit.

    Parameters
    ----------
    path : file, replaced if there
    frf : FRF          labels as 412:+Z; 412:n is written as a scalar, base:+Z as node 0
    nodes : {node: (3,)}  places [m]
    """
    write_sets(path, nodes or {}, title, _blocks(frf, uff_text(title), binary))


def uff_text(name: str) -> str:
    """A name as a file can hold it: bytes that are no UTF-8 become question marks."""
    return name.encode("utf-8", "replace").decode()


def write_sets(
    path: str | Path, nodes: Mapping[int, np.ndarray], title: str, blocks: Iterable[bytes]
) -> Path:
    """Header, units and nodes, then these datasets; a file that is there is replaced at the end."""

    def write(part: Path) -> None:
        part.unlink()  # pyuff writes into files of its own
        _write_head(part, nodes, uff_text(title))
        with part.open("ab") as file:
            file.writelines(blocks)

    return atomic(path, write)


def _write_head(path: Path, nodes: Mapping[int, np.ndarray], title: str) -> None:
    """Header, units and nodes, in pyuff's hand."""
    import pyuff

    program = {"db_app": "chladni", "program": "chladni"}
    degrees = {"temp_mode": 1, "temp": 1.0, "temp_offset": 273.15}
    sets: list[dict[str, Any]] = [
        {"type": 151, "model_name": title, "description": "NONE", **program},
        {"type": 164, "units_code": 1, "units_description": "SI", "length": 1.0, "force": 1.0,
         **degrees},
    ]  # fmt: skip
    if nodes:
        (x, y, z), zero = np.array(list(nodes.values()), float).T, np.zeros(len(nodes), int)
        frame = {"def_cs": zero, "disp_cs": zero, "color": zero + 1}
        sets.append({"type": 2411, "node_nums": np.array(list(nodes)), "x": x, "y": y, "z": z,
                     **frame})  # fmt: skip
    pyuff.UFF(str(path)).write_sets(sets, mode="add")


def _blocks(frf: FRF, title: str, binary: bool) -> Iterator[bytes]:
    """One dataset 58 a channel, then its coherence."""
    ordinate = MOTION[frf.quantity]
    denominator = ordinate if frf.quantity == "transmissibility" else NEWTON
    for j, input in enumerate(frf.inputs):
        for i, output in enumerate(frf.outputs):
            H = FunctionSet(
                function=4,
                response=uff_code(output),
                reference=uff_code(input),
                due=len(frf.frequency),
                x=frf.frequency,
                y=frf.values[:, i, j],
                abscissa=Axis(18, "Hz"),
                ordinate=ordinate,
                denominator=denominator,
            )
            yield _encoded(H, title, binary)
            if frf.coherence is not None:
                gamma = replace(
                    H, function=6, y=frf.coherence[:, i, j], ordinate=Axis(), denominator=Axis()
                )
                yield _encoded(gamma, title, binary)


def uff_code(dof: str) -> tuple[int, int]:
    """(node, direction code) of a label."""
    node, _, axis_text = dof.partition(":")
    try:
        if node == "base":
            return 0, parse(f"1:{axis_text}")[1] * parse(f"1:{axis_text}")[2]
        if axis_text == "n":
            return int(node), 0
        point, component, sign = parse(dof)
    except (LabelError, ValueError) as error:
        raise FileError(f"label {dof!r} has no place in a universal file: {error}") from error
    return point, component * sign


def _encoded(record: FunctionSet, title: str, binary: bool) -> bytes:
    """One record: head, numbers, end mark."""
    x, y = record.x, record.y
    even = _even(x) and not binary
    head = head_records(record, title, even)
    if not binary:
        return (f"    -1\n    58{'':74}\n" + head + _text(x, y, even)).encode()
    return binary_set(head, _columns(x, y).astype("<f8").tobytes())


def binary_set(head: str, bits: bytes) -> bytes:
    """A dataset 58b between its marks."""
    kind = f"    58b{1:6d}{2:6d}"  # little-endian, IEEE
    mark = f"{kind}{11:12d}{len(bits):12d}{0:6d}{0:6d}{0:12d}{0:12d}\n"
    return (f"    -1\n{mark}" + head).encode() + bits + b"    -1\n"


def head_records(record: FunctionSet, title: str, even: bool, single: bool = False) -> str:
    """Records 1 to 11; ``single``: real numbers of single precision, in place of double."""
    (out, out_axis), (ref, ref_axis) = record.response, record.reference
    f, kind = record.x, 6 if np.iscomplexobj(record.y) else 2 if single else 4
    start, step = (f[0], (f[-1] - f[0]) / (len(f) - 1)) if even else (0.0, 0.0)
    lines = [f"{title[:80]:80}"] + [f"{'NONE':80}"] * 4
    lines += [
        f"{record.function:5d}{0:10d}{0:5d}{0:10d} {'NONE':10}{out:10d}{out_axis:4d} {'NONE':10}"
        f"{ref:10d}{ref_axis:4d}",
        f"{kind:10d}{len(f):10d}{int(even):10d}{start:13.5e}{step:13.5e}{0:13.5e}",
    ]
    names = ("Time" if record.abscissa.kind == 17 else "Frequency", "NONE", "NONE", "NONE")
    axes = (record.abscissa, record.ordinate, record.denominator, Axis())
    for name, axis in zip(names, axes, strict=True):
        lines.append(f"{axis.kind:10d}{0:5d}{0:5d}{0:5d} {name:20} {axis.unit:20}")
    return "\n".join(lines) + "\n"


def _even(f: np.ndarray) -> bool:
    """Whether first line and step, in the six digits the head has, give every line back."""
    if len(f) < 2:
        return False
    step = (f[-1] - f[0]) / (len(f) - 1)
    start, step = float(f"{f[0]:13.5e}"), float(f"{step:13.5e}")
    return bool(np.allclose(start + step * np.arange(len(f)), f, rtol=1e-12, atol=0.0))


def _columns(f: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Abscissa, real part and, where complex, imaginary part of every line."""
    parts = (f, y.real, y.imag) if np.iscomplexobj(y) else (f, y)
    return np.column_stack(parts)


def _text(f: np.ndarray, y: np.ndarray, even: bool) -> str:
    """Record 12 in double precision: 4E20.12, E13.5 2E20.12 or 2(E13.5 E20.12)."""
    table = _columns(f, y)
    if even:
        row, flat = ("%20.12e",) * 4, table[:, 1:].ravel()
    else:
        row, flat = ("%13.7e", *("%20.12e",) * (table.shape[1] - 1)), table.ravel()
        row = row * 2 if len(row) == 2 else row
    whole, rest = divmod(len(flat), len(row))
    form = ("".join(row) + "\n") * whole + "".join(row[:rest]) + "\n" * bool(rest)
    return form % tuple(flat) + "    -1\n"
