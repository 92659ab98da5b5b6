"""One injured input: its files, and the command that is given them."""

import random
from collections.abc import Callable
from dataclasses import dataclass

from .sound_files import Files


@dataclass(frozen=True)
class FuzzInput:
    """Files of one input, which of them was injured, and the command that is given it.

    ``cause`` is a pattern that an answer (exit 0) must contain: what contradicts itself is named.
    """

    kind: str
    files: dict[str, bytes]
    arguments: tuple[str, ...]
    cause: str = ""


Maker = Callable[[random.Random, Files], FuzzInput]
