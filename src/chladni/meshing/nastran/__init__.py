"""Nastran decks in and out."""

from .analysis import analysis as analysis
from .binary import read_op2_modes as read_op2_modes
from .binary import read_op4 as read_op4
from .connected import components as components
from .convert import assembly as assembly
from .deck import Deck as Deck
from .deck import read_deck as read_deck
from .edits import Add as Add
from .edits import Delete as Delete
from .edits import Replace as Replace
from .edits import SetColumns as SetColumns
from .edits import SetField as SetField
from .fresh import write_assembly as write_assembly
from .punch import read_punch_modes as read_punch_modes
from .punch import read_punch_responses as read_punch_responses
from .write import write_deck as write_deck
