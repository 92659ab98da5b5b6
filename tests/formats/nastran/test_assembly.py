"""Deck to Assembly: geometry in closed form, and units."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.decks import flat_sheet

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.fem.energy import rigid_motions
from chladni.io.nastran import assembly, components, read_deck, write_assembly
from chladni.io.nastran.read.analysis_requests import analysis
from chladni.model.properties import Anisotropic, Isotropic, Orthotropic
from chladni.units import UNITS
from chladni_specimens.plates import plate

from .conftest import PLATE, read_real, real_decks

MM = UNITS["mm-t-s"]
SECTION = "PSHELL,101,5,2.,5,,5\n"
BAR = """\
GRID,1,,0.,0.,0.
GRID,2,,2.,0.,0.
MAT1,5,2.1+5,,.3,7.85-9
"""


def test_plate_in_si(bulk):
    made = assembly(bulk(PLATE), MM)
    assert_allclose(made.points[2], [0.01, 0.01, 0])
    assert made.shells.nodes.tolist() == [[0, 1, 2, 3]]
    assert_allclose(made.shells.thickness, 2e-3)
    section = made.parts[0].section
    assert_allclose((section.membrane.E, section.membrane.rho), (2.1e11, 7850))
    assert not section.rigid_shear
    assert section.bending is not None
    assert not made.coupled_mass  # Nastran lumps unless told otherwise
    assert made.parts[0].name == "PSHELL 101"
    assert assembly(bulk(PLATE.replace("5,,5", "5"))).parts[0].section.rigid_shear  # MID3 blank


@pytest.mark.parametrize("name", UNITS)
def test_wtmass_scales_every_mass_and_nothing_else(bulk, name):
    text = PLATE.replace("5\nMAT1", "5,,.25\nMAT1") + "CONM2,9,1,,3.,1.,,,,4.\nCMASS2,10,2.,2,1\n"
    masses = []
    for w in ("1.", "2.5"):
        made = assembly(bulk(text + f"PARAM,WTMASS,{w}\n"), UNITS[name])
        section, M = made.parts[0].section, made.masses.matrix[0]
        assert section.membrane.E == assembly(bulk(PLATE), UNITS[name]).parts[0].section.membrane.E
        masses.append([section.membrane.rho, section.nonstructural, M[0, 0], M[3, 3],
                       made.scalar_masses.value[0]])  # fmt: skip
    assert_allclose(np.divide(*masses[::-1]), 2.5)


def test_unit_systems_agree_on_frequencies(bulk):
    """ω² = k/m has the unit 1/s² whatever the mix of components: a spring and a mass, each way."""
    text = (
        "GRID,1\nGRID,2\nCONM2,1,1,,2.,,,,,3.,,4.,,,5.\n"
        + "".join(f"CELAS2,{10 + c},7.,1,{c}\n" for c in range(1, 7))
        + "CDAMP2,30,5.,1,4\nCELAS2,31,9.,1,1,1,5\n"
    )
    for name, unit in UNITS.items():
        made = assembly(bulk(text), UNITS[name])
        m = np.diag(made.masses.matrix[0])
        expected = 7.0 / np.array([2, 2, 2, 3, 4, 5])
        assert_allclose(made.springs.value[:6] / m, expected / unit.time**2, rtol=1e-12)
        assert_allclose(made.dampers.value[0] / m[3] * unit.time, 5 / 3, rtol=1e-12)
        mixed = made.springs.value[6] / np.sqrt(m[0] * m[4]) * unit.time**2
        assert_allclose(mixed, 9 / np.sqrt(8), rtol=1e-12)


def test_nested_coordinate_systems(bulk):
    """Cylindrical in spherical in rectangular, checked against the rotations written out."""
    text = """\
