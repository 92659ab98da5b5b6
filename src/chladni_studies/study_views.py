"""How studies are shown, saved and written as JSON; importing this module registers it."""

from collections.abc import Sequence
from pathlib import Path

from chladni.report.result_views import Paged
from chladni.results import show_by

from .parameter_study import ParameterStudy
from .study_store import write_samples


def _tables(found: ParameterStudy, folder: Path) -> Sequence[tuple[str, str]]:
    write_samples(folder / "samples.csv", found.table())
    return [("samples.csv", "one line per sample")]


_PAGED = Paged(
    "study",
    f"{__package__}.study_page",
    "study.json",
    _tables,
    needs_origin=False,
)

show_by(ParameterStudy, _PAGED.view)
