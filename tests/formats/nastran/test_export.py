"""A fresh deck says the same as the Assembly it came from, in any unit system."""

import re
from dataclasses import fields, is_dataclass, replace

import numpy as np
import pytest

from chladni.io.nastran import assembly, read_deck, write_assembly
from chladni.model.assembly import (
    Assembly,
    Average,
    Beams,
    Bushes,
    Equation,
    Masses,
    RigidBody,
    Scalars,
    Shells,
    Solids,
)
from chladni.model.properties import (
    Anisotropic,
    BeamSection,
    BeamStation,
    Isotropic,
    Orthotropic,
    Part,
    ShellSection,
    SolidSection,
)
from chladni.units import UNITS

from .conftest import read_real, real_decks

RENUMBERED = (".rigid[", ".id")  # a tie's number is shared with elements in old decks


def differences(a, b, where=""):
    """Paths at which two values differ by more than 1e-9 of their largest entry."""
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        if a.shape != b.shape:
            return [f"{where}: {a.shape} {b.shape}"]
        size = np.abs(a).max(initial=1e-300)
        return [where] if np.abs(a.astype(float) - b).max(initial=0) > 1e-9 * size else []
    if is_dataclass(a) and type(a) is type(b):
        pairs = [(f".{f.name}", getattr(a, f.name), getattr(b, f.name)) for f in fields(a)]
        return [d for name, x, y in pairs for d in differences(x, y, where + name)]
    if isinstance(a, tuple) and isinstance(b, tuple) and len(a) == len(b):
        pairs = enumerate(zip(a, b, strict=True))
        return [d for k, (x, y) in pairs for d in differences(x, y, f"{where}[{k}]")]
    if where.startswith(RENUMBERED[0]) and where.endswith(RENUMBERED[1]):
        return []
    same = a == pytest.approx(b, rel=1e-9) if isinstance(a, float) else a == b
    return [] if same else [f"{where}: {a} {b}"]


def round_trip(made, folder, unit):
    """Differences; a scalar point has no place, and only one spring keeps the id of its element."""
    path = write_assembly(made, folder / "fresh.bdf", UNITS[unit])
    back = assembly(read_deck(path), UNITS[unit], loose=True)
    if made.scalar_points is None:
        return differences(made, back)
    nowhere, ids = made.scalar_points[:, None], made.springs.ids
    first = np.isin(np.arange(len(ids)), np.unique(ids, return_index=True)[1])
    made, back = (
        replace(a, points=np.where(nowhere, 0.0, a.points),
                springs=replace(a.springs, ids=np.where(first, a.springs.ids, 0)))
        for a in (made, back)
    )  # fmt: skip
    return differences(made, back)


@real_decks()
def test_real_decks_come_back(path, tmp_path):
    made = assembly(read_real(path), UNITS["mm-t-s"])
    unit = sorted(UNITS)[len(path.parent.name) % len(UNITS)]
    assert round_trip(made, tmp_path, unit) == []


