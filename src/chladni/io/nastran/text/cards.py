"""What the fields of a card are called, which cards are understood, which may be ignored."""

from typing import Final

_NAMES: Final = {
    "GRID": "ID CP X1 X2 X3 CD PS SEID",
    "CQUAD4": "EID PID G1 G2 G3 G4 THETA ZOFFS - TFLAG T1 T2 T3 T4",
    "CQUADR": "EID PID G1 G2 G3 G4 THETA ZOFFS - TFLAG T1 T2 T3 T4",
    "CTRIA3": "EID PID G1 G2 G3 THETA ZOFFS - - TFLAG T1 T2 T3",
    "CTRIAR": "EID PID G1 G2 G3 THETA ZOFFS - - TFLAG T1 T2 T3",
    "PSHELL": "PID MID1 T MID2 12I/T3 MID3 TS/T NSM Z1 Z2 MID4",
    "PCOMP": "PID Z0 NSM SB FT TREF GE LAM MID1 T1 THETA1 SOUT1",
    "PCOMPG": "PID Z0 NSM SB FT TREF GE LAM GPLYID1 MID1 T1 THETA1 SOUT1",
    "MAT1": "MID E G NU RHO A TREF GE ST SC SS MCSID",
    "MAT2": "MID G11 G12 G13 G22 G23 G33 RHO A1 A2 A3 TREF GE ST SC SS",
    "MAT8": "MID E1 E2 NU12 G12 G1Z G2Z RHO A1 A2 TREF XT XC YT YC S GE F12 STRN",
    "CONM1": "EID G CID M11 M21 M22 M31 M32 M33 M41 M42 M43 M44 M51 M52 M53 M54 M55 "
    "M61 M62 M63 M64 M65 M66",
    "CONM2": "EID G CID M X1 X2 X3 - I11 I21 I22 I31 I32 I33",
    "CHEXA": "EID PID G1 G2 G3 G4 G5 G6 G7 G8",
    "CPENTA": "EID PID G1 G2 G3 G4 G5 G6",
    "CTETRA": "EID PID G1 G2 G3 G4",
    "PSOLID": "PID MID CORDM IN STRESS ISOP FCTN",
    "CBAR": "EID PID GA GB X1 X2 X3 OFFT PA PB W1A W2A W3A W1B W2B W3B",
    "CBEAM": "EID PID GA GB X1 X2 X3 OFFT PA PB W1A W2A W3A W1B W2B W3B SA SB",
    "CROD": "EID PID G1 G2",
    "CTUBE": "EID PID G1 G2",
    "CONROD": "EID G1 G2 MID A J C NSM",
    "PBAR": "PID MID A I1 I2 J NSM - C1 C2 D1 D2 E1 E2 F1 F2 K1 K2 I12",
    "PBARL": "PID MID GROUP TYPE",
    "PBEAM": "PID MID A I1 I2 I12 J NSM",
    "PBEAML": "PID MID GROUP TYPE",
    "PROD": "PID MID A J C NSM",
    "PTUBE": "PID MID OD T NSM OD2",
    "CELAS1": "EID PID G1 C1 G2 C2",
    "CELAS2": "EID K G1 C1 G2 C2 GE S",
    "CELAS3": "EID PID S1 S2",
    "CELAS4": "EID K S1 S2",
    "PELAS": "PID K GE S PID K GE S",
    "CDAMP1": "EID PID G1 C1 G2 C2",
    "CDAMP2": "EID B G1 C1 G2 C2",
    "CDAMP3": "EID PID S1 S2",
    "CDAMP4": "EID B S1 S2",
    "PDAMP": "PID B PID B PID B PID B",
    "CMASS1": "EID PID G1 C1 G2 C2",
    "CMASS2": "EID M G1 C1 G2 C2",
    "CMASS3": "EID PID S1 S2",
    "CMASS4": "EID M S1 S2",
    "PMASS": "PID M PID M PID M PID M",
    "CVISC": "EID PID G1 G2",
    "PVISC": "PID CE CR",
    "CBUSH": "EID PID GA GB X1 X2 X3 CID S OCID S1 S2 S3",
    "PBUSH": "PID",
    "RBE1": "EID",
    "RBE2": "EID GN CM GM1",
    "RBE3": "EID - REFGRID REFC WT1 C1 G1",
    "RBAR": "EID GA GB CNA CNB CMA CMB",
    "RROD": "EID GA GB CMA CMB",
    "RTRPLT": "EID GA GB GC CNA CNB CNC - CMA CMB CMC",
    "MPC": "SID G1 C1 A1 G2 C2 A2",
    "MPCADD": "SID S1",
    "SPC": "SID G1 C1 D1 G2 C2 D2",
    "SPC1": "SID C G1",
    "SPCADD": "SID S1",
    "SPCD": "SID G1 C1 D1 G2 C2 D2",
    "SPOINT": "ID1",
    "CORD1R": "CID G1 G2 G3",
    "CORD1C": "CID G1 G2 G3",
    "CORD1S": "CID G1 G2 G3",
    "CORD2R": "CID RID A1 A2 A3 B1 B2 B3 C1 C2 C3",
    "CORD2C": "CID RID A1 A2 A3 B1 B2 B3 C1 C2 C3",
    "CORD2S": "CID RID A1 A2 A3 B1 B2 B3 C1 C2 C3",
    "GRDSET": "- CP - - - CD PS",
    "BAROR": "- PID - - X1 X2 X3 OFFT",
    "BEAMOR": "- PID - - X1 X2 X3 OFFT",
    "PARAM": "N V1 V2",
    "FORCE": "SID G CID F N1 N2 N3",
    "MOMENT": "SID G CID M N1 N2 N3",
    "FORCE1": "SID G F G1 G2",
    "MOMENT1": "SID G M G1 G2",
    "SLOAD": "SID S1 F1 S2 F2 S3 F3",
    "GRAV": "SID CID A N1 N2 N3",
    "LOAD": "SID S S1 L1 S2 L2",
    "PLOAD": "SID P G1 G2 G3 G4",
    "PLOAD2": "SID P EID1",
    "PLOAD4": "SID EID P1 P2 P3 P4 G1 G3 CID N1 N2 N3 SORL LDIR",
    "DAREA": "SID P1 C1 A1 P2 C2 A2",
    "RLOAD1": "SID EXCITEID DELAY DPHASE TC TD TYPE",
    "RLOAD2": "SID EXCITEID DELAY DPHASE TB TP TYPE",
    "DLOAD": "SID S S1 L1 S2 L2",
    "LSEQ": "SID EXCITEID LID TID",
    "TABLED1": "TID XAXIS YAXIS",
    "TABDMP1": "TID TYPE",
    "FREQ": "SID F1",
    "FREQ1": "SID F1 DF NDF",
    "FREQ2": "SID F1 F2 NF",
    "FREQ3": "SID F1 F2 TYPE NEF CLUSTER",
    "FREQ4": "SID F1 F2 FSPD NFM",
    "FREQ5": "SID F1 F2 FR1",
    "EIGRL": "SID V1 V2 ND MSGLVL MAXSET SHFSCL NORM",
    "EIGR": "SID METHOD F1 F2 NE ND",
}

