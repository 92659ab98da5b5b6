"""One injured input: its files, and the command that is given them."""

import random
from collections.abc import Callable
from dataclasses import dataclass

from .sound_files import Files


@dataclass(frozen=True)
class FuzzInput:
    """Files of one input, which of them was injured, and the command that is given it."""

    kind: str
    files: dict[str, bytes]
    arguments: tuple[str, ...]
    sound: bool = False  # nothing was injured: to be answered, not refused


Maker = Callable[[random.Random, Files], FuzzInput]
