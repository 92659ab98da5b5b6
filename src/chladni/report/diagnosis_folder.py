"""The folder of a diagnosis: the updated deck, ``diagnosis.json``, pictures, the page."""

from dataclasses import replace
from itertools import count
from pathlib import Path

from ..case import Case
from ..io.nastran import changed_lines, write_deck
from ..output import write_json, write_npz
from ..progress import Progress, silent
from ..search import earlier_answer
from ..search.next_measurement import FILE, arrays_of
from ..workflows.diagnosis_result import ChangedDeck, DiagnosisResult
from .blocks import Code, Section, Text, write_pictures
from .calibration_blocks import calibration_json
from .diagnosis_drawings import drawings
from .diagnosis_json import diagnosis_json
from .information_map import with_surface
from .mesh_drawings import case_shown
from .page import write_page
from .shown import Shown
from .states_table import state_folder

_CHANGED = 80  # lines of the deck that the page shows


def write_diagnosis(
    folder: Path,
    case: Case,
    result: DiagnosisResult,
    command: str = "",
    progress: Progress = silent,
    home: Path | None = None,
    pictures: bool = False,
) -> DiagnosisResult:
    """Write the whole folder; return the result with the names of the files.

    Parameters
    ----------
    command : the line that makes this run again
    home : where the folder is moved to afterwards, if it is
    pictures : True: every drawing as PNG too; False: that of the first screen
    """
    folder.mkdir(parents=True, exist_ok=True)
    home = home or folder
    result = _with_states(folder, case, result, progress, home, pictures)
    seen = shown(case, result)
    files = _decks(folder, case, result, home)
    files |= {"report": "report.html", "diagnosis": "diagnosis.json"}
    if result.study is not None:
        files["calibration"] = "calibration.json"
        write_json(folder / "calibration.json", calibration_json(result))
    if result.outlook is not None:
        arrays = with_surface(arrays_of(result.outlook), seen.seen)
        files["outlook"] = write_npz(folder / FILE, **arrays).name
    if result.posterior is not None:
        left = earlier_answer.posterior_json(result.posterior)
        files["posterior"] = write_json(folder / earlier_answer.FILE, left).name
    result = replace(result, files=files)
    write_json(folder / "diagnosis.json", diagnosis_json(result))
    progress("pictures", 0.0)
    drawn = drawings(case, result, seen)
    figures = {name: folder / name for name, _ in write_pictures(folder, drawn, pictures)}
    title = f"{'Diagnosis' if result.searched else 'Calibration'} – {case.path.parent.name}"
    write_page(
        folder, result, {path.stem: path for path in figures.values()}, result.notes,
        _changed(case, result), command, title, drawn,
    )  # fmt: skip
    return result


def _with_states(
    folder: Path, case: Case, result: DiagnosisResult, progress: Progress, home: Path,
    pictures: bool,
) -> DiagnosisResult:  # fmt: skip
    """Write every state except the first into its own folder; the first is the run itself."""
    done = list(result.states)
    for k, state in enumerate(result.states):
        if k:
            name = state_folder(result, k)
            written = write_diagnosis(
                folder / name, case, state.result, "", progress, home / name, pictures
            )
            done[k] = replace(state, result=written)
    return replace(result, states=tuple(done))


def _decks(folder: Path, case: Case, result: DiagnosisResult, home: Path) -> dict[str, str | None]:
    """Return names of the updated deck and, if an effect is named, of the one without it.

    None where no card can hold the change.
    """
    found: dict[str, str | None] = {"deck": None}
    if (models := result.models) is None:
        return found
    read = {s.path.resolve() for s in case.deck.sources}

    def written(stem: str, deck: ChangedDeck) -> str:
        names = (f"{stem}{k or ''}.bdf" for k in count())
        name = next(n for n in names if (home / n).resolve() not in read)
        return write_deck(deck.source or case.deck, folder / name, deck.changes or (), home).name

    if models.final.changes is not None:
        found["deck"] = written("updated" if result.searched else "calibrated", models.final)
    if models.calibrated is not models.final and models.calibrated.changes is not None:
        found["calibrated"] = written("calibrated", models.calibrated)
    return found


def _changed(case: Case, result: DiagnosisResult) -> list[Section]:
    """Cards before and after."""
    if result.models is None or not (changes := result.models.final.changes):
        return []
    lines = changed_lines(result.models.final.source or case.deck, changes)
    more = len(lines) - _CHANGED
    text = f"Changed lines: the given deck (-) and {result.files['deck']} (+)."
    if more > 0:
        text += f" {more} further lines differ."
    return [Section("Changes in the deck", [Text([text]), Code(lines[:_CHANGED])])]


def shown(case: Case, result: DiagnosisResult) -> Shown:
    """Mesh, sensors, test and model responses for the pictures."""
    models, compared = result.models, result.compared == "responses"
    return replace(
        case_shown(case),
        curves={} if models is None else models.curves,
        held_out=() if models is None else models.held_out,
        compared=compared,
        fitted=[case.band] if case.band and compared else [],
        excluded=list(case.exclude),
    )
