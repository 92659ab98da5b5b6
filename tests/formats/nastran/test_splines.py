"""RSPLINE: rigid motions, the cubic of a straight line, part of the components, lines that bend."""

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.fem.assemble import structure
from chladni.fem.rigid import transformation
from chladni.io.nastran import assembly

STRAIGHT = ((0, 0, 0), (10, 0, 0), (25, 0, 0), (40, 0, 0))
BENT = ((0, 0, 0), (10, 0, 0), (20, 8, 0), (28, 20, 5))
ALL = "RSPLINE,9,,1,2,123456,3,123456,4"


def deck(bulk, card, places, more=""):
    grids = "".join(
        f"GRID,{k},,{x:g}.,{y:g}.,{z:g}.{more}\n" for k, (x, y, z) in enumerate(places, start=1)
    )
    turned = "CORD2R,6,,0.,0.,0.,1.,2.,3.\n,3.,-1.,1.\n" if more else ""
    held = "CELAS2,71,5.,1,1\nCONM2,8,1,,1.-3\n"
    return bulk(grids + turned + held + card + "\n")


def motions(made):
    """u (24, k) of the points in basic axes, and the labels (row, component) of its columns."""
    T, kept = transformation(made)
    return T.toarray(), np.stack([kept // 6, kept % 6 + 1], axis=1)


def rigid(points):
    """(6n, 6) of points (n, 3)."""
    out = np.zeros((len(points), 6, 6))
    for k, x in enumerate(points):
        out[k] = np.eye(6)
        out[k, :3, 3:] = np.stack([np.cross(axis, x) for axis in np.eye(3)], axis=1)
    return out.reshape(-1, 6)


@pytest.mark.parametrize("places", [STRAIGHT, BENT], ids=["straight", "bent"])
@pytest.mark.parametrize("more", ["", ",6"], ids=["basic", "turned"])
@pytest.mark.parametrize(
    "card", [ALL, "RSPLINE,9,.3,1,2,123,3,12,4", "RSPLINE,9,.05,1,2,,3,123456,4"]
)
def test_a_rigid_motion_of_the_leading_grids_is_one_of_all(bulk, card, places, more):
    made = assembly(deck(bulk, card, places, more), "mm-t-s", loose=True)
    T, free = motions(made)
    motion = rigid(made.points)
    axes = np.eye(3)[None] if made.axes is None else made.axes
    axes = np.broadcast_to(axes, (4, 3, 3))
    q = np.stack(
        [axes[r, (c - 1) % 3] @ motion.reshape(4, 2, 3, 6)[r, int(c > 3)] for r, c in free]
    )
    np.testing.assert_allclose(T @ q, motion, atol=1e-9)


def test_between_two_grids_on_a_line_deflections_are_cubic(bulk):
    """Hermite's polynomials for deflection and slope, linear extension and twist, whatever D/L."""
    for ratio in ("", ".02", ".4"):
        card = ALL.replace("9,,", f"9,{ratio},")
        made = assembly(deck(bulk, card, STRAIGHT), "mm-t-s", loose=True)
        T, free = motions(made)
        u = T.reshape(4, 6, -1)
        L = 0.04
        for row, x in ((1, 0.010), (2, 0.025)):
            s = x / L
            N = [1 - 3 * s**2 + 2 * s**3, L * s * (1 - s) ** 2, 3 * s**2 - 2 * s**3,
                 L * s**2 * (s - 1)]  # fmt: skip
            slope = [6 * (s**2 - s) / L, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / L, 3 * s**2 - 2 * s]
            column = {tuple(label): k for k, label in enumerate(free.tolist())}
            y = [column[key] for key in ((0, 2), (0, 6), (3, 2), (3, 6))]
            np.testing.assert_allclose(u[row, 1, y], N, atol=1e-12)
            np.testing.assert_allclose(u[row, 5, y], slope, atol=1e-9)
            z = [column[key] for key in ((0, 3), (0, 5), (3, 3), (3, 5))]
            np.testing.assert_allclose(u[row, 2, z], np.array(N) * [1, -1, 1, -1], atol=1e-12)
            ends = [column[key] for key in ((0, 1), (3, 1), (0, 4), (3, 4))]
            np.testing.assert_allclose(u[row, [0, 0, 3, 3], ends], [1 - s, s, 1 - s, s], atol=1e-12)


def test_components_that_are_not_named_lead(bulk):
    """Translations of 2 follow, its rotations are free; grid 3 with a blank leads with all six."""
    made = assembly(deck(bulk, "RSPLINE,9,,1,2,123,3,,4", STRAIGHT), "mm-t-s", loose=True)
    _, free = motions(made)
    of = [free[free[:, 0] == row, 1].tolist() for row in range(4)]
    every = [1, 2, 3, 4, 5, 6]
    assert of == [every, [4, 5, 6], every, every]


def test_a_line_that_bends_carries_extension_into_deflection(bulk):
    """A corner between two arms moves out as its ends approach, more where the tube is thicker."""
    corner = ((0, 0, 0), (20, 15, 0), (40, 0, 0))
    out = []
    for ratio in (".01", ".3"):
        card = f"RSPLINE,9,{ratio},1,2,123456,3"
        T, free = motions(assembly(deck(bulk, card, corner), "mm-t-s", loose=True))
        k = int(np.flatnonzero((free == [2, 1]).all(axis=1))[0])
        out.append(T.reshape(3, 6, -1)[1, :3, k])
    np.testing.assert_allclose([o[0] for o in out], 0.5, atol=1e-9)
    assert out[0][1] < -0.3
    assert out[0][1] < out[1][1] < 0


def test_a_spline_joins_its_grids(bulk):
    """What hangs on a followed grid hangs on all that lead: one dof has a stiffness here."""
    made = assembly(deck(bulk, ALL, STRAIGHT), "mm-t-s")
    assert structure(made).system.dofs.tolist() == [[1, 1]]


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("RSPLINE,9,,1,2,123456,3,123456", "the last one leads"),
        ("RSPLINE,9,,1,4", "it needs a grid between two others"),
        ("RSPLINE,9,,1,2,,4", "it needs a grid between two others"),
        ("RSPLINE,9,,1,2,127,4", "is not made of the digits 1 to 6"),
        ("RSPLINE,9,,1,8,123,4", "grid 8 does not exist"),
        ("RSPLINE,9,,1,2,123,1", "a grid is named twice"),
        ("RSPLINE,9,-.1,1,2,123,4", "D/L is -0.1; it is to be positive"),
    ],
)
def test_a_line_that_cannot_be_is_refused(bulk, card, said):
    says(said, assembly, deck(bulk, card, STRAIGHT), "mm-t-s", loose=True)
