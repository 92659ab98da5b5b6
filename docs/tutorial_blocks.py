"""The blocks of a tutorial: run one after another in a folder of their own, and shown.

- ``sh`` runs in Bash. The word ``exit=2`` states the exit code of its last command; 0 without it.
- A block with the word ``file=NAME`` is written to that file.
- Every other block is only shown.

A picture whose path begins with the folder of the runs is made by a block above it; one that ends
with ``.html.png`` is a photograph of a page. A build that has not run the blocks shows the small
pictures of ``docs/pictures``. A page that needs data from outside of the repository names their
folder in its first line, as ``<!-- needs: spruce_plates -->``; it lies in ``../shared/recordings``.

``python docs/tutorial_blocks.py docs/tutorials/first_day.md`` runs one page and makes its small
pictures anew.
"""

import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

DOCS = Path(__file__).parent
RUNS = DOCS / "_build" / "tutorials"
RECORDINGS = DOCS.parents[1] / "shared" / "recordings"
FENCE = re.compile(r"^```(\w+)?([^\n]*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
PICTURE = re.compile(r"^!\[([^\]]*)\]\(((?:\.\./)+)_build/tutorials/([^)]*)\)$", re.MULTILINE)
SMALL = DOCS / "pictures"
WIDE = 480  # of a small picture [px]
PROGRESS = re.compile(r"^(?:\[\d+ s\] .*|\d+ of \d+ samples(?:, .* left)?)\n?", re.MULTILINE)
SHOWN = 60  # lines of an output
CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")


@dataclass(frozen=True)
class Block:
    """A fenced block: language, words after it, text, and where it ends in the page."""

    language: str
    words: dict[str, str]
    text: str
    end: int

    @property
    def runs(self) -> bool:
        """True for a block of commands."""
        return self.language == "sh" and self.words.get("run") != "no"


class BlockError(Exception):
    """A block that does not do what its page says."""


def blocks(text: str) -> Iterator[Block]:
    """The fenced blocks of a page."""
    for found in FENCE.finditer(text):
        words = dict(word.partition("=")[::2] for word in found[2].split())
        yield Block(found[1] or "", words, found[3], found.end())


def missing(page: Path) -> str:
    """Why a page cannot be run here; "" if it can."""
    needs = re.match(r"<!-- needs: (\S+) -->", page.read_text(encoding="utf-8"))
    if needs and not (RECORDINGS / needs[1]).is_dir():
        return f"the recordings {needs[1]} are not beside the checkout"
    return ""


def run(page: Path) -> list[str] | None:
    """Outputs of the commands of a page, in their order; None where data are missing.

    The results of an earlier run are used while page and program are the same.

    Raises
    ------
    BlockError
        If a block ends with another exit code than the page states.
    """
    if missing(page):
        return None
    folder = RUNS / page.stem
    kept, key = folder / "outputs.json", _key(page)
    if kept.is_file() and (known := json.loads(kept.read_text()))["key"] == key:
        return list(known["outputs"])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    outputs = [_run(page, b, folder) for b in blocks(page.read_text(encoding="utf-8")) if _acts(b)]
    shown = [output for output in outputs if output is not None]
    for made in pictures(page):
        if made.name.endswith(".html.png") and CHROMIUM:
            _photograph(made.with_suffix(""), made)
    kept.write_text(json.dumps({"key": key, "outputs": shown}))
    return shown


def pictures(page: Path) -> list[Path]:
    """Pictures that the blocks of a page make."""
    text = page.read_text(encoding="utf-8")
    return [RUNS / found[3] for found in PICTURE.finditer(text)]


def _photograph(page: Path, path: Path) -> None:
    """The upper part of a page, as a browser shows it."""
    options = "--headless --no-sandbox --hide-scrollbars --window-size=800,600"
    options += " --timeout=5000"
    command = [str(CHROMIUM), *options.split(), f"--screenshot={path}", page.as_uri()]
    subprocess.run(command, check=True, capture_output=True, timeout=120)


def small(picture: Path) -> Path:
    """Place of the small picture of a picture."""
    return SMALL / "-".join(picture.relative_to(RUNS).with_suffix(".webp").parts)


def make_small(picture: Path) -> None:
    """Keep a small picture."""
    from PIL import Image

    with Image.open(picture) as given:
        made = given.convert("RGB")
        made.thumbnail((WIDE, WIDE))
        made.save(small(picture), quality=50, method=6)


def _acts(block: Block) -> bool:
    return block.runs or "file" in block.words


def _run(page: Path, block: Block, folder: Path) -> str | None:
    if "file" in block.words:
        path = folder / block.words["file"]
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(block.text, encoding="utf-8")
        return None
    bash = ["bash", "-euo", "pipefail", "-c", block.text]
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ.get('PATH', '')}"
    own = {
        "PATH": path,
        "COLUMNS": "100",
        "OMP_NUM_THREADS": "1",
        "RECORDINGS": str(RECORDINGS),
        "REPOSITORY": str(DOCS.parent),
    }
    done = subprocess.run(
        bash, cwd=folder, env={**os.environ, **own}, text=True, encoding="utf-8",
        capture_output=True, stdin=subprocess.DEVNULL,
    )  # fmt: skip
    due = int(block.words.get("exit", 0))
    said = PROGRESS.sub("", done.stdout + done.stderr)
    if done.returncode != due:
        raise BlockError(
            f"{page.name}: exit code {done.returncode}, not {due}:\n{block.text}{said}"
        )
    return (
        said.replace(str(folder), "~")
        .replace(str(RECORDINGS), "$RECORDINGS")
        .replace(str(DOCS.parent), "$REPOSITORY")
    )


