"""Odd but legal values of properties: a number by theory or a note."""

import re
import warnings

import numpy as np
import pytest
from tests.builders.decks import flat_sheet
from tests.builders.refusals import says

import chladni

STEEL = "MAT1,1,2.1+5,,.3,7.85-9\n"
PLAIN = "PSHELL,1,1,2.,1,,1\n"


def sheet(section=PLAIN, material=STEEL, more=""):
    """Four quadrilaterals, 100 x 80 mm, held along one edge."""
    cards = "\n".join(flat_sheet(2, 2, 100.0, 80.0))
    return f"{cards}\n{section}{material}SPC1,1,123456,1,THRU,3\n{more}"


def line(section, material=STEEL, card="CBAR", toward=",0.,0.,1."):
    """Four bars of 50 mm in a row, held at one end."""
    grids = "".join(f"GRID,{k + 1},,{50 * k}.,0.,0.\n" for k in range(5))
    bars = "".join(f"{card},{k},1,{k},{k + 1}{toward}\n" for k in range(1, 5))
    return grids + bars + section + "\n" + material + "SPC1,1,123456,1\n"


def brick(material=STEEL):
    """One cube of 20 mm, held on one face."""
    places = [(20 * i, 20 * j, 20 * k) for k in (0, 1) for j in (0, 1) for i in (0, 1)]
    grids = "".join(f"GRID,{n},,{x}.,{y}.,{z}.\n" for n, (x, y, z) in enumerate(places, 1))
    body = "CHEXA,1,1,1,2,4,3,5,6\n,8,7\nPSOLID,1,1\n"
    return grids + body + material + "SPC1,1,123,1,THRU,4\n"


def control(text):
    """A deck of bulk data with its supports and equations selected."""
    tied = "MPC = 5\n" if "MPC," in text else ""
    return f"SOL 103\nCEND\nSPC = 1\n{tied}BEGIN BULK\n{text}"


@pytest.fixture
def modes(tmp_path):
    """Modes of bulk data, no warning of NumPy's on the way."""

    def found(text, count=8):
        path = tmp_path / "deck.bdf"
        path.write_text(control(text))
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            return chladni.modes(path, count, units="mm-t-s")

    return found


E_ALONE, G_ALONE = "MAT1,1,2.1+5,,,7.85-9\n", "MAT1,1,,8.+4,,7.85-9\n"
ALIKE = {  # what is written in two ways is one structure
    "E alone": (E_ALONE, "MAT1,1,2.1+5,0.,0.,7.85-9\n"),
    "E alone as MAT2": (E_ALONE, "MAT2,1,2.1+5,0.,0.,2.1+5,0.,0.,7.85-9\n"),
    "E alone as MAT8": ("MAT8,1,2.1+5,2.1+5,0.,0.,,,7.85-9\n", E_ALONE),
    "G alone": (G_ALONE, "MAT2,1,0.,0.,0.,0.,0.,8.+4,7.85-9\n"),
    "E and NU": (STEEL, "MAT1,1,2.1+5,80769.23,,7.85-9\n"),
}


@pytest.mark.parametrize(("one", "other"), ALIKE.values(), ids=ALIKE)
def test_blank_moduli_are_those_of_the_quick_reference(modes, one, other):
    """E and NU, or G and NU, that are both blank are 0 (MSC Nastran Quick Reference, MAT1)."""
    found = [modes(sheet("PSHELL,1,1,2.,1\n", m)).frequency for m in (one, other)]
    stiff = found[0] > 1e-3 * found[0].max()
    np.testing.assert_allclose(found[0][stiff], found[1][stiff], rtol=1e-5)
    assert np.all(found[1][~stiff] < 1e-3 * found[0].max())


def test_a_sheet_without_shear_is_a_grillage(modes):
    """With G = NU = 0 each strip along x bends alone: that of a beam with E t²/12, and shears free.

    The first bending frequency of four elements differs from Bernoulli's by their coarseness.
    """
    found = modes(sheet(material=E_ALONE))
    beam = 1.875104**2 / (2 * np.pi * 100**2) * np.sqrt(2.1e5 * 2**2 / 12 / 7.85e-9)
    flexible = found.frequency[found.frequency > 1]
    assert 0.7 < flexible[0] / beam < 1.1
    assert any("MAT1 1 has E alone" in note for note in found.notes)


@pytest.mark.parametrize("material", [E_ALONE, G_ALONE])
def test_solids_without_some_modulus_have_mechanisms(modes, material):
    """Tᵀ K T is finite, without stiffness where the material has none."""
    found = modes(brick(material), 12)
    assert found.frequency[-1] > 1e3 > 1 > found.frequency[0]


