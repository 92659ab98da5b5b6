"""What a calibration could free besides E, rho and t is said with the words of case.toml."""

from types import SimpleNamespace

from chladni.workflows.calibrate import proposed
from chladni_evidence.recovery import COARSE, panel
from chladni_specimens.plates import plate


def case(assembly, parameters=()):
    return SimpleNamespace(assembly=assembly, parameters=parameters)


def test_adhesive_welds_and_spiders_of_a_deck_are_proposed():
    glue, patch, reach = proposed(case(panel(COARSE)))
    assert 'field = "adhesive-stiffness" and parts = ["glue"]' in glue
    assert 'field = "weld-patch" frees the sheet about its welds' in patch
    assert 'field = "rigid-patch" frees the sheet about its RBE2 and RBE3' in reach


def test_nothing_is_proposed_where_there_is_no_joint_or_the_user_chose():
    assert list(proposed(case(plate(0.4, 0.3, 2, 2, 1e-3)))) == []
    assert list(proposed(case(panel(COARSE), ("one",)))) == []