CORD2R,1,,1.,2.,3.,1.,2.,4.,1.,3.,3.
CORD2S,2,1,0.,0.,0.,0.,0.,1.,1.,0.,0.
CORD2C,3,2,5.,90.,0.,5.,90.,90.,10.,90.,0.
GRID,10,1,1.,0.,0.,2
GRID,20,2,2.,90.,90.,3
GRID,30,3,2.,90.,7.
"""
    made = assembly(bulk(text))
    # system 1: origin (1, 2, 3), z up, x along global y, so y along global -x
    assert_allclose(made.points[0], [1, 3, 3], atol=1e-14)
    assert_allclose(made.points[1], [-1, 2, 3], atol=1e-14)
    # system 3: A = (5, 0, 0)_1 = (1, 7, 3); B = (0, 5, 0)_1 = (-4, 2, 3); C = (10, 0, 0)_1
    A, B, C = np.array([1.0, 7, 3]), np.array([-4.0, 2, 3]), np.array([1.0, 12, 3])
    z = (B - A) / np.linalg.norm(B - A)
    y = np.cross(z, C - A) / np.linalg.norm(np.cross(z, C - A))
    assert_allclose(made.points[2], A + 2 * y + 7 * z, atol=1e-13)
    for frame in made.axes:
        assert_allclose(frame @ frame.T, np.eye(3), atol=1e-14)
        assert np.linalg.det(frame) == pytest.approx(1)
    assert_allclose(made.axes[0, 0], [0, 1, 0], atol=1e-14)  # e_r of 2 at x_1


def test_cord1r_by_grids(bulk):
    text = "GRID,1,,1.\nGRID,2,,1.,0.,5.\nGRID,3,,1.,4.,0.\nCORD1R,9,1,2,3\nGRID,4,9,1.,2.,3.\n"
    made = assembly(bulk(text))
    assert_allclose(made.points[3], [1 - 2, 1, 3], atol=1e-14)


def test_corner_thickness_and_offsets(bulk):
    base = PLATE.replace("CQUAD4,7,101,1,2,3,4", "CQUAD4,7,101,1,2,3,4,,1.5\n,,,1.,,3.")
    shells = assembly(bulk(base), MM).shells
    assert_allclose(shells.thickness[0], [1e-3, 2e-3, 3e-3, 2e-3])
    assert_allclose(shells.offset, 1.5e-3)
    relative = assembly(bulk(base.replace(",,,1.,,3.", ",,1,.5,,3.")), MM).shells
    assert_allclose(relative.thickness[0], [1e-3, 2e-3, 6e-3, 2e-3])


@pytest.mark.parametrize(("theta", "angle"), [("30.", 30), ("", 0), ("0.", 0), ("-90.", -90)])
def test_material_axis_by_angle(bulk, theta, angle):
    axis = assembly(bulk(PLATE.replace("1,2,3,4", f"2,3,4,1,{theta}"))).shells.axis[0]
    side = np.array([0.0, 1, 0])  # from grid 2 to grid 3; the normal is +z
    across = np.array([-1.0, 0, 0])
    a = np.radians(angle)
    assert_allclose(axis, np.cos(a) * side + np.sin(a) * across, atol=1e-14)


def test_material_axis_by_system(bulk):
    cord = "CORD2C,8,,0.,0.,0.,0.,0.,1.,1.,0.,0.\n"
    axis = assembly(bulk(cord + PLATE.replace("1,2,3,4", "2,3,4,1,8"))).shells.axis[0]
    assert_allclose(axis, [np.sqrt(0.5), np.sqrt(0.5), 0], atol=1e-14)
    basic = assembly(bulk(PLATE.replace("1,2,3,4", "2,3,4,1,0"))).shells.axis[0]
    assert_allclose(basic, [1, 0, 0], atol=1e-14)


def test_symmetric_laminate_of_one_material_is_that_material(bulk):
    """A stack of one isotropic material is a homogeneous sheet, whatever its angles: G 5/6 too."""
    stack = "PCOMP,101,,,,,,,SYM\n,5,.5,30.,,5,.5,-45.\n"
    section = assembly(bulk(PLATE.replace(SECTION, stack)), MM).parts[0].section
    steel = Isotropic(2.1e11, 0.3, 7850)
    for material in (section.membrane, section.bending):
        assert_allclose(material.plane_stress(), steel.plane_stress(), rtol=1e-12, atol=1)
    assert section.coupling is None
    assert_allclose((section.thickness, section.membrane.rho), (2e-3, 7850))
    G = section.shear_ratio * section.shear.transverse()
    assert_allclose(G, 5 / 6 * steel.shear_modulus * np.eye(2), rtol=1e-9)


def test_layers_with_global_numbers(bulk):
    """PCOMPG says the same as PCOMP, a line a layer."""
    global_ = "PCOMPG,101,-.3,.2,,,,.04,\n,1,5,.5,30.\n,2,5,.7,-45.\n"
    plain = "PCOMP,101,-.3,.2,,,,.04,\n,5,.5,30.,,5,.7,-45.\n"
    a, b = (assembly(bulk(PLATE.replace(SECTION, t), fold=False), MM) for t in (global_, plain))
    assert_allclose(a.parts[0].section.bending.Q, b.parts[0].section.bending.Q)
    assert a.parts[0].section.thickness == pytest.approx(1.2e-3)
    assert_allclose([a.shells.offset, b.shells.offset], 0.3e-3)  # Z0 + T/2


def test_parameters_above_bulk_data(bulk):
    made = assembly(bulk(PLATE, before="SOL 103\nCEND\nPARAM,WTMASS,.5\nPARAM,COUPMASS,1\n"))
    assert made.coupled_mass
    assert made.parts[0].section.membrane.rho == pytest.approx(7.85e-9 / 2)


def test_k6rot(bulk):
    """100 where a deck is silent, as in MSC; CQUADR have a drilling stiffness of their own."""
    assert assembly(bulk(PLATE)).k6rot == 100
    assert assembly(bulk(PLATE + "PARAM,K6ROT,AUTO\n")).k6rot is None
    assert assembly(bulk(PLATE + "PARAM,K6ROT,100.\n")).k6rot == 100
    told = bulk(PLATE.replace("CQUAD4", "CQUADR") + "PARAM,K6ROT,100.\n")
    assert assembly(told).k6rot is None
    assert "K6ROT" in analysis(told).notes[0]


def test_k6rot_of_what_was_written_here(tmp_path):
    """The mesh keeps the drilling field it was made with, whatever is added to its deck."""
    made = read_deck(write_assembly(plate(0.3, 0.2, 3, 2, 1e-3), tmp_path / "own.bdf"))
    assert assembly(made).k6rot is None
    text = made.path.read_text()
    for change, due in (
        ("BEGIN BULK\nPARAM,K6ROT,1.", 1),
        ("SPC = 1\nBEGIN BULK\nSPC1,1,3,1", None),
    ):
        made.path.write_text(text.replace("BEGIN BULK", change))
        assert assembly(read_deck(made.path)).k6rot == due
    made.path.write_text(text.replace("$ units: SI", "$ by hand"))
    assert assembly(read_deck(made.path)).k6rot == 100


@pytest.mark.parametrize("said", ["", "PARAM,K6ROT,100.\n"])
def test_a_stringer_is_as_soft_as_in_nastran(bulk, said):
    """Offset bars hang on the rotation about the sheet's normal: the field would stiffen them."""
    bars = [f"CBAR,{90 + k},2,{3 + 5 * k},{8 + 5 * k},0.,0.,1.\n,,,0.,3.,12.,0.,-3.,12."
            for k in range(6)]  # fmt: skip
    more = "PSHELL,1,1,2.,1,,1\nPBAR,2,1,60.,500.,500.,50.\nMAT1,1,70000.,,.33,2.7-9\n"
    text = "\n".join([*flat_sheet(6, 4, 300.0, 200.0), *bars, more])
    made = assembly(bulk(said + text), "mm-t-s")
    due, found, field = (
        normal_modes(structure(a).system, 9).frequency[6]
        for a in (replace(made, k6rot=100.0), made, replace(made, k6rot=None))
    )
    assert found == pytest.approx(due, rel=1e-9)
    assert field > due


