"""Responses of a structure to loads and to motions of its supports.

Loads and motions are (6n, k) over all points in the basic frame: six motions a point, one column a
load case. Dependent dofs may have loads, which Tᵀ transfers to their independent dofs.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ..dofs import COMPONENTS, rows
from ..dynamics.modes import ModalModel
from ..errors import LabelError
from ..model.assembly import Assembly
from ..sparse.factor import factorise
from .assemble import Structure, mass_over_all_motions, structure
from .energy import rigid_motions


def inertia_load(assembly: Assembly, acceleration: np.ndarray) -> np.ndarray:
    """Weight f = M R a (6n, k) [N] of every mass in fields a (3 or 6, k) [m/s², rad/s²].

    In gravity g, a = g; on a base accelerated by b, a = -b. Rows 4-6 are rotations about the
    origin.
    """
    a = np.asarray(acceleration, dtype=float)
    field = rigid_motions(assembly)[:, : len(a)] @ a
    return mass_over_all_motions(assembly) @ field


def _split(assembly: Assembly, dofs: np.ndarray) -> tuple[Structure, np.ndarray, np.ndarray]:
    """The structure with these dofs free, and the rows of the enforced (s) and other dofs (f)."""
    dofs, held = np.asarray(dofs, dtype=np.int64), assembly.supports
    moved = np.isin(8 * held[:, 0] + held[:, 1], 8 * dofs[:, 0] + dofs[:, 1])
    built = structure(replace(assembly, supports=held[~moved]))
    s = _at(built, dofs)
    return built, s, np.setdiff1d(np.arange(len(built.system.dofs)), s)


def driven(
    assembly: Assembly,
    dofs: np.ndarray,
    values: np.ndarray,
    frequency: np.ndarray,
    outputs: np.ndarray,
    modal: ModalModel | None = None,
) -> np.ndarray:
    """Motion for dofs of given amplitudes, Z_ff q_f = -Z_fs q_s (n_f, n_out, k) [m].

    Parameters
    ----------
    dofs : (s, 2) int        row of points and component 1-6 of enforced dofs, supports or not
    values : (n_f, s, k)     their complex displacements, or (s, k) for all lines [m]
    frequency : (n_f,)       [Hz]
    outputs : (n_out, 2)     point id and component 1-6
    modal : ModalModel       damped modes of the structure with the enforced dofs held: the absolute
                             motion is a sum over these, as in SOL 111 with SPCD; by default the
                             equations are solved line by line
    """
    built, s, f = _split(assembly, dofs)
    free = built.system.dofs[f]
    answer = _line_by_line(free) if modal is None else _by_modes(modal, free)
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)
    u_s = np.broadcast_to(values, (len(omega), *np.shape(values)[-2:]))
    pick, whole = built.rows(outputs), built.hysteretic()
    H = np.empty((len(omega), len(outputs), u_s.shape[2]), dtype=complex)
    for k, w in enumerate(omega):
        Z = sp.csr_array(whole.K + 1j * w * whole.V - w**2 * whole.M)
        q = np.zeros((len(built.system.dofs), u_s.shape[2]), dtype=complex)
        q[s] = u_s[k]
        q[f] = answer(w, sp.csr_array(Z[f][:, f]), -(Z[f] @ q))
        H[k] = pick @ q
    return H


Answer = Callable[[float, sp.csr_array, np.ndarray], np.ndarray]


def _line_by_line(dofs: np.ndarray) -> Answer:
    """Z⁻¹ f."""
    return lambda _, Z, f: factorise(Z, nodes=dofs[:, 0], definite=False).solve(f)


def _by_modes(modal: ModalModel, dofs: np.ndarray) -> Answer:
    """Φ (Φᵀ Z Φ + diag(2 i ζ_r ω_r ω))⁻¹ Φᵀ f: dashpots and loss factors couple the modes."""
    phi, w_r = _shapes_at(modal, dofs), 2 * np.pi * modal.frequency

    def answer(w: float, Z: sp.csr_array, f: np.ndarray) -> np.ndarray:
        A = phi.T @ (Z @ phi) + np.diag(2j * modal.damping * w_r * w)
        return phi @ np.linalg.solve(A, phi.T @ f)

    return answer


def _shapes_at(modal: ModalModel, dofs: np.ndarray) -> np.ndarray:
    """Rows of Φ at (point id, component)."""
    at = rows(dofs, modal.dofs)
    if np.any(at < 0):
        point, component = dofs[np.argmax(at < 0)]
        raise LabelError(f"the modes have no {point}:+{COMPONENTS[component - 1]}")
    return modal.shapes[at]


def _at(built: Structure, dofs: np.ndarray) -> np.ndarray:
    """Rows of the system at (row of points, component)."""
    wanted = np.column_stack([built.assembly.ids[dofs[:, 0]], dofs[:, 1]])
    at = rows(wanted, built.system.dofs)
    if np.any(missing := at < 0):
        point, component = built.assembly.ids[dofs[missing][0, 0]], dofs[missing][0, 1]
        raise LabelError(
            f"{point}:+{COMPONENTS[component - 1]} cannot be moved: it depends on other dofs, or "
            "has no stiffness"
        )
    return at


def harmonic(
    built: Structure, load: np.ndarray, frequency: np.ndarray, pick: sp.sparray | np.ndarray
) -> np.ndarray:
    """Receptance p (K (1 + i g) + i K_loss + i ω V - ω² M)⁻¹ Tᵀ f, without modes [m].

    Parameters
    ----------
    load : (6n, k)           may be complex [N]
    frequency : (n_f,)       [Hz]
    pick : (n_out, n_free)   outputs over the free dofs, as ``Structure.rows`` gives them

    Returns
    -------
    (n_f, n_out, k) complex
    """
    system, f = built.hysteretic(), (built.T.T @ load).astype(complex)
    H = np.empty((len(frequency), pick.shape[0], f.shape[1]), dtype=complex)
    for k, omega in enumerate(2 * np.pi * np.asarray(frequency, dtype=float)):
        Z = sp.csr_array(system.K + 1j * omega * system.V - omega**2 * system.M)
        H[k] = pick @ factorise(Z, nodes=system.dofs[:, 0], definite=False).solve(f)
    return H
