"""A case: one ``case.toml`` that names the deck, the recordings and what to do with them."""

from .load import Case as Case
from .load import FreeParameter as FreeParameter
from .load import load_case as load_case
