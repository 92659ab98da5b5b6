"""Loads, excitation, damping and frequencies: resultants, virtual work, closed forms."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from chladni.io.nastran import analysis, assembly, read_deck
from chladni.io.nastran.read.pressure import on_face
from chladni.model.analysis import Tabulated
from chladni.units import UNITS

from .conftest import ANCHORS, CUBE, PLATE, needs_decks

MM = UNITS["mm-t-s"]


def resultant(load, points):
    """(force, moment about the origin) of a load."""
    f, m = np.zeros((len(points), 3)), np.zeros((len(points), 3))
    for row, c, value in zip(load.rows, load.components, load.values, strict=True):
        (f if c <= 3 else m)[row, (c - 1) % 3] += value
    return f.sum(axis=0), (np.cross(points, f) + m).sum(axis=0)


def resultants(deck, units=None):
    """{load: (force, moment)} of a deck."""
    points = assembly(deck, units).points
    return {sid: resultant(load, points) for sid, load in analysis(deck, units).loads.items()}


def test_forces_in_any_system(bulk):
    """A moment turned by a cylindrical system; units of both."""
    text = PLATE + (
        "CORD2C,7,,0.,0.,0.,0.,0.,1.,1.,0.,0.\nFORCE,1,3,7,2.,0.,3.,0.\nMOMENT,1,3,,4.,0.,0.,1.\n"
        "FORCE1,2,1,8.,1,2\n"
    )
    loads = resultants(bulk(text), MM)
    F, M = 6 * np.array([-1, 1, 0]) / np.sqrt(2), np.array([0, 0, 4e-3])  # F along e_t
    assert_allclose(loads[1][0], F, atol=1e-14)
    assert_allclose(loads[1][1], np.cross([1e-2, 1e-2, 0], F) + M, atol=1e-15)
    assert_allclose(loads[2][0], [8, 0, 0])


def test_combinations(bulk):
    """S Σ S_i L_i; what cancels is gone."""
    text = PLATE + (
        "FORCE,1,1,,3.,1.\nFORCE,2,1,,1.,1.\nFORCE,2,2,,1.,,1.\nGRAV,3,,9.81,0.,0.,-1.\n"
        "LOAD,9,2.,1.,1,-3.,2,.5,3\n"
    )
    load = analysis(bulk(text)).loads[9]
    assert (load.rows.tolist(), load.components.tolist(), load.values.tolist()) == ([1], [2], [-6])
    assert_allclose(load.gravity, [0, 0, -9.81])
    in_si = analysis(bulk(text), UNITS["mm-kg-ms"]).loads[9]
    assert_allclose(in_si.gravity, [0, 0, -9.81e-3 / 1e-6])


def test_pressure_does_the_virtual_work():
    """Σ f·u = ∫ p n·u dA for every linear u and bilinear p, on a flat skew face."""
    X = np.array([[0.0, 0, 0], [3, 0.5, 0], [2.5, 2, 0], [-0.5, 1.5, 0]])
    rng = np.random.default_rng(0)
    p, a = rng.normal(size=4), rng.normal(size=3)
    xi, w = np.polynomial.legendre.leggauss(6)
    s, t = np.array([-1, 1, 1, -1]), np.array([-1, -1, 1, 1])
    work = 0.0
    for x, wx in zip(xi, w, strict=True):
        for y, wy in zip(xi, w, strict=True):
            N = (1 + s * x) * (1 + t * y) / 4
            J = np.linalg.det(np.array([s * (1 + t * y), t * (1 + s * x)]) @ X[:, :2] / 4)
            work += wx * wy * J * (N @ p) * (a @ [1, *(N @ X)[:2]])
    f = on_face(X, p)
    assert f[:, 2] @ (a[0] + X[:, :2] @ a[1:]) == pytest.approx(work)
    tri = on_face(X[:3], np.ones(3))
    assert_allclose(tri, np.tile(np.cross(X[1] - X[0], X[2] - X[0]) / 6, (3, 1)))


def test_pressure_on_shells(bulk):
    """Along the normal, by PLOAD4, PLOAD2 and PLOAD alike; along a way when one is given."""
    cards = "PLOAD4,1,7,3.\nPLOAD2,2,3.,7\nPLOAD,3,3.,1,2,3,4\nPLOAD4,4,7,3.\n,,1.,0.,-1.\n"
    loads = resultants(bulk(PLATE + cards), MM)
    for sid in (1, 2, 3):
        assert_allclose(loads[sid][0], [0, 0, 300], atol=1e-12)
        assert_allclose(loads[sid][1], [1.5, -1.5, 0], atol=1e-14)
    assert_allclose(loads[4][0], np.array([300, 0, -300]) / np.sqrt(2), atol=1e-12)


def test_pressure_on_a_solid_points_inwards(bulk):
    """Two opposite corners mark a face of a brick, a corner and the one opposite of a tetra."""
    brick = {(1, 3): (0, 0, 6), (3, 1): (0, 0, 6), (5, 7): (0, 0, -6), (1, 6): (0, 10, 0),
             (2, 7): (-15, 0, 0), (4, 7): (0, -10, 0), (1, 8): (15, 0, 0)}  # fmt: skip
    tetra = {(1, 5): (0, 0, 3), (1, 4): (0, 5, 0)}
    other = CUBE.replace("CHEXA,9,1,1,2,3,4,5,6,7,8", "CTETRA,9,1,1,2,4,5")
    hut = CUBE.replace("CHEXA,9,1,1,2,3,4,5,6,7,8", "CPYRAM,9,1,1,2,3,4,5")
    roof = {(1, 3): (0, 0, 6), (1, 2): (0, 5, 0), (2, 3): (-7.5, 0, -3), (4, 1): (5 * 1.5, 0, 0)}
    for text, faces in ((CUBE, brick), (other, tetra), (hut, roof)):
        marks = enumerate(faces, start=1)
        cards = "".join(f"PLOAD4,{k},9,1.,,,,{a},{b}\n" for k, (a, b) in marks)
        found = [force for force, _ in resultants(bulk(text + cards)).values()]
        assert_allclose(found, list(faces.values()), atol=1e-14)


def test_prescribed_motion(bulk):
    asked = analysis(bulk(PLATE + "SPC,1,1,3,.5,2,5,.25\nSPCD,8,3,12,2.\n"), MM)
    assert asked.prescribed[1].values.tolist() == [0.5e-3, 0.25]
    assert asked.prescribed[8].components.tolist() == [1, 2]


def test_tables_continue_their_end_slopes():
    table = Tabulated(np.array([1.0, 2.0, 4.0]), np.array([0.0, 1.0, 5.0]))
    assert_allclose(table([0.0, 1.5, 3.0, 5.0]), [-1, 0.5, 3, 7])
    power = Tabulated(np.array([1.0, 10.0, 100.0]), np.array([2.0, 2e-2, 2e-4]), True, True)
    assert_allclose(power([3.0, 30.0, 1000.0]), 2 * np.array([3.0, 30.0, 1000.0]) ** -2)
    jump = Tabulated(np.array([0.0, 1.0, 1.0, 2.0]), np.array([0.0, 0.0, 1.0, 1.0]))
    assert_allclose(jump([0.5, 1.5]), [0, 1])


def test_both_harmonic_loads_agree(bulk):
    """C + iD of RLOAD1 is B exp(iφ) of RLOAD2; delay and phase turn both."""
    text = PLATE + (
        "DAREA,1,3,3,10.\nTABLED1,4\n,1.,3.,9.,3.,ENDT\nTABLED1,5\n,1.,4.,9.,4.,ENDT\n"
        "TABLED1,6\n,1.,5.,9.,5.,ENDT\nTABLED1,7\n,1.,53.13010235415598,9.,53.13010235415598,ENDT\n"
        "DELAY,8,3,3,.01\nDPHASE,9,3,3,30.\nRLOAD1,11,1,8,9,4,5\nRLOAD2,12,1,.01,30.,6,7\n"
        "DLOAD,20,2.,1.,11,-1.,12\nDLOAD,21,1.,2.,11\n"
    )
    dynamic = analysis(bulk(text)).dynamic
    f = np.array([1.0, 2.5, 7.0])
    first, second = dynamic[11][0].at(f), dynamic[12][0].at(f)
    assert_allclose(first, second, rtol=1e-6)
    turn = np.exp(1j * (np.pi / 6 - 2 * np.pi * f * 0.01))
    assert_allclose(first[:, 0], 10 * (3 + 4j) * turn)
    assert np.abs(sum(e.at(f) for e in dynamic[20])).max() < 1e-5
    assert_allclose(dynamic[21][0].at(f), 2 * first)


def test_areas_follow_the_displacement_frame(bulk):
    """DAREA along component 1 of a grid whose frame is turned by 90 degrees about z."""
    text = PLATE.replace("GRID,3,,10.,10.,0.", "GRID,3,,10.,10.,0.,7") + (
        "CORD2R,7,,0.,0.,0.,0.,0.,1.,0.,1.,0.\nDAREA,1,3,1,10.,3,5,2.\nRLOAD2,2,1,,,1.\n"
    )
    (load,) = analysis(bulk(text), MM).dynamic[2]
    # x of system 7 is global y, y is global -x: a force along y, a moment about -x
    found = dict(zip(load.components.tolist(), load.amplitude, strict=True))
    assert found == {2: pytest.approx(10), 4: pytest.approx(-2e-3)}


def test_static_loads_excite(bulk):
    """FORCE of the same id, or by way of LSEQ, stands for DAREA."""
    text = PLATE + "FORCE,5,3,,2.,0.,0.,1.\nLSEQ,1,30,5\nRLOAD1,2,5,,,1.\nRLOAD1,3,30,,,1.\n"
    dynamic = analysis(bulk(text)).dynamic
    for sid in (2, 3):
        assert dynamic[sid][0].at(np.ones(1)).tolist() == [[2]]
    motion = PLATE + "SPCD,5,3,3,2.\nRLOAD1,2,5,,,1.,,ACCE\n"
    (base,) = analysis(bulk(motion), UNITS["mm-kg-ms"]).dynamic[2]
    assert base.kind == "acceleration"
    assert_allclose(base.amplitude, 2e-3 / 1e-6)


@pytest.mark.parametrize(("unit", "factor"), [(None, 1.0), (UNITS["mm-kg-ms"], 1e3)])
def test_frequencies_that_follow_modes(bulk, unit, factor):
    text = PLATE + "FREQ3,1,2.,50.,,5\nFREQ4,1,1.,90.,.2,3\nFREQ5,2,,100.,.5,2.\nFREQ,1,7.\n"
    modes, asked = factor * np.array([10.0, 60.0]), analysis(bulk(text), unit)
    first = np.unique(np.concatenate([rule(modes) for rule in asked.following[1]]))
    (second,) = (rule(modes) for rule in asked.following[2])
    due = np.unique([2, 4, 6, 8, 10, 20, 30, 40, 50, *(8, 10, 12, 48, 60, 72)])
    assert_allclose(first, factor * due)
    assert_allclose(second, factor * np.array([5, 20, 30]))
    assert asked.frequency[1].tolist() == [7 * factor]


def test_what_the_case_control_wants_to_see(bulk):
    before = (
        "SOL 111\nCEND\nSET 9 = 1, 10 THRU 20 EXCEPT 15,\n  16, 40\nRESVEC(NOINRL) = YES\n"
        "DISP(PHASE, PLOT) = 9\nSUBCASE 1\nFREQ=5\nSUBCASE 2\nACCE=ALL\nRESVEC=NO\n"
    )
    one, two = analysis(bulk(PLATE, before)).subcases
    assert one.outputs == ((1, 1), (10, 14), (17, 20), (40, 40))
    assert two.outputs[0][0] == 1
    assert two.outputs[0][1] > 10**12
    assert (one.residual, two.residual) == (True, False)
    asked = analysis(bulk(PLATE + "PARAM,RESVEC,YES\n", "SOL 111\nCEND\nFREQ=1\n"))
    assert asked.subcases[0].residual


def test_damping_and_frequencies(bulk):
    text = PLATE + (
        "TABDMP1,1\n,0.,.02,100.,.04,ENDT\nTABDMP1,2,CRIT\n,0.,.01,100.,.02,ENDT\n"
        "TABDMP1,3,Q\n,0.,50.,100.,25.,ENDT\nFREQ,5,3.,1.,2.\nFREQ1,5,1.,.5,4\nFREQ2,6,1.,100.,2\n"
        "EIGRL,7,1.,200.,30\nEIGR,8,LAN,,50.,,12\n"
    )
    for unit, factor in ((None, 1.0), (UNITS["mm-kg-ms"], 1e3)):
        asked = analysis(bulk(text), unit)
        for tid in (1, 2, 3):  # g/2, the ratio itself, 1/2Q: all the same damping
            assert_allclose(asked.damping[tid], [[0, 100 * factor], [0.01, 0.02]])
        assert_allclose(asked.frequency[5], factor * np.array([1, 1.5, 2, 2.5, 3]))
        assert_allclose(asked.frequency[6], factor * np.array([1, 10, 100]))
        assert asked.eigen[7] == (factor, 200 * factor, 30)
        assert np.isnan(asked.eigen[8][0])
        assert asked.eigen[8][1:] == (50 * factor, 12)


def test_what_is_left_out_is_said(bulk):
    """Cards without effect, and parameters but for those heeded and those of output alone."""
    left = "TEMPD,1,20.\nPLOAD1,2,7,FY,FR,0.,1.,1.,1.\nSNORM,1,,0.,0.,1.\n"
    notes = analysis(bulk(PLATE + left)).notes
    assert len(notes) == 3
    assert all("left out" in n and "deck.bdf:" in n for n in notes)
    text = PLATE + "PARAM,POST,-1\nPARAM,G,.02\nPARAM,SNORM,20.\nPARAM,K6ROT,1.\n"
    (note,) = analysis(bulk(text, "SOL 111\nCEND\nPARAM,LFREQ,1.\n")).notes
    assert "PARAM LFREQ, SNORM: ignored" in note


@needs_decks
def test_wing_box_pressure():
    """The resultant of 1632 pressures on a closed skin equals p times its projected area."""
    deck = read_deck(next(ANCHORS.glob("shell_wingbox*/*.bdf")))
    load, made, cards = analysis(deck).loads[1], assembly(deck), deck["PLOAD4"]
    nodes = dict(zip(made.shells.ids.tolist(), made.shells.nodes, strict=True))
    a, b, c, d = made.points[[nodes[e] for e in cards.integers(2).tolist()]].swapaxes(0, 1)
    due = cards.reals(3) @ np.cross(c - a, d - b) / 2
    assert_allclose(resultant(load, made.points)[0], due, atol=1e-9 * np.abs(load.values).sum())
