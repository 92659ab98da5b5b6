"""K2GG, B2GG and M2GG of DMIG: the matrix itself is added, in displacement frames."""

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.errors import ModelError
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly, read_deck, write_assembly
from chladni.units import UNITS

from .conftest import PLATE

MM = UNITS["mm-t-s"]
DOFS = [(1, 1), (1, 5), (3, 3), (90, 0)]  # two translations, a rotation, a scalar point
SIZE = np.array([1e-3, 1.0, 1e-3, 1e-3])  # SI of a unit of each: m, rad; a scalar point as a length
TURNED = PLATE.replace("GRID,3,,10.,10.,0.", "GRID,3,,10.,10.,0.,4") + (
    "CORD2R,4,,0.,0.,0.,1.,2.,3.\n,-2.,1.,.5\nSPOINT,90\nCELAS2,91,3.,90,,1,1\n"
    "CDAMP2,92,3.,90,,1,1\nCMASS2,93,3.,90\n"
)


def cards(A, name="AB"):
    out = f"DMIG,{name},0,6,1,0\n"
    for j, (grid, component) in enumerate(DOFS):
        first, *more = [f"{DOFS[i][0]},{DOFS[i][1]},{float(A[i, j])}" for i in range(j, len(DOFS))]
        out += f"DMIG,{name},{grid},{component},,{first}\n"
        out += "".join(f",{',,'.join(more[k : k + 2])}\n" for k in range(0, len(more), 2))
    return out


@pytest.fixture
def matrix():
    A = np.random.default_rng(2).normal(size=(4, 4))
    return A @ A.T


@pytest.mark.parametrize(("kind", "system"), [("K2GG", "K"), ("B2GG", "V"), ("M2GG", "M")])
@pytest.mark.parametrize(("text", "factor"), [("AB", 1.0), ("1.5*AB", 1.5), ("AB, .5*AB", 1.5)])
def test_the_matrix_is_added(bulk, matrix, kind, system, text, factor):
    """The change of K, V or M over the free dofs is A itself; WTMASS does not scale it."""
    found = []
    for chosen in ("", f"{kind} = {text}\n"):
        deck = bulk(f"{TURNED}{cards(matrix)}", f"SOL 103\nCEND\n{chosen}", fold=False)
        found.append(assembly(deck, MM))
    without, with_it = (structure(a).system for a in found)
    dofs = with_it.dofs.tolist()
    at = [dofs.index([g, max(c, 1)]) for g, c in DOFS]
    change = (getattr(with_it, system) - getattr(without, system)).toarray()
    unit = {"K": 1e-3 * 1e0, "V": 1e-3, "M": 1e3 * 1e-6}[system]  # N mm, N mm s, t mm²
    np.testing.assert_allclose(
        change[np.ix_(at, at)], factor * matrix * unit / np.outer(SIZE, SIZE), rtol=1e-7
    )
    change[np.ix_(at, at)] = 0
    assert np.abs(change).max() < 1e-9 * np.abs(getattr(with_it, system)).max()


def test_a_fresh_deck_has_scalar_elements_in_its_place(bulk, matrix, tmp_path):
    deck = bulk(f"{TURNED}{cards(matrix)}", "SOL 103\nCEND\nK2GG = AB\n", fold=False)
    made = assembly(deck, MM)
    again = assembly(read_deck(write_assembly(made, tmp_path / "fresh.bdf", MM)), MM)
    one, other = (structure(a).system.K for a in (made, again))
    assert abs(one - other).max() < 1e-9 * abs(one).max()


def test_allowed_matrices_are_passed_over(bulk, matrix):
    text = f"{TURNED}{cards(matrix)}"
    deck = bulk(text, "SOL 103\nCEND\nK2GG = AB\n", fold=False, allow=("DMIG",))
    assert len(assembly(deck, MM).springs) == 1


def test_a_matrix_that_makes_the_structure_unstable(bulk, matrix):
    deck = bulk(f"{TURNED}{cards(-matrix)}", "SOL 103\nCEND\nK2GG = AB\n", fold=False)
    said = "the matrix K2GG has a negative stiffness, and the structure is unstable"
    says(said, structure, assembly(deck, MM), error=ModelError)
