"""Frequency responses of a deck in SOL 108 and 111, under its own harmonic loads."""

import numpy as np
import scipy.sparse as sp

from ..dynamics.coupled import coupled_receptance
from ..dynamics.damping import DampingTable, with_table
from ..dynamics.eigen import normal_modes
from ..dynamics.modes import ModalModel
from ..dynamics.residual import with_residual_vectors
from ..errors import ModelError
from ..model.analysis import Analysis, Excitation, Subcase
from ..model.following_frequencies import merged
from .assemble import Structure
from .solve import driven, harmonic

MODAL = 111
_RANK = 1e-12  # of the largest singular value: load patterns below it are rounding


def response(
    built: Structure, analysis: Analysis, case: Subcase, outputs: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Displacements u(f) of a subcase under its DLOAD: frequencies (n_f,) and (n_f, n_out).

    SOL 108 solves line by line. SOL 111 sums the modes of METHOD, with the damping of SDAMP. With
    RESVEC it adds the residual vectors of the loads; enforced motion has no residual vectors.

    Parameters
    ----------
    outputs : (n_out, 2) int   point id and component 1-6

    Raises
    ------
    ModelError
        If the subcase selects no frequencies or no dynamic load.
    """
    loads = analysis.dynamic.get(case.dload)
    if loads is None:
        raise ModelError(f"subcase {case.id} selects no DLOAD set that the deck holds")
    modal = _modes(built, analysis, case) if analysis.solution == MODAL else None
    f = _frequencies(analysis, case, modal)
    if modal is not None:
        modal = _completed(built, analysis, case, modal, _patterns(built, loads, f))
    u = np.zeros((len(f), len(outputs)), dtype=complex)
    for load in loads:
        answer = _forced if load.kind == "force" else _moved
        u += answer(built, load, f, outputs, modal)
    return f, u


def _frequencies(analysis: Analysis, case: Subcase, modal: ModalModel | None) -> np.ndarray:
    """The FREQ set: its lists, and in SOL 111 the frequencies that follow the modes [Hz]."""
    lists = [analysis.frequency.get(case.frequency, np.zeros(0))]
    if modal is not None:
        lists += [rule(modal.frequency) for rule in analysis.following.get(case.frequency, ())]
    f = merged(lists)
    if not len(f):
        raise ModelError(f"subcase {case.id} selects no FREQ set that the deck holds")
    return f


def _modes(built: Structure, analysis: Analysis, case: Subcase) -> ModalModel:
    """The modes requested by EIGRL or EIGR."""
    low, high, count = analysis.eigen.get(case.method, (np.nan, np.nan, 0))
    band = high if np.isfinite(high) else None
    if band is None and not count:
        raise ModelError(f"METHOD {case.method} gives neither an upper frequency nor a count")
    n = len(built.system.dofs)
    modal = normal_modes(built.system, min(count, n) or None, band=band)
    return modal.sel(modal.frequency >= low) if np.isfinite(low) else modal


def _completed(
    built: Structure, analysis: Analysis, case: Subcase, modal: ModalModel, patterns: np.ndarray
) -> ModalModel:
    """Add residual vectors to the modes, and the damping of TABDMP1 at their frequencies."""
    if case.residual and patterns.shape[1] and len(modal):
        modal = with_residual_vectors(built.system, modal, patterns)
    if case.damping in analysis.damping:
        f, zeta = analysis.damping[case.damping]
        modal = with_table(modal, DampingTable(f, zeta, "crit"))
    return modal


def _patterns(built: Structure, loads: tuple[Excitation, ...], f: np.ndarray) -> np.ndarray:
    """Real load patterns Tᵀ p (n_free, k) of all forces among the loads."""
    out = [np.zeros((len(built.system.dofs), 0))]
    for load in loads:
        if load.kind == "force":
            _, pattern = _factored(load.at(f))
            part = built.T.T @ _spread(built, load, pattern)
            out += [part.real, part.imag]
    P = np.concatenate(out, axis=1)
    size = np.linalg.norm(P, axis=0)
    return P[:, size > _RANK * size.max(initial=0.0)]


def _spread(built: Structure, load: Excitation, pattern: np.ndarray) -> np.ndarray:
    """Expand forces on the load's dofs (k, r) to all motions (6n, r)."""
    whole = np.zeros((built.T.shape[0], pattern.shape[1]), dtype=complex)
    np.add.at(whole, 6 * load.rows + load.components - 1, pattern)
    return whole


def _forced(
    built: Structure, load: Excitation, f: np.ndarray, outputs: np.ndarray, modal: ModalModel | None
) -> np.ndarray:
    """Σ_k H_k(f) c_k(f), with the load as a few fixed patterns times functions of frequency."""
    amplitude, pattern = _factored(load.at(f))
    whole, pick = _spread(built, load, pattern), built.rows(outputs)
    if modal is None:
        H = harmonic(built, whole, f, pick)
    else:
        phi_i = (built.T.T @ whole).T @ modal.shapes
        loss = sp.csr_array(built.hysteretic().K.imag)
        H = coupled_receptance(modal, pick @ modal.shapes, phi_i, f, V=built.system.V, loss=loss)
    return np.einsum("fok,fk->fo", H, amplitude)


def _factored(P: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """P (n_f, k) = amplitude (n_f, r) patternᵀ with the smallest r, by singular values."""
    U, s, Vh = np.linalg.svd(P, full_matrices=False)
    r = max(1, int((s > _RANK * s[0]).sum())) if len(s) else 0
    return U[:, :r] * s[:r], Vh[:r].T


def _moved(
    built: Structure, load: Excitation, f: np.ndarray, outputs: np.ndarray, modal: ModalModel | None
) -> np.ndarray:
    """Enforced displacement, velocity or acceleration: the motion over (i ω) to the order."""
    order = {"displacement": 0, "velocity": 1, "acceleration": 2}[load.kind]
    if order and np.any(f == 0):
        raise ModelError(f"an enforced {load.kind} at 0 Hz has no displacement; begin above")
    motion = load.at(f) / (2j * np.pi * f[:, None]) ** order
    dofs = np.column_stack([load.rows, load.components])
    return driven(built.assembly, dofs, motion[:, :, None], f, outputs, modal)[:, :, 0]
