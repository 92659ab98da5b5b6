"""Nastran decks in and out."""

from ...geometry.connected_points import components as components
from .edit.changed_deck import changed_lines as changed_lines
from .edit.changed_deck import write_deck as write_deck
from .edit.changes import Add as Add
from .edit.changes import Delete as Delete
from .edit.changes import Replace as Replace
from .edit.changes import SetColumns as SetColumns
from .edit.changes import SetField as SetField
from .export.whole_deck import write_assembly as write_assembly
from .read.analysis_requests import analysis as analysis
from .read.assembly_from_deck import assembly as assembly
from .read.context import units_of as units_of
from .results.op2 import read_op2_modes as read_op2_modes
from .results.op2 import read_op4 as read_op4
from .results.punch import read_punch_modes as read_punch_modes
from .results.punch import read_punch_responses as read_punch_responses
from .text.deck import Deck as Deck
from .text.deck import read_deck as read_deck
