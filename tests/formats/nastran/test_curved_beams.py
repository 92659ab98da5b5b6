"""CBEND: the arcs that GEOM describes, closed forms of a quarter circle, polygons of bars."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.io.nastran import assembly

E, NU, R = 2.1e5, 0.3, 100.0
G = E / (2 * (1 + NU))
A, I1, I2, J = 12.0, 90.0, 40.0, 70.0
PBEND = f"PBEND,5,7,{A},{I1},{I2},{J},{{}}"
BLANK = ",,,,,,,,"  # C1 to F2

QUARTERS = {  # of a circle about 0, from (R, 0) to (0, R): v or GO, GEOM, RB, THETAB
    "centre": (f"{-R},0.,0.,1", ",", ""),
    "centre by its grid": ("3,,,1", ",", ""),
    "tangent": ("0.,1.,0.,2", ",", ""),
    "radius": ("0.,2.,0.,3", f"{R},", ""),
    "radius by a grid": ("4,,,3", f"{R},", ""),
    "angle": ("0.,2.,0.,4", ",90.", ""),
}


def text(geom="tangent", more=f"{BLANK},,,,,,0.", held="SPC1,1,123456,1\n"):
    v, radius, _ = QUARTERS[geom]
    return (
        f"GRID,1,,{R},0.,0.\nGRID,2,,0.,{R},0.\nGRID,3,,0.,0.,0.\nGRID,4,,{R},{R},0.\n"
        f"CBEND,9,5,1,2,{v}\n{PBEND.format(radius)}{more}\nMAT1,7,{E},,{NU},7.85-9,,,.02\n{held}"
    )


BEFORE = "SOL 103\nCEND\nSPC = 1\n"


def flexibility(made, id=2):
    """(6, 6) [mm/N, 1/N, 1/N mm] of a grid."""
    system = structure(made).system
    at = [int(np.flatnonzero((system.dofs == [id, c]).all(axis=1))[0]) for c in range(1, 7)]
    unit = np.array([1e3] * 3 + [1.0] * 3)
    return np.linalg.inv(system.K.toarray())[np.ix_(at, at)] * np.outer(unit, unit) / 1e3


@pytest.mark.parametrize("geom", QUARTERS)
def test_a_quarter_circle_deflects_as_in_the_books(bulk, geom):
    """Castigliano: along the tangent, radially, out of plane; the neutral axis in the middle."""
    F = flexibility(assembly(bulk(text(geom), before=BEFORE), "mm-t-s"))
    # B at (0, R): its tangent is -x, its radius y; M = -R (1 - cos) and R sin of the angle from B
    tangent = R**3 / (E * I1) * (3 * np.pi / 4 - 2) + np.pi * R / (4 * E * A)
    radial = np.pi * R**3 / (4 * E * I1) + np.pi * R / (4 * E * A)
    out = R**3 * (np.pi / (4 * E * I2) + (3 * np.pi / 4 - 2) / (G * J))
    np.testing.assert_allclose(F.diagonal()[:3], [tangent, radial, out], rtol=1e-9)
    np.testing.assert_allclose(F[5, 5], np.pi * R / 2 / (E * I1), rtol=1e-9)
    np.testing.assert_allclose(F[5, 1], -(R**2) / (E * I1), rtol=1e-9)


def test_the_neutral_axis_lies_inside(bulk):
    """Default I_1 / A R: Timoshenko's energy ∫ (M²/EI + N²/EA + 2 M N / EAR) ds / 2."""
    F = flexibility(assembly(bulk(text(more=BLANK), before=BEFORE), "mm-t-s"))
    e = I1 / (A * R)
    plain = np.pi * R**3 / (4 * E * I1) + np.pi * R / (4 * E * A)
    # radial force: N = F sin φ opens, M = -F R sin φ closes; M + e N bends
    due = np.pi * R * (R - e) ** 2 / (4 * E * I1) + np.pi * R / (4 * E * A)
    assert F[1, 1] == pytest.approx(due, rel=1e-9)
    assert F[1, 1] - plain == pytest.approx(-np.pi * R / (2 * E * A), rel=2e-3)


def test_shear_flexibility_is_that_of_K1_and_K2(bulk):
    plain = flexibility(assembly(bulk(text(), before=BEFORE), "mm-t-s"))
    more = f"{BLANK},.5,.8,,,,0."
    found = flexibility(assembly(bulk(text(more=more), before=BEFORE), "mm-t-s")) - plain
    line = np.pi * R / (G * A)
    np.testing.assert_allclose(found.diagonal()[:3], [line / 2, line / 2, line / 1.6], rtol=1e-6)


