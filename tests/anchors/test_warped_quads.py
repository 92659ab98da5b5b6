"""CQUAD4 whose corners lie off its mean plane: a patch of MSC Nastran 2020, figures of the rule."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.builders.statics import motion_at, subcase_statics

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.io.nastran.read.analysis_requests import analysis
from chladni.io.nastran.read.assembly_from_deck import assembly
from chladni.io.nastran.text.deck import read_deck

FOLDER = Path(__file__).resolve().parents[2] / "../shared/anchors/warped_quads"
MSC = np.array([-5.1959488e-3, 3.2730366e-3, -2.1422641e-2])  # grid 12432 [in]
CORNER_SLOPES = {  # first elastic modes, free [Hz]; one slope for all corners: 1841 and 457 Hz
    "five_quads.bdf": (1292.2, 1767.4, 2355.3),
    "recess_corner.bdf": (398.5, 490.6, 611.1),
}


def deck(name):
    if not FOLDER.exists():
        pytest.skip(f"no reference results at {FOLDER}")
    return read_deck(FOLDER / name)


def test_patch_of_msc():
    """Four quads of an aircraft's nose, outer grids moved as in MSC's own result: 2e-6 in."""
    source = deck("msc_patch.bdf")
    asked, made = analysis(source), assembly(source)
    u = subcase_statics(made, asked, asked.subcases[0])
    found = motion_at(made, np.array([(12432, 1), (12432, 2), (12432, 3)]), u).ravel()
    np.testing.assert_allclose(found, MSC, rtol=0, atol=2e-6)


@pytest.mark.parametrize("name", CORNER_SLOPES)
def test_figures_of_the_rule(name):
    """Six rigid modes and the figures measured for this rule, drilling as a model without K6ROT."""
    made = replace(assembly(deck(name)), k6rot=None)
    f = normal_modes(structure(made).system, 9).frequency
    assert f[5] < 1e-5 * f[6]
    np.testing.assert_allclose(f[6:], CORNER_SLOPES[name], atol=0.06)


def test_k6rot_of_the_recess():
    """K6ROT 100 is a hundredth of the field's stiffness: within half a percent of the figures.

    Five quads alone hang on it more: their second mode, 1767 Hz, falls to 1594.
    """
    f = normal_modes(structure(assembly(deck("recess_corner.bdf"))).system, 9).frequency
    assert f[5] < 1e-5 * f[6]
    np.testing.assert_allclose(f[6:], CORNER_SLOPES["recess_corner.bdf"], rtol=5e-3)
