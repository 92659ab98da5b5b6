"""Echaniz Granado (2015) retold on the open tailgate: its tables and figures next to ours.

Each chapter reads decks, sensors and recordings from the folder of the chapters, and adds its own.
A finished chapter is kept, so that an interrupted run continues with the next one.
"""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from chladni.ema.shapes import driven_shapes
from chladni.io.uff.estimate_stamp import stamp
from chladni.io.uff.write_uff import write_uff
from chladni.output import run_folder, write_json
from chladni.progress import Progress
from chladni.report.blocks import Links, Section, Text
from chladni.report.page import write_sections
from chladni_bench import FREQUENCIES

from .thesis_bench import Subject, ThesisTest, thesis_subject, thesis_test
from .thesis_calibration import calibration_chapter, identifiability_chapter
from .thesis_chapter import Chapter, ChapterStore, StoryStep
from .thesis_corrections import adhesive_chapter, mapping_chapter
from .thesis_desk import DECK, Desk, tailgate_story
from .thesis_figures import drawn
from .thesis_findings import findings
from .thesis_model import model_chapter, plan_chapter
from .thesis_modes import article_identified
from .thesis_page import numbers, thesis_page
from .thesis_results import hem_chapter, results_chapter
from .thesis_scores import keep_modes

CHAPTERS = "chapters"
SIZE = 0.030  # mesh of deck and article [m]
TITLE = "Echaniz Granado (2015) retold"
_LEAD = (
    "A virtual tailgate with formed thickness and a hem that holds takes the place of the thesis' "
    "articles. Every table has the thesis' numbers next to ours."
)


def regenerate(
    out: Path, seed: int, say: Callable[[str], None], progress: Progress, size: float = SIZE,
    effects: tuple[str, ...] = (),
) -> None:  # fmt: skip
    """Tell the thesis on the open tailgate; write the page and its numbers.

    Parameters
    ----------
    size : of the elements of deck and article [m]
    effects : that the last chapter searches; none: all of the catalogue
    """
    desk = Desk(out / CHAPTERS, tailgate_story(size), seed, effects=effects)
    settings = {"seed": seed, "size": size, "effects": list(effects)}
    retold(out, desk, settings, say, progress)


def retold(
    out: Path, desk: Desk, settings: Mapping[str, Any], say: Callable[[str], None],
    progress: Progress,
) -> dict[str, Chapter]:  # fmt: skip
    """Make all chapters that are missing, and one page of all.

    Raises
    ------
    FileError
        If the folder holds chapters of other settings, or is in use.
    """
    with run_folder(out, "thesis") as folder:
        store = ChapterStore(desk.folder, settings)
        chapters = store.run(steps(desk), say, progress)
        every = list(chapters.values())
        write_json(folder / "thesis.json", {k: v for c in every for k, v in c.numbers.items()})
        leads = Section("In short", [Text([f"{c.lead}." for c in every])])
        kept = [(f"{CHAPTERS}/{name}", what) for c in every for name, what in c.files]
        files = [("thesis.json", "the numbers"), *kept]
        body = [leads, *(s for c in every for s in c.sections), Section("Files", [Links(files)])]
        write_sections(folder / "report.html", TITLE, body, lead=_LEAD)
    say(f"results in {out / 'report.html'}")
    return chapters


def steps(desk: Desk) -> list[StoryStep]:
    """All chapters in the order of the thesis."""
    every: tuple[tuple[str, str, Callable[[Desk, Progress], Chapter]], ...] = (
        ("model", "Chapter 3, the model", model_chapter),
        ("plan", "Section 4.1, the plan", plan_chapter),
        ("test", "Sections 4.2 to 5.2, test and identification", test_chapter),
        ("mapping", "Section 5.3.1, formed thickness", mapping_chapter),
        ("adhesive", "Section 5.3.2, the seam", adhesive_chapter),
        ("identifiability", "Section 5.4, what can be identified", identifiability_chapter),
        ("calibration", "Section 5.4, calibration", calibration_chapter),
        ("results", "Chapter 6, nominal and calibrated", results_chapter),
        ("hem", "Beyond the thesis, the hem", hem_chapter),
    )
    return [StoryStep(name, title, partial(work, desk)) for name, title, work in every]


def test_chapter(desk: Desk, progress: Progress) -> Chapter:
    """Record tailgates A, B and C, and identify their modes."""
    rng = np.random.default_rng([desk.seed, 9])
    case, specimen = desk.case(DECK, tested=False), desk.specimen
    article = specimen.article()
    subject = thesis_subject(article, case.outputs, case.inputs, specimen.hangers(article), rng)
    progress("stepped sine and burst random", 0.1)
    test = thesis_test(subject, rng, desk.stages, desk.resolution)
    return identified_chapter(desk, subject, test, progress)


def identified_chapter(
    desk: Desk, subject: Subject, test: ThesisTest, progress: Progress
) -> Chapter:
    """Identify the recordings; write them, the modes of A, and the chapter."""
    rings = np.concatenate([test.tapped, test.along], axis=1)
    identified = []
    for k, (recording, ring) in enumerate(zip(test.stepped, rings, strict=True)):
        progress(f"modes of tailgate {recording.article}", 0.3 + 0.2 * k)
        identified.append(article_identified(recording, ring))
    found = findings(test, tuple(identified), FREQUENCIES)
    own = identified[0].modes.sel(found.modes.rows)
    keep_modes(desk.folder, own, driven_shapes(own))
    page = thesis_page(drawn(desk.folder, test, tuple(identified)), test, found)
    files = (*page.files, *_recordings(desk.folder, subject, test))
    return Chapter(page.lead, tuple(page.sections), numbers(test, found), files)


def _recordings(folder: Path, subject: Subject, test: ThesisTest) -> list[tuple[str, str]]:
    """Write A, B and C by both excitations as universal files."""
    files = []
    for kind, recordings in (("sine", test.stepped), ("burst", test.bursts)):
        for r in recordings:
            name = f"{kind}_{r.article}.uff"
            write_uff(folder / name, r.frf, subject.nodes, stamp(r.averages, 0.0), binary=True)
            files.append((name, f"tailgate {r.article}, {r.test.excitation}"))
    return files
