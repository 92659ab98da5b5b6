"""One self-contained page per run: pictures inside, no network, readable on a phone, printable.

Jinja escapes all text from a deck or a recording.
"""

from __future__ import annotations

import platform
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from ..output import own_version, write_text
from .blocks import Facts, Picture
from .drawings import Drawings, library
from .glossary import meaning

if TYPE_CHECKING:
    from ..workflows.diagnosis_result import DiagnosisResult
    from .blocks import Block, Section

_TEMPLATES = Path(__file__).parent / "templates"


def write_page(
    folder: Path | str,
    result: DiagnosisResult,
    figures: Mapping[str, Path] | None = None,
    notes: Sequence[str] = (),
    tables: Sequence[Section] = (),
    command: str = "",
    title: str = "",
    drawings: Drawings | None = None,
) -> Path:
    """Write ``report.html`` of a diagnosis into ``folder``.

    Parameters
    ----------
    result : DiagnosisResult
    figures : dict     name to picture; ``where`` stands on top, known names are put in their
                       section, others at the end (``verdict.PLACES`` lists the known ones)
    notes : sentences  what was done and why
    tables : sections  anything more, put before the files
    command : str      the line that makes this run again
    drawings : Drawings    what the page draws itself; its pictures stand for it on paper
    """
    text = diagnosis_page(result, figures, notes, tables, command, title, drawings)
    return write_text(Path(folder) / "report.html", text)


def diagnosis_page(
    result: DiagnosisResult,
    figures: Mapping[str, Path | str] | None = None,
    notes: Sequence[str] = (),
    tables: Sequence[Section] = (),
    command: str = "",
    title: str = "",
    drawings: Drawings | None = None,
) -> str:
    """The page of a diagnosis as text, its parameters those of :func:`write_page`."""
    from .next_steps import next_steps
    from .sentence import sentence
    from .verdict import HEADING, TONE, live, sections, three_numbers

    shown = {name: Path(path) for name, path in (figures or {}).items()}
    drawings = drawings or Drawings()
    hero: Block | None = Picture(shown["where"]) if "where" in shown else None
    if "where" in drawings.by_name:
        hero = live("where", drawings.by_name["where"], shown)
    return page_text(
        title or "Diagnosis",
        sections(result, shown, notes, tables, command, drawings),
        lead=sentence(result),
        badge=HEADING.get(result.verdict, result.verdict),
        tone="warn" if result.distrust else TONE.get(result.verdict, "neutral"),
        hero=hero,
        facts=three_numbers(result),
        steps=next_steps(result),
        drawings=drawings,
    )


def write_sections(
    path: Path | str,
    title: str,
    body: Sequence[Section],
    *,
    lead: str = "",
    drawings: Drawings | None = None,
) -> Path:
    """Write one page of titled sections; the page of every command but the diagnosis.

    ``drawings`` holds the numbers of the ``Live`` blocks.
    """
    return write_text(path, page_text(title, body, lead=lead, drawings=drawings))


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
    drawings: Drawings | None = None,
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
    drawn = drawings is not None and drawings.by_name
    return environment.get_template("page.html").render(
        title=title,
        lead=lead,
        badge=badge,
        tone=tone,
        hero=hero,
        first=Facts(facts),
        steps=steps,
        numbers=drawings.packed() if drawings is not None and drawn else [],
        places={name: k for k, name in enumerate(drawings.by_name)} if drawings else {},
        library=library() if drawn else "",
        sections=[s for s in body if s.blocks],
        made=made_with(),
    )


def made_with() -> str:
    """Versions and date, for the foot of the page."""
    tools = ", ".join(f"{name} {version(name)}" for name in ("numpy", "scipy"))
    today = datetime.now(UTC).strftime("%Y-%m-%d %H:%M UTC")
    return f"chladni {own_version()}, Python {platform.python_version()}, {tools}; {today}"
