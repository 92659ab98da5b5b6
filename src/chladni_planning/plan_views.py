"""How plans are shown, saved and written as JSON; importing this module registers it."""

from chladni.report.result_views import Paged
from chladni.results import show_by

from .whole_plan import Plan

_PAGED = Paged(
    "plan",
    f"{__package__}.plan_page",
    "plan.json",
)

show_by(Plan, _PAGED.view)
