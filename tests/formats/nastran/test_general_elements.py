"""GENEL: a matrix between dofs is that matrix; a flexibility with a rigid base is the bar's."""

import numpy as np
import pytest
from tests.builders.decks import alike
from tests.builders.refusals import says

from chladni.fem.assemble import structure
from chladni.io.nastran import assembly

E, G, A, I1, I2, J, L = 2.0e5, 8.0e4, 12.0, 90.0, 40.0, 70.0, 50.0
GRIDS = (
    "CORD2R,6,,0.,0.,0.,1.,2.,3.\n,3.,-1.,1.\n"
    "GRID,1,,0.,0.,0.\nGRID,2,,50.,0.,0.\nGRID,3,,50.,40.,0.\n"
    "CBAR,31,5,2,3,0.,0.,1.\nPBAR,5,7,12.,90.,40.,70.\nMAT1,7,2.+5,8.+4,,7.85-9\n"
    "CONM2,41,1,,2.-3,,,,,9.,,9.,,,9.\n"
)
BAR = "CBAR,9,5,1,2,0.,1.,0.,BGG\n"


def triangle(Z):
    """Rows of eight fields behind the mark, from the diagonal on."""
    numbers = [f"{v:.9e}" for v in Z[np.triu_indices(len(Z))]]
    return "," + ",".join(numbers)


def pairs(grid):
    return ",".join(f"{grid},{c}" for c in range(1, 7))


def cantilever():
    """Flexibility (6, 6) of the end of the bar, without its mass."""
    Z = np.diag([L / (E * A), L**3 / (3 * E * I1), L**3 / (3 * E * I2), L / (G * J), L / (E * I2),
                 L / (E * I1)])  # fmt: skip
    Z[1, 5] = Z[5, 1] = L**2 / (2 * E * I1)
    Z[2, 4] = Z[4, 2] = -(L**2) / (2 * E * I2)
    return Z


def padded(*parts):
    """Fields of each part, filled up to whole lines of eight."""
    out = []
    for part in parts:
        fields = part.split(",")
        out += fields + [""] * (-len(fields) % 8)
    return "GENEL," + ",".join(out) + "\n"


RIGID = np.block([[np.eye(3), np.array([[0, 0, 0], [0, 0, L], [0, -L, 0]])],
                  [np.zeros((3, 3)), np.eye(3)]])  # fmt: skip
HEAD = f"8,,{pairs(2)}"
FORMS = {
    "Z, rigid": ("Z", cantilever(), ""),
    "K, rigid": ("K", np.linalg.inv(cantilever()), ""),
    "Z and S": ("Z", cantilever(), "S," + ",".join(f"{v:.6f}" for v in RIGID.ravel())),
}


@pytest.mark.parametrize(
    ("form", "frame"),
    [*((form, "") for form in FORMS), ("Z, rigid", ",6"), ("K, rigid", ",6")],
)
def test_flexibility_over_a_rigid_base_is_the_bar(bulk, form, frame):
    """The dofs of a free bar by Z, by K = Z⁻¹, and with S written out; its base in any frame."""
    mark, matrix, S = FORMS[form]
    card = padded(HEAD, f"UD,,{pairs(1)}", mark + triangle(matrix), *([S] if S else []))
    base = GRIDS.replace("GRID,1,,0.,0.,0.", f"GRID,1,,0.,0.,0.{frame}")
    found = assembly(bulk(base + card), "mm-t-s")
    light = "PBAR,6,8,12.,90.,40.,70.\nMAT1,8,2.+5,8.+4\n"
    due = assembly(bulk(base + BAR.replace("9,5,", "9,6,") + light), "mm-t-s")
    alike(found, due, 1e-7)


def test_a_stiffness_between_dofs_is_that_matrix(bulk):
    """Of a translation and a rotation: K [[a, b], [b, c]] in N/mm, N and N mm."""
    card = padded("8,,2,2,3,6", "K,300.,-20.,700.")
    plain, more = (
        structure(assembly(bulk(GRIDS + text), "mm-t-s", loose=True)).system for text in ("", card)
    )
    rows = [int(np.flatnonzero((plain.dofs == dof).all(axis=1))[0]) for dof in ([2, 2], [3, 6])]
    gap = (more.K - plain.K).toarray()
    due = np.zeros_like(gap)
    due[np.ix_(rows, rows)] = [[300e3, -20.0], [-20.0, 0.7]]
    np.testing.assert_allclose(gap, due, atol=1e-9 * plain.K.diagonal().max())


def test_a_scalar_point_has_no_component(bulk):
    text = GRIDS + "SPOINT,50\nCMASS2,72,1.-3,50\n"
    found = assembly(bulk(text + padded("8,,2,2,50,", "K,300.,-300.,300.")), "mm-t-s", loose=True)
    due = assembly(bulk(text + "CELAS2,81,300.,2,2,50\n"), "mm-t-s", loose=True)
    alike(found, due, 1e-9)


@pytest.mark.parametrize(
    ("card", "said"),
    [
        (padded("8,,2,2,3,6", "K,300.,-20."), "K has 2 values; its dofs ask for 3"),
        (padded("8,,2,2,2,2", "K,300.,-20.,1."), "a dof is named twice"),
        (padded("8,,2,2,3,6"), "not one of K and Z"),
        (padded("8,,2,2,3,9", "K,3.,1.,1."), "is not made of the digits 1 to 6"),
        (padded("8,,2,2,3,6", "Z,3.,3.,3."), "its flexibility Z has no inverse"),
        (padded("8,,2,2", "UD,,1,1,1,2", "K,3."), "S is blank, so UD has to be six dofs"),
        (padded("8,,2,2", "UD,,1,1", "K,3.", "S,1.,2."), "S has 2 values; its dofs ask for 1"),
        (
            padded("8,,2,2", "UD,,1,1,1,2,1,3,3,1,3,2,1,4", "K,3."),
            "the six dofs UD leave a rigid motion free",
        ),
    ],
)
def test_a_matrix_that_is_none_is_refused(bulk, card, said):
    says(said, assembly, bulk(GRIDS + card), "mm-t-s", loose=True)


def test_scalar_elements_make_their_points(bulk):
    """What CELAS3, CMASS4 or a CELAS2 without a component names needs no SPOINT."""
    mass = "PELAS,70,300.\nCMASS4,73,2.-3,51\nCELAS2,74,100.,51,,50\n"
    text = GRIDS + "CELAS3,71,70,,50\nCMASS4,72,1.-3,50\n" + mass
    found, due = (
        assembly(bulk(text + more), "mm-t-s", loose=True) for more in ("", "SPOINT,50,51\n")
    )
    assert found.ids[found.scalar_points].tolist() == [50, 51]
    alike(found, due, 1e-12)
    says("grid 52 does not exist", assembly, bulk(text + "CELAS2,75,1.,52,1\n"), "mm-t-s")
