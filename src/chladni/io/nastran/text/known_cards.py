"""Names of bulk data that may stand in a deck; any other may change the structure and is refused.

Harmless is what no linear analysis of stiffness, mass, damping and harmonic loads heeds: MSC
Nastran Quick Reference Guide, section 8. Cards that are read or left out with a note are harmless,
too. Materials that follow temperature (MATT1...) are harmless while no temperature is chosen.
"""

from collections.abc import Mapping
from typing import Final

from ....errors import nearest
from .cards import FIELDS, LEGACY


def _by_name(groups: Mapping[str, str]) -> dict[str, str]:
    return {name: what for what, names in groups.items() for name in names.split()}


HARMLESS: Final = _by_name({  # {card: what it is for}; those that matter are noted
    "loads, initial states and requests of other analyses":
    """PLOAD1 PLOADX PLOADX1 RFORCE TEMP TEMPD TEMPP1 TEMPP2 TEMPP3 TEMPRB TEMPF TEMPBC TEMPN1
    TEMPAX TLOAD1 TLOAD2 ACCEL ACCEL1 FORCE2 MOMENT2 DEFORM CLOAD LOADT TIC TICD TSTEP TSTEP1
    TSTEPNL
    NOLIN1 NOLIN2 NOLIN3 NOLIN4 NLRGAP NLPARM NLPCI NLSTEP NLCNTL NLCNTL2 NLCNTLG NLARCL NLAUTO
    NLOUT NLHARM NLFREQ NLFREQ1 RANDPS RANDT1 RCROSS TABRND1 TABRNDG GUST DELAY DPHASE EIGB EIGC
    EIGP TABLED2 TABLED3 TABLED4 TABLED5 TABLEM1 TABLEM2 TABLEM3 TABLEM4 TABLES1 TABLEST TABLEHT
    TABLEH1 TABLE3D SUPORT SUPORT1 SPCOFF SPCOFF1 SEQGP RVDOF RVDOF1 MODTRAK CMETHOD CMSMETH
    BOLTFOR ISTRESS IPSTRAIN""",
    "sets of degrees of freedom, elements and faces":
    """OMIT OMIT1 ASET ASET1 BSET BSET1 CSET CSET1 QSET QSET1 USET USET1 BNDFIX BNDFIX1 BNDFREE
    BNDFRE1 SET1 SET2 SET3 SELABEL PARVEC GROUP BSURF BSURFS ELIST""",
    "properties and materials that no element here names":
    """PBUSHT PELAST PDAMPT PBEAM3 PBCOMP PBMSECT PBRSECT PBUSH2D PSEAM
    PRAC2D PRAC3D PLPLANE PLSOLID PCONEAX PTRPLT1 PDUM1 PAABSF PACABS PACBAR PACINF
    PPLANE PSHLN1 PSHLN2 PSLDN1 PCOMPLS PCOMPF PCOMPS PDAMP5 PHBDY MAT3 MAT4 MAT5 MAT10 MAT11
    MATF MATG MATHE MATHP MATS1 MATVE MATVP CREEP SWLDPRM""",
    "normals of shells at grids": "SNORM",
    "damping, which acts where RSDAMP of the case control selects it": "DAMPING HYBDAMP",
    "settings of contact and glue, without which they are nothing":
    "BCPARA BCPARM BCTPARA BCTPARM BCRPARA BGPARM BCBMRAD BFRIC",
    "design optimisation and random variables":
    """DESVAR DVPREL1 DVPREL2 DVMREL1 DVMREL2 DVCREL1 DVCREL2 DVGRID DVSHAP DVBSHAP DVSET DVPSURF
    DCONSTR DCONADD DRESP1 DRESP2 DRESP3 DREPORT DREPADD DOPTPRM DLINK DSCREEN DDVAL DTABLE DTABLE2
    DEQATN DMNCON DMRLAW DVTREL1 BNDGRID TOPVAR BEADVAR RANDVAR STOCHAS""",
    "aeroelasticity":
    """AERO AEROS AECOMP AECOMPL AEFACT AELINK AELIST AELISTC AEPARM AEPRESS AEFORCE AESTAT AESURF
    AESURFS AESCALE AEDW AEGRID AEQUAD4 AETRIA3 CAERO1 CAERO2 CAERO3 CAERO4 CAERO5 PAERO1 PAERO2
    PAERO3 PAERO4 PAERO5 SPLINE1 SPLINE2 SPLINE3 SPLINE4 SPLINE5 SPLINE6 SPLINE7 SPLINEX SPLINRB
    SPBLND1 SPBLND2 SPRELAX FLFACT FLUTTER MKAERO1 MKAERO2 TRIM TRIM2 DIVERG UXVEC CSSCHD""",
    "sums for output":
    "MONPNT1 MONPNT2 MONPNT3 MONDSP1 MONGRP MONCNCM MONSUM MONSUM1 MONSUMT FBODYLD FBODYSB ERPPNL",
    "heat":
    """CONV CONVM PCONV PCONVM CHBDYE CHBDYG CHBDYP QBDY1 QBDY2 QBDY3 QHBDY QVECT QVOL RADBC RADBND
    RADCAV RADLST RADM RADMT RADMTX RADSET VIEW VIEW3D VIEWEX BDYOR""",
    "sound, which acts on points of a fluid":
    "ACMODL ACPLNW ACSRCE ACTYPE ACADAPT AMLREG MICPNT PMIC PANEL",
    "cyclic symmetry, which its own solutions alone heed":
    "CYAX CYJOIN CYSUP CYSYM LOADCYH LOADCYN LOADCYT",
    "control and matrices, which act where the case control selects them":
    "CNGRNT CAMPBLL CONTRLT CSCHD CHECKEL DMI DMIJ DMIK DTI EPOINT",
    "plots, output and switches of the run":
    """PLOTEL PLOTEL3 PLOTEL4 PLOTG PLOTOPT CBARAO PLTSURF CPLSTN3 CPLSTN4 CPLSTN6 CPLSTN8 CORD3G
    CORD3R ECHOON ECHOOFF MDLPRM ITER PARAMARC OUTPUT OUTRCV ABSNMVS ABSTRCT""",
})  # fmt: skip
FOLLOWS_TEMPERATURE: Final = (  # materials, where the case control chooses their temperatures
    """MATT1 MATT2 MATT3 MATT4 MATT5 MATT8 MATT9 MATT11 MATTC MATTEP MATTF MATTG MATTHE MATTVE
    MATTVP""".split()
)
SELECTED: Final = _by_name({  # {card: meaning}; harmless where no command of that meaning stands
    "contact or glue":
    """BCTABLE BCTABL1 BCTSET BCTADD BGSET BGADD BCBODY BCBODY1 BCPROP BCPROPS BCONPRG BCONPRP
    BCONECT""",
    "transfer functions": "TF",
    "the mass of a fluid": "MFLUID MLIST",
})  # fmt: skip
REFUSED: Final = _by_name({  # {card: what of the structure it stands for}
    "quadrilaterals of plane strain": "CQUAD",
    "curved beams of three grids": "CBEAM3",
    "axisymmetric structure":
    "CTRIAX CTRIAX6 CQUADX CQUADX4 CQUADX8 CTRAX3 CTRAX6 CCONEAX AXIC RINGAX FORCEAX AXIF AXSLOT",
    "spot welds, fasteners and seams": "CSEAM CBUTT CFILLET CSPOT",
    "bushings in two directions": "CBUSH2D",
    "ties": "RTRPLT1 RJOINT RSSCON RBE2GS RBE2F RBAR1 MPCREIG MPCY",
    "bolts with a preload": "BOLT",
    "lines in contact": "BLSEG BCONP",
    "elements that absorb sound": "CHACAB CHACBR CAABSF CACINF3 CACINF4",
    "a fluid": "CFLUID2 CFLUID3 CFLUID4 RINGFL FREEPT BDYLIST FLSYM FSLIST GRIDB PRESPT",
    "structure that the solver generates": "CGEN EGRID GRIDG SPCG DELETE LIST",
    "elements of higher order":
    """PVAL PINTS PSET ADAPT FEEDGE FEFACE GMBC GMBNDC GMBNDS GMCORD GMCURV GMINTC GMINTS GMLOAD
    GMSPC GMSURF""",
    "superelements": "SESET SEBSET SEBSET1 SEQSET SEQSET1 SEELT CSUPER CSUPEXT SECONCT SEBULK",
    "rotors": "ROTORD ROTORG RSPINR RSPINT RGYRO UNBALNC",
    "thickness at grids": "NTHICK",
})  # fmt: skip