def test_material_axis_falls_back_to_y(bulk):
    """MCID 6 has x along the element's normal; 5 has not."""
    systems = "CORD2R,5,,0.,0.,0.,0.,0.,1.,1.,1.,0.\nCORD2R,6,,0.,0.,0.,0.,1.,0.,0.,0.,1.\n"
    for cid, due in ((5, (1, 1, 0)), (6, (1, 0, 0))):
        deck = bulk(PLATE.replace("1,2,3,4\n", f"1,2,3,4,{cid}\n") + systems)
        assert_allclose(assembly(deck).shells.axis[0], due / np.linalg.norm(due))
        notes = analysis(deck).notes
        assert len(notes) == (cid == 6)
        assert cid == 5 or "CQUAD4 7 and 0 others lie across x" in notes[0]


def test_unsymmetric_laminate_couples_as_its_offset_says(bulk):
    """[a, b]: B = (Q_b - Q_a) t²/8 for two layers of t/2."""
    stack = "PCOMP,101\n,5,1.,0.,,6,1.,0.\nMAT1,6,1.+5,,.3,1.-9\n"
    section = assembly(bulk(PLATE.replace(SECTION, stack)), MM).parts[0].section
    Qa, Qb = (Isotropic(E, 0.3).plane_stress() for E in (2.1e11, 1e11))
    assert_allclose(section.coupling.plane_stress(), (Qb - Qa) / 8, rtol=1e-12, atol=1)


