"""Nastran decks in and out."""

from .connected import components as components
from .convert import assembly as assembly
from .deck import Deck as Deck
from .deck import read_deck as read_deck
from .fresh import write_assembly as write_assembly