def everything():
    """One of each family, in turned frames, with awkward numbers."""
    rng = np.random.default_rng(3)
    ids = np.array([3, 5, 8, 9, 20, 21, 22, 23, 30, 77])
    points = rng.normal(size=(10, 3))
    points[:4] = [[0, 0, 0], [1, 0.1, 0], [1.1, 0.9, 0], [0, 1, 0]]
    points[4:8] = points[:4] + np.array([0, 0.1, 1.3])
    points[8], points[9] = points[:2].mean(axis=0) - [0, 0.05, 0], 0  # on the edge of a tetrahedron
    axes = np.linalg.qr(rng.normal(size=(10, 3, 3)))[0]
    axes *= np.linalg.det(axes)[:, None, None]
    axes[[0, 9]] = np.eye(3)
    steel = Isotropic(2.1e11 / 3, 0.3, 7850 / 7, 0.01, id=5)
    wood = Orthotropic(1.1e10, 9e8, 0.37, 6e8, 5e8, 1e8, 450.0, id=5)  # the same id: renumbered
    sheet = Anisotropic(np.diag([3.0, 2.0, 1.0]) * 1e10 / 3, np.diag([2.0, 1.0]) * 1e9, 900.0, id=8)
    parts = (
        Part(7, "outer", ShellSection(1.1e-3, steel, steel, steel, None, 1.3, 0.7, 0.21)),
        Part(7, "door; inner", ShellSection(2e-3, sheet, sheet, None, sheet)),
        Part(8, "glue", SolidSection(steel, full=True)),
        Part(9, "rail", BeamSection(steel, 1e-4 / 3, 2e-9, 3e-9, 1e-10, 4e-9, (0.8, 0.7), 0.1)),
        Part(10, "rod", BeamSection(steel, 1e-4, J=1e-9 / 3, kind="rod")),
        Part(11, "mast", BeamSection(steel, 1e-4, 2e-9, 3e-9, 0.0, 4e-9, (0.8, 0.7), 0.1, "beam",
                                     (1e-3, 2e-3), (3e-3, 4e-3), 0.05)),
        Part(12, "wood", ShellSection(3e-3, wood, wood, rigid_shear=True)),
        Part(13, "boom", BeamSection(steel, 1e-4, 2e-9, 3e-9, 1e-10, 4e-9, (0.8, 0.7), 0.1, "beam",
                                     stations=(BeamStation(1.0, 0.7, 0.6, 0.5, 0.02, 0.3, 0.2, 0.03,
                                                           (1e-3, 2e-3), (3e-3, 4e-3)),))),
    )  # fmt: skip
    nodes = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [0, 1, 2, 2]])
    axis = np.array([[1.0, 0, 0], [0.6, 0.8, 0], [1, 0.1, 0], [0, 1, 0]])
    shells = Shells(np.array([1, 2, 3, 4]), nodes, np.array([0, 1, 6, 0]),
                    np.array([[1.1e-3] * 4, [1e-3, 2e-3, 3e-3, 4e-3], [3e-3] * 4, [1e-3 / 3] * 4]),
                    _in_plane(axis, points[nodes]), np.array([0, 1e-3 / 3, 0, -2e-3]),
                    nonstructural=np.array([0.0, 0.3, 0.0, 1.0]))  # fmt: skip
    mass = np.zeros((2, 6, 6))
    mass[0] = np.diag([2, 2, 2, 0.1, 0.2, 0.3])
    mass[1] = np.diag([1, 2, 3, 0.1, 0.2, 0.3]) + 0.01
    return Assembly(
        ids=ids,
        points=points,
        parts=parts,
        shells=shells,
        solids=(
            Solids(np.array([10]), np.arange(8)[None], np.array([2])),
            Solids(np.array([29]), np.array([[0, 1, 3, 4, 8, 1, 3, 0, 1, 3]]), np.array([2])),
        ),
        beams=Beams(np.array([11, 31, 12, 13]), np.array([[0, 8], [1, 7], [2, 5], [3, 8]]),
                    np.array([3, 7, 5, 4]),
                    np.array([[0, 0, 1.0], [0, 1.0, 0], [1, 0.2, 0], [0, 0, 0]]),
                    np.array([[[0.1, 0.2, 0.3]] * 2, *[[[0, 0, 0]] * 2] * 3]),
                    np.array([[[0, 0, 0, 1, 1, 0], [0] * 6], *[[[0] * 6] * 2] * 3], bool),
                    np.array([0.0, 0.0, 0.7, 0.2])),
        springs=Scalars(np.array([14, 15]), np.array([[0, 9], [-1, 3]]), np.array([[5, 1], [1, 4]]),
                        np.array([1e5 / 3, 7.0]), np.array([0.02, 0])),
        dampers=Scalars(np.array([16]), np.array([[1, 2]]), np.array([[1, 6]]), np.array([3.3]),
                        np.zeros(1)),
        scalar_masses=Scalars(np.array([17]), np.array([[1, -1]]), np.array([[4, 1]]),
                              np.array([0.7]), np.zeros(1)),
        bushes=Bushes(np.array([18, 19]), np.array([[0, 4], [3, -1]]), axes[1:3],
                      np.array([0.5 * (points[0] + points[4]), [0.3, 0.2, 0.1]]),
                      rng.uniform(1e4, 1e5, (2, 6)), np.array([np.arange(6.0), np.zeros(6)]),
                      np.array([np.zeros(6), [0, 0.1, 0, 0, 0, 0]])),
        masses=Masses(np.array([24, 25]), np.array([8, 3]), mass),
        rigid=(
            RigidBody(26, 8, (6, 7), ((1, 2, 3), (1, 2, 3))),
            Average(27, 8, (1, 2, 3), ((0, (1, 2, 3), 1.0), (1, (1, 2, 3), 1.0), (2, (1,), 0.3))),
            Average(28, 4, (1, 2, 3, 4, 5, 6), ((0, (1, 2, 3), 1.0), (1, (1, 2, 3, 4), 1 / 3),
                    (2, (1, 2, 3), 1.0)), ((0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (2, 3))),
            Equation(1, (0, 9, 1, 2), (5, 1, 2, 6), (1.0, -0.5, 1 / 3, 2.0)),
        ),
        supports=np.array([[0, 1], [0, 2], [0, 3], [1, 1], [1, 2], [1, 3], [9, 1]]),
        axes=axes,
        scalar_points=np.arange(10) == 9,
        coupled_mass=True,
        structural_damping=0.03,
        auto_spc=False,
    )  # fmt: skip


def _in_plane(axis, X):
    """Directions laid on the elements, as the reader gives them."""
    d1, d2 = X[:, 2] - X[:, 0], X[:, 3] - X[:, 1]
    n = np.cross(d1, d2)
    n /= np.linalg.norm(n, axis=1)[:, None]
    flat = axis - np.einsum("ni,ni->n", axis, n)[:, None] * n
    return flat / np.linalg.norm(flat, axis=1)[:, None]


@pytest.mark.parametrize("unit", UNITS)
def test_one_of_each_comes_back(unit, tmp_path):
    made = everything()
    found = round_trip(made, tmp_path, unit)
    # a shear material that was left out is named when it comes back; ids and names that occur
    # twice or hold a semicolon are replaced
    expected = (
        r"\.parts\[1\]\.(id|name):|\.id:|\.section\.(shear|membrane|bending|coupling)(\.G)?(:|$)"
    )
    assert [d for d in found if not re.search(expected, d)] == []


def test_shear_of_a_laminate_comes_back(tmp_path):
    """Transverse moduli given on the bending material itself become a MAT2 of their own."""
    made = everything()
    again = assembly(read_deck(write_assembly(made, tmp_path / "fresh.bdf")), loose=True)
    found, due = again.parts[1].section, made.parts[1].section
    np.testing.assert_allclose(found.shear.transverse(), due.bending.transverse(), rtol=1e-9)
    np.testing.assert_allclose(found.coupling.Q, due.coupling.Q, rtol=1e-9)
    assert again.parts[1].name == "door, inner"


def test_numbers_already_taken_are_given_anew(tmp_path):
    """A generated specimen may number each family from 1."""
    made = everything()
    clash = replace(made, springs=replace(made.springs, ids=np.array([1, 2])))
    path = write_assembly(clash, tmp_path / "fresh.bdf")
    again = assembly(read_deck(path), UNITS["SI"], loose=True)
    assert again.shells.ids.tolist() == made.shells.ids.tolist()
    assert len({*again.springs.ids, *again.shells.ids}) == 6


def test_plain_text(tmp_path):
    """Lines of at most 80 columns, ASCII, the unit system said."""
    text = write_assembly(everything(), tmp_path / "fresh.bdf", UNITS["mm-t-s"]).read_text()
    assert text.isascii()
    assert max(map(len, text.splitlines())) <= 80
    assert text.startswith("$ units: mm-t-s\nSOL 103\n")


@pytest.mark.parametrize("m", [0.0, 2.0])
def test_inertia_that_no_body_has_stays_a_matrix(tmp_path, m):
    """Fluid or a condensed part may weigh so; a CONM2 that says it is refused."""
    matrix = np.diag([m, m, m, 1.0, 1.0, 3.0])[None]
    base = everything()
    made = replace(base, masses=Masses(np.array([9000]), base.masses.node[:1], matrix))
    path = write_assembly(made, tmp_path / "fresh.bdf", UNITS["mm-t-s"])
    assert "CONM1" in path.read_text()
    again = assembly(read_deck(path), UNITS["mm-t-s"], loose=True).masses
    np.testing.assert_allclose(again.matrix, matrix, atol=1e-9)
