"""Joint builders: they find their faces, transmit force and moment, and refuse thin air."""

import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.errors import LabelError, ModelError
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.geometry.mesh_quality import check_mesh
from chladni.geometry.nearest import ShellSurface, barycentric_foot
from chladni.model.assembly import Assembly
from chladni.model.properties import Isotropic, Part, ShellSection
from chladni_specimens.joints.bolts import accelerometers, grip, screw, tied_hole
from chladni_specimens.joints.builders import adhesive_bead, spot_welds
from chladni_specimens.mesher.flat_regions import grid
from chladni_specimens.mesher.pressed_sheets import MAIN, PressedSheet
from chladni_specimens.tailgate.tailgate import of_sheets

STEEL = Isotropic(210e9, 0.3, 7850.0)
GAP = 0.0015


def sheet(name, x, y, z):
    plan, quads = grid(x, y)
    points = np.column_stack([plan, np.full(len(plan), z)])
    return PressedSheet(name, points, points, quads, np.full(len(quads), MAIN))


def pair(h=0.010, gap=GAP, length=0.2, width=0.06):
    """Two plates above each other, of different meshes."""
    n, m = round(length / h), round(width / h)
    lower = sheet("a", np.linspace(0, length, n + 1), np.linspace(0, width, m + 1), 0.0)
    upper = sheet("b", np.linspace(0, length, n), np.linspace(0, width, m + 2), gap)
    parts = tuple(Part(k, s, ShellSection(1e-3, STEEL, STEEL)) for k, s in enumerate("ab", 1))
    assembly, _ = of_sheets({"a": lower, "b": upper}, parts)
    return assembly


def rigid_count(assembly, below=0.5):
    built = structure(assembly)
    count = min(20, len(built.system.dofs))
    return int((normal_modes(built.system, count, proof=False).frequency < below).sum())


WELDS = np.array([(0.03, 0.03, 0.0007), (0.1, 0.031, 0.0007), (0.17, 0.029, 0.0007)])
LINE = np.column_stack([np.linspace(0.02, 0.18, 17), np.full(17, 0.03), np.full(17, GAP / 2)])


def test_unjoined_sheets_are_loose():
    assembly = pair()
    assert rigid_count(assembly) == 12
    assert check_mesh(assembly).loose == ("b",) or check_mesh(assembly).loose == ("a",)


@pytest.mark.parametrize("patch", [0.0, 0.006])
def test_welds_join_two_sheets(patch):
    """Twelve rigid modes become six; each weld reports its sheets and its place."""
    assembly, report = spot_welds(pair(), WELDS, patch=patch)
    assert [j.kind for j in report] == ["spot weld"] * 3
    assert {j.sheets for j in report} <= {("a", "b"), ("b", "a")}
    np.testing.assert_allclose([j.place for j in report], WELDS[:, :3], atol=1e-3)
    assert rigid_count(assembly) == 6
    assert check_mesh(assembly).fit
    assert mass_properties(assembly)[0] == pytest.approx(mass_properties(pair())[0])


def test_a_weld_carries_rigid_motion_without_force():
    """K u = 0 for all six motions of the whole: RBE3 and solid hold nothing to the ground."""
    assembly, _ = spot_welds(pair(), WELDS, ("a", "b"))
    built = structure(assembly)
    x = assembly.points[assembly.rows(built.system.dofs[:, 0])]
    for axis in range(3):
        for motion in (np.eye(3)[axis] + 0 * x, np.cross(np.eye(3)[axis], x)):
            turn = np.eye(3)[axis] if motion is not None and np.ptp(motion) > 0 else None
            u = np.zeros(len(x))
            for c in range(3):
                u[built.system.dofs[:, 1] == c + 1] = motion[built.system.dofs[:, 1] == c + 1, c]
                if turn is not None and not np.allclose(motion, motion[0]):
                    u[built.system.dofs[:, 1] == c + 4] = turn[c]
            force = built.system.K @ u
            assert np.abs(force).max() < 1e-7 * np.abs(built.system.K.diagonal()).max()


