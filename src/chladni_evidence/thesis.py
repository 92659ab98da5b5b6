"""Tables 3 to 6 and figures 19, 23 to 27 of Echaniz Granado (2015) from the virtual bench."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from chladni.io.uff.estimate_stamp import stamp
from chladni.io.uff.write_uff import write_uff
from chladni.output import run_folder, write_json
from chladni.report.blocks import Links, Section
from chladni.report.page import write_sections
from chladni_bench import FREQUENCIES

from .thesis_bench import Subject, ThesisTest, tailgate_subject, thesis_test
from .thesis_figures import drawn
from .thesis_findings import findings
from .thesis_modes import article_identified
from .thesis_page import numbers, thesis_page


def regenerate(out: Path, seed: int, say: Callable[[str], None]) -> None:
    """Test, identify, draw, and write the page, its numbers and the recordings."""
    rng = np.random.default_rng([seed, 9])
    with run_folder(out, "thesis") as folder:
        say("the tailgate: modes, sensors, cords")
        subject = tailgate_subject(rng)
        say("stepped sine and burst random of A, B and C")
        test = thesis_test(subject, rng)
        say(written(folder, subject, test, say))
    say(f"results in {out / 'report.html'}")


def written(folder: Path, subject: Subject, test: ThesisTest, say: Callable[[str], None]) -> str:
    """Identify the recordings and write all results into the folder; return a summary in words."""
    rings = np.concatenate([test.tapped, test.along], axis=1)
    identified = []
    for recording, ring in zip(test.stepped, rings, strict=True):
        say(f"modes of tailgate {recording.article}")
        identified.append(article_identified(recording, ring))
    found = findings(test, tuple(identified), FREQUENCIES)
    page = thesis_page(drawn(folder, test, tuple(identified)), test, found)
    write_json(folder / "thesis.json", numbers(test, found))
    files = [*page.files, ("thesis.json", "the numbers"), *_recordings(folder, subject, test)]
    title = "Echaniz Granado (2015) on the virtual bench"
    body = [*page.sections, Section("Files", [Links(files)])]
    write_sections(folder / "report.html", title, body, lead=page.lead)
    return page.lead


def _recordings(folder: Path, subject: Subject, test: ThesisTest) -> list[tuple[str, str]]:
    """Write A, B and C by both excitations as universal files."""
    files = []
    for kind, recordings in (("sine", test.stepped), ("burst", test.bursts)):
        for r in recordings:
            name = f"{kind}_{r.article}.uff"
            write_uff(folder / name, r.frf, subject.nodes, stamp(r.averages, 0.0), binary=True)
            files.append((name, f"tailgate {r.article}, {r.test.excitation}"))
    return files
