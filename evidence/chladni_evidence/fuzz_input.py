"""One injured input: its files, and the command that is given them."""

import random
from collections.abc import Callable
from dataclasses import dataclass, field

from .sound_files import Files


@dataclass(frozen=True)
class FuzzInput:
    """Files of one input, which of them was injured, and the command that is given it."""

    kind: str
    files: dict[str, bytes]
    arguments: tuple[str, ...]
    # {name: where it leads}, made after the files; a name may lie in a folder
    links: dict[str, str] = field(default_factory=dict)
    sound: bool = False  # nothing was injured: to be answered, not refused
    # pattern that an answer (exit 0) must contain: what contradicts itself is named
    cause: str = ""


YOURS = "yours"  # a folder next to the input, with files that a case of somebody else may not use
YOUR_FILES = ("plate.bdf", "frf.npz", "sensors.csv", "case.toml", "run.json", "report.html",
              "modes.json", "v1")  # fmt: skip
SECRET = b"WORD-OF-YOURS"  # what each of them holds


Maker = Callable[[random.Random, Files], FuzzInput]
