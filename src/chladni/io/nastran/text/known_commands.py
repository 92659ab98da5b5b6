"""Commands of the case control that may be passed over; any other may choose another structure.

MSC Nastran Quick Reference Guide, section 5. A command is known by its first four letters.
"""

import re
from collections.abc import Iterable, Iterator
from typing import Final

_ACTED_UPON: Final = "SET PARAM SUBCASE SUBCOM SUBSEQ SYM SYMCOM REPCASE AUTOSPC RESVEC".split()
_EXECUTIVE: Final = """ID SOL TIME APP DIAG CEND ENDALTER ALTER COMPILE LINK MALTER INCLUDE
    INIT ASSIGN NASTRAN UNIT CHKPNT RESTART BEGIN GEOMCHECK MODEL_CHECK ENDJOB FMSINSERT ACQUIRE
    DBLOCATE DBKEYS EXPAND MEMLIST PROJ RFINCLUDE CONNECT DEFINE DBLOAD DBUNLOAD
    ATTACH DATABASE""".split()
_TITLES: Final = """TITLE SUBTITLE LABEL PLOTID TCURVE XTITLE YTITLE YTTITLE YBTITLE""".split()
_REQUESTS: Final = """ACCELERATION DISPLACEMENT VELOCITY VECTOR SVECTOR SDISPLACEMENT SVELOCITY
    SACCELERATION NLLOAD OLOAD SPCFORCES MPCFORCES GPFORCE GPKE GPSTRESS GPSTRAIN GPSDCON STRESS
    STRAIN STRFIELD STRN ELSTRESS ELSTRAIN ELFORCE ELSDCON ELSUM FORCE NLSTRESS NOUTPUT ESE EKE EDE
    EQUILIBRIUM GROUNDCHECK WEIGHTCHECK MEFFMASS MCFRACTION MODALKE MODALSE MAXLINES MAXMIN LINE
    PAGE ECHO ECHOON ECHOOFF SKIP SKIPON SKIPOFF OUTPUT OFREQUENCY OMODES OTIME OUTRCV DATAREC
    EXTSEOUT POST PRESSURE FLUX THERMAL ENTHALPY HDOT HOUTPUT VOLUME SURFACE VUGRID BOUTPUT
    CSCALE XYPLOT XYPRINT XYPUNCH XYPEAK XGRID YGRID XAXIS YAXIS CAMERA PLOTTER FIND PLOT""".split()
_OTHER_ANALYSES: Final = """ANALYSIS CMETHOD FMETHOD SMETHOD RANDOM TSTEP TSTEPNL NLPARM NLSTEP IC
    NONLINEAR TRIM DIVERG GUST AUXCASE DESOBJ DESSUB DESGLB DESVAR DSAPRT SENSITY TEMPERATURE BC
    MODES RIGID TERM SUPER SEALL SEDR SEDV SEEXCLUDE SEFINAL SEKREDUCE SELGENERATE SELREDUCE
    SEMGENERATE SEMREDUCE SERESP AESYMXY AESYMXZ AECONFIG ADAPT ENDCASE MASTER END""".split()
_FIRST_FOUR: Final = frozenset(
    name[:4]
    for name in (*_ACTED_UPON, *_EXECUTIVE, *_TITLES, *_REQUESTS, *_OTHER_ANALYSES)
)  # fmt: skip
_OF_MATERIALS = re.compile(r"^\s*TEMP\w*\s*(?:\(\s*(?:MATE\w*|MAT|BOTH)\b[^)]*\)\s*)?=", re.I)
_WORD = re.compile(r"^\s*([A-Z]\w*)", re.I)
_PLOTS = re.compile(r"^\s*OUTPUT\s*\(\s*(XY|PLOT|POST|CARDS)", re.I)


def commands(lines: Iterable[str]) -> Iterator[tuple[int, str, str]]:
    """(line from 0, command, its text) of what stands below CEND, up to the language of plots.

    Parameters
    ----------
    lines : of the file above BEGIN BULK, without comments
    """
    texts = list(lines)
    heads = [(_WORD.match(text) or [""])[0].strip().upper() for text in texts]
    below = heads.index("CEND") + 1 if "CEND" in heads else 0
    goes_on = False
    for k in range(below, len(texts)):
        if _PLOTS.match(texts[k]):
            return
        inside, goes_on = goes_on, texts[k].rstrip().endswith(",")
        if heads[k] and not inside:
            yield k, heads[k], texts[k]


def sets_material_temperature(text: str) -> bool:
    """True for a command that chooses the temperatures that materials follow (MATT1, remark 1).

    >>> sets_material_temperature("TEMP(MATE) = 4"), sets_material_temperature("TEMP(LOAD) = 4")
    (True, False)
    """
    return bool(_OF_MATERIALS.match(text))


def harmless(command: str) -> bool:
    """True for a command that leaves the structure as it is or is heeded."""
    return command[:4] in _FIRST_FOUR
