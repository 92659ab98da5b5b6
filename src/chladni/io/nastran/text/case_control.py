"""Executive and case control: which solution, and what each subcase selects."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Final

from .case_control_sets import EVERY, continued, members

_SOLUTIONS: Final = {
    "SESTATIC": 101, "SESTATICS": 101, "STATIC": 101, "STATICS": 101,
    "SEMODES": 103, "MODES": 103, "SEDFREQ": 108, "SEMFREQ": 111, "SEBUCKL": 105,
    "SEDCEIG": 107, "SEMCEIG": 110, "SEDTRAN": 109, "SEMTRAN": 112,
}  # fmt: skip
_COSMIC: Final = {1: 101, 3: 103, 8: 108, 11: 111}
SELECTS: Final = {
    "SPC": "SPC", "MPC": "MPC", "LOAD": "LOAD", "METHOD": "METHOD", "METH": "METHOD",
    "FREQ": "FREQ", "FREQUENCY": "FREQ", "FREQUENC": "FREQ", "DLOAD": "DLOAD",
    "SDAMP": "SDAMP", "SDAMPING": "SDAMP", "SUPORT1": "SUPORT", "SUPORT": "SUPORT",
    "LOADSET": "LOADSET", "K2GG": "K2GG", "M2GG": "M2GG", "B2GG": "B2GG",
    "K2PP": "K2PP", "M2PP": "M2PP", "B2PP": "B2PP",
}  # fmt: skip
_COMMAND = re.compile(r"^\s*([A-Z]\w*)\s*(?:\([^)]*\))?\s*=\s*([\w.]+)")
_ONE_SET = re.compile(r"^\s*\w+\s*(?:\([^)]*\))?\s*=\s*\d+\s*$")
_SUBCASE = re.compile(r"^\s*(SUBCASE|SUBCOM|SYM|REPCASE)\s*=?\s*(\d+)", re.I)
_SET = re.compile(r"^\s*SET\s+(\d+)\s*=\s*(.*)", re.I)
_OUTPUTS: Final = ("DISP", "VELO", "ACCE", "VECT")  # how the requests for motion begin
_PARAM = re.compile(r"^\s*PARAM\s*,\s*(\w+)\s*,\s*([^,\s]+)", re.I)
_SOL = re.compile(r"^\s*SOL[\s,]+(\w+)", re.I)


def selects_one(command: str, text: str) -> bool:
    """True where a command that selects names one set, or matrices by their names.

    >>> selects_one("SPC", "SPC = 7"), selects_one("SPC", "SPC = ALL")
    (True, False)
    """
    return bool((_COMMAND if "2" in command else _ONE_SET).match(text.upper()))


@dataclass(frozen=True)
class SubcaseSelection:
    """What one subcase selects: {"SPC": 1, "LOAD": 2, ...}."""

    id: int
    selects: dict[str, int]
    matrices: dict[str, str] = field(default_factory=dict)  # direct matrices: K2GG, M2PP...
    outputs: tuple[tuple[int, int], ...] = ()  # points whose motion is asked for, first to last
    residual: bool = False  # RESVEC: residual vectors beside the modes

    def get(self, what: str) -> int:
        """Set id selected, 0 where none is."""
        return self.selects.get(what, 0)


@dataclass(frozen=True)
class CaseControl:
    """Solution number (0: not stated) and the subcases; always at least one where there are any."""

    sol: int = 0
    subcases: tuple[SubcaseSelection, ...] = ()
    present: bool = False
    parameters: dict[str, str] = field(default_factory=dict)  # PARAM above BEGIN BULK


def case_control(lines: Iterable[str], sections: bool) -> CaseControl:
    """Parse the lines before BEGIN BULK; ``sections``: there is a case control at all."""
    sol, common, cases, current, parameters = 0, _Case(0), [], None, {}
    sets: dict[int, tuple[tuple[int, int], ...]] = {}
    for text in continued(line.split("$")[0] for line in lines):
        if found := _SET.match(text):
            sets[int(found[1])] = members(found[2])
        elif found := _SOL.match(text):
            sol = _solution(found[1])
        elif found := _SUBCASE.match(text):
            current = _Case(int(found[2]))
            cases.append(current)
        elif found := _PARAM.match(text):
            parameters[found[1].upper()] = found[2].upper()
        elif found := _COMMAND.match(text.upper()):
            if found[1] == "AUTOSPC":
                parameters["AUTOSPC"] = found[2]
            (current or common).add(found[1], found[2], sets)
    made = [case.over(common) for case in cases] or [common.over(_Case(0))]
    return CaseControl(sol, tuple(made) if sections else (), sections, parameters)


class _Case:
    """A subcase being read."""

    def __init__(self, id: int) -> None:
        self.id = id
        self.selects: dict[str, int] = {}
        self.matrices: dict[str, str] = {}
        self.outputs: list[tuple[int, int]] | None = None
        self.residual: bool | None = None

    def add(self, command: str, value: str, sets: dict[int, tuple[tuple[int, int], ...]]) -> None:
        """Keep a selection, a request for motion; anything else is other output."""
        name = SELECTS.get(command)
        if command == "RESVEC":
            self.residual = value not in ("NO", "NOSYSTEM")
        elif command[:4] in _OUTPUTS:
            wanted = (
                (EVERY,) if value == "ALL" else sets.get(int(value) if value.isdecimal() else 0)
            )
            self.outputs = [*(self.outputs or ()), *(wanted or ())]
        elif name and value.isdecimal():
            self.selects[name] = int(value)
        elif name and "2" in name:
            self.matrices[name] = value

    def over(self, common: "_Case") -> SubcaseSelection:
        """The subcase with what stands above all subcases."""
        own = (self.outputs, common.outputs)
        residual = (self.residual, common.residual)
        return SubcaseSelection(
            self.id,
            {**common.selects, **self.selects},
            {**common.matrices, **self.matrices},
            tuple(next((o for o in own if o is not None), [])),
            next((r for r in residual if r is not None), False),
        )


def _solution(word: str) -> int:
    if word.isdecimal():
        return _COSMIC.get(int(word), int(word))
    return _SOLUTIONS.get(word.upper(), 0)
