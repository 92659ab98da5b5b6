"""CalculiX solves what we write for it: a plate as Leissa has it, and as our elements have it."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.errors import ModelError
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.model.ground_springs import with_ground_bushes
from chladni.model.properties import Isotropic, Orthotropic
from chladni_evidence import calculix
from chladni_evidence.calculix import calculix_modes, installed
from chladni_evidence.calculix_deck import deck
from chladni_evidence.hidden import with_lumps
from chladni_specimens.forms.tube_frame import pipe, tube_frame
from chladni_specimens.plates import plate

needs_ccx = pytest.mark.skipif(not installed(), reason="CalculiX (ccx) is not installed")
A, T = 0.3, 1e-3
FREE_SQUARE = (13.489, 19.789, 24.432, 35.024, 35.024)  # Leissa (1973), J. Sound Vib. 31, table C21
UP = np.array([[0.0, 0.0, 1.0]])


def square(n=10, **more):
    return plate(A, A, n, n, T, **more)


def ours(assembly, count):
    return normal_modes(structure(assembly).system, count).frequency


@needs_ccx
def test_free_square_plate_is_leissas():
    """ω a² (ρt/D)^½ of the first five modes within 1 %."""
    f, _ = calculix_modes(square(), 11, np.array([0]))
    m = Isotropic(210e9, 0.3, 7850.0)
    D = m.E * T**3 / (12 * (1 - m.nu**2))
    np.testing.assert_allclose(
        2 * np.pi * f[6:11] * A**2 * np.sqrt(m.rho * T / D), FREE_SQUARE, rtol=0.01
    )


@needs_ccx
def test_shapes_are_mass_normalised():
    """At the centre of gravity the six rigid modes add up to φφᵀ = I/m, whatever their mixture."""
    a = square()
    centre = int(np.argmin(np.linalg.norm(a.points - [A / 2, A / 2, 0], axis=1)))
    _, U = calculix_modes(a, 8, np.array([centre]))
    rigid = U[0, :, :6]
    np.testing.assert_allclose(rigid @ rigid.T * mass_properties(a)[0], np.eye(3), atol=1e-4)


@needs_ccx
@pytest.mark.parametrize("degrees", [0.0, 30.0])
def test_a_grain_lies_where_our_elements_have_it(degrees):
    """Elastic modes of a sheet with E1 = 4 E2 within 1 %, the grain along an edge or across it."""
    orthotropic = Orthotropic(40e9, 10e9, 0.3, 6e9, 6e9, 6e9, 1500.0)
    turn = np.radians(degrees)

    def grained(n):
        a = square(n, material=orthotropic)
        axis = np.tile([np.cos(turn), np.sin(turn), 0.0], (len(a.shells), 1))
        return replace(a, shells=replace(a.shells, axis=axis))

    f, _ = calculix_modes(grained(10), 11, np.array([0]))
    np.testing.assert_allclose(f[6:], ours(grained(30), 11)[6:], rtol=0.01)


@needs_ccx
def test_thickness_that_varies_is_given_at_the_nodes():
    a = square(12)
    a = replace(a, shells=replace(a.shells, thickness=T * (1 + a.points[a.shells.nodes][:, :, 0])))
    f, _ = calculix_modes(a, 11, np.array([0]))
    np.testing.assert_allclose(f[6:], ours(a, 11)[6:], rtol=0.01)


@needs_ccx
def test_masses_and_springs_to_ground():
    """A stiff plate on four springs heaves at (4 k / (m + 4 M))^½."""
    a = plate(0.1, 0.1, 4, 4, 0.02)
    at = np.array([int(np.argmin(np.linalg.norm(a.points[:, :2] - c, axis=1)))
                   for c in ((0, 0), (0.1, 0), (0, 0.1), (0.1, 0.1))])  # fmt: skip
    k, M = 1e4, 0.5
    held = with_lumps(with_ground_bushes(a, at, np.tile(UP, (4, 1)), k), at, M)
    f, _ = calculix_modes(held, 8, at)
    heave = np.sqrt(4 * k / (mass_properties(a)[0] + 4 * M)) / (2 * np.pi)
    assert np.abs(f / heave - 1).min() < 2e-3


@needs_ccx
def test_tubes():
    """A frame of tubes, by beams of either code: within 2 %."""
    d = {
        **{"length": 0.6, "width": 0.4, "height": 0.3, "bay": 0.5, "narrow": 1.0},
        **{"rail": 0.02, "brace": 0.014, "t rail": 1.5e-3, "t brace": 1e-3},
    }
    a = tube_frame(d, 0.03)
    f, _ = calculix_modes(a, 14, np.array([0]))
    np.testing.assert_allclose(f[6:], ours(a, 14)[6:], rtol=0.02)


def test_what_calculix_has_no_card_for_is_refused():
    a = square(2)
    hinged = a.with_parts((a.parts[0].with_section(bending_ratio=0.5),))
    with pytest.raises(ModelError, match="plate has a bending ratio"):
        deck(hinged, 3, np.array([0]))
    lump = with_lumps(a, np.array([0]), 1.0)
    lump.masses.matrix[0, 4, 4] = 0.1
    with pytest.raises(ModelError, match="offset or inertia"):
        deck(lump, 3, np.array([0]))


def test_a_solved_deck_is_kept(tmp_path, monkeypatch):
    """The same text is not solved again, another one is."""
    calls = []
    said = "\n".join(f"  {k}  0.1E+1  0.2E+1  0.3E+1  0.0E+0" for k in (1,))
    table = "\n displacements (vx,vy,vz) for set PLACES\n\n 1  0.1E+0 0.2E+0 0.3E+0\n"

    def run(text, folder):
        calls.append(text)
        return said + table

    monkeypatch.setattr(calculix, "_run", run)
    for t in (1e-3, 1e-3, 2e-3):
        f, U = calculix_modes(plate(A, A, 2, 2, t), 1, np.array([0]), tmp_path)
    assert len(calls) == 2
    assert f.tolist() == [3.0]
    assert U[0, :, 0].tolist() == [0.1, 0.2, 0.3]


def test_a_tube_is_told_by_area_and_moment():
    """R and wall come back from A and I: what is written is the tube that was meant."""
    a = tube_frame({**dict.fromkeys(("length", "width", "height"), 0.5), "bay": 0.5,
                    "narrow": 1.0, "rail": 0.02, "brace": 0.01, "t rail": 2e-3,
                    "t brace": 1e-3}, 0.2)  # fmt: skip
    assert pipe(0.02, 2e-3).area == a.parts[0].section.area
    assert "SECTION=PIPE\n1.000000000e-02, 2.000000000e-03" in deck(a, 3, np.array([0]))