FIELDS: Final = {name: tuple(text.split()) for name, text in _NAMES.items()}

# Names that begin as elements do but hold neither stiffness nor mass.
_HARMLESS_C: Final = frozenset(
    """CORD1R CORD1C CORD1S CORD2R CORD2C CORD2S CORD3G CORD3R CREEP CSET CSET1 CSUPEXT CYAX CYJOIN
    CYSUP CYSYM CHBDYE CHBDYG CHBDYP CONV CONVM CLOAD CBARAO CMSMETH CSSCHD CAERO1 CAERO2 CAERO3
    CAERO4 CAERO5 CAMPBLL CNTCTPR CNGRNT CHECKEL CPLSTN CMETHOD CONTRLT CSCHD""".split()
)
# Others that stiffen, weigh or tie.
_CARRIERS: Final = frozenset(
    "GENEL RSPLINE RTRPLT1 RJOINT RSSCON RBE2GS RBE2F BLSEG BCTABLE BGSET BCTSET BGADD".split()
)


def carries(name: str) -> bool:
    """True for a card nothing here understands that would change stiffness, mass or ties.

    >>> carries("CWELD"), carries("CQUAD4"), carries("CORD2R"), carries("MDLPRM")
    (True, False, False, False)
    """
    if name in FIELDS or name in _HARMLESS_C or name in LEGACY:
        return False
    return name in _CARRIERS or (name[:1] == "C" and name.isalnum() and len(name) > 2)


# Cards of the public-domain COSMIC release, read as their present-day kin.
LEGACY: Final = frozenset(
    "CRIGD1 CRIGD2 CRIGD3 CRIGDR CQUAD1 CQUAD2 CTRIA1 CTRIA2 PQUAD1 PQUAD2 PTRIA1 PTRIA2".split()
)


def position(name: str, field: str | int) -> int:
    """Position (1-based, after the card's name) of a field.

    >>> position("PSHELL", "T"), position("CQUAD4", "T1")
    (3, 11)
    """
    if isinstance(field, int):
        return field
    return FIELDS[name].index(field) + 1
