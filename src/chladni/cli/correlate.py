"""``chladni correlate``: how far model and recording are apart, before anything is changed."""

from pathlib import Path
from typing import Annotated

import typer

from ..progress import within
from ..report.result_json import to_json
from ..workflows.correlate import correlate
from .run import Out, opened, started


def run(
    source: Annotated[Path, typer.Argument(metavar="CASE")],
    out: Out = None,
) -> None:
    """Paired modes, MAC, and the deviation Q by channel and band, nothing calibrated."""
    from ..report.correlation_page import correlation_page

    with started("correlate", source, out) as job:
        case = opened(source)
        found = correlate(case, within(job.progress, 0.0, 0.8))
        job.json("correlation.json", to_json(found))
        job.progress("pictures", 0.8)
        job.show(correlation_page(job.folder, case, found))
