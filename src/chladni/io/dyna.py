"""Formed thickness in and out: LS-DYNA keyword files.

A forming simulation hands over *NODE and *ELEMENT_SHELL_THICKNESS, two lines an element (LS-DYNA
Keyword User's Manual, Vol. I). Shells without thicknesses of their own take their section's.
Everything is converted to SI here.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import numpy as np

from ..errors import FileError
from ..geometry.cells import contradicted
from ..geometry.formed_mesh import FormedMesh
from ..output import write_text
from ..units import Units
from ..units import units as units_named
from .file_size import refuse_large, refuse_outside

_WIDTHS = {"": (8, 16), "%": (10, 16), "+": (20, 20)}  # integers and reals of each format


@dataclass
class KeywordBlock:
    """One keyword with its data lines and their numbers."""

    keyword: str
    form: str
    source: Path
    lines: list[str] = field(default_factory=list)
    at: list[int] = field(default_factory=list)

    @property
    def widths(self) -> tuple[int, int]:
        """Columns of an integer and of a real number."""
        return _WIDTHS[self.form]

    def fault(self, row: int, what: str) -> FileError:
        """An error in a data line."""
        return FileError(f"{self.source}, line {self.at[row]}: {what} in *{self.keyword}")


def keyword_blocks(path: Path, above: tuple[Path, ...] = ()) -> Iterator[KeywordBlock]:
    """The keyword blocks of a file and of those it includes; ``above`` includes this one."""
    above = (*above, path.resolve())
    try:
        refuse_large(path)
        text = path.read_text(encoding="latin-1")
    except OSError as error:
        raise FileError(f"{path} cannot be read: {error.strerror}") from error
    form, block = "", None
    for number, line in enumerate(text.splitlines(), start=1):
        if line.startswith("$"):
            continue
        if line.startswith("*"):
            if block is not None:
                yield from _resolved(block, above)
            name = line[1:].split()[0].upper() if line[1:].split() else ""
            if name == "END":
                return
            if name == "KEYWORD":
                form = _format(line.upper(), form)
            here = name[-1] if name[-1:] in ("%", "+") else form
            block = KeywordBlock(name.rstrip("%+-"), "" if name.endswith("-") else here, path)
        elif block is not None:
            block.lines.append(line)
            block.at.append(number)
    if block is not None:
        yield from _resolved(block, above)


def _format(line: str, default: str) -> str:
    if "LONG=Y" in line or "LONG=S" in line:
        return "+"
    return "%" if "I10=Y" in line else default


def _resolved(block: KeywordBlock, above: tuple[Path, ...]) -> Iterator[KeywordBlock]:
    """The block itself, or the blocks of the file it includes."""
    if block.keyword != "INCLUDE":
        yield block
        return
    for row, line in enumerate(block.lines):
        if line.strip():
            other = block.source.parent / line.strip()
            refuse_outside(other, f"{block.source}, line {block.at[row]}: INCLUDE ")
            if not other.is_file():
                raise block.fault(row, f"no file {line.strip()!r}")
            if other.resolve() in above:
                raise block.fault(row, f"{line.strip()!r} includes itself")
            yield from keyword_blocks(other, above)


def table(block: KeywordBlock, rows: np.ndarray, widths: Sequence[int], kind: type) -> np.ndarray:
    """The fields of some lines as numbers (n, fields); blank is zero."""
    lines = [block.lines[r] for r in rows]
    if any("," in line for line in lines):
        words = np.array([_split(line, widths) for line in lines], dtype="U32")
    else:
        edges = np.r_[0, np.cumsum(widths)]
        wide = np.array([line.ljust(edges[-1])[: edges[-1]] for line in lines], dtype="U")
        chars = wide.view("U1").reshape(len(lines), edges[-1])
        columns = [
            np.ascontiguousarray(chars[:, a:b]).view(f"U{b - a}") for a, b in pairwise(edges)
        ]
        words = np.char.strip(np.column_stack([c.ravel().astype("U32") for c in columns]))
    words[words == ""] = "0"
    try:
        values: np.ndarray = words.astype(kind)
        if np.isfinite(values).all() and _plain("".join(words.ravel())):
            return values
    except (ValueError, OverflowError):
        pass
    row, word = _first_bad(words, kind)
    raise block.fault(int(rows[row]), f"{word!r} is not a number")


def _split(line: str, widths: Sequence[int]) -> list[str]:
    """Fields of one line, free where it has commas, else fixed."""
    if "," in line:
        cells = [c.strip() for c in line.split(",")][: len(widths)]
        return cells + [""] * (len(widths) - len(cells))
    edges = np.r_[0, np.cumsum(widths)].tolist()
    return [line[a:b].strip() for a, b in pairwise(edges)]


def _plain(word: str) -> bool:
    """False for digits with underscores or of other scripts, which Python takes for a number."""
    return word.isascii() and "_" not in word


def _first_bad(words: np.ndarray, kind: type) -> tuple[int, str]:
    for row, line in enumerate(words):
        for word in line:
            try:
                bad = not (_plain(word) and np.isfinite(np.array([word]).astype(kind)[0]))
            except (ValueError, OverflowError):
                bad = True
            if bad:
                return row, str(word)
    return 0, str(words[0, 0])


def nodes_of(blocks: list[KeywordBlock]) -> tuple[np.ndarray, np.ndarray]:
    """Ids (n,) and places (n, 3) of all *NODE lines, by increasing id."""
    ids, places, lines = [np.zeros(0, np.int64)], [np.zeros((0, 3))], []
    for block in blocks:
        if block.keyword == "NODE" and block.lines:
            whole, real = block.widths
            rows = np.arange(len(block.lines))
            values = table(block, rows, (whole, real, real, real), float)
            ids.append(values[:, 0].astype(np.int64))
            places.append(values[:, 1:])
            lines.append((block, rows))
    every, xyz = np.concatenate(ids), np.vstack(places)
    first = _first_of_each(every, xyz, lines, "node")
    return every[first], xyz[first]


def _first_of_each(
    ids: np.ndarray, values: np.ndarray, lines: list[tuple[KeywordBlock, np.ndarray]], what: str
) -> np.ndarray:
    """Where each id stands first; what an include repeats is the same, all else is refused."""
    _, first, which = np.unique(ids, return_index=True, return_inverse=True)
    for k in contradicted(values, first[which])[:1]:
        (block, row), (other, before) = _at(lines, int(k)), _at(lines, int(first[which[k]]))
        where = f"line {other.at[before]} of {other.source.name}"
        raise block.fault(row, f"{what} {ids[k]} occurs twice, with other values in {where},")
    return first


def _at(lines: list[tuple[KeywordBlock, np.ndarray]], k: int) -> tuple[KeywordBlock, int]:
    """Block and row of the k-th of all that was read."""
    for block, rows in lines:
        if k < len(rows):
            return block, int(rows[k])
        k -= len(rows)
    raise IndexError(k)


def shells_of(blocks: list[KeywordBlock]) -> tuple[np.ndarray, np.ndarray]:
    """(n, 6) id, part, four node ids and (n, 4) thickness, zero where the section's holds."""
    found, thickness, lines = [np.zeros((0, 6), np.int64)], [np.zeros((0, 4))], []
    for block in blocks:
        if not block.keyword.startswith("ELEMENT_SHELL") or not block.lines:
            continue
        options, (whole, real) = block.keyword.split("_")[2:], block.widths
        cards = 1 + ("THICKNESS" in options or "BETA" in options) + ("OFFSET" in options)
        if len(block.lines) % cards:
            raise block.fault(-1, f"{len(block.lines)} lines are not {cards} per element")
        first = np.arange(0, len(block.lines), cards)
        values = table(block, first, (whole,) * 10, int)
        if np.any(higher := values[:, 6:].any(axis=1)):
            raise block.fault(int(first[higher][0]), "a shell with mid-side nodes")
        found.append(values[:, :6])
        has = "THICKNESS" in block.keyword
        t = table(block, first + 1, (real,) * 4, float) if has else np.zeros((len(first), 4))
        thickness.append(t)
        lines.append((block, first))
    shells, t = np.vstack(found), np.vstack(thickness)
    once = np.sort(_first_of_each(shells[:, 0], np.hstack([shells, t]), lines, "shell"))
    return shells[once], t[once]


