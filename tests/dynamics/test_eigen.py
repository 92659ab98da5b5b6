from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
from tests.builders.refusals import says

from chladni.dynamics import eigen
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.modes import ModalModel, rigid_modes
from chladni.dynamics.system import System
from chladni.errors import AccuracyError, ModelError
from chladni.fem.assemble import structure
from chladni.sparse.lanczos import block_lanczos
from chladni_specimens.plates import box

from .conftest import line, line_frequency


def together(*systems):
    """Systems side by side, with nothing between them."""
    blocks = [sp.csr_array(sp.block_diag([getattr(s, a) for s in systems])) for a in "MVK"]
    return System(*blocks, np.vstack([s.dofs for s in systems]))


@pytest.fixture(scope="module")
def shell_box():
    built = structure(box(0.3, 0.2, 0.1, h=0.025))
    return built.system


@pytest.mark.parametrize("n", [40, 900])
def test_line_has_its_closed_form(n):
    """Dense and sparse roads; sine law to rounding, mode 0 rigid."""
    modal = normal_modes(line(n), 12)
    assert rigid_modes(modal).sum() == 1
    due = line_frequency(n, np.arange(12))
    np.testing.assert_allclose(modal.frequency[1:], due[1:], rtol=1e-8)
    assert modal.frequency[0] < 1e-4 * due[1]


def test_shapes_solve_the_problem(shell_box):
    modal = normal_modes(shell_box, 25)
    lam, phi = (2 * np.pi * modal.frequency) ** 2, modal.shapes
    np.testing.assert_allclose(phi.T @ (shell_box.M @ phi), np.eye(25), atol=1e-10)
    k = phi.T @ (shell_box.K @ phi)
    np.testing.assert_allclose(k, np.diag(lam), atol=1e-7 * lam[-1])


def test_a_wide_range_of_modes_leaves_the_rigid_one_rigid():
    """Modes of a line over three decades and more: what is highest says nothing of the lowest."""
    f = np.r_[1e-6, line_frequency(10_000, np.arange(1, 10_000))]
    modal = ModalModel(f, 0 * f, np.zeros((0, len(f))), np.zeros((0, 2), int))
    assert f[-1] > 1e3 * f[1]
    assert rigid_modes(modal).tolist() == [True] + [False] * (len(f) - 1)


def test_sparse_equals_dense(monkeypatch):
    system = structure(box(0.3, 0.2, 0.1, h=0.04)).system
    sparse = normal_modes(system, 30)
    monkeypatch.setattr(eigen, "_DENSE", 10**6)
    dense = normal_modes(system, 30)
    np.testing.assert_allclose(sparse.frequency[6:], dense.frequency[6:], rtol=1e-7)


def test_units_do_not_matter(shell_box):
    """mm-t-s: forces in N, lengths in mm; translations and rotations scale apart."""
    mm = np.where(shell_box.dofs[:, 1] <= 3, 1e-3, 1.0)  # q_SI = D q_mm; work in N mm
    D = sp.diags_array(mm)
    other = replace(
        shell_box,
        M=sp.csr_array(D @ shell_box.M @ D) * 1e3,
        K=sp.csr_array(D @ shell_box.K @ D) * 1e3,
    )
    a, b = normal_modes(shell_box, 20), normal_modes(other, 20)
    np.testing.assert_allclose(a.frequency[6:], b.frequency[6:], rtol=1e-7)
    assert rigid_modes(b).sum() == 6


@pytest.mark.parametrize("copies", [2, 12, 20])
def test_disconnected_copies_give_repeated_modes(copies):
    """More equal modes than a block has columns: all of them are found."""
    n = 120
    modal = normal_modes(together(*(line(n, first=1 + n * c) for c in range(copies))), 3 * copies)
    due = np.repeat(line_frequency(n, np.arange(3)), copies)
    np.testing.assert_allclose(modal.frequency, due, atol=1e-5 * due[-1])
    assert rigid_modes(modal).sum() == copies


def test_a_cut_through_equal_modes_is_no_error():
    """count = 15 of 4 equal sets: whichever of the equal ones, but fifteen."""
    modal = normal_modes(together(*(line(120, first=1 + 120 * c) for c in range(4))), 15)
    due = np.repeat(line_frequency(120, np.arange(4)), 4)[:15]
    np.testing.assert_allclose(modal.frequency, due, atol=1e-5 * due[-1])


def test_band_finds_all_below(shell_box):
    f_max = 0.5 * np.sum(normal_modes(shell_box, 20).frequency[[14, 15]])
    assert len(normal_modes(shell_box, band=f_max)) == 15
    assert len(normal_modes(shell_box, 9, band=f_max)) == 9
    at_a_mode = normal_modes(shell_box, 20).frequency[14]
    assert len(normal_modes(shell_box, band=at_a_mode)) == 15
    assert len(normal_modes(line(900, free=False), band=1e-3)) == 0


@pytest.mark.parametrize("n", [150, 901])
def test_massless_dofs_follow_statically(n):
    """Every second point without mass: springs in series, a line of half the points and k/2."""
    full = line(n, free=False)
    m = np.zeros(n)
    m[1::2] = 1.0
    light = replace(full, M=sp.csr_array(sp.diags_array(m)))
    keep = np.arange(1, n, 2)
    due = normal_modes(line(len(keep), free=False, k=5e4), 10)
    modal = normal_modes(light, 10)
    if n % 2:  # both ends hang on two springs in series, as all the others do
        np.testing.assert_allclose(modal.frequency, due.frequency, rtol=1e-8)
    inner = modal.shapes[2:-2:2]
    mean = (modal.shapes[1:-3:2] + modal.shapes[3:-1:2]) / 2
    np.testing.assert_allclose(inner, mean, atol=1e-8)


