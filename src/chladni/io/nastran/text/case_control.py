"""Executive and case control: which solution, and what each subcase selects."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

from .case_control_sets import EVERY, members
from .known_commands import SELECTS, SUBCASES, Command, commands

_SOLUTIONS: Final = {
    "SESTATIC": 101, "SESTATICS": 101, "STATIC": 101, "STATICS": 101,
    "SEMODES": 103, "MODES": 103, "SEDFREQ": 108, "SEMFREQ": 111, "SEBUCKL": 105,
    "SEDCEIG": 107, "SEMCEIG": 110, "SEDTRAN": 109, "SEMTRAN": 112,
}  # fmt: skip
_COSMIC: Final = {1: 101, 3: 103, 8: 108, 11: 111}
_ID = re.compile(r"^=?\s*([0-9]+)")
_SET = re.compile(r"^([0-9]+)\s*=\s*(.*)")
_OUTPUTS: Final = ("DISP", "VELO", "ACCE", "VECT")  # how the requests for motion begin
_PARAM = re.compile(r"^,?\s*(\w+)[\s,]+([^,\s]+)")
_SOL = re.compile(r"^\s*SOL[\s,=]+(\w+)", re.I)


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
    commands: tuple[Command, ...] = ()


def case_control(control: Sequence[tuple[str, str]], sections: bool) -> CaseControl:
    """Parse (file:line, text) above BEGIN BULK; ``sections``: there is a case control at all."""
    stated = [_solution(m[1]) for _, text in control if (m := _SOL.match(text.split("$")[0]))]
    reading = _CaseReading()
    every = commands(control)
    for command in reversed(every):  # a set may be asked for above the line that defines it
        if command.name == "SET":
            reading.take(command)
    for command in every:
        reading.take(command)
    common = reading.common
    made = [case.over(common) for case in reading.cases] or [common.over(_Case(0))]
    return CaseControl(
        stated[-1] if stated else 0,
        tuple(made) if sections else (),
        sections,
        reading.parameters,
        every,
    )


class _CaseReading:
    """A case control being read."""

    def __init__(self) -> None:
        self.common = _Case(0)
        self.cases: list[_Case] = []
        self.parameters: dict[str, str] = {}
        self.sets: dict[int, tuple[tuple[int, int], ...]] = {}  # as they are where one reads
        self.stepped: _Case | None = None  # the subcase as it is above its first STEP

    def take(self, command: Command) -> None:
        """Heed one command."""
        name, rest = command.name, command.rest
        if name == "SET" and (found := _SET.match(rest)):
            self.sets[int(found[1])] = members(found[2])
        elif name in SUBCASES and (found := _ID.match(rest)):
            self.cases.append(_Case(int(found[1])))
            self.stepped = None
        elif name == "STEP" and _ID.match(rest) and self.cases:
            if self.stepped is not None:  # several steps are a subcase each (SOL 400)
                self.cases.append(self.stepped.copy())
            else:
                self.stepped = self.cases[-1].copy()
        elif name == "PARAM" and (found := _PARAM.match(rest)):
            self.parameters[found[1]] = found[2]
        else:
            if name == "AUTOSPC" and command.value:
                self.parameters["AUTOSPC"] = command.value
            (self.cases[-1] if self.cases else self.common).add(command, self.sets)


class _Case:
    """A subcase being read."""

    def __init__(self, id: int) -> None:
        self.id = id
        self.selects: dict[str, int] = {}
        self.matrices: dict[str, str] = {}
        self.outputs: list[tuple[int, int]] | None = None
        self.residual: bool | None = None

    def copy(self) -> "_Case":
        """A subcase of the same selections."""
        new = _Case(self.id)
        new.selects, new.matrices = {**self.selects}, {**self.matrices}
        new.outputs, new.residual = self.outputs, self.residual
        return new

    def add(self, command: Command, sets: dict[int, tuple[tuple[int, int], ...]]) -> None:
        """Keep a selection, a request for motion; anything else is other output."""
        value, kept = command.value, SELECTS.get(command.name)
        if command.name == "RESVEC" and value:
            self.residual = value not in ("NO", "NOSYSTEM")
        elif command.name[:4] in _OUTPUTS and value:
            chosen = sets.get(int(value) if value.isdecimal() else 0)
            wanted = (EVERY,) if value == "ALL" else chosen
            self.outputs = [*(self.outputs or ()), *(wanted or ())]
        elif kept and "2" in kept:
            self.matrices[kept] = value
        elif kept and value.isdecimal() and "FLUID" not in command.described:
            self.selects[kept] = int(value)

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
    if word.isdecimal() and word.isascii():
        return _COSMIC.get(int(word), int(word))
    return _SOLUTIONS.get(word.upper(), 0)