def parts_of(blocks: list[KeywordBlock]) -> tuple[dict[int, str], dict[int, int]]:
    """Title and section of each part."""
    names, sections = {}, {}
    for block in blocks:
        if block.keyword == "PART":
            for k in range(0, len(block.lines) - 1, 2):
                id_, section = table(block, np.array([k + 1]), (10, 10), int)[0].tolist()
                names[id_], sections[id_] = block.lines[k].strip(), section
    return names, sections


def section_thickness(blocks: list[KeywordBlock]) -> dict[int, float]:
    """Thickness at the first node of every shell section."""
    out = {}
    for block in blocks:
        if block.keyword.startswith("SECTION_SHELL"):
            titled = block.keyword.endswith("TITLE")
            cards = 3 if titled else 2
            for k in range(int(titled), len(block.lines) - 1, cards):
                id_ = int(table(block, np.array([k]), (10,), int)[0, 0])
                out[id_] = float(table(block, np.array([k + 1]), (10,), float)[0, 0])
    return out


def read_keyword(path: Path | str, units: str | Units = "mm-t-s") -> FormedMesh:
    """Nodes, shells and their thickness of an LS-DYNA keyword file, in SI."""
    path, unit = Path(path), units_named(units)
    blocks = list(keyword_blocks(path))
    ids, places = nodes_of(blocks)
    shells, t = shells_of(blocks)
    if not len(ids) or not len(shells):
        raise FileError(f"{path} has {len(ids)} nodes and {len(shells)} shells; both are needed")
    nodes = shells[:, 2:].copy()
    nodes[:, 3] = np.where(nodes[:, 3] == 0, nodes[:, 2], nodes[:, 3])
    rows = np.minimum(np.searchsorted(ids, nodes), len(ids) - 1)
    if np.any(lost := (ids[rows] != nodes).any(axis=1)):
        raise FileError(f"{path}: shell {shells[lost][0, 0]} names a node that is not in *NODE")
    names, sections = parts_of(blocks)
    t = _with_sections(path, shells, t, sections, section_thickness(blocks))
    return FormedMesh(ids, places * unit.length, rows, shells[:, 1], t * unit.length, names)


