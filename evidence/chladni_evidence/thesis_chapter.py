"""A chapter of the thesis retold: sections, numbers and files, kept between interrupted runs."""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from chladni.errors import FileError
from chladni.output import own_version, write_json
from chladni.progress import Progress, within
from chladni.report.blocks import (
    Block,
    Drawing,
    Facts,
    Items,
    Picture,
    Section,
    Table,
    Text,
    write_pictures,
)

SETTINGS = "settings.json"
_BLOCKS = {kind.__name__.lower(): kind for kind in (Text, Items, Facts, Table, Picture)}


@dataclass(frozen=True)
class Chapter:
    """Part of the page of the thesis."""

    lead: str  # its result in one sentence
    # blocks of words, numbers and pictures; pictures lie in the folder of the chapters
    sections: tuple[Section, ...]
    numbers: Mapping[str, Any]  # the same for other programs
    files: tuple[tuple[str, str], ...] = ()  # (name, description) in that folder


@dataclass(frozen=True)
class StoryStep:
    """A chapter to be made: its name, a title in words, the work."""

    name: str
    title: str
    work: Callable[[Progress], Chapter]


@dataclass(frozen=True)
class ChapterStore:
    """Folder of finished chapters, one JSON file each, with decks and pictures."""

    folder: Path
    # of the run; chapters of other settings are refused
    settings: Mapping[str, Any] = field(default_factory=dict)

    def open(self) -> None:
        """Make the folder, or continue an interrupted run of the same settings.

        Raises
        ------
        FileError
            If the folder holds chapters of other settings or of another version.
        """
        path, mine = self.folder / SETTINGS, {**self.settings, "version": own_version()}
        if not path.is_file():
            write_json(path, mine)
            return
        theirs = json.loads(path.read_text(encoding="utf-8"))
        unlike = [name for name in mine if theirs.get(name) != mine[name]]
        if unlike:
            name = unlike[0]
            raise FileError(
                f"{self.folder} holds chapters with {name} {theirs.get(name)!r}, not "
                f"{mine[name]!r}; give another --out, or delete the folder"
            )

    def kept(self, name: str) -> Chapter | None:
        """Read a chapter of an earlier run; None if it is not finished."""
        path = self.folder / f"{name}.json"
        if not path.is_file():
            return None
        data = json.loads(path.read_text(encoding="utf-8"))
        sections = tuple(
            Section(s["title"], [_block(b, self.folder) for b in s["blocks"]])
            for s in data["sections"]
        )
        files = tuple((name, what) for name, what in data["files"])
        return Chapter(data["lead"], sections, data["numbers"], files)

    def keep(self, name: str, chapter: Chapter) -> Chapter:
        """Write a finished chapter; return it as it will be read again."""
        sections = [
            {"title": s.title, "blocks": [_plain(b) for b in _still(s.blocks, self.folder)]}
            for s in chapter.sections
        ]
        data = {"lead": chapter.lead, "sections": sections, "numbers": chapter.numbers,
                "files": chapter.files}  # fmt: skip
        write_json(self.folder / f"{name}.json", data)
        found = self.kept(name)
        assert found is not None
        return found

    def run(
        self, steps: Sequence[StoryStep], say: Callable[[str], None], progress: Progress
    ) -> dict[str, Chapter]:
        """Make all chapters in order, or take them from an earlier run."""
        self.open()
        out = {}
        for k, step in enumerate(steps):
            found = self.kept(step.name)
            note = " (kept from an earlier run)" if found else ""
            if found is None:
                stage = within(progress, k / len(steps), (k + 1) / len(steps))
                stage(step.title, 0.0)
                found = self.keep(step.name, step.work(stage))
            say(f"{step.title}{note}: {found.lead}")
            out[step.name] = found
        return out


def _still(blocks: Sequence[Block], folder: Path) -> Iterator[Block]:
    """The blocks, with pictures in place of drawings by the page."""
    for block in blocks:
        if isinstance(block, Drawing):
            names = [name for name, _ in write_pictures(folder, [block], True)]
            yield from (Picture(folder / name, block.caption) for name in names)
        else:
            yield block


def _plain(block: Block) -> dict[str, Any]:
    """A block as JSON; a picture by its name in the folder."""
    if isinstance(block, Picture):
        block = replace(block, path=Path(block.path.name))
    return {"kind": type(block).__name__.lower(), **asdict(block)}


def _block(data: Mapping[str, Any], folder: Path) -> Block:
    """A block as :func:`_plain` wrote it."""
    values = dict(data)
    kind = _BLOCKS[values.pop("kind")]
    if kind is Picture:
        values["path"] = folder / values["path"]
    made: Block = kind(**values)
    return made
