"""A case: one ``case.toml`` that names the deck, the recordings and what to do with them."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..model.free_parameter import FreeParameter as FreeParameter
    from .load import Case as Case
    from .load import load_case as load_case
else:
    _LATER = {"Case": ".load", "load_case": ".load", "FreeParameter": "..model.free_parameter"}

    def __getattr__(name: str) -> object:
        """Load a name of ``_LATER`` and keep it: whoever lists files needs no effects."""
        if name not in _LATER:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return globals().setdefault(name, getattr(import_module(_LATER[name], __name__), name))