def refusal(name: str, count: int) -> str:
    """Why cards of this name cannot be passed over; '' where they may stand in a deck.

    >>> refusal("CQUAD4", 1), refusal("DESVAR", 1)
    ('', '')
    >>> refusal("CSEAM", 1)
    'CSEAM (1 card: spot welds, fasteners and seams) is not understood'
    >>> refusal("SPCC1", 2)
    'SPCC1 (2 cards) is not understood and may change the structure; did you mean SPC1?'
    """
    if known(name):
        return ""
    cards = counted(count)
    if what := REFUSED.get(name) or SELECTED.get(name):
        return f"{name} ({cards}: {what}) is not understood"
    near = nearest(name, FIELDS, 0.75)
    meant = f"; did you mean {near}?" if near else ""
    if name[:1] == "C" and name.isalnum() and len(name) > 2:
        return f"{name} ({cards}) may carry stiffness or mass and is not understood{meant}"
    return f"{name} ({cards}) is not understood and may change the structure{meant}"


def meaning(name: str) -> tuple[str, str]:
    """(use, meaning) of a card: read, passed over, or not understood.

    >>> meaning("DESVAR"), meaning("CSEAM")[1]
    (('passed over', 'design optimisation and random variables'), 'spot welds, fasteners and seams')
    """
    if name in FIELDS or name in LEGACY:
        return "read", ""
    what = HARMLESS.get(name) or SELECTED.get(name)
    if what or name in FOLLOWS_TEMPERATURE:
        return "passed over", what or "materials that follow temperature"
    return "not understood", REFUSED.get(name, "")


def counted(count: int) -> str:
    """1 card, 2 cards."""
    return f"{count} card{'' if count == 1 else 's'}"


def known(name: str) -> bool:
    """True for a card that is read or may be passed over whatever the case control says."""
    return any(name in names for names in (FIELDS, HARMLESS, LEGACY, FOLLOWS_TEMPERATURE))
