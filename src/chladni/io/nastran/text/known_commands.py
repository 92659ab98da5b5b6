"""Commands of the case control: their names, and which of them may be passed over.

MSC Nastran Quick Reference Guide, section 4. A command may be cut down to its first four letters
where no other begins so; a line that ends with a comma goes on in the next.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Final

# Sets of cards that a command selects; {command: as a subcase keeps it}.
SELECTS: Final = {
    "SPC": "SPC", "MPC": "MPC", "LOAD": "LOAD", "METHOD": "METHOD", "FREQUENCY": "FREQ",
    "NSM": "NSM", "DLOAD": "DLOAD", "SDAMPING": "SDAMP", "SUPORT1": "SUPORT", "LOADSET": "LOADSET",
    "K2GG": "K2GG", "M2GG": "M2GG", "B2GG": "B2GG", "K2PP": "K2PP", "M2PP": "M2PP", "B2PP": "B2PP",
}  # fmt: skip
SUBCASES: Final = ("SUBCASE", "SUBCOM", "SYM", "SYMCOM", "REPCASE")
_HEEDED: Final = (*SUBCASES, *"SET PARAM SUBSEQ SYMSEQ STEP AUTOSPC RESVEC".split())
_MOTIONS: Final = ("DISPLACEMENT", "VELOCITY", "ACCELERATION", "VECTOR")
_TITLES: Final = """TITLE SUBTITLE STITLE LABEL PLOTID TCURVE XTITLE YTITLE YTTITLE
    YBTITLE""".split()
_EXECUTIVE: Final = """ID SOL TIME APP DIAG CEND ENDALTER ALTER COMPILE LINK MALTER INCLUDE
    INIT ASSIGN NASTRAN UNIT CHKPNT RESTART BEGIN GEOMCHECK MODEL_CHECK ENDJOB FMSINSERT ACQUIRE
    DBLOCATE DBKEYS EXPAND MEMLIST PROJ RFINCLUDE CONNECT DEFINE DBLOAD DBUNLOAD
    ATTACH DATABASE""".split()
_REQUESTS: Final = """NLLOAD SVECTOR SDISPLACEMENT SVELOCITY SACCELERATION OLOAD SPCFORCES
    MPCFORCES GPFORCE GPKE GPSTRESS GPSTRAIN GPSDCON GPRSORT GPLDIST STRESS STRAIN STRFIELD STRN
    ELSTRESS ELSTRAIN ELFORCE ELSDCON ELSUM ELDATA ELRAND ELAR ELAROUT FORCE NLSTRESS NOUTPUT
    ESE EKE EDE EQUILIBRIUM GROUNDCHECK WEIGHTCHECK MEFFMASS MPFACTOR MCFRACTION MODALKE MODALSE
    MODTRAK MODCON MODESELECT MAXLINES MAXMIN LINE PAGE ECHO ECHOON ECHOOFF SKIP SKIPON SKIPOFF
    OUTPUT OFREQUENCY OMODES OTIME OTEMP OTM OPRESSURE OSTNINI OSTREL OUTRCV DATAREC EXTSEOUT
    EXTDROUT POST PARTN PRESSURE MPRES FLUX THERMAL ENTHALPY HDOT HOUTPUT HTFLOW VOLUME SURFACE
    VUGRID BOUTPUT CSCALE XYPLOT XYPRINT XYPUNCH XYPEAK XGRID YGRID XAXIS YAXIS CAMERA PLOTTER
    FIND PLOT AEROF APRESSURE MONITOR CMSENERGY PFMODE PFPANEL PFGRID PANCON PEAKOUT ERP INTENSITY
    ACPOWER ACFPMRESULT HARMONICS HDF5OUT ADAMSMNF MBDEXPORT MBDRECVR SHELLTHK SPLINOUT FBODYLD
    GKRESULTS BGRESULTS BOLTRESULTS JRESULTS CZRESULTS PFRESULTS CRSTRN PLSTRN THSTRN
    DAMAGE DRSPAN GVECTOR
    PACCELERATION PVELOCITY CAMPBELL RCROSS MONVAR TRACE""".split()
_OTHER_ANALYSES: Final = """ANALYSIS CMETHOD FMETHOD SMETHOD RANDOM TSTEP TSTEPNL NLPARM NLSTEP
    NLOPRM NLCNTL NLARCL NLBUCK NLIC NLRESTART SUBSTEP IC ICF INITS ENDTIME NONLINEAR TRIM DIVERG
    GUST AUXCASE DESMOD DESOBJ DESSUB DESGLB DESVAR DSAPRT SENSITY DSYM DTSEQ SEQDEP STOCHASTICS
    TEMPERATURE DEFORM CLOAD ALOAD BC MODES RIGID TERM SUPER SEALL SEDR SEDV SEEXCLUDE SEFINAL
    SEKREDUCE SELGENERATE SELREDUCE SEMGENERATE SEMREDUCE SERESP AESYMXY AESYMXZ AECONFIG AECSSSET
    AEUXREF CSSCHD ADAPT HADAPT ADACT TSTRU FLSFSEL FLSPOUT FLSTCNT ENDCASE MASTER END""".split()
_NAMED: Final = (*SELECTS, *_HEEDED, "TEMPERATURE", "STATSUB")
_FOUR: Final = {  # what the first four letters of a longer word can only mean
    name[:4]: name
    for name in _NAMED
    if len(name) > 4 and name[:4] not in _NAMED and sum(n[:4] == name[:4] for n in _NAMED) == 1
}
_FIRST_FOUR: Final = frozenset(
    name[:4]
    for names in (_HEEDED, _MOTIONS, _EXECUTIVE, _TITLES, _REQUESTS, _OTHER_ANALYSES)
    for name in names
)  # fmt: skip
MEANINGS: Final = {  # of commands that change the structure and are refused
    "STATSUB": "stiffness of a loaded state",
    "MFLUID": "the mass of a fluid", "TFL": "transfer functions",
    "K42GG": "a matrix of structural damping", "A2GG": "a matrix that couples a fluid",
    "P2G": "loads given as a matrix", "BCONTACT": "contact or glue", "BCSET": "contact or glue",
    "BGSET": "contact or glue", "BOLTLD": "preload of bolts", "UNGLUE": "glue that is let go",
    "BSQUEAL": "friction of brakes", "RGYRO": "gyroscopic terms", "TRIMGRP": "trim components",
    "AUXMODEL": "auxiliary models", "AXISYM": "axial symmetry", "AXISYMMETRIC": "axial symmetry",
    "BCMOVE": "bodies in contact", "BCHANGE": "bodies in contact",
}  # fmt: skip
_OF_MATERIALS = re.compile(r"^(?:\(\s*(?:MATE\w*|MAT|BOTH)\b[^)]*\)\s*)?=", re.I)
_WORD = re.compile(r"^\s*([A-Z]\w*)\s*", re.I)
_PLOTS = re.compile(r"^\(\s*(XY|PLOT|POST|CARDS)", re.I)
_FLOW: Final = frozenset((*SUBCASES, *_EXECUTIVE, *_TITLES, "OUTPUT", "ECHOON", "ECHOOFF"))


@dataclass(frozen=True)
class Command:
    """One command, its continuation lines joined."""

    where: str  # file:line on which it begins
    name: str  # in full where it has an effect, else as it is written, upper case
    rest: str  # what stands behind its name, upper case
    text: str  # as it is written
    plots: bool = False  # it stands in the language of plots, behind OUTPUT(XYPLOT) or the like

    @property
    def described(self) -> str:
        """The text in the parentheses behind the name."""
        return self.rest[1 : _closing(self.rest) - 1] if self.rest.startswith("(") else ""

    @property
    def value(self) -> str:
        """The text behind the equals sign."""
        after = self.rest[_closing(self.rest) :] if self.rest.startswith("(") else self.rest
        after = after.strip()
        return after[1:].strip() if after.startswith("=") else ""


def named(word: str) -> str:
    """The name in full of a command that has an effect, else the word.

    >>> named("METH"), named("SPCF"), named("SUBC"), named("SUBCO"), named("LOADS"), named("LOAD")
    ('METHOD', 'SPCF', 'SUBCASE', 'SUBCOM', 'LOADSET', 'LOAD')
    """
    word = word.upper()
    if word in _NAMED or len(word) < 4:
        return word
    longer = [name for name in _NAMED if name.startswith(word)]
    return longer[0] if longer else _FOUR.get(word[:4], word)


def commands(control: Iterable[tuple[str, str]]) -> tuple[Command, ...]:
    """The commands below CEND.

    Parameters
    ----------
    control : (file:line, text) of executive and case control
    """
    lines = [(where, text.split("$")[0].rstrip()) for where, text in control]
    heads = [_head(text) for _, text in lines]
    below = heads.index("CEND") + 1 if "CEND" in heads else 0
    out: list[Command] = []
    plots = False
    for where, text in _joined(lines[below:]):
        if found := _WORD.match(text):
            name, rest = named(found[1]), text[found.end() :].upper()
            plots = plots or (name[:4] == "OUTP" and bool(_PLOTS.match(rest)))
            out.append(Command(where, name, rest, text, plots))
    return tuple(out)


def _head(text: str) -> str:
    found = _WORD.match(text)
    return found[1].upper() if found else ""


def _joined(lines: Sequence[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    """Commands of which a list goes on in the lines below it."""
    where, text = "", ""
    for at, line in lines:
        if not line.strip():
            continue
        if text and _goes_on(text) and not _begins(line, text):
            text = f"{text} {line.strip()}"
            continue
        if text:
            yield where, text
        where, text = at, line
    if text:
        yield where, text


def _goes_on(text: str) -> bool:
    return text.endswith(",") and _head(text)[:4] not in {name[:4] for name in _TITLES}


def _begins(line: str, above: str) -> bool:
    """True for a line that is itself a command, so that it continues none.

    >>> _begins("SPC = 1", "ECHO = SORT,"), _begins("  12, 14 THRU 20", "SET 1 = 2,")
    (True, False)
    >>> _begins("SET=(G,N)) = YES", "GROUNDCHECK(PRINT,")
    False
    """
    found = _WORD.match(line)
    if not found:
        return False
    name, rest = named(found[1]), line[found.end() :]
    if above.count("(") > above.count(")"):  # options may be words with an equals sign
        return name in SELECTS or (name in SUBCASES and rest[:1].isdecimal())
    if name in _FLOW and rest[:1] != ",":
        return True
    known = name in _NAMED or harmless(name)
    return "=" in rest or (known and rest[:1] not in ("", ","))


def _closing(rest: str) -> int:
    """Characters up to the parenthesis that closes the first."""
    depth = 0
    for k, letter in enumerate(rest):
        depth += (letter == "(") - (letter == ")")
        if depth == 0:
            return k + 1
    return len(rest)


def selects_one(command: Command) -> bool:
    """True where a command that selects names one set, or matrices by their names."""
    if "2" in command.name:
        return bool(command.value)
    return command.value.isdecimal() and command.value.isascii()


def sets_material_temperature(command: Command) -> bool:
    """True for a command that chooses the temperatures that materials follow (MATT1, remark 1)."""
    return command.name == "TEMPERATURE" and bool(_OF_MATERIALS.match(command.rest))


def harmless(name: str) -> bool:
    """True for a command that leaves the structure as it is or is heeded.

    >>> harmless("OTEMP"), harmless("STATSUB"), harmless("SPCC")
    (True, False, False)
    """
    return name[:4] in _FIRST_FOUR and name not in MEANINGS