def test_a_stiff_and_a_soft_world_far_apart():
    """No scale fits both: modes a thousand times slower are found beside the others."""
    modal = normal_modes(together(line(400), line(400, k=1e-1, first=500)), 30)
    fast, slow = (line_frequency(400, np.arange(30), k=k) for k in (1e5, 1e-1))
    due = np.sort(np.r_[fast, slow])[:30]
    np.testing.assert_allclose(modal.frequency[2:], due[2:], rtol=1e-5)


@pytest.mark.parametrize("backend", ["cholmod", "superlu"])
def test_backends_agree(shell_box, backend):
    if backend == "cholmod":
        pytest.importorskip("sksparse")
    a, b = (normal_modes(shell_box, 15, backend=x) for x in ("multifrontal", backend))
    np.testing.assert_allclose(a.frequency[6:], b.frequency[6:], rtol=1e-8)


def forgetful(times):
    """block_lanczos that loses the fourth mode for so many calls."""
    left = [times]

    def lanczos(*args, **options):
        ritz = block_lanczos(*args, **options)
        if left[0] == 0:
            return ritz
        left[0] -= 1
        keep = np.arange(len(ritz.theta)) != min(3, len(ritz.theta) - 1)
        if len(ritz.theta) <= 3:
            keep[0] = False
        return replace(
            ritz, theta=ritz.theta[keep], error=ritz.error[keep], weights=ritz.weights[:, keep]
        )

    return lanczos


def test_a_dropped_mode_is_found_again(monkeypatch):
    monkeypatch.setattr(eigen, "block_lanczos", forgetful(1))
    modal = normal_modes(line(900), 12)
    np.testing.assert_allclose(
        modal.frequency[1:], line_frequency(900, np.arange(1, 12)), rtol=1e-7
    )


def test_a_mode_lost_for_good_is_an_error(monkeypatch):
    """A solver blind to mode 3, M-orthogonal to it throughout."""
    n, lost = 900, []

    def blind(solve, M, k, **options):
        lost.append(block_lanczos(solve, M, 4).vectors(4)[:, 3])
        x = lost[0]
        return block_lanczos(lambda B: (Y := solve(B)) - np.outer(x, x @ Y), M, k, **options)

    monkeypatch.setattr(eigen, "block_lanczos", blind)
    says(r"modes lie below .* Hz, .* were found", normal_modes, line(n), 12, error=AccuracyError)
    assert len(normal_modes(line(n), 12, proof=False)) == 12


def test_wrong_vectors_are_an_error(monkeypatch):
    def sloppy(*args, **options):
        ritz = block_lanczos(*args, **options)
        return replace(ritz, weights=ritz.weights[:, ::-1])

    monkeypatch.setattr(eigen, "block_lanczos", sloppy)
    says("residual", normal_modes, line(900), 12, error=AccuracyError)


def test_a_part_that_hangs_on_nothing_is_named():
    K = line(900).K.tolil()
    K[600, :] = K[:, 600] = 0
    loose = replace(
        line(900),
        K=sp.csr_array(K),
        M=sp.csr_array(sp.diags_array(np.where(np.arange(900) == 600, 0.0, 1.0))),
    )
    says(r"601:\+Z", normal_modes, loose, 5)


@pytest.mark.parametrize("n", [50, 900])
def test_negative_stiffness_is_refused(n):
    bad = line(n)
    with pytest.raises((ModelError, AccuracyError)):
        normal_modes(replace(bad, K=bad.K - 5e4 * sp.eye_array(n)), 5)


def test_a_band_is_proved_too(monkeypatch):
    """A mode lost within the band is missed by the count at its upper end, and found."""
    monkeypatch.setattr(eigen, "block_lanczos", forgetful(1))
    due = line_frequency(900, np.arange(12))
    modal = normal_modes(line(900), band=np.mean(due[-2:]))
    np.testing.assert_allclose(modal.frequency[1:], due[1:-1], rtol=1e-7)


def test_what_does_not_converge_names_the_mass_out_of_proportion(shell_box, monkeypatch):
    """A guessed shift is nobody's fault: the heaviest translation is named; a given one is."""
    heavy = 42
    assert shell_box.dofs[heavy, 1] <= 3
    M = shell_box.M.copy().tolil()
    M[heavy, heavy] = 1e5 * np.median(shell_box.M.diagonal()[shell_box.dofs[:, 1] <= 3])
    monkeypatch.setattr(eigen, "_LOOSE", -1.0)  # whatever converges is not enough
    said = f"may be wrong: {shell_box.dofs[heavy, 0]}:.* has 1e\\+05 times"
    other = replace(shell_box, M=sp.csr_array(M))
    says(said, normal_modes, other, 8, error=AccuracyError)
    says("nearer to the modes", normal_modes, shell_box, 8, shift=-1e3, error=AccuracyError)


def test_the_shift_of_the_last_try_is_that_of_its_factor(monkeypatch):
    """Two tries with poor shifts: the modes are those of the shift that was factorised last."""
    made = []

    def poor_at_first(solve, M, k, **more):
        ritz = block_lanczos(solve, M, k, **more)
        made.append(ritz)
        return ritz if len(made) > 1 else replace(ritz, error=np.ones_like(ritz.error))

    monkeypatch.setattr(eigen, "block_lanczos", poor_at_first)
    monkeypatch.setattr(eigen, "_NEAR", 0.5)  # no shift is near enough
    modal = normal_modes(line(900), 12, proof=False)
    assert len(made) == 2
    due = line_frequency(900, np.arange(12))
    np.testing.assert_allclose(modal.frequency[1:], due[1:], rtol=1e-7)
