"""Springs, dampers, bushes and concentrated masses, assembled directly as sparse matrices (SI).

Scalar components refer to the displacement frames of their points, bushes to their own frames. The
matrices are in the basic frame, six dofs a point in the order of ``points``.
"""

import numpy as np
import scipy.sparse as sp

from ..model.assembly import Assembly, Bushes, Scalars
from .beam import cross

_ROUNDING = 1e-12  # of the length of an arm


def matrices(
    assembly: Assembly,
) -> tuple[sp.csr_array, sp.csr_array, sp.csr_array, sp.csr_array]:
    """(K, V, M, K_loss), each (6n, 6n): K_loss is Σ η_e K_e, the hysteretic part."""
    springs, bushes = assembly.springs, assembly.bushes
    E = _relative(assembly, bushes)
    K = _scalar(assembly, springs, springs.value) + _bush(assembly, E, bushes.stiffness)
    V = _scalar(assembly, assembly.dampers, assembly.dampers.value)
    V = V + _bush(assembly, E, bushes.viscous)
    lossy = _scalar(assembly, springs, springs.value * springs.damping)
    lossy = lossy + _bush(assembly, E, bushes.stiffness * bushes.loss)
    masses = assembly.scalar_masses
    return K, V, _scalar(assembly, masses, masses.value) + _points(assembly), lossy


def direction(assembly: Assembly, nodes: np.ndarray, component: np.ndarray) -> np.ndarray:
    """Unit vectors (..., 6) in the basic frame of components 1-6 in the points' own frames."""
    component = np.asarray(component)
    axis = np.eye(3)[(component - 1) % 3]
    if assembly.axes is not None:
        axis = np.take_along_axis(
            assembly.axes[nodes], ((component - 1) % 3)[..., None, None], axis=-2
        )[..., 0, :]
    moves = (component <= 3)[..., None]
    return np.concatenate([np.where(moves, axis, 0), np.where(moves, 0, axis)], axis=-1)


def _scalar(assembly: Assembly, elements: Scalars, value: np.ndarray) -> sp.csr_array:
    """Σ value b bᵀ with b = d_a - d_b, a grounded end (-1) left out (6n, 6n)."""
    b = direction(assembly, elements.nodes, elements.component)
    b = b * np.array([1.0, -1.0])[:, None] * (elements.nodes >= 0)[..., None]
    blocks = value[:, None, None] * np.einsum("mi,mj->mij", *[b.reshape(-1, 12)] * 2)
    return scattered(blocks, elements.nodes, len(assembly.ids))


def _relative(assembly: Assembly, bushes: Bushes) -> np.ndarray:
    """E (m, 6, 12) of δ = E (q_a, q_b): motion of b relative to a, at the bush, in its frame."""
    m = len(bushes)
    E = np.zeros((m, 6, 12))
    for end, sign in ((0, -1), (1, 1)):
        arm = bushes.place - assembly.points[bushes.nodes[:, end]]
        joined = sign * (bushes.nodes[:, end] >= 0)[:, None, None]
        k = 6 * end
        E[:, :3, k : k + 3] = E[:, 3:, k + 3 : k + 6] = joined * bushes.frame
        turned = bushes.frame @ cross(arm)
        size = np.linalg.norm(arm, axis=1)[:, None, None]
        turned[np.abs(turned) < _ROUNDING * size] = 0  # a force along the arm turns nothing
        E[:, :3, k + 3 : k + 6] = -joined * turned
    return E


def _bush(assembly: Assembly, E: np.ndarray, value: np.ndarray) -> sp.csr_array:
    """Σ Eᵀ diag(value) E (6n, 6n)."""
    blocks = E.transpose(0, 2, 1) @ (value[:, :, None] * E)
    return scattered(blocks, assembly.bushes.nodes, len(assembly.ids))


def _points(assembly: Assembly) -> sp.csr_array:
    """Concentrated masses on the diagonal blocks (6n, 6n)."""
    return scattered(assembly.masses.matrix, assembly.masses.node[:, None], len(assembly.ids))


def scattered(blocks: np.ndarray, nodes: np.ndarray, n: int) -> sp.csr_array:
    """Σ of element matrices (m, 6k, 6k) at the six dofs of nodes (m, k); -1 is ground (6n, 6n)."""
    dofs = (6 * nodes[:, :, None] + np.arange(6)).reshape(len(nodes), 6 * nodes.shape[1])
    rows = np.broadcast_to(dofs[:, :, None], blocks.shape)
    columns = np.broadcast_to(dofs[:, None, :], blocks.shape)
    keep = (rows >= 0) & (columns >= 0) & (blocks != 0)
    full = sp.coo_array((blocks[keep], (rows[keep], columns[keep])), shape=(6 * n, 6 * n))
    return full.tocsr()
