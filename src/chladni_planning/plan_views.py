"""How plans are shown, saved and written as JSON; importing this module registers it."""

from chladni.report.result_json import to_json
from chladni.report.result_views import Paged
from chladni.results import show_by

from .detectable import Detectable
from .detectable_page import detectable_json
from .plan_json import plan_json
from .plan_summary import summary
from .whole_plan import Plan

_PAGED = Paged(
    "plan",
    f"{__package__}.plan_page",
    lambda m, at, found: m.plan_page(at, found.origin, found),
    "plan.json",
)

show_by(Plan, _PAGED.view)
to_json.register(Plan, lambda found: plan_json(summary(found)))
to_json.register(Detectable, detectable_json)