def test_sandwich_shear_is_the_core(bulk):
    """Thin stiff faces, soft core: S = G_c d²/h_c (Allen, Sandwich Panels)."""
    stack = "PCOMP,101,,,,,,,\n,6,.1,,,5,20.,,,6,.1\nMAT1,6,7.+4,,.3\n"
    text = PLATE.replace(SECTION, stack).replace("2.1+5,,.3", "10.,4.,.25")
    section = assembly(bulk(text), MM).parts[0].section
    S = section.shear.transverse()[0, 0] * section.thickness
    assert S == pytest.approx(4e6 * 20.1e-3**2 / 20e-3, rel=1e-3)


def test_materials(bulk):
    text = PLATE.replace("101,5,2.,5,,5", "101,1,2.,2,,8,,,,,2")
    text += "MAT1,1,,8.+4,.3\nMAT2,2,9.,1.,,8.,,3.,1.-9\nMAT8,8,7.,6.,.2,3.,1.,2.\n"
    section = assembly(bulk(text)).parts[0].section
    assert isinstance(section.membrane, Isotropic)
    assert section.membrane.E == pytest.approx(2 * 1.3 * 8e4)
    assert isinstance(section.bending, Anisotropic)
    assert_allclose(section.bending.Q, [[9, 1, 0], [1, 8, 0], [0, 0, 3]])
    assert isinstance(section.shear, Orthotropic)
    assert_allclose(section.shear.transverse(), np.diag([1.0, 2.0]))
    assert section.coupling is section.bending


def test_concentrated_mass_is_its_kinetic_energy(bulk):
    """T = ½ m |v + ω × x|² + ½ ω J ω, in a turned and shifted system."""
    text = (
        "CORD2R,4,,0.,0.,0.,0.,1.,0.,0.,0.,1.\nGRID,1,,1.,1.,1.\n"
        "CONM2,9,1,4,3.,.1,.2,.3,,5.,.1,6.,.2,.3,7.\n"
    )
    M = assembly(bulk(text)).masses.matrix[0]
    R = np.array([[0, 0, 1], [1, 0, 0], [0, 1, 0]], float)  # rows: x, y, z of system 4
    x = np.array([0.1, 0.2, 0.3]) @ R
    J = R.T @ np.array([[5, -0.1, -0.2], [-0.1, 6, -0.3], [-0.2, -0.3, 7]]) @ R
    rng = np.random.default_rng(1)
    for v, w in rng.normal(size=(4, 2, 3)):
        u = v + np.cross(w, x)
        energy = 3 * u @ u + w @ J @ w
        assert np.concatenate([v, w]) @ M @ np.concatenate([v, w]) == pytest.approx(energy)


