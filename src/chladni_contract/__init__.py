"""The contract of effects: the rules that every effect keeps, checked in seconds."""

from . import effect_check_views as effect_check_views
from .effect_check import EffectCheck as EffectCheck
from .effect_check import check_effect as check_effect

__all__ = ["EffectCheck", "check_effect"]