def test_a_polygon_of_bars_tends_to_the_arc(bulk):
    """The difference falls with the square of the number of bars, in all six components."""
    due = flexibility(assembly(bulk(text(), before=BEFORE), "mm-t-s"))

    def polygon(n):
        angle = np.linspace(0, np.pi / 2, n + 1)
        ids = [1, *range(11, 10 + n), 2]
        grids = "".join(
            f"GRID,{id},,{R * np.cos(a):.12f},{R * np.sin(a):.12f},0.\n"
            for id, a in zip(ids, angle, strict=True)
        )
        # plane 1 holds the vector to the centre
        bars = "".join(f"CBAR,{k},6,{ids[k]},{ids[k + 1]},3\n" for k in range(n)).replace(
            "CBAR,0,", "CBAR,100,"
        )
        own = (
            f"GRID,3,,0.,0.,0.\nPBAR,6,7,{A},{I1},{I2},{J}\nMAT1,7,{E},,{NU},7.85-9\n"
            "SPC1,1,123456,1\n"
        )
        return flexibility(assembly(bulk(grids + bars + own, before=BEFORE), "mm-t-s"))

    off = [np.abs(polygon(n) - due).max() / np.abs(due).max() for n in (8, 16, 32)]
    assert off[2] < 2e-3
    np.testing.assert_allclose(np.array(off[:2]) / off[1:], 4, rtol=0.05)


def test_an_arc_that_is_nearly_straight_is_a_bar(bulk):
    """R of 1e7 times the chord: the stiffness of a CBAR to rounding of the vector."""
    ends = "GRID,1,,0.,0.,0.\nGRID,2,,50.,0.,0.\nSPC1,1,123456,1\nMAT1,7,2.1+5,,.3,7.85-9\n"
    bend = f"CBEND,9,5,1,2,1.,1.+8,0.,1\n{PBEND.format('')}\n"
    bar = f"CBAR,9,5,1,2,0.,1.,0.\nPBAR,5,7,{A},{I1},{I2},{J}\n"
    F, due = (flexibility(assembly(bulk(ends + b, before=BEFORE), "mm-t-s")) for b in (bend, bar))
    np.testing.assert_allclose(F, due, rtol=1e-6, atol=1e-6 * np.abs(due).max())


def test_rigid_motions_are_free_and_damping_follows(bulk):
    """Six zeros of twelve motions, of a slender arc too; K_loss = GE K; the mass of the arc."""
    for thin in (1.0, 1e-6):
        deck = text(held="").replace(f",{I1},{I2},{J}", f",{I1 * thin},{I2 * thin},{J * thin}")
        made = replace(assembly(bulk(deck), "mm-t-s", loose=True), auto_spc=False)
        built = structure(made)
        scale = np.tile([1.0] * 3 + [R / 1e3] * 3, 2)
        K = built.system.K.toarray()[:12, :12] / np.outer(scale, scale)
        value = np.linalg.eigvalsh(K)
        assert np.abs(value[:6]).max() < 1e-13 * value[-1]
        assert value[6] > 1e-7 * thin * value[-1]
        loss = built.loss.toarray()[:12, :12] / np.outer(scale, scale)
        np.testing.assert_allclose(loss, 0.02 * K, atol=1e-12 * value[-1])
    assert mass_properties(made)[0] == pytest.approx(7.85e-6 * A * R * np.pi / 2)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("0.,1.,0.,2", "0.,1.,0.,5", "GEOM is 5; there are 1, 2, 3, 4"),
        ("0.,1.,0.,2", "1.,0.,0.,2", "its arc is 180 degrees or more"),
        ("0.,1.,0.,2", "-1.,1.,0.,2", "lies along its chord"),
        ("0.,1.,0.,2", ",,,2", "missing or zero"),
        ("0.,1.,0.,2", "1.,1.,0.,1", "no centre of curvature"),
        ("0.,1.,0.,2", "0.,1.,0.,3", "RB is blank"),
        ("CBEND,9,5", "CBEND,9,6", "there is no PBEND 6; there are 5"),
        (f"7,{A},", "7,1,", "FSI, a curved pipe, is not supported"),
        (f",{J},", ",0.,", "J is 0; it is to be positive"),
        ("9,5,1,2", "9,5,1,1", "its ends lie at one place"),
    ],
)
def test_an_arc_that_cannot_be_is_refused(bulk, old, new, said):
    deck = text()
    assert old in deck
    says(said, assembly, bulk(deck.replace(old, new), before=BEFORE), "mm-t-s")