def test_mass_at_a_place(bulk):
    """CID -1: X is the place of the mass itself."""
    grid = "GRID,1,,1.,2.,3.\n"
    here = assembly(bulk(grid + "CONM2,9,1,-1,3.,1.5,2.,3.\n")).masses.matrix
    there = assembly(bulk(grid + "CONM2,9,1,,3.,.5\n")).masses.matrix
    assert_allclose(here, there)


def test_conm1_is_its_matrix(bulk):
    values = np.arange(1.0, 22)
    values[np.cumsum(np.arange(1, 7)) - 1] += 100.0  # the diagonal, so that it is of a mass
    fields = "".join(f",{v}" + ("\n" if k % 8 == 4 else "") for k, v in enumerate(values))
    M = assembly(bulk("GRID,1\nCONM1,9,1," + fields.replace("\n,", "\n,") + "\n")).masses.matrix[0]
    assert_allclose(M[np.tril_indices(6)], values)
    assert_allclose(M, M.T)


def test_bar_orientation_offsets_pins(bulk):
    """G0, a vector in the displacement frame of GA, BAROR, and pins."""
    text = BAR + "GRID,3,,0.,0.,5.\nPBAR,1,5,1.,2.,3.,4.,.5\n"
    frame = "CORD2R,7,,0.,0.,0.,1.,0.,0.,0.,1.,0.\n"
    by_grid = assembly(bulk(text + "CBAR,9,1,1,2,3\n")).beams
    assert_allclose(by_grid.up, [[0, 0, 5]])
    turned = text.replace("GRID,1,,0.,0.,0.", "GRID,1,,0.,0.,0.,7") + frame
    beams = assembly(bulk(turned + "CBAR,9,1,1,2,0.,1.,0.,GGG\n,46,5,.1,.2,.3,.4,.5,.6\n")).beams
    # system 7: z along x, x along y, so y along z
    assert_allclose(beams.up, [[0, 0, 1]], atol=1e-14)
    assert_allclose(beams.offset[0, 0], [0.3, 0.1, 0.2], atol=1e-14)
    assert_allclose(beams.offset[0, 1], [0.4, 0.5, 0.6], atol=1e-14)
    assert np.flatnonzero(beams.pins[0, 0]).tolist() == [3, 5]
    assert np.flatnonzero(beams.pins[0, 1]).tolist() == [4]
    usual = assembly(bulk(text + "BAROR,,1,,,0.,2.,0.\nCBAR,9,,1,2\n")).beams
    assert_allclose(usual.up, [[0, 2, 0]])


def test_element_frame_offsets(bulk):
    """OFFT GOO: offsets along the axes of the bar itself."""
    text = BAR.replace("2.,0.,0.", "0.,2.,0.") + "PBAR,1,5,1.,2.,3.,4.\n"
    beams = assembly(bulk(text + "CBAR,9,1,1,2,0.,0.,1.,GOO\n,,,.1,.2,.3,.1,.2,.3\n")).beams
    # x along global y, y along global z, z along global x
    assert_allclose(beams.offset[0], [[0.3, 0.1, 0.2]] * 2, atol=1e-14)


def walls(*rectangles):
    """Second moment of area of rectangles (from, to, width) about their common centre."""
    y0, y1, b = np.array(rectangles, float).T
    A, y, h = b * (y1 - y0), (y0 + y1) / 2, y1 - y0
    return (b * h**3 / 12 + A * (y - A @ y / A.sum()) ** 2).sum()


