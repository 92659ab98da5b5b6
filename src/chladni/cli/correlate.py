"""``chladni correlate``: how far model and recording are apart, before anything is changed."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..errors import FileError
from ..io.mesh_format import refuse_foreign
from ..progress import within
from ..results import to_json
from ..workflows.correlate import correlate
from ..workflows.loaded_model import is_case, load_model
from ..workflows.other_modes import other_modes
from .run import (
    Allow,
    DeckOrCase,
    Mass,
    Out,
    Pictures,
    Recordings,
    Run,
    SensorTable,
    Units,
    opened,
    started,
    stated,
)

if TYPE_CHECKING:
    from ..case.schema import CaseWords


def run(
    source: DeckOrCase,
    recordings: Recordings = None,
    modes: Annotated[
        Path | None,
        typer.Option(
            help="Modes instead of a test: OP2, punch or universal file (dataset 55) of another "
            "program, or another deck, as one with a joint left out."
        ),
    ] = None,
    sensors: SensorTable = None,
    mass: Mass = None,
    units: Units = None,
    allow: Allow = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Compare model and test without a fit: paired modes, MAC, deviation Q by channel and band.

    A case is compared with its recording, a deck with the recording after it. With --modes, a case
    or a bare deck is compared with the modes of another program or of another deck.
    """
    test = stated(sensors=sensors, mass=mass)
    with started("correlate", source, out, pictures=pictures, reads=recordings or ()) as job:
        if modes is None:
            words = test | stated(units=units, allow=allow)
            _with_test(job, source, recordings or (), words)
            return
        if recordings or test:
            raise FileError("--modes stands for the test; leave out recording, --sensors, --mass")
        _with_other_modes(job, source, modes, units, allow or [])


def _with_test(job: Run, source: Path, recordings: Sequence[Path], words: "CaseWords") -> None:
    from ..report.correlation_page import as_page

    if source.is_file() and not is_case(source) and not recordings:
        refuse_foreign(source)
        raise FileError(
            f"{source} is a deck; give its recording after it, a case with a recording, or --modes "
            "with another deck or the modes from another program"
        )
    case = opened(source, recordings, words)
    found = correlate(case, progress=within(job.progress, 0.0, 0.8))
    job.json("correlation.json", to_json(found))
    job.progress("pictures", 0.8)
    job.show(as_page(job.folder, found))


def _with_other_modes(
    job: Run, source: Path, modes: Path, units: str | None, allow: list[str]
) -> None:
    from ..report.other_modes_page import as_page

    model = load_model(source, units, allow, command="correlate")
    found = other_modes(model, modes, progress=within(job.progress, 0.0, 0.8))
    job.json("correlation.json", to_json(found))
    job.progress("pictures", 0.8)
    job.show(as_page(job.folder, found))