def test_places_in_thin_air_are_refused():
    with pytest.raises(ModelError, match=r"no second part within 6.0 mm of \(100.0, 30.0, 0.7\)"):
        spot_welds(pair(gap=0.02), np.array([(0.1, 0.03, 0.0007)]))
    with pytest.raises(ModelError, match=r"\(300.0, 30.0, 0.0\) mm is 100.0 mm from a"):
        spot_welds(pair(), np.array([(0.3, 0.03, 0.0)]), ("a", "b"))
    with pytest.raises(LabelError, match="no part 'c'"):
        spot_welds(pair(), WELDS, ("a", "c"))
    with pytest.raises(ModelError, match="two points or more"):
        adhesive_bead(pair(), LINE[:1], ("a", "b"))


def test_bead_is_one_string():
    """Neighbours share their corners: 4 (n + 1) grids for n solids; its mass is ρ b h L."""
    before = pair()
    assembly, report = adhesive_bead(before, LINE, ("a", "b"), width=0.008)
    assert len(report) == 16
    assert len(assembly.points) - len(before.points) == 4 * 17
    assert rigid_count(assembly) == 6
    gained = mass_properties(assembly)[0] - mass_properties(before)[0]
    assert gained == pytest.approx(1000 * 0.008 * GAP * 0.16, rel=1e-6)
    thin, _ = adhesive_bead(before, LINE, ("a", "b"), width=0.008, height=0.2e-3, pitch=0.02)
    assert sum(len(s) for s in thin.solids) == 8
    gained = mass_properties(thin)[0] - mass_properties(before)[0]
    assert gained == pytest.approx(1000 * 0.008 * 0.2e-3 * 0.16, rel=1e-6)


def test_bead_stiffness_is_shear_of_the_layer():
    """Two rigid plates on a soft bead slide at f = √(k/μ)/2π, k = G b L/h, μ = m/2."""
    rigid = Isotropic(210e12, 0.3, 7850.0)
    parts = tuple(Part(k, s, ShellSection(1e-3, rigid, rigid)) for k, s in enumerate("ab", 1))
    soft = Isotropic(1e6, 0.3, 0.0)
    bare = pair().with_parts(parts)
    assembly, _ = adhesive_bead(bare, LINE, ("a", "b"), width=0.04, material=soft)
    k, mu = 1e6 / 2.6 * 0.04 * 0.16 / GAP, 7850 * 1e-3 * 0.2 * 0.06 / 2
    f = normal_modes(structure(assembly).system, 12, proof=False).frequency[6:]
    assert np.abs(f / (np.sqrt(k / mu) / (2 * np.pi)) - 1).min() < 0.01


def test_screw_and_holes():
    """A screw weighs what it should and holds all six motions; a tied hole weighs nothing."""
    before = pair()
    assembly, report = screw(before, np.array([0.1, 0.03, 0.0]), ("a", "b"))
    assert rigid_count(assembly) == 6
    gained = mass_properties(assembly)[0] - mass_properties(before)[0]
    assert gained == pytest.approx(0.012, abs=1e-9)
    assert report[0].kind == "screw"
    tied, _ = tied_hole(assembly, np.array([0.05, 0.03, 0.0]), ("a", "b"))
    assert mass_properties(tied)[0] == pytest.approx(mass_properties(assembly)[0])
    stiff, soft = (
        normal_modes(structure(a).system, 8, proof=False).frequency for a in (tied, assembly)
    )
    assert np.all(stiff[6:] >= soft[6:] * (1 - 1e-9))
    with pytest.raises(ModelError, match="share grids"):
        screw(before, np.array([0.1, 0.03, 0.0]), ("a", "a"))


def test_grip_holds_sliding_only():
    """k along the line: rigid motion stays free, a weldless pair keeps its other motions."""
    line = LINE.copy()
    e = np.tile([1.0, 0, 0], (len(line), 1))
    assembly, report = grip(pair(), line, e, np.full(len(line), 1e6), ("a", "b"))
    assert len(report) == len(line)
    assert rigid_count(assembly) == 12 - 1
    joined, _ = spot_welds(assembly, WELDS, ("a", "b"))
    assert rigid_count(joined) == 6