I_BEAM = walls((0, 1, 6), (1, 9, 1), (9, 10, 6))
PROFILES = {  # sizes, area, I1, J
    "ROD": ([2.0], np.pi * 4, np.pi * 4, np.pi * 8),
    "TUBE": ([2.0, 1.0], np.pi * 3, np.pi * 15 / 4, np.pi * 15 / 2),
    "TUBE2": ([2.0, 1.0], np.pi * 3, np.pi * 15 / 4, np.pi * 15 / 2),
    "BAR": ([3.0, 3.0], 9.0, 81 / 12, 0.1406 * 81),
    "BOX": ([4.0, 4.0, 0.1, 0.1], 16 - 3.8**2, (4**4 - 3.8**4) / 12, 3.9**3 * 0.1),
    "BOX1": ([4.0, 4.0, 0.1, 0.1, 0.1, 0.1], 16 - 3.8**2, (4**4 - 3.8**4) / 12, 3.9**3 * 0.1),
    "I": ([10.0, 6.0, 6.0, 1.0, 1.0, 1.0], 20.0, I_BEAM, 20 / 3),
    "I1": ([5.0, 1.0, 8.0, 10.0], 20.0, I_BEAM, 20 / 3),
    "CHAN": ([6.0, 10.0, 1.0, 1.0], 20.0, I_BEAM, 20 / 3),
    "CHAN1": ([5.0, 1.0, 8.0, 10.0], 20.0, I_BEAM, 20 / 3),
    "Z": ([5.0, 1.0, 8.0, 10.0], 20.0, I_BEAM, 20 / 3),
    "H": ([8.0, 2.0, 6.0, 1.0], 20.0, (2 * 216 + 8) / 12, 20 / 3),
    "T": ([6.0, 10.0, 1.0, 1.0], 15.0, walls((0, 9, 1), (9, 10, 6)), 15 / 3),
    "T2": ([6.0, 10.0, 1.0, 1.0], 15.0, walls((0, 9, 1), (9, 10, 6)), 15 / 3),
    "T1": ([10.0, 5.0, 1.0, 1.0], 15.0, (1000 + 5) / 12, 15 / 3),
    "L": ([6.0, 10.0, 1.0, 1.0], 15.0, walls((0, 1, 6), (1, 10, 1)), 15 / 3),
    "CROSS": ([5.0, 1.0, 10.0, 1.0], 15.0, (1000 + 5) / 12, 15 / 3),
    "CHAN2": ([1.0, 1.0, 6.0, 10.0], 20.0, walls((0, 1, 10), (1, 6, 2)), 20 / 3),
    "HAT": ([5.0, 1.0, 6.0, 3.0], 20.0, walls((0, 1, 8), (1, 4, 2), (4, 5, 6)), 20 / 3),
    "HAT1": ([8.0, 4.1, 4.1, 0.1, 0.1], 2.38, walls((0, 0.1, 8), (0.1, 0.2, 4.1), (0.2, 4, 0.2),
             (4, 4.1, 4.1)), 4**3 * 0.1),
    "DBOX": ([8.0, 4.0, 4.0, *[0.1] * 7], 2.74, 0.3 * 4**3 / 12 + 7.7 * (4**3 - 3.8**3) / 12,
             8 * 3.95**2 * 3.9**2 * 0.1 / (2 * 3.95 + 3.9)),
    "HEXA": ([1.0, 4.0, 2 * 3**0.5], 6 * 3**0.5, 5 * 3**0.5, 10.3923**4 / 40 / 17.3205),
}  # fmt: skip


@pytest.mark.parametrize("shape", PROFILES)
@pytest.mark.parametrize("kind", ["BAR", "BEAM"])
def test_cross_sections(bulk, shape, kind):
    """Areas and moments written out by hand; J of a thin closed section is 4 A²/∮ds/t."""
    sizes, area, I1, J = PROFILES[shape]
    card = f"P{kind}L,1,5,,{shape}\n," + ",".join(map(str, sizes))
    section = assembly(bulk(f"{BAR}{card},.5\nC{kind},9,1,1,2,0.,1.,0.\n")).parts[0].section
    assert_allclose((section.area, section.I1, section.nonstructural), (area, I1, 0.5))
    assert section.J == pytest.approx(J, rel=2e-3)
    assert (section.I12 != 0) == (shape in ("Z", "L"))


