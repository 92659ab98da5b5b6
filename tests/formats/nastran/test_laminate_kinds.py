"""LAM of PCOMP: what of the layers counts, by the Quick Reference Guide and sandwich theory."""

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.io.nastran import assembly

from .conftest import PLATE

PLIES = "MAT8,7,1.3+5,9.+3,.31,5.+3,4.5+3,3.5+3,1.6-9\nMAT8,8,10.,10.,.3,4.,200.,100.,5.-11\n"
SHEET = PLATE.replace("PSHELL,101,5,2.,5,,5\n", PLIES)
HALF = ",7,.2,30.,,7,.3,-50.\n"
WHOLE = f"{HALF},7,.3,-50.,,7,.2,30.\n"


@pytest.fixture
def section(bulk):
    def read(lam, plies):
        return assembly(bulk(f"{SHEET}PCOMP,101,,,,,,,{lam}\n{plies}", fold=False)).parts[0].section

    return read


def alike(a, b):
    for name in ("membrane", "bending", "coupling"):
        one, other = getattr(a, name), getattr(b, name)
        assert (one is None) == (other is None), name
        if one is not None:
            np.testing.assert_allclose(one.Q, other.Q, atol=1e-9 * np.abs(one.Q).max())
            assert one.rho == pytest.approx(other.rho)
    assert a.thickness == pytest.approx(b.thickness)
    assert a.rigid_shear == b.rigid_shear


@pytest.mark.parametrize(
    ("half", "whole"), [("SYM", ""), ("SYMEM", "MEM"), ("SYBEND", "BEND"), ("SYSMEAR", "SMEAR")]
)
def test_one_side_of_a_symmetric_laminate_is_mirrored(section, half, whole):
    alike(section(half, HALF), section(whole, WHOLE))


def test_what_of_the_layers_counts(section):
    """MEM: MID1 alone; BEND: MID2 alone; SMEAR: MID2 = MID1, neither MID3 nor MID4."""
    full, membrane, bending, smeared = (section(x, HALF) for x in ("", "MEM", "BEND", "SMEAR"))
    assert full.coupling is not None
    assert (membrane.bending, membrane.coupling) == (None, None)
    assert (bending.membrane, bending.coupling, smeared.coupling) == (None, None, None)
    np.testing.assert_array_equal(membrane.membrane.Q, full.membrane.Q)
    np.testing.assert_array_equal(bending.bending.Q, full.bending.Q)
    np.testing.assert_array_equal(smeared.bending.Q, full.membrane.Q)
    np.testing.assert_array_equal(smeared.membrane.Q, full.membrane.Q)
    assert bending.rigid_shear
    assert smeared.rigid_shear
    assert not full.rigid_shear


def test_a_core_has_half_of_the_faces_on_either_side(section):
    """D = E_f (T³ - c³)/12 + E_c c³/12, and G of the sandwich is G_c c (T/c)² about over T."""
    one = section("SMCORE", ",7,.5,0.,,8,9.,0.\n")
    plies = ",7,.25,0.,,8,9.,0.,,7,.25,0.\n".replace(",,7,.25,0.\n", "\n,7,.25,0.\n")
    alike(one, section("", plies))
    T, c = 9.5, 9.0
    Q = 1.3e5 / (1 - 0.31**2 * 9e3 / 1.3e5)
    core = 10 / (1 - 0.3**2)
    due = Q * (1 - (c / T) ** 3) + core * (c / T) ** 3
    assert one.bending.Q[0, 0] == pytest.approx(due)
    assert one.shear.G[0, 0] == pytest.approx(200 * T / c, rel=0.1)
    order = [section("SMCORE", f"{a}{b},8,9.,0.\n") for a, b in
             ((",7,.2,30.\n", ",7,.3,-50.\n"), (",7,.3,-50.\n", ",7,.2,30.\n"))]  # fmt: skip
    alike(*order)


@pytest.mark.parametrize(
    ("lam", "plies", "said"),
    [
        ("ODD", HALF, "LAM 'ODD' is not understood; there are SYM, MEM"),
        ("SMCORE", ",7,.2\n", "SMCORE needs the layers of its faces"),
    ],
)
def test_what_is_no_laminate(section, lam, plies, said):
    says(rf"deck.bdf:\d+: PCOMP 101: {said}", section, lam, plies)
