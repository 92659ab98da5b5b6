"""Rotations with little or no inertia: masses on a bar, joints that turn freely.

The bar has no mass. A deck in any units says the same; the closed forms are those of two bodies
joined by the bar's own stiffness, of plane 1 with a hinge about z at the second body.
"""

from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose
from tests.builders.elements import bars

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.system import System
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck
from chladni.model.assembly import Equation
from chladni.model.properties import BeamSection, Isotropic, Part
from chladni_specimens.plates import plate

E, G, A, I1, I2, J, L, M = 210e9, 80e9, 1e-4, 1e-9, 3e-9, 2e-9, 1.5, 2.0  # SI


def hinged(folder, inertia, n=1, metre=1.0, kilogram=1.0):
    """N bars between two CONM2; the second one turns freely about z (MPC). Units: per m, per kg."""
    stress, turn = kilogram / metre, kilogram * metre**2
    text = "SOL 103\nCEND\nMPC = 7\nBEGIN BULK\n"
    for k, x in enumerate([*np.linspace(0, L, n + 1), L], start=1):
        text += f"GRID,{k},,{float(x * metre)!r},0.,0.\n"
    for k in range(1, n + 1):
        text += f"CBAR,{k},1,{k},{k + 1},0.,1.,0.\n"
    text += f"PBAR,1,1,{A * metre**2!r},{I1 * metre**4!r},{I2 * metre**4!r},{J * metre**4!r}\n"
    text += f"MAT1,1,{E * stress!r},{G * stress!r}\n"
    for k, grid in ((901, 1), (902, n + 2)):
        i = float(inertia * turn)
        text += f"CONM2,{k},{grid},,{M * kilogram!r}\n,{i!r},,{i!r},,,{i!r}\n"
    text += "".join(f"MPC,7,{n + 2},{c},1.,{n + 1},{c},-1.\n" for c in range(1, 6))
    file = folder / "hinged.bdf"
    file.write_text(text + "ENDDATA\n")
    return structure(assembly(read_deck(file))).system


def closed_form(i):
    """Elastic frequencies [Hz]: extension, plane 1 with the hinge, and with inertia the others."""
    lam = [2 * E * A / L / M]
    if i:
        lam.append(3 * E * I1 / L**3 * (2 / M + L**2 / i))  # ½ (3EI/L³) (w₂ - w₁ - L θ₁)²
        lam.append(2 * G * J / L / i)
        lam.append(2 * E * I2 / L / i)  # ends turn against each other
        lam.append(12 * E * I2 / L * (1 / (2 * i) + 2 / (M * L**2)))  # and with each other
    return np.sqrt(np.sort(lam)) / (2 * np.pi)


@pytest.mark.parametrize(
    ("inertia", "n"), [(i, n) for i in (1e-2, 1e-6, 1e-10) for n in (1, 80)] + [(1e-14, 1)]
)
def test_hinged_bar(tmp_path, inertia, n):
    """Six rigid modes and the closed forms, dense and sparse, however light the rotations are."""
    due = closed_form(inertia)
    f = normal_modes(hinged(tmp_path, inertia, n), 6 + len(due)).frequency
    assert f[5] < 1e-3 * due[0]
    assert_allclose(f[6:], due, rtol=1e-6)


@pytest.mark.parametrize("n", [1, 80])
def test_bar_between_points(tmp_path, n):
    """No inertia: bending and torsion have no modes, turning about itself is no motion."""
    f = normal_modes(hinged(tmp_path, 0.0, n)).frequency
    assert len(f) == 6
    assert f[4] < 1e-4 * f[5]
    assert_allclose(f[5:], closed_form(0.0), rtol=1e-8)


@pytest.mark.parametrize("inertia", [1e-6, 0.0])
@pytest.mark.parametrize(("metre", "kilogram"), [(1e3, 1e-3), (1e-6, 1.0), (1e6, 1e6)])
def test_units_do_not_matter(tmp_path, inertia, metre, kilogram):
    """The same deck in mm and t, and in units that nobody uses."""
    due = closed_form(inertia)
    f = normal_modes(hinged(tmp_path, inertia, 1, metre, kilogram)).frequency
    assert_allclose(f[-len(due) :], due, rtol=1e-6)
    assert f[-len(due) - 1] < 1e-3 * due[0]


@pytest.mark.parametrize("factor", [1e-6, 1e6])
@pytest.mark.parametrize("n", [1, 80])
def test_frequencies_go_with_the_root_of_stiffness(tmp_path, n, factor):
    s = hinged(tmp_path, 1e-6, n)
    scaled = System(s.M, s.V, sp.csr_array(s.K * factor), s.dofs)
    a, b = (normal_modes(x, 11).frequency for x in (s, scaled))
    assert_allclose(b[6:], np.sqrt(factor) * a[6:], rtol=1e-7)


def strutted(cells, held):
    """A free plate, corners joined by a bar without mass on ball joints; ``held``: it is not free
    to turn about itself."""
    sheet = plate(0.3, 0.2, cells, cells, 1e-3)
    n, corners = len(sheet.points), (0, len(sheet.points) - 1)
    along = np.diff(sheet.points[list(corners)], axis=0)
    bar = bars([[n, n + 1]], 1, (0, 0, 1))
    section = BeamSection(Isotropic(210e9, 0.3, 0.0), 1e-6, 1e-9, 1e-9, 0.0, 2e-9, (0, 0))
    balls = tuple(Equation(1, (n + k, c), (d, d), (1.0, -1.0))
                  for k, c in enumerate(corners) for d in (1, 2, 3))  # fmt: skip
    axial = Equation(2, (n, n), (4, 5), tuple(along[0, :2]))  # of the rotation of one end
    made = replace(
        sheet, ids=np.arange(1, n + 3), points=np.vstack([sheet.points, sheet.points[[*corners]]]),
        parts=(*sheet.parts, Part(99, "strut", section)), beams=bar,
        rigid=(*balls, axial) if held else balls,
    )  # fmt: skip
    return structure(made).system


@pytest.mark.parametrize("cells", [4, 14])
@pytest.mark.parametrize("wanted", [{"count": 12}, {"band": 300.0}])
def test_a_massless_mechanism_is_no_mode(cells, wanted):
    """What turns without stiffness and mass changes nothing, held or not; dense and sparse."""
    free, held = (normal_modes(strutted(cells, h), **wanted).frequency for h in (False, True))
    assert len(free) == len(held)
    assert free[5] < 1e-3 * free[6]
    assert_allclose(free[6:], held[6:], rtol=1e-7)