def test_bush_frames_and_places(bulk):
    text = (
        "GRID,1\nGRID,2,,0.,4.,0.\nPBUSH,1,K,1.,2.,3.,4.,5.,6.\n,,B,.1,.2\n,,GE,.05\n"
        "CORD2R,7,,0.,0.,0.,1.,0.,0.,0.,1.,0.\n"
    )
    cards = (
        "CBUSH,1,1,1,2,0.,0.,1.\nCBUSH,2,1,1,2,,,,7\n,.25\nCBUSH,3,1,1,,,,,0\n"
        "CBUSH,4,1,1,2,,,,0\n,,7,1.,2.,3.\n"
    )
    bushes = assembly(bulk(text + cards), MM).bushes
    assert_allclose(bushes.frame[:2], [[[0, 1, 0], [0, 0, 1], [1, 0, 0]]] * 2, atol=1e-14)
    places = np.array([[0, 2, 0], [0, 1, 0], [0, 0, 0], [3, 1, 2]])
    assert_allclose(bushes.place, 1e-3 * places, atol=1e-15)
    assert_allclose(bushes.stiffness[0], [1e3, 2e3, 3e3, 4e-3, 5e-3, 6e-3])
    assert_allclose(bushes.viscous[0, :3], [100, 200, 0])
    assert_allclose(bushes.loss[0], 0.05)
    assert bushes.nodes[2].tolist() == [0, -1]


@pytest.mark.parametrize("unit", [None, "mm-t-s"])
@pytest.mark.parametrize(
    ("card", "count"),
    [("RBE1,9,1,123,2,23,3,3\n,UM,1,456,4,123", 6), ("RBAR,9,1,4,123,456", 6),
     ("RROD,9,1,4,1,", 1), ("RBAR,9,1,4,12345,4,6,12356", 6),
     ("RTRPLT,9,1,2,4,1235,3,3,,,12", 2), ("RTRPLT,9,1,2,4,123,13,3", 12)],
)  # fmt: skip
def test_rigid_equations_leave_rigid_motions_free(bulk, card, count, unit):
    """Σ a q = 0 for every rigid motion, in turned frames and any unit."""
    text = PLATE.replace("3,,10.,10.,0.", "3,,9.,8.,2.,7").replace("1,,0.,0.,0.", "1,,.5,.3,1.,7")
    cord = "CORD2R,7,,0.,0.,0.,1.,1.,0.,0.,1.,3.\n"
    made = assembly(bulk(f"{cord}{text}{card}\n"), unit and UNITS[unit])
    assert len(made.rigid) == count
    R = rigid_motions(made).reshape(-1, 2, 3, 6)
    if made.axes is not None:  # in the displacement frames
        R = np.einsum("nij,nkjr->nkir", made.axes, R)
    q = R.reshape(-1, 6, 6)
    for tie in made.rigid:
        terms = [a * q[n, c - 1] for n, c, a in zip(tie.nodes, tie.components, tie.factors,
                                                    strict=True)]  # fmt: skip
        assert_allclose(np.sum(terms, axis=0), 0, atol=1e-11 * max(np.abs(made.points).max(), 1))
        assert tie.factors[0] != 0


