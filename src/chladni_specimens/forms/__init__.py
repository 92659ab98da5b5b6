"""Six forms of structures whose dimensions are drawn at random, each meshed at any density."""

from .drawn_form import FORMS as FORMS
from .drawn_form import DrawnForm as DrawnForm
