"""How results are put into words, drawn and saved: what the commands write, from Python."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType
from typing import TYPE_CHECKING, Any

from ..output import write_json
from ..results import View, show_by
from .blocks import Items, PageParts, Section, Still, drawings, write_pictures

if TYPE_CHECKING:
    from ..workflows.diagnosis_result import DiagnosisResult
    from ..workflows.frf import FrequencyResponses
    from ..workflows.map import MappedDeck


@dataclass(frozen=True)
class Paged:
    """A result whose command writes one page of sections.

    ``show_by(kind, Paged(...).view)`` shows results of a type of another package.
    """

    command: str
    module: str  # with ``as_page``, ``in_words``, ``as_json``; ``.name``: one of this room
    json: str = ""  # name of the file with the result by ``as_json``; "": none
    # writes more files into the folder and returns (name, what it is) of each
    files: Callable[[Any, Path], Sequence[tuple[str, str]]] = lambda *_: ()
    needs_origin: bool = True

    def view(self) -> View:
        """The view of such results."""
        from importlib import import_module

        module = import_module(self.module, __package__)
        words: Callable[[Any], PageParts] = module.in_words
        return View(
            self.command,
            lambda found: _text(words(found)),
            lambda found: _html(self.command, words(found)),
            lambda found: self._stills(module, found),
            lambda found, folder, _, pictures: self._write(module, found, folder, pictures),
            _inputs,
            self.needs_origin,
            module.as_json if self.json else dict,
        )

    def _stills(self, module: ModuleType, found: Any) -> Mapping[str, Still]:
        """Functions that draw the pictures; files of the page are not used here."""
        with TemporaryDirectory(prefix="chladni-") as folder:
            parts = module.as_page(Path(folder), found)
        return {name: draw for d in drawings(parts.sections) for name, draw in d.pictures.items()}

    def _write(self, module: ModuleType, found: Any, folder: Path, pictures: bool) -> None:
        from .page import write_sections

        parts = module.as_page(folder, found)
        drawn = write_pictures(folder, drawings(parts.sections), pictures)
        files = [*self.files(found, folder), *parts.files, *drawn]
        if self.json:
            write_json(folder / self.json, module.as_json(found))
            files.append((self.json, "the result for other programs"))
        body = [*parts.sections, *closing_sections(parts.notes, files)]
        figures = {Path(name).stem: folder / name for name, _ in drawn}
        write_sections(folder / "report.html", self.command, body, lead=parts.lead, figures=figures)


def closing_sections(notes: Sequence[str], files: Sequence[tuple[str, str]]) -> list[Section]:
    """The last sections of a page: notes and files."""
    from .blocks import Links

    return [
        Section("Steps and reasons", [Items(notes)]),
        Section("Files", [Links(files)]),
    ]


def _text(parts: PageParts) -> str:
    from .text_tables import section_lines

    notes = [f"note: {text}" for text in parts.notes]
    return "\n".join([parts.lead, *section_lines(parts.sections), *([""] if notes else []), *notes])


def _html(title: str, parts: PageParts) -> str:
    from .page import page_text

    closing = closing_sections(parts.notes, ())
    return page_text(title, [*parts.sections, *closing], lead=parts.lead)


def _inputs(found: Any) -> Sequence[Path]:
    """The files of the deck."""
    deck = getattr(found.origin, "deck", None)
    return () if deck is None else tuple(s.path for s in deck.sources)


def _diagnosis() -> View:
    from .diagnosis_drawings import drawings as drawings_of
    from .diagnosis_folder import shown, write_diagnosis
    from .diagnosis_json import diagnosis_json
    from .page import diagnosis_page
    from .sentence import sentence
    from .verdict import sections, three_numbers

    def summary(found: "DiagnosisResult") -> str:
        from .blocks import Facts
        from .next_steps import next_steps

        steps = [f"next: {text}" for text in next_steps(found)]
        first = Section("Before and after", [Facts(three_numbers(found))])
        parts = PageParts(sentence(found), [first, *sections(found, {}, (), (), "")], ())
        return "\n".join([_text(parts), *([""] if steps else []), *steps])

    def stills(found: "DiagnosisResult") -> Mapping[str, Still]:
        drawn = drawings_of(found.origin, found, shown(found.origin, found))
        return {name: draw for d in drawn for name, draw in d.pictures.items()}

    def save(found: "DiagnosisResult", folder: Path, home: Path, pictures: bool) -> None:
        write_diagnosis(folder, found.origin, found, home=home, pictures=pictures)

    return View("diagnose", summary, diagnosis_page, stills, save, _inputs, json=diagnosis_json)


def _mapped(found: "MappedDeck", folder: Path) -> Sequence[tuple[str, str]]:
    from ..io.nastran import write_deck

    write_deck(found.origin.deck, folder / "mapped.bdf", found.changes)
    return [("mapped.bdf", "the deck with mapped thickness")]


def _arrays(found: "FrequencyResponses", folder: Path) -> Sequence[tuple[str, str]]:
    from ..io.tables.write_tables import write_csv, write_npz

    files = []
    for k, one in enumerate(found.frfs):
        stem = f"frf_{k + 1}" if k else "frf"
        write_npz(folder / f"{stem}.npz", one)
        write_csv(folder / f"{stem}.csv", one)
        files += [(f"{stem}.npz", "responses as arrays"), (f"{stem}.csv", "the same as a table")]
    return files


_PAGES = {  # class of ``chladni.workflows``: how it is shown
    "modes.NormalModes": Paged("modes", ".modes_page", "modes.json"),
    "correlate.Correlation": Paged("correlate", ".correlation_page", "correlation.json"),
    "other_modes.OtherModes": Paged("correlate", ".other_modes_page", "correlation.json"),
    "identify.Identification": Paged(
        "identify", ".identification_page", "identified.json", needs_origin=False
    ),
    "evaluation.Evaluation": Paged("test", ".evaluation_page", "test.json", needs_origin=False),
    "map.MappedDeck": Paged("map", ".map_page", "mapping.json", _mapped),
    "joint_models.JointModels": Paged("calibrate", ".joint_models_page", "variants.json"),
    "case_check.CaseCheck": Paged("check", ".check_page", "check.json"),
    "frf.FrequencyResponses": Paged("frf", ".response_page", files=_arrays, needs_origin=False),
}

show_by("chladni.workflows.diagnosis_result.DiagnosisResult", _diagnosis)
for _kind, _paged in _PAGES.items():
    show_by(f"chladni.workflows.{_kind}", _paged.view)
