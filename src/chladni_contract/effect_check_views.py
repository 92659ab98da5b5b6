"""How checks of effects are shown, saved and written as JSON; importing it registers them."""

from chladni.report.result_views import Paged
from chladni.results import show_by

from .effect_check import EffectCheck

_PAGED = Paged(
    "check-effect",
    f"{__package__}.effect_check_page",
    "effect.json",
    needs_origin=False,
)

show_by(EffectCheck, _PAGED.view)
