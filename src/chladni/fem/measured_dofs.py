"""Where sensors and shakers are on a structure: one type from the case to the picture."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..geometry.facets import tangents
from ..model.assembly import Assembly
from .assemble import Structure
from .base_motion import base_motion
from .locate import Share, rows_of, shares_of

_ONE_DEVICE = 1e-3  # [m]; channels of one accelerometer share its place


@dataclass(frozen=True, eq=False)
class MeasuredDofs:
    """Measured or driven dofs: grids, free points on the nearest shell, or the motion of the base.

    Attributes
    ----------
    labels : (k,) text
    grids : (k,) int       id, 0 where the place is no grid
    points : (k, 3)        [m], basic frame; nan for the motion of the base
    directions : (k, 3)    unit vectors, basic frame
    sd : (k,)              uncertainty of the place [m]
    mass : (k,)            of the sensor [kg]
    """

    labels: tuple[str, ...]
    grids: np.ndarray
    points: np.ndarray
    directions: np.ndarray
    sd: np.ndarray
    mass: np.ndarray

    @property
    def base(self) -> np.ndarray:
        """True where the dof is the enforced motion of the supports (k,)."""
        return np.isnan(self.points[:, 0])

    @property
    def device(self) -> np.ndarray:
        """Of each channel the first one at its place (k,): the channels of one sensor."""
        apart = np.linalg.norm(self.points[:, None] - self.points[None], axis=2)
        here = (apart < _ONE_DEVICE) | np.eye(len(apart), dtype=bool)
        return np.array([row.argmax() for row in here], dtype=np.int64)

    @property
    def channels(self) -> np.ndarray:
        """How many channels the sensor of each has (k,)."""
        return np.asarray(np.bincount(self.device)[self.device])

    @property
    def nodes(self) -> dict[int, np.ndarray]:
        """Places (3,) [m] by the node of the label; a label that begins with a name has none."""
        named = (
            (label.partition(":")[0], x) for label, x in zip(self.labels, self.points, strict=True)
        )
        return {int(node): x for node, x in named if node.isdecimal()}

    def rows(self, built: Structure, turning: bool = False) -> sp.csr_array:
        """Motion of each dof over the free dofs of the structure (k, n); the base has none (zero).

        A place that is no grid moves with the nearest point of the shells. Where ``turning``, the
        rotation about the direction instead.
        """
        found = sp.lil_array((len(self.labels), built.T.shape[1]))
        real = np.flatnonzero(~self.base)
        if len(real):
            found[real] = rows_of(
                built, self.grids[real], self.points[real], self.directions[real], turning
            )
        return sp.csr_array(found)

    def across(self) -> tuple["MeasuredDofs", "MeasuredDofs"]:
        """The same places along two directions u, v square to their own, u x v = n."""
        u, v = tangents(self.directions)
        return replace(self, directions=u), replace(self, directions=v)

    def loads(self, built: Structure) -> sp.csr_array:
        """What each input does to the free dofs, all forces or all motions of the base (k, n).

        A unit force is its row; a unit acceleration of the base is less the inertia it carries.
        """
        if not self.base.any():
            return self.rows(built)
        return sp.csr_array(-base_motion(built, self.directions).force.T)

    def carried_by(self, inputs: "MeasuredDofs") -> np.ndarray:
        """Motion of each dof for a unit motion of the base, nothing deforming (k, n_in)."""
        return np.where(inputs.base, self.directions @ inputs.directions.T, 0.0)

    def shares(self, assembly: Assembly) -> tuple[Share, ...]:
        """Grids each place hangs on with their weights; the motion of the base has none."""
        real = np.flatnonzero(~self.base)
        return tuple(shares_of(assembly, self.grids[real], self.points[real]))

    def around(self, built: Structure) -> sp.csr_array:
        """Rows at each place, then at four more round each that is uncertain (k + 4 m, n).

        They lie √2 standard deviations away in the sheet, so that the mean square of the four along
        either axis is sd².
        """
        rows = [self.rows(built)]
        for k in np.flatnonzero(self.sd > 0):
            n = self.directions[k]
            u, v = tangents(n)
            near = self.points[k] + np.sqrt(2) * self.sd[k] * np.array([u, -u, v, -v])
            rows.append(rows_of(built, np.zeros(4, int), near, np.tile(n, (4, 1))))
        return sp.csr_array(sp.vstack(rows))
