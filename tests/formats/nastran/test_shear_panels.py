"""CSHEAR: one deformation, the energy of a constant shear, rods along its edges, its mass."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.io.nastran import assembly
from chladni.io.nastran.read.shear_panels import _energy

E, NU, T = 7.0e4, 0.3, 2.0  # MPa, -, mm
G = E / (2 * (1 + NU))
RECTANGLE = ((0, 0), (40, 0), (40, 30), (0, 30))
SHAPES = {
    "rectangle": RECTANGLE,
    "parallelogram": ((0, 0), (40, 0), (55, 30), (15, 30)),
    "trapezoid": ((0, 0), (40, 0), (30, 30), (5, 30)),
    "trapezoid, the other sides": ((0, 0), (40, 0), (40, 35), (0, 20)),
    "no parallels": ((0, 0), (40, 0), (46, 31), (8, 22)),
}


def text(corners, more=",,", z=(0, 0, 0, 0)):
    grids = [f"GRID,{k},,{x:g}.,{y:g}.,{h:g}.\n"
             for k, ((x, y), h) in enumerate(zip(corners, z, strict=True), start=1)]  # fmt: skip
    cards = f"CSHEAR,9,5,1,2,3,4\nPSHEAR,5,7,{T}{more}\nMAT1,7,{E},,{NU},2.7-9,,,.02\n"
    return "".join(grids) + cards


def stiffness(made):
    """K (12, 12) [N/mm] of the translations of four grids, and the hysteretic part."""
    built = structure(replace(made, auto_spc=False))
    kept = np.flatnonzero(built.system.dofs[:, 1] <= 3)
    return tuple(A.toarray()[np.ix_(kept, kept)] / 1e3 for A in (built.system.K, built.loss))


def rigid_motions(X):
    """(12, 6) translations and rotations of points (4, 3)."""
    turns = [np.cross(axis, X).ravel() for axis in np.eye(3)]
    return np.stack([*np.tile(np.eye(3), 4), *turns], axis=1)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("warp", [0, 6])
def test_a_panel_resists_one_deformation_and_no_rigid_motion(bulk, shape, warp):
    """Rank one, with a loss of GE times it; a warped panel is in equilibrium, too."""
    made = assembly(bulk(text(SHAPES[shape], z=(0, warp, 0, warp))), "mm-t-s")
    K, loss = stiffness(made)
    value = np.linalg.eigvalsh(K)
    assert value[-1] > 1e3
    assert np.abs(value[:-1]).max() < 1e-9 * value[-1]
    moved = K @ rigid_motions(made.points[:4] * 1e3)
    assert np.abs(moved).max() < 1e-9 * value[-1] * 60
    np.testing.assert_allclose(loss, 0.02 * K, atol=1e-9 * value[-1])


def test_simple_shear_of_a_parallelogram_is_exact(bulk):
    """½ uᵀ K u with u_x = γ y, times 1 + 2 cot²α / (1+ν) less than that of a sheet: σ_n = 0."""
    for shape, cot in (("rectangle", 0.0), ("parallelogram", 0.5)):
        made = assembly(bulk(text(SHAPES[shape])), "mm-t-s")
        u = np.zeros((4, 3))
        u[:, 0] = 0.01 * made.points[:4, 1] * 1e3
        K, _ = stiffness(made)
        due = G * T * 40 * 30 * 0.01**2 / (1 + 2 * cot**2 / (1 + NU))
        assert u.ravel() @ K @ u.ravel() == pytest.approx(due)


def test_the_flexibility_of_a_trapezoid_is_garveys():
    """(p_1 p_2 / p_3 p_4) A (1 + 2/3 (D_1² + D_1 D_2 + D_2²) / (1+ν)), parallels 1-2 or 2-3."""
    bottom, top, height, shift = 40.0, 25.0, 30.0, 5.0
    P = np.array([[0, 0], [bottom, 0], [shift + top, height], [shift, height]])
    to_apex = height * bottom / (bottom - top)
    x = shift * to_apex / height
    D = np.array([-x, bottom - x]) / to_apex
    slopes = 1 + 2 / 3 * (D @ D + D[0] * D[1]) / (1 + NU)
    due = (to_apex / (to_apex - height)) ** 2 * (bottom + top) / 2 * height * slopes
    assert _energy(P, NU) == pytest.approx(due, rel=1e-10)
    turned = P[[1, 2, 3, 0]]  # side 1-2 is one of the others: the same energy by another flow
    flow = (to_apex - height) / to_apex  # q_1 q_2 of the rays: C / p_1 p_3 to C / p_1²
    assert _energy(turned, NU) == pytest.approx(due / (1 / flow) ** 2, rel=1e-10)


def test_the_edges_balance(bulk):
    """The forces along an edge at both ends are the flow times its length, all edges alike."""
    made = assembly(bulk(text(SHAPES["parallelogram"])), "mm-t-s")
    K, _ = stiffness(made)
    f = np.linalg.eigh(K)[1][:, -1].reshape(4, 3)[:, :2]
    X = made.points[:4, :2]
    sides = np.roll(X, -1, axis=0) - X
    flow = []
    for k in range(4):  # each corner's force as a sum of one along its two sides
        a, _ = np.linalg.solve(np.stack([sides[k], sides[k - 1]], axis=1), f[k])
        _, b = np.linalg.solve(np.stack([sides[(k + 1) % 4], sides[k]], axis=1), f[(k + 1) % 4])
        flow.append(a + b)
    np.testing.assert_allclose(flow, [flow[0], -flow[0], flow[0], -flow[0]], rtol=1e-9)


@pytest.mark.parametrize(
    ("F", "width"),
    [("1.", 30.0), (".5", 15.0), ("30.", 30 * T)],  # both rods together
)
def test_rods_make_a_panel_stiff_along_its_edges(bulk, F, width):
    """F1 to 1.01 is the share of the sheet that works, above it F T is a width."""
    made = assembly(bulk(text(RECTANGLE, f",,{F}")), "mm-t-s")
    stretched = np.zeros((4, 3))
    stretched[[1, 2], 0] = 1.0
    K, _ = stiffness(made)
    assert stretched.ravel() @ K @ stretched.ravel() == pytest.approx(E * T * width / 40)
    across = np.zeros((4, 3))
    across[2:, 1] = 1.0
    assert across.ravel() @ K @ across.ravel() == pytest.approx(0, abs=1e-6)


def test_its_mass_is_that_of_a_sheet_at_its_corners(bulk):
    """(ρ T + NSM) A, in equal parts on a parallelogram; a stiff frame vibrates with it."""
    for shape in SHAPES:
        made = assembly(bulk(text(SHAPES[shape], ",3.-9")), "mm-t-s")
        x, y = np.array(SHAPES[shape], float).T
        area = abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2
        assert mass_properties(made)[0] == pytest.approx((2.7e-9 * T + 3e-9) * area * 1e3)
        if shape == "parallelogram":
            assert np.ptp(made.masses.matrix[:, 0, 0]) < 1e-15


def test_a_shear_wall_of_panels_and_flanges_has_the_closed_deflection(bulk):
    """w = P L / G t h + Σ f F L_bay / E A: flow P / h, in each rod the mean of its axial force."""
    bays, bay, h, A, P = 6, 50.0, 80.0, 120.0, 100.0
    lines = []
    for k in range(bays + 1):
        lines += [f"GRID,{2 * k + 1},,{bay * k},0.,0.", f"GRID,{2 * k + 2},,{bay * k},{h},0."]
        if k:
            lines.append(f"CROD,{200 + k},3,{2 * k + 1},{2 * k + 2}")
    for k in range(bays):
        a = 2 * k + 1
        lines += [f"CROD,{300 + k},4,{a},{a + 2}", f"CROD,{400 + k},4,{a + 1},{a + 3}"]
        lines.append(f"CSHEAR,{500 + k},5,{a},{a + 2},{a + 3},{a + 1}")
    last = 2 * bays + 1
    lines += ["PROD,3,7,1.+9", f"PROD,4,7,{A}", f"PSHEAR,5,7,{T}", f"MAT1,7,{E},,{NU},2.7-9",
              "SPC1,1,123,1,2"]  # fmt: skip
    made = assembly(bulk("\n".join(lines) + "\n", before="SOL 103\nCEND\nSPC = 1\n"), "mm-t-s")
    system = structure(made).system
    load = np.zeros(len(system.dofs))
    at = np.flatnonzero(np.isin(system.dofs[:, 0], [last, last + 1]) & (system.dofs[:, 1] == 2))
    load[at] = P / 2
    w = np.linalg.solve(system.K.toarray(), load)[at].mean() * 1e3
    mean = P / h * bay * (bays - np.arange(bays) - 0.5)
    unit = mean / P
    assert w == pytest.approx(P * bay * bays / (G * T * h) + 2 * (mean @ unit) * bay / (E * A))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("CSHEAR,9,5", "CSHEAR,9,6", "CSHEAR 9: there is no PSHEAR 6; there are 5"),
        ("PSHEAR,5,7,2.0", "PSHEAR,5,7,-2.", "T is -2.; it is to be positive"),
        ("PSHEAR,5,7,2.0,,", "PSHEAR,5,7,2.0,,-1.", "F1 or F2 is negative"),
        ("1,2,3,4", "1,3,2,4", "its area is zero"),
        ("1,2,3,4", "1,2,3,3", "a corner is named twice"),
        ("PSHEAR,5,7", "PSHEAR,5,8", "material 8 does not exist"),
    ],
)
def test_a_panel_that_no_solver_runs_is_refused(bulk, old, new, said):
    says(said, assembly, bulk(text(RECTANGLE).replace(old, new)), "mm-t-s")
