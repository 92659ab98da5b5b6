"""Welded and glued coupons against CalculiX: another code's shells, solids and constraints."""

import numpy as np
import pytest
from tests.specimens.test_connections import STEEL, sheet

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.model.properties import Isotropic, Part, ShellSection
from chladni_evidence.calculix import calculix_modes, installed
from chladni_specimens.joints.builders import adhesive_bead, spot_welds
from chladni_specimens.tailgate.design import TailgateDesign
from chladni_specimens.tailgate.tailgate import of_sheets, tailgate

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not installed(), reason="CalculiX (ccx) is not installed"),
]
H, GAP = 0.005, 0.0015
KNOWN = {  # measured, where the first ten modes of the tailgate are more than 3 % apart
    # Before membranes hung on warped corners by each corner's slope: 2: 3.4, 4: 5.6, 5: 3.1,
    # 8: 3.6 % at 30 mm and 4: 3.3, 8: 3.1 % at 20 mm. Most came nearer; 9 and 10 moved away but
    # stay within 3 %; 8 left it, because ours fell (131.8 -> 128.7, 128.6 -> 127.1 Hz) towards the
    # 124.8 Hz of 8 mm while CalculiX's still stands high (136.6, 132.8, at 16 mm 131.1 Hz).
    0.03: {8: 0.059},
    0.02: {8: 0.043},
}


def coupon(gap=GAP):
    """Two strips of 0.8 and 1.2 mm that overlap by 40 mm, of different meshes."""
    y = np.linspace(0, 0.05, 11)
    a = sheet("a", np.linspace(0, 0.12, 25), y, 0.0)
    b = sheet("b", np.linspace(0.08, 0.2, 24), np.linspace(0, 0.05, 12), gap)
    parts = (
        Part(1, "a", ShellSection(0.8e-3, STEEL, STEEL)),
        Part(2, "b", ShellSection(1.2e-3, STEEL, STEEL)),
    )
    return of_sheets({"a": a, "b": b}, parts)[0]


def calculix(assembly, count):
    """Frequencies from ccx: quadratic shells on the same corners, C3D8I solids, equations."""
    return calculix_modes(assembly, count, np.array([0]))[0]


def ours(assembly, count):
    return normal_modes(structure(assembly).system, count).frequency


WELDS = np.array([(0.09, 0.012, GAP / 2), (0.10, 0.038, GAP / 2), (0.111, 0.025, GAP / 2)])
LINE = np.column_stack([np.full(12, 0.1), np.linspace(0.003, 0.047, 12), np.full(12, GAP / 2)])


@pytest.mark.parametrize("patch", [0.0, 0.006])
def test_welds(patch):
    """Ten elastic modes of a free welded coupon within 2 %."""
    assembly, _ = spot_welds(coupon(), WELDS, ("a", "b"), patch=patch)
    compare(assembly)


@pytest.mark.parametrize(
    "material",
    [Isotropic(6e6, 0.4, 1000.0), Isotropic(100e6, 0.45, 1000.0), Isotropic(210e9, 0.49, 1000.0)],
    ids=["soft", "cured", "steel-like"],
)
def test_bead(material):
    """The same of a glued one, from sealant to a steel-like adhesive."""
    assembly, _ = adhesive_bead(coupon(), LINE, ("a", "b"), width=0.012, material=material)
    compare(assembly)


def compare(assembly):
    theirs = calculix(assembly, 16)
    mine = ours(assembly, 16)
    assert (mine[:6] < 0.5).all()
    assert mine[6] > 5
    np.testing.assert_allclose(mine[6:], theirs[6:], rtol=0.02)


@pytest.mark.parametrize("size", list(KNOWN))
def test_first_ten_modes_of_the_tailgate(size):
    """Within 3 %, but for those in KNOWN, which are held to the figure measured.

    CalculiX has quadratic shells on the same corners, ours are linear: on a coarse mesh ours are
    higher, least so for the finer one. Mode 8, a strut one shell wide, is lower here: CalculiX
    joins the expanded shells of its folds by rigid knots. At 16 mm the other nine are within 1.6 %.
    """
    assembly = tailgate(TailgateDesign(size=size, screws=False))
    theirs, mine = calculix(assembly, 16)[6:], ours(assembly, 16)[6:]
    limit = [KNOWN[size].get(k, 0.03) for k in range(1, 11)]
    assert (np.abs(mine / theirs - 1) < limit).all()
