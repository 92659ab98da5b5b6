"""Names of bulk data that may stand in a deck; any other may change the structure and is refused.

Harmless is what no linear analysis of stiffness, mass, damping and harmonic loads heeds: MSC
Nastran Quick Reference Guide, section 8. Cards that are read or left out with a note are harmless,
too. Materials that follow temperature (MATT1...) are harmless while no temperature is chosen.
"""

from typing import Final

from ....errors import nearest
from .cards import FIELDS, LEGACY

HARMLESS: Final = frozenset(
    # loads, initial states and requests of other analyses; those that matter are noted
    """PLOAD1 PLOADX1 RFORCE TEMP TEMPD TEMPP1 TEMPP2 TEMPP3 TEMPRB TEMPF TEMPBC TEMPN1 TEMPAX
    TLOAD1 TLOAD2 ACCEL ACCEL1 FORCE2 MOMENT2 DEFORM CLOAD LOADT TIC TSTEP TSTEPNL NOLIN1 NOLIN2
    NOLIN3 NOLIN4 NLRGAP NLPARM NLPCI NLSTEP RANDPS RANDT1 TABRND1 TABRNDG GUST DELAY DPHASE
    EIGB EIGC EIGP TABLED2 TABLED3 TABLED4 TABLEM1 TABLEM2 TABLEM3 TABLEM4 TABLES1 TABLEST
    SUPORT SUPORT1 SPCOFF SPCOFF1 SEQGP RVDOF RVDOF1 MODTRAK CMETHOD CMSMETH
    """
    # sets of degrees of freedom: reduction is noted, the others change no full model
    """OMIT OMIT1 ASET ASET1 BSET BSET1 CSET CSET1 QSET QSET1 USET USET1 BNDFIX BNDFIX1 BNDFREE
    BNDFRE1 SET1 SET2 SET3 SELABEL
    """
    # properties that follow the frequency are noted; properties and materials that no element
    # here can name: an element that does is refused
    """PBUSHT PELAST PDAMPT PBEND PBEAM3 PBCOMP PBMSECT PBRSECT PBUSH1D PBUSH2D PWELD PFAST PSEAM
    PGAP PSHEAR PRAC2D PRAC3D PLPLANE PLSOLID PCONEAX PTRPLT1 PDUM1 PAABSF PACABS PACBAR PACINF
    PPLANE PSHLN1 PSHLN2 PSLDN1 PCOMPLS PCOMPF PDAMP5 PHBDY MAT3 MAT4 MAT5 MAT9 MAT10 MAT11
    MATF MATG MATHE MATHP MATS1 CREEP SWLDPRM
    """
    # design optimisation
    """DESVAR DVPREL1 DVPREL2 DVMREL1 DVMREL2 DVCREL1 DVCREL2 DVGRID DVSHAP DVBSHAP DVSET DCONSTR
    DCONADD DRESP1 DRESP2 DRESP3 DOPTPRM DLINK DSCREEN DDVAL DTABLE DTABLE2 DEQATN BNDGRID TOPVAR
    BEADVAR
    """
    # aeroelasticity and heat
    """AERO AEROS AECOMP AEFACT AELINK AELIST AELISTC AEPARM AEPRESS AEFORCE AESTAT AESURF AESURFS
    AEDW CAERO1 CAERO2 CAERO3 CAERO4 CAERO5 PAERO1 PAERO2 PAERO3 PAERO4 PAERO5 SPLINE1 SPLINE2
    SPLINE3 SPLINE4 SPLINE5 SPLINE6 SPLINE7 FLFACT FLUTTER MKAERO1 MKAERO2 TRIM TRIM2 DIVERG
    MONPNT1 MONPNT2 MONPNT3 MONDSP1 MONGRP UXVEC CONV CONVM PCONV PCONVM CHBDYE CHBDYG CHBDYP
    QBDY1 QBDY2 QBDY3 QHBDY QVECT QVOL RADBC RADBND RADLST RADM RADMT RADMTX RADSET VIEW VIEW3D
    BDYOR
    """
    # cyclic symmetry, which its own solutions alone heed; control and matrices, which act where
    # the case control selects them
    """CYAX CYJOIN CYSUP CYSYM CNGRNT CAMPBLL CONTRLT CSCHD CSSCHD CHECKEL DMIG DMI DMIJ DMIK DTI
    EPOINT LOADCYH LOADCYN LOADCYT
    """
    # plots, output, switches of the run
    """PLOTEL PLOTEL3 PLOTEL4 CBARAO PLTSURF CPLSTN3 CPLSTN4 CPLSTN6 CPLSTN8 CORD3G CORD3R ECHOON
    ECHOOFF MDLPRM ITER PARAMARC
    """.split()
)
FOLLOWS_TEMPERATURE: Final = (  # materials, where the case control chooses their temperatures
    """MATT1 MATT2 MATT3 MATT4 MATT5 MATT8 MATT9 MATT11 MATTC MATTEP MATTF MATTG MATTHE MATTVE
    MATTVP""".split()
)
CARRIERS: Final = frozenset(  # that stiffen, weigh or tie and do not begin with C
    """GENEL RSPLINE RTRPLT1 RJOINT RSSCON RBE2GS RBE2F RBAR1 BLSEG BCTABLE BGSET BCTSET BGADD TF
    NSM NSM1 NSML NSML1 NSMADD MFLUID""".split()
)


def refusal(name: str, count: int) -> str:
    """Why cards of this name cannot be passed over; '' where they may stand in a deck.

    >>> refusal("CQUAD4", 1), refusal("DESVAR", 1)
    ('', '')
    >>> refusal("SPCC1", 2)
    'SPCC1 (2 cards) is not understood and may change the structure; did you mean SPC1?'
    """
    if name in FIELDS or name in HARMLESS or name in LEGACY or name in FOLLOWS_TEMPERATURE:
        return ""
    what = f"{name} ({count} cards)"
    near = nearest(name, FIELDS, 0.75)
    meant = f"; did you mean {near}?" if near and name not in CARRIERS else ""
    if name in CARRIERS or (name[:1] == "C" and name.isalnum() and len(name) > 2):
        return f"{what} carries stiffness, mass or a tie and is not understood{meant}"
    return f"{what} is not understood and may change the structure{meant}"