def shown(page: Path, outputs: list[str] | None) -> str:
    """The page with the output below every block of commands, and with the pictures there are."""
    text = "".join(_with_outputs(page.read_text(encoding="utf-8"), outputs or []))
    why = missing(page) or "this build has not run the tutorials"

    def picture(found: re.Match[str]) -> str:
        made = RUNS / found[3]
        if made.is_file():
            return found[0]
        if small(made).is_file():
            return f"![{found[1]}]({found[2]}pictures/{small(made).name})"
        return f"*(No picture: {why}.)* {found[1]}"

    return PICTURE.sub(picture, text)


def _with_outputs(text: str, outputs: list[str]) -> Iterator[str]:
    begin, left = 0, iter(outputs)
    for block in blocks(text):
        output = next(left, "").strip("\n") if block.runs else ""
        yield text[begin : block.end]
        begin = block.end
        if output:
            yield f"\n\n```{{code-block}} none\n:class: output\n\n{_short(output)}\n```"
    yield text[begin:]


def _short(output: str) -> str:
    lines = output.splitlines()
    if len(lines) <= SHOWN:
        return output
    head, tail = lines[: SHOWN - 10], lines[-9:]
    return "\n".join([*head, f"... ({len(lines) - SHOWN + 1} more lines)", *tail])


def _key(page: Path) -> str:
    """Changes with the blocks of a page and with any file of the program."""
    acting = [b for b in blocks(page.read_text(encoding="utf-8")) if _acts(b)]
    words = repr([(b.words, b.text) for b in acting])
    return key_of(words, *(DOCS.parent / folder for folder in ("src", "envs", "meshes")))


def key_of(words: str, *places: Path) -> str:
    """Changes with the words and with any file in these places."""
    hashed = hashlib.sha256(words.encode())
    for place in places:
        for path in sorted(place.rglob("*")) if place.is_dir() else [place]:
            if path.is_file() and "__pycache__" not in path.parts:
                hashed.update(f"{path} {path.stat().st_size} {path.stat().st_mtime_ns}".encode())
    return hashed.hexdigest()


if __name__ == "__main__":
    for name in sys.argv[1:]:
        page = Path(name).resolve()
        sys.stdout.write(shown(page, run(page)))
        for picture in filter(Path.is_file, pictures(page)):
            make_small(picture)