def _with_sections(
    path: Path,
    shells: np.ndarray,
    t: np.ndarray,
    sections: dict[int, int],
    gauges: dict[int, float],
) -> np.ndarray:
    """Thickness (n, 4) with a section's where the element has none."""
    gauge = np.array([gauges.get(sections.get(int(p), -1), 0.0) for p in shells[:, 1]])
    t = np.where(t > 0, t, gauge[:, None])
    if np.any(bare := (t <= 0).any(axis=1)):
        raise FileError(
            f"{path}: shell {shells[bare][0, 0]} ({bare.sum()} in all) has neither a thickness "
            "nor a *SECTION_SHELL"
        )
    return t


def write_keyword(path: Path | str, mesh: FormedMesh, units: str | Units = "mm-t-s") -> Path:
    """Write *NODE, *PART and *ELEMENT_SHELL_THICKNESS, to 0.1 µm in mm."""
    unit = units_named(units)
    return write_text(path, "\n".join(_keyword_lines(mesh, unit)) + "\n")


def _keyword_lines(mesh: FormedMesh, unit: Units) -> Iterator[str]:
    yield "*KEYWORD"
    yield f"$ unit system {unit.name}"
    for id_, name in sorted(mesh.names.items()):
        yield f"*PART\n{name}\n{id_:10d}{id_:10d}{0:10d}"
    yield "*NODE"
    digits = max(0, int(np.ceil(np.log10(unit.length / 1e-7) - 1e-9)))
    for id_, (x, y, z) in zip(mesh.ids.tolist(), (mesh.points / unit.length).tolist(), strict=True):
        yield f"{id_:8d}{x:16.{digits}f}{y:16.{digits}f}{z:16.{digits}f}"
    yield "*ELEMENT_SHELL_THICKNESS"
    ids = mesh.ids[mesh.cells].tolist()
    rows = zip(mesh.part.tolist(), ids, (mesh.thickness / unit.length).tolist(), strict=True)
    for k, (part, nodes, t) in enumerate(rows, start=1):
        yield f"{k:8d}{part:8d}" + "".join(f"{n:8d}" for n in nodes)
        yield "".join(f"{v:16.{digits}f}" for v in t)
    yield "*END"
