"""``chladni check``: what of a case will be used, what not, what cannot be right."""

from ..errors import AccuracyError
from ..progress import within
from ..report.result_json import to_json
from ..workflows.case_check import check
from .run import CaseFolder, Out, opened, started


def run(
    source: CaseFolder,
    out: Out = None,
) -> None:
    """Check a case before a long run: units, mass, size, places, band, words."""
    from ..report.check_page import check_page

    with started("check", source, out) as job:
        case = opened(source)
        found = check(case, progress=within(job.progress, 0.0, 0.7))
        job.json("check.json", to_json(found))
        job.progress("the picture", 0.7)
        job.show(check_page(job.folder, case, found))
        for what, text in found.facts:
            job.say(f"{what}: {text}")
        for finding in found.findings:
            job.say(f"{'FAULT' if finding.fault else 'check'}: {finding.text}; {finding.remedy}")
        for note in dict.fromkeys(n for said in found.unused.values() for n in said):
            job.say(f"note: {note}")
    if found.faults:
        first = found.faults[0]
        raise AccuracyError(f"{source}: {first.text}; {first.remedy}")
