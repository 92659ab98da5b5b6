"""Nastran decks in and out."""

from .deck import Deck as Deck
from .deck import read_deck as read_deck