def test_rigid_bodies_averages_and_equations(bulk):
    text = PLATE + (
        "RBE2,20,1,123456,2,3\nRBE3,21,,4,123456,1.,123,1,2\n,.5,123456,3\n,UM,1,123,2,12,3,3\n"
        "MPC,5,1,1,2.,2,2,-1.\n,,3,5,4.\nMPC,6,1,1,1.\nMPCADD,7,5\n"
    )
    made = assembly(bulk(text, before="SOL 103\nCEND\nMPC = 7\n"), MM)
    body, mean, equation = made.rigid
    assert (body.independent, body.dependent) == (0, (1, 2))
    assert body.components == ((1, 2, 3, 4, 5, 6),) * 2
    assert mean.reference == 3
    assert mean.terms == ((0, (1, 2, 3), 1.0), (1, (1, 2, 3), 1.0), (2, (1, 2, 3, 4, 5, 6), 0.5))
    assert mean.moved == ((0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (2, 3))
    assert (equation.nodes, equation.components) == ((0, 1, 2), (1, 2, 5))
    assert_allclose(equation.factors, [2, -1, 4e-3])


def test_supports(bulk):
    """GRID PS, SPC, SPC1 with THRU (over grids that exist), SPCADD, GRDSET."""
    text = PLATE.replace("GRID,4,,0.,10.,0.", "GRID,4,,0.,10.,0.,,345") + (
        "SPC,1,1,12,0.,2,3,0.5\nSPC1,2,6,2,THRU,90\nSPCADD,3,1,2\nSPC1,4,1,3\n"
    )
    held = assembly(bulk(text, before="CEND\nSPC = 3\n")).supports.tolist()
    assert held == [[0, 1], [0, 2], [1, 3], [1, 6], [2, 6], [3, 3], [3, 4], [3, 5], [3, 6]]
    one = text.replace("SPC1,4,1,3\n", "")
    assert assembly(bulk(one)).supports.tolist() == held  # no case control: the only top set
    assert len(assembly(bulk(text, before="CEND\nTITLE = none selected\n")).supports) == 3


def test_components(bulk):
    """Two plates joined by nothing; by a spring; by an RBE2; or one held."""
    corners = enumerate([(0, 0), (9, 0), (9, 9), (0, 9)], start=10)
    second = "".join(f"GRID,{k},,{x}.,{y}.,5.\n" for k, (x, y) in corners)
    text = PLATE + second + "CQUAD4,17,102,10,11,12,13\nPSHELL,102,5,1.,5\n"
    assert np.bincount(components(assembly(bulk(text), loose=True))).tolist() == [4, 4]
    for joint in ("CELAS2,50,1.,1,3,10,3\n", "RBE2,50,1,123,10\n",
                  "CBUSH,50,5,1,10,,,,0\nPBUSH,5,K,1.\n", "MPC,1,1,3,1.,10,3,-1.\n",
                  "RBE3,50,,1,123456,1.,123,10,11,12\n"):  # fmt: skip
        assert components(assembly(bulk(text + joint))).max() == 0
    for held in ("SPC1,1,123,10,11,12\n", "CELAS2,50,1.,10,3\n"):
        assert len(assembly(bulk(text + held)).parts) == 2


@real_decks()
def test_real_decks_convert(path):
    """Points, elements and ties of every reference deck, finite throughout."""
    made = assembly(read_real(path), MM)
    assert len(made.ids) == len(np.unique(made.ids))
    for table in (made.points, made.shells.thickness, made.springs.value, made.masses.matrix):
        assert np.all(np.isfinite(table))


@pytest.mark.parametrize(
    "card",
    [
        "PBEAM,1,5,2.,.5,.25,,,.1\n,,,,,,,,\n,YES,1.,2.,,.25\n,,,,,,,,\n,1.,1.",
        "PBEAM,1,5,2.,.5,.25,,,.1\n,NO,.5,2.,.5,.25,,,.1\n,NO,1.,,,,,,.1\n,1.,1.,,,,,,\n,,,,,.1,,.1",
        "PBEAML,1,5,,BAR\n,2.,1.,.1,YES,1.,2.,1.,.1",
    ],
)
def test_stations_that_repeat_end_A_make_no_taper(bulk, card):
    section = assembly(bulk(f"{PLATE}CBEAM,8,1,1,2,0.,0.,1.\n{card}\n")).parts[-1].section
    assert section.kind == "beam"
    assert section.area == pytest.approx(2.0)
    assert section.nonstructural == pytest.approx(0.1)
    assert not section.stations
