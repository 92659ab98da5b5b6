"""Where to put sensors and shakers, and which lines to measure."""

from ..case import Case
from ..planning import Plan, Wishes
from ..planning import plan as planned
from ..progress import Progress, silent
from .loaded_model import Model, as_model


def plan(source: Case | Model, wishes: Wishes | None = None, progress: Progress = silent) -> Plan:
    """Sensors by effective independence and exchange, shaker and cords, lines and duration."""
    model = as_model(source)
    built, wishes = model.structure, wishes or Wishes()
    return planned(model.assembly, wishes, built=built, unit=model.unit, progress=progress)
