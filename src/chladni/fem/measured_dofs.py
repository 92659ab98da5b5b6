"""Places and directions of sensors and shakers on a structure."""

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from ..geometry.facets import tangents
from ..model.assembly import Assembly
from ..results import ShownBriefly
from .assemble import Structure
from .base_motion import base_motion
from .locate import Share, change_of, rows_of, shares_of

_ONE_DEVICE = 1e-3  # [m]; channels of one accelerometer share its place


@dataclass(frozen=True, eq=False, repr=False)
class MeasuredDofs(ShownBriefly):
    """Measured or driven dofs: grids, free points on the nearest shell, or motion of the base."""

    labels: tuple[str, ...]  # (k,) text
    grids: np.ndarray  # (k,) int: id, 0 for a place away from grids
    points: np.ndarray  # (k, 3) [m], basic frame; nan for the motion of the base
    directions: np.ndarray  # (k, 3) unit vectors, basic frame
    sd: np.ndarray  # (k,) uncertainty of the place [m]
    mass: np.ndarray  # (k,) of the sensor [kg]

    @property
    def base(self) -> np.ndarray:
        """True where the dof is the enforced motion of the supports (k,)."""
        return np.isnan(self.points[:, 0])

    @property
    def device(self) -> np.ndarray:
        """Index (k,) of the first channel at the place of each channel: one value per sensor."""
        apart = np.linalg.norm(self.points[:, None] - self.points[None], axis=2)
        here = (apart < _ONE_DEVICE) | np.eye(len(apart), dtype=bool)
        return np.array([row.argmax() for row in here], dtype=np.int64)

    @property
    def channels(self) -> np.ndarray:
        """Number of channels of each channel's sensor (k,)."""
        return np.asarray(np.bincount(self.device)[self.device])

    @property
    def nodes(self) -> dict[int, np.ndarray]:
        """Places (3,) [m] by the node number of the label; labels with a name are left out."""
        named = (
            (label.partition(":")[0], x) for label, x in zip(self.labels, self.points, strict=True)
        )
        return {int(node): x for node, x in named if node.isdecimal()}

    def first(self, n: int) -> "MeasuredDofs":
        """The first n of them; all but the last -n for a negative n."""
        return MeasuredDofs(*(value[:n] for value in vars(self).values()))

    def only(self, chosen: np.ndarray) -> "MeasuredDofs":
        """A selection of them, by a mask (k,)."""
        labels = tuple(np.array(self.labels, dtype=object)[chosen])
        arrays = {name: value[chosen] for name, value in vars(self).items() if name != "labels"}
        return MeasuredDofs(labels, **arrays)

    def joined(self, other: "MeasuredDofs") -> "MeasuredDofs":
        """These, and others whose labels are new."""
        new = [k for k, name in enumerate(other.labels) if name not in self.labels]
        own, added = vars(self), vars(other)
        arrays = {
            name: np.concatenate([value, added[name][new]])
            for name, value in own.items() if name != "labels"
        }  # fmt: skip
        return MeasuredDofs((*self.labels, *(other.labels[k] for k in new)), **arrays)

    def rows(self, built: Structure, turning: bool = False) -> sp.csr_array:
        """Motion of each dof over the free dofs of the structure (k, n); zero for the base.

        A place away from grids moves with the nearest point of the shells. With ``turning``, rows
        of the rotation about the direction.
        """
        found = sp.lil_array((len(self.labels), built.T.shape[1]))
        real = np.flatnonzero(~self.base)
        if len(real):
            found[real] = rows_of(
                built, self.grids[real], self.points[real], self.directions[real], turning
            )
        return sp.csr_array(found)

    def moved(self, built: Structure, by: np.ndarray) -> tuple[sp.csr_array, sp.csr_array]:
        """Change of the motion of each dof where its place moves by (k,) [m] along u, and along v.

        On sheets and beams it follows from rotations, w(x + dx) = w + (θ × dx) · n. Grids of solids
        have none: there it is the slope of the motion over the faces about the place.
        """
        u, v = self.across()
        solid = np.flatnonzero(self._on_solids(built.assembly) & (by > 0))
        out = []
        for along, about, sign in ((u, v, -1.0), (v, u, 1.0)):
            rows = (sp.diags_array(sign * by) @ about.rows(built, turning=True)).tolil()
            if len(solid):
                step = by[solid, None] * along.directions[solid]
                rows[solid] = change_of(built, self.points[solid], step, self.directions[solid])
            out.append(sp.csr_array(rows))
        return out[0], out[1]

    def _on_solids(self, assembly: Assembly) -> np.ndarray:
        """True (k,) where a place is on grids of solids alone, which do not rotate."""
        out, solid = np.zeros(len(self.labels), bool), np.zeros(len(assembly.points), bool)
        for some in assembly.solids:
            solid[some.nodes] = True
        solid[assembly.shells.nodes] = solid[assembly.beams.nodes] = False
        if solid.any():
            shares = self.shares(assembly)
            out[~self.base] = [solid[assembly.rows([g for g, _ in s])].all() for s in shares]
        return out

    def across(self) -> tuple["MeasuredDofs", "MeasuredDofs"]:
        """Copies with the two directions u, v normal to n, u x v = n."""
        u, v = tangents(self.directions)
        return replace(self, directions=u), replace(self, directions=v)

    def loads(self, built: Structure) -> sp.csr_array:
        """Load of each input on the free dofs (k, n), for forces or for motions of the base.

        A unit force is its row; a unit acceleration of the base is minus the inertia load.
        """
        if not self.base.any():
            return self.rows(built)
        return sp.csr_array(-base_motion(built, self.directions).force.T)

    def moved_with_base(self, inputs: "MeasuredDofs") -> np.ndarray:
        """Motion of each dof for a unit rigid motion of the base (k, n_in)."""
        return np.where(inputs.base, self.directions @ inputs.directions.T, 0.0)

    def shares(self, assembly: Assembly) -> tuple[Share, ...]:
        """Grids and weights of each place; the motion of the base is left out."""
        real = np.flatnonzero(~self.base)
        return tuple(shares_of(assembly, self.grids[real], self.points[real]))

    def around(self, built: Structure) -> sp.csr_array:
        """Rows at each place, then at four points round each uncertain place (k + 4 m, n).

        These points lie √2 standard deviations away in the sheet, so that their mean square along
        either axis is sd².
        """
        rows = [self.rows(built)]
        for k in np.flatnonzero(self.sd > 0):
            n = self.directions[k]
            u, v = tangents(n)
            near = self.points[k] + np.sqrt(2) * self.sd[k] * np.array([u, -u, v, -v])
            rows.append(rows_of(built, np.zeros(4, int), near, np.tile(n, (4, 1))))
        return sp.csr_array(sp.vstack(rows))