def test_accelerometers_weigh():
    before = pair()
    after = accelerometers(before, before.ids[[0, 5]].tolist())
    assert mass_properties(after)[0] - mass_properties(before)[0] == pytest.approx(0.010)
    with pytest.raises(LabelError, match="no grid"):
        accelerometers(before, [10**6])


def test_foot_of_a_triangle_against_brute_force():
    """The nearest of a fine lattice of points of the triangle is no nearer than the foot."""
    rng = np.random.default_rng(3)
    lattice = np.array([(a, b, 40 - a - b) for a in range(41) for b in range(41 - a)]) / 40
    for _ in range(40):
        x, p = rng.normal(size=(3, 3)), 2 * rng.normal(size=3)
        w = barycentric_foot(p, x)
        assert w.min() >= -1e-12
        assert w.sum() == pytest.approx(1)
        brute = np.linalg.norm(lattice @ x - p, axis=1).min()
        assert np.linalg.norm(w @ x - p) <= brute + 1e-12


def test_nearest_shell_is_not_the_nearest_centre():
    """A long shell beside short ones: its centre is far, its face is not."""
    x = np.r_[0.0, np.linspace(0.5, 0.6, 21)]
    points, quads = grid(x, np.array([0.0, 0.004]))
    surface = ShellSurface.over("s", np.column_stack([points, 0 * points[:, 0]]), quads)
    feet = surface.closest_points(np.array([(0.48, 0.002, 0.001)]))
    assert feet.shell[0] == 0
    assert feet.distance[0] == pytest.approx(0.001)


def test_patch_tends_to_the_disc():
    """Σ w x = centre, Σ w (x - c)² -> R²/4, at any mesh finer than the disc."""
    for h in (0.004, 0.002, 0.001):
        n = round(0.06 / h)
        points, quads = grid(np.linspace(0, 0.06, n + 1), np.linspace(0, 0.06, n + 1))
        surface = ShellSurface.over("s", np.column_stack([points, 0 * points[:, 0]]), quads)
        centre = np.array([0.0303, 0.0297, 0.0])
        nodes, weight = surface.patch(centre, 0.006)
        assert weight.sum() == pytest.approx(1)
        np.testing.assert_allclose(weight @ surface.points[nodes], centre, atol=1e-9)
    spread = weight @ ((surface.points[nodes] - centre) ** 2).sum(axis=1)
    assert spread == pytest.approx(0.006**2 / 2, rel=0.05)


def lap(h, patch):
    """Two strips overlapping by 30 mm, joined by one weld."""
    m = round(0.04 / h)
    y = np.linspace(0, 0.04, m + 1)
    a = sheet("a", np.linspace(0, 0.12, round(0.12 / h) + 1), y, 0.0)
    b = sheet("b", np.linspace(0.09, 0.21, round(0.12 / h) + 1), y, 0.001)
    parts = tuple(Part(k, s, ShellSection(1e-3, STEEL, STEEL)) for k, s in enumerate("ab", 1))
    assembly, _ = of_sheets({"a": a, "b": b}, parts)
    places = np.array([(0.105, 0.02, 0.0005)])
    return spot_welds(assembly, places, ("a", "b"), patch=patch)[0]


def first_modes(assembly: Assembly):
    return normal_modes(structure(assembly).system, 12, proof=False).frequency[6:]


def test_patched_weld_depends_less_on_the_mesh():
    """From 10 to 4 mm a nearest-shell weld softens with its shell; a patch of 6 mm does not."""
    plain = first_modes(lap(0.004, 0.0)) / first_modes(lap(0.010, 0.0))
    patched = first_modes(lap(0.004, 0.006)) / first_modes(lap(0.010, 0.006))
    assert np.abs(patched - 1).max() < np.abs(plain - 1).max()
