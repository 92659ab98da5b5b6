"""Responses of a structure: static, enforced and harmonic.

Loads and motions are (6n, k) over all points in the basic frame: six motions a point, one column a
load case. Dependent dofs may have loads, which Tᵀ transfers to their independent dofs.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ..dofs import COMPONENTS, rows
from ..dynamics.modes import ModalModel
from ..errors import LabelError, ModelError
from ..model.analysis import Analysis, Subcase
from ..model.assembly import Assembly
from ..sparse.factor import factorise
from .assemble import Structure, over_all_motions, structure
from .energy import rigid_motions


def static(built: Structure, load: np.ndarray) -> np.ndarray:
    """Displacements u = T K⁻¹ Tᵀ f (6n, k) [m, rad] under loads f (6n, k) [N, N m].

    Raises
    ------
    ModelError
        If the structure can move without strain.
    """
    return built.T @ _solved(built.system.K, built.T.T @ load, built.system.dofs)


def _solved(K: sp.csr_array, f: np.ndarray, dofs: np.ndarray) -> np.ndarray:
    """K⁻¹ f, refined once; raise ``ModelError`` if K is singular to working precision."""
    try:
        factor = factorise(K, nodes=dofs[:, 0])
    except ModelError as fault:
        raise ModelError(f"the structure can move freely, hold it by supports: {fault}") from fault
    q = factor.solve(f)
    q = q + factor.solve(f - K @ q)
    gap, scale = np.abs(K @ q - f).max(initial=0), np.abs(f).max(initial=0)
    if not gap <= 1e-6 * scale:
        raise ModelError(
            f"the structure can move freely, hold it by supports: {gap:.1e} N of {scale:.1e} N "
            "meet no resistance"
        )
    return q


def subcase_statics(assembly: Assembly, analysis: Analysis, case: Subcase) -> np.ndarray:
    """Displacements (6n, 1) of one static subcase: its loads, weight and enforced supports.

    Parameters
    ----------
    assembly : with the supports and equations of this subcase
    """
    load = np.zeros((6 * len(assembly.ids), 1))
    if chosen := analysis.loads.get(case.load):
        np.add.at(load[:, 0], 6 * chosen.rows + chosen.components - 1, chosen.values)
        if np.any(chosen.gravity):
            load += inertia_load(assembly, chosen.gravity[:, None])
    moved = [analysis.prescribed[k] for k in {case.load, case.spc} if k in analysis.prescribed]
    if not moved:
        return static(structure(assembly), load)
    dofs = np.column_stack(
        [np.concatenate([getattr(m, name) for m in moved]) for name in ("rows", "components")]
    )
    values = np.concatenate([m.values for m in moved])
    return enforced(assembly, dofs, values[:, None], load)


def inertia_load(assembly: Assembly, acceleration: np.ndarray) -> np.ndarray:
    """Weight f = M R a (6n, k) [N] of every mass in fields a (3 or 6, k) [m/s², rad/s²].

    In gravity g, a = g; on a base accelerated by b, a = -b. Rows 4-6 are rotations about the
    origin.
    """
    a = np.asarray(acceleration, dtype=float)
    field = rigid_motions(assembly)[:, : len(a)] @ a
    return over_all_motions(assembly)[0] @ field


def enforced(
    assembly: Assembly, dofs: np.ndarray, values: np.ndarray, load: np.ndarray | None = None
) -> np.ndarray:
    """Displacements (6n, k) with some enforced dofs q_s: K_ff q_f = (Tᵀ f)_f - K_fs q_s.

    Parameters
    ----------
    dofs : (s, 2) int     row of points and component 1-6 in displacement frames, supports or not
    values : (s, k)       [m, rad]
    load : (6n, k)        additional forces [N, N m]

    Raises
    ------
    LabelError
        If an enforced dof depends on others, or has no stiffness.
    """
    built, s, f = _split(assembly, dofs)
    q = np.zeros((len(built.system.dofs), np.shape(values)[1]))
    q[s] = values
    force = -(built.system.K @ q)
    if load is not None:
        force = force + built.T.T @ load
    q[f] = _solved(sp.csr_array(built.system.K[f][:, f]), force[f], built.system.dofs[f])
    return built.T @ q


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


def motion_at(assembly: Assembly, dofs: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Components of u (6n, k) at (point id, component 1-6) in displacement frames (n_out, k)."""
    dofs = np.asarray(dofs, dtype=np.int64)
    at, component = assembly.rows(dofs[:, 0]), dofs[:, 1] - 1
    first = 6 * at + 3 * (component // 3)
    axes = np.eye(3)[component % 3]
    if assembly.axes is not None:
        axes = assembly.axes[at, component % 3]
    return np.einsum("oi,oik->ok", axes, u[first[:, None] + np.arange(3)])