def test_a_wedge_has_the_mass_of_its_mean_thickness(modes):
    text = sheet()
    for quad in ("1,1,1,4,5,2", "3,1,4,7,8,5"):  # along an edge, where it ends in nothing
        text = text.replace(f"CQUAD4,{quad}", f"CQUAD4,{quad}\n,,,0.,0.,2.,2.")
    whole, wedge = modes(sheet()), modes(text)
    assert wedge.mass / whole.mass == pytest.approx(0.75)
    assert 0 < wedge.frequency[0] < whole.frequency[0]


@pytest.mark.parametrize(
    ("card", "same", "noted"),
    [
        ("RBAR,90,9,50", "RBAR,90,9,50,123456", False),
        ("RBAR,90,9,50,123", "".join(f"MPC,5,50,{c},1.,9,{c},-1.\n" for c in (1, 2, 3)), True),
        ("RBAR,90,9,50,,3", "MPC,5,9,3,1.,50,3,-1.", True),
    ],
)
def test_bars_with_blank_components(modes, card, same, noted):
    """Both blank: GA leads. Fewer than six: the same components of the other end move alike."""
    far = "GRID,50,,0.,0.,9.\nCONM2,91,50,,1.-5\n"
    far += "".join(f"CELAS2,{91 + c},1.,50,{c}\n" for c in (1, 2, 3))
    one, other = (modes(sheet(more=f"{far}{c}\n")) for c in (card, same))
    np.testing.assert_allclose(one.frequency, other.frequency, rtol=1e-9)
    assert any("fewer than six components" in n for n in one.notes) == noted


def test_a_negative_spring_is_computed_until_it_makes_the_structure_unstable(modes):
    """K of a mass on 5 and -3 N/mm is 2 N/mm; with -7 it falls away."""
    mass = "SPOINT,90\nCMASS2,91,1.-3,90\nCELAS2,92,5.,90\n"
    found = modes(sheet(more=mass + "CELAS2,93,-3.,90\n"))
    assert np.abs(found.frequency - np.sqrt(2 / 1e-3) / (2 * np.pi)).min() < 1e-6
    for spring in ("CELAS2,93,-7.,90\n", "CELAS2,93,-1.+6,9,3\n"):
        said = r"spring 93 .* unstable with it: 1 eigenvalue is neg"
        says(said, modes, sheet(more=mass + spring))


NUMBERS = {
    "only membrane": sheet("PSHELL,1,1,2.\n"),
    "only bending": sheet("PSHELL,1,,2.,1\n"),
    "MID3 without moduli": sheet("PSHELL,1,1,2.,1,,2\n", STEEL + "MAT2,2\n"),
    "G11 alone": sheet(material="MAT2,1,2.3+5,,,,,,7.85-9\n"),
    "G22 alone": sheet(material="MAT2,1,,,,2.3+5,,,7.85-9\n"),
    "plies of E alone": sheet("PCOMP,1\n,1,1.,0.,,1,1.,90.\n", E_ALONE),
    "core of E alone": sheet("PCOMP,1\n,1,1.,0.,,2,5.,0.\n,1,1.,0.\n", STEEL + "MAT1,2,1.\n"),
    "NU = .5": sheet(material="MAT1,1,2.1+5,,.5,7.85-9\n"),
    "soft in shear": sheet("PSHELL,1,1,2.,1,,1,1.-6\n"),
    "I1 = 0": line("PBAR,1,1,100.,,900.,9."),
    "I = J = 0": line("PBAR,1,1,100."),
    "K = 1e-9": line("PBAR,1,1,100.,800.,900.,9.\n,\n,1.-9,1.-9"),
    "bar, E alone": line("PBAR,1,1,100.,800.,900.,9.\n,\n,.8,.8", E_ALONE),
    "beam, A alone": line("PBEAM,1,1,100.", card="CBEAM"),
    "rod, A alone": line("PROD,1,1,100.", card="CROD", toward=""),
    "tube without a hole": line("PTUBE,1,1,10.", card="CTUBE", toward=""),
    "spring of nothing": sheet(more="CELAS2,90,0.,9,3\n"),
    "bush of nothing": sheet(more="CBUSH,90,7,9,,,,,0\nPBUSH,7\n"),
    "mass of nothing": sheet(more="CONM2,90,9\n"),
}


@pytest.mark.parametrize("text", NUMBERS.values(), ids=NUMBERS)
def test_a_zero_that_means_something_is_computed(modes, text):
    found = modes(text)
    assert np.all(np.isfinite(found.frequency))
    assert found.frequency.max() > 1
    assert not [note for note in found.notes if re.search("traceback|nan", note)]
