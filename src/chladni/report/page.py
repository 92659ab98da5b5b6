"""One self-contained page per run: pictures inside, no network, readable on a phone, printable.

Jinja escapes all text from a deck or a recording.
"""

from __future__ import annotations

import platform
import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from html import escape
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from ..output import own_version, write_text
from .blocks import Drawing, Facts, Picture, drawings
from .drawings import library, packed
from .glossary import meaning

if TYPE_CHECKING:
    from ..workflows.diagnosis_result import DiagnosisResult
    from .blocks import Block, Section

_TEMPLATES = Path(__file__).parent / "templates"


def write_page(folder: Path | str, *given: Any, **more: Any) -> Path:
    """Write the text of :func:`diagnosis_page` as ``report.html`` into a folder."""
    return write_text(Path(folder) / "report.html", diagnosis_page(*given, **more))


def diagnosis_page(
    result: DiagnosisResult,
    figures: Mapping[str, Path] | None = None,
    notes: Sequence[str] = (),
    tables: Sequence[Section] = (),
    command: str = "",
    title: str = "",
    drawn: Sequence[Drawing] = (),
    shared: Mapping[str, Any] | None = None,
) -> str:
    """The page of a diagnosis as text.

    Parameters
    ----------
    result : DiagnosisResult
    figures : dict     pictures by name; those of a drawing replace it on paper, the others stand at
                       the end
    notes : sentences  what was done and why
    tables : sections  anything more, put before the files
    command : str      the line that makes this run again
    drawn : drawings   that of the first screen is ``where``
    shared : dict      what the drawings of an earlier page share
    """
    from .next_steps import next_steps
    from .sentence import sentence
    from .verdict import TONE, badge, sections, three_numbers

    shown = {name: Path(path) for name, path in (figures or {}).items()}
    hero: Block | None = next((d for d in drawn if d.name == "where"), None)
    if hero is None and "where" in shown:
        hero = Picture(shown["where"])
    return page_text(
        title or "Diagnosis",
        sections(result, shown, notes, tables, command, drawn),
        lead=sentence(result),
        badge=badge(result),
        tone="warn" if result.distrust else TONE.get(result.verdict, "neutral"),
        hero=hero,
        facts=three_numbers(result),
        steps=next_steps(result),
        figures=shown,
        shared=shared,
    )


def write_sections(
    path: Path | str, title: str, body: Sequence[Section], *, lead: str = "",
    figures: Mapping[str, Path] | None = None,
) -> Path:  # fmt: skip
    """Write one page of titled sections; the page of every command but the diagnosis.

    ``figures`` are the pictures of its drawings by name.
    """
    return write_text(path, page_text(title, body, lead=lead, figures=figures))


def page_text(
    title: str,
    body: Sequence[Section],
    *,
    lead: str,
    badge: str = "",
    tone: str = "neutral",
    hero: Block | None = None,
    facts: Sequence[tuple[str, str]] = (),
    steps: Sequence[str] = (),
    figures: Mapping[str, Path] | None = None,
    shared: Mapping[str, Any] | None = None,
) -> str:
    """One page of titled sections as HTML.

    Hero, facts and steps are picture, numbers and next steps of the first screen.
    """
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(_TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["relative_link"] = lambda name: "./" + quote(str(name))
    environment.filters["meaning"] = meaning
    environment.filters["code"] = _with_code
    environment.filters["id"] = id
    environment.filters["stills"] = lambda block: [
        Picture(figures[name]) for name in block.pictures if figures and name in figures
    ]
    every = [*([hero] if isinstance(hero, Drawing) else []), *drawings(body)]
    drawn = [d for d in every if d.content is not None]
    return environment.get_template("page.html").render(
        title=title,
        lead=lead,
        badge=badge,
        tone=tone,
        hero=hero,
        first=Facts(facts),
        steps=steps,
        numbers=packed(drawn, shared) if drawn else [],
        places={id(d): k for k, d in enumerate(drawn)},
        library=library() if drawn else "",
        sections=[s for s in body if s.blocks],
        made=made_with(),
    )


def _with_code(text: str) -> str:
    """A sentence as HTML; what stands between backticks is code."""
    return re.sub("`([^`]+)`", r"<code>\1</code>", escape(text))


def made_with() -> str:
    """Versions and date, for the foot of the page."""
    tools = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy"))
    today = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return f"chladni {own_version()}, Python {platform.python_version()}, {tools}; {today}"
