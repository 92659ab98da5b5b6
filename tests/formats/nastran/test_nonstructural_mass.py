"""NSM, NSM1, NSML, NSML1: the mass that they add, and where."""

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.fem.energy import mass_properties
from chladni.io.nastran import assembly
from chladni.units import UNITS

from .conftest import PLATE

BARS = "CBAR,8,9,1,2,0.,0.,1.\nCROD,9,12,2,3\nCONROD,11,3,4,5,.5\nCQUAD4,17,101,1,2,3,4\n"
BARS += "PBAR,9,5,.5,1.,1.,1.\nPROD,12,5,.5,1.\n"
MORE = {  # kg of two shells of 100 mm², and of a bar, a rod and a conrod of 10 mm each
    "NSM,4,PSHELL,101,2.-9": 2 * 2e-4,
    "NSM,4,PSHELL,101,2.-9,101,3.-9": 2 * 5e-4,
    "NSM,4,ELEMENT,7,2.-9,8,3.-9": 2e-4 + 3e-5,
    "NSM,4,PBAR,9,2.-9,12,3.-9": 2e-5,
    "NSM1,4,ELEMENT,2.-9,8,9,11": 6e-5,
    "NSM1,4,ELEMENT,2.-9,7,THRU,9": 2e-4 + 4e-5,
    "NSM1,4,CONROD,2.-9,ALL": 2e-5,
    "NSM1,4,ELEMENT,2.-9,ALL": 4e-4 + 6e-5,
    "NSM1,4,PSHELL,2.-9,101,102": 4e-4,
    "NSML,4,PSHELL,101,5.-7": 5e-4,
    "NSML,4,ELEMENT,7,5.-7,9,3.-7": 8e-4,
    "NSML1,4,PROD,5.-7,12": 5e-4,
    "NSML1,4,ELEMENT,5.-7,8,9": 5e-4,
    "NSM1,5,ELEMENT,2.-9,7\nNSML,6,PBAR,9,5.-7\nNSM,7,PBAR,9,1.\nNSMADD,4,5,6": 2e-4 + 5e-4,
}


@pytest.mark.parametrize("coupled", [1, -1])
@pytest.mark.parametrize("cards", MORE)
def test_mass_that_is_selected(bulk, cards, coupled):
    """A unit of area or length, or all of it spread over all that an entry names."""
    text = f"{PLATE}{BARS}{cards}\nPARAM,COUPMASS,{coupled}\n"
    without, with_it = (
        assembly(bulk(text, f"SOL 103\nCEND\n{chosen}"), UNITS["mm-t-s"])
        for chosen in ("", "NSM = 4\n")
    )
    more = mass_properties(with_it)[0] - mass_properties(without)[0]
    assert more == pytest.approx(MORE[cards])


def test_a_total_is_shared_by_area(bulk):
    """NSML1 of all shells: the same kg/m² on a triangle and on a square of twice its area."""
    text = PLATE + "CTRIA3,8,101,1,2,3\nNSML1,4,PSHELL,3.-7,101\n"
    made = assembly(bulk(text, "SOL 103\nCEND\nNSM = 4\n"), UNITS["mm-t-s"])
    np.testing.assert_allclose(made.shells.nonstructural, 3e-4 / 150e-6)


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("NSM,4,PBEND,101,1.", "NSM 4: TYPE 'PBEND' is not understood; there are PSHELL"),
        ("NSM1,4,ELEMENT,1.,7,99", "NSM1 4: element 99 is no shell, bar"),
        ("NSML1,4,ELEMENT,1.,7,8", "areas and lengths"),
        ("NSM,4,PSHELL,101,-1.", "NSM 4: its mass is negative, and more than element 7"),
        ("NSM,4,PSHELL,101,x", "VALUE is 'X', not a number"),
        ("NSM1,4,PSHELL,x,1.,101", "VALUE is 'X', not a number"),
        ("NSM,5,PSHELL,101,1.", "NSM set 4 is selected but there is no such set; there are 5"),
    ],
)
def test_mass_that_is_not_understood(bulk, card, said):
    deck = bulk(f"{PLATE}{BARS}{card}\n", "SOL 103\nCEND\nNSM = 4\n")
    says(said, assembly, deck, UNITS["mm-t-s"])
