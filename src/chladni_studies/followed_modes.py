"""The nominal model's modes found again in a sample, by MAC, however far they have moved."""

from dataclasses import dataclass

import numpy as np

from chladni.dofs import rows
from chladni.dynamics.modes import ModalModel, rigid_modes
from chladni.ema.correlation import mac, subspace_mac
from chladni.geometry.sampling import farthest_point_sample

MARGIN = 1.4  # modes solved over modes followed: a mode may rise past its neighbours
MOST_NODES = 1500  # nodes at which shapes are compared: a MAC of thousands of dofs gains nothing
CLOSE = 5e-3  # relative distance of frequencies below which shapes may mix freely
LEAST_MAC = 0.5  # MAC below which a mode is lost


@dataclass(frozen=True, eq=False)
class FollowedModes:
    """Elastic modes of the nominal model, at the translations of a few nodes."""

    frequency: np.ndarray  # (r,) [Hz]
    shapes: np.ndarray  # (k, r)
    dofs: np.ndarray  # (k, 2) int; point id and component of each row
    rigid: int  # modes below them

    @property
    def solved(self) -> int:
        """Number of modes that are solved for in a sample."""
        return self.rigid + int(np.ceil(MARGIN * len(self.frequency))) + 2

    @property
    def clusters(self) -> np.ndarray:
        """Number of the group of close frequencies each mode is in (r,)."""
        f = self.frequency
        return np.concatenate([[0], np.cumsum(np.diff(f) > CLOSE * f[:-1])]).astype(int)

    def found_in(self, modal: ModalModel) -> tuple[np.ndarray, np.ndarray]:
        """Frequency (r,) [Hz] and MAC (r,) of each in the modes of a sample; nan where it is lost.

        Close modes may mix.  A shape is assigned by its share in the space of a group
        (``subspace_mac``), and within the group by its own MAC.
        """
        from scipy.optimize import linear_sum_assignment

        elastic = modal.sel(np.arange(len(modal)) >= self.rigid)
        psi = elastic.shapes[rows(self.dofs, elastic.dofs)]
        own, group = mac(self.shapes, psi), self.clusters
        share = np.zeros_like(own)
        for k in range(group[-1] + 1):
            members = group == k
            share[members] = subspace_mac(psi, self.shapes[:, members])
        m, n = linear_sum_assignment(share + 1e-3 * own, maximize=True)
        f, value = np.full(len(group), np.nan), np.full(len(group), np.nan)
        value[m] = share[m, n]
        kept = share[m, n] >= LEAST_MAC
        f[m[kept]] = elastic.frequency[n[kept]]
        return f, value


def followed(modal: ModalModel, places: np.ndarray, count: int) -> FollowedModes:
    """The ``count`` lowest elastic modes of a model, fewer where it has fewer.

    Parameters
    ----------
    places : (n, 3)   of the node of each dof [m]
    """
    rigid = int(rigid_modes(modal).sum())
    ids, first = np.unique(modal.dofs[:, 0], return_index=True)
    chosen = ids[farthest_point_sample(places[first], MOST_NODES)]
    use = np.isin(modal.dofs[:, 0], chosen) & (modal.dofs[:, 1] <= 3)
    elastic = slice(rigid, rigid + count)
    return FollowedModes(
        modal.frequency[elastic], modal.shapes[use, elastic], modal.dofs[use], rigid
    )
