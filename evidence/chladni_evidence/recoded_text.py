"""Sound decks written otherwise: encoded, cut down, with other line ends, included."""

import random
import re
from collections.abc import Callable

from .fuzz_input import FuzzInput
from .sound_files import Files

_WORDED: tuple[Callable[[bytes], bytes], ...] = (
    lambda data: data,
    bytes.lower,
    lambda data: re.sub(rb"(?m)^(\s*[A-Z]{4})[A-Z]+(?=\s*=)", rb"\1", data),
    lambda data: data.replace(b"CEND\n", b"CEND\nTITLE = SHEET, FRAME,\nECHO = SORT,PUNCH,\n"),
    lambda data: data.replace(b"CEND\n", b"CEND\nSET 99 = 1,\n $\n 2 THRU 3\nOTEMP = 99\n"),
    lambda data: data.replace(b"BEGIN BULK\n", b"BEGIN BULK\n$ Tr\xe4ger, 5 \xb5m\n"),
    lambda data: data.replace(b"BEGIN BULK\n", "BEGIN BULK\n$ Tr\u00e4ger, 5 \u00b5m\n".encode()),
    lambda data: data.replace(b"\n", b" $ = , 1\n"),
)
_ENDED: tuple[Callable[[bytes], bytes], ...] = (
    lambda data: data,
    lambda data: data.replace(b"\n", b"\r\n"),
    lambda data: data.replace(b"\n", b"\r"),
    lambda data: re.sub(rb"(?m)$", lambda m: b"\0" * 8, data),
)
_ENCODED: tuple[Callable[[bytes], bytes], ...] = (
    lambda data: data,
    lambda data: b"\xef\xbb\xbf" + data,
    lambda data: data.decode("latin-1").encode("utf-16"),
    lambda data: data.decode("latin-1").encode("utf-16-be"),
    lambda data: data + b"\0" * 512,
    lambda data: data + b"\x1a",
)


def recoded(rng: random.Random, sound: Files) -> FuzzInput:
    """A sound deck that says what it said, and is due to be answered."""
    name = rng.choice([n for n in sound if n.endswith(".bdf")])
    data = sound[name].replace(b"\r\n", b"\n")
    for ways in (_WORDED, _ENDED, _ENCODED):
        data = rng.choice(ways)(data)
    files = {name: data}
    for depth in range(rng.choice((0, 0, 1, 3))):
        files[f"{depth}.inc"] = files.pop(name)
        files[name] = f"INCLUDE '{depth}.inc'\n".encode()
    return FuzzInput("recoded", files, ("modes", name, "--count", "8"), sound=True)
