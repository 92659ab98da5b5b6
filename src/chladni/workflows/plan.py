"""Where to put sensors and shakers, and which lines to measure."""

from ..case import Case
from ..parallel import one_blas_thread
from ..planning import Plan, PlanSettings
from ..planning import plan as planned
from ..progress import Progress, silent
from .loaded_model import Model, as_model


@one_blas_thread()
def plan(
    source: Case | Model, settings: PlanSettings | None = None, progress: Progress = silent
) -> Plan:
    """Sensors by effective independence and exchange, shaker and cords, lines and duration."""
    model = as_model(source)
    built, settings = model.structure, settings or PlanSettings()
    return planned(model.assembly, settings, built=built, unit=model.unit, progress=progress)
