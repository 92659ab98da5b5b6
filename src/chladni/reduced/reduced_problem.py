"""A structure prepared for testing hypotheses: groups of elements, basis, factor, places."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from ..dynamics.eigen import normal_modes
from ..dynamics.reduction import attachments, orthonormal, shifted
from ..effects.effect import Effect, MatrixTerm, of
from ..effects.effect_context import ElementGrids, element_grids
from ..effects.element_groups import ElementGroups, element_groups
from ..fem.assemble import Structure
from ..fem.base_motion import base_motion
from ..fem.modelled import Modelled, modelled
from ..fem.released import Release
from ..model.assembly import Assembly
from ..sparse.factor import Factor
from .reduced_model import Reduced, reduce

FEWEST = 12  # modes of a basis without a flexible mode in reach: six rigid, six flexible
FOLLOWED = 10  # iterations for the response to a clamp's motion, which use a shifted factor
AT_ONCE = 32  # places whose static responses are in memory at a time
MOST_PLACES = 200  # candidates
REACH = 2.5  # the basis holds modes up to this many times the highest frequency of interest


@dataclass(frozen=True, eq=False)
class ReducedProblem:
    """One structure, its reduced model, and the candidate places of effects."""

    structure: Structure
    groups: ElementGroups
    model: Reduced
    frequency: np.ndarray  # (r,) [Hz] of the nominal model's modes, rigid ones included
    factor: Factor
    hertz: float  # shift of the static responses
    grids: ElementGrids
    candidates: ElementGrids  # a sample of all of ``grids``
    f_max: float  # highest frequency of interest [Hz]

    def flexibility(self, where: ElementGrids) -> np.ndarray:
        """b (K + σM)⁻¹ bᵀ less the share within the basis (k,) [m/N]."""
        each = [self.flexibility_between(rows).diagonal() for rows in _pieces(where.rows)]
        return np.maximum(np.concatenate(each), 0.0)

    def flexibility_between(self, rows: sp.csr_array) -> np.ndarray:
        """B (K + σM)⁻¹ Bᵀ of rows B (k, n), less the share within the basis (k, k)."""
        b = self.model.rows(rows, keep=False)
        return self.factor.between(sp.csr_array(rows.T)) - b @ self._inside @ b.T

    @cached_property
    def _inside(self) -> np.ndarray:
        """(K + σM)⁻¹ over the basis (r, r)."""
        K = self.model.K0 + (2 * np.pi * self.hertz) ** 2 * np.eye(len(self.model.K0))
        for stack in (*self.model.linear.values(), *self.model.cubic.values()):
            K += stack.weighted(np.ones(stack.shape[0]))
        return np.linalg.inv(K)

    def model_for(self, effect: Effect, x: np.ndarray) -> Reduced:
        """The reduced model over a basis that can represent an effect near x, split as needed."""
        model, rows = self.model, effect.basis_rows(x, self.shapes)
        if rows is None:
            return model.split_for(effect, x)
        if effect.release is not None:
            model = self._released(effect.release)
            assert model.following is not None
            g = rows[:, len(model.following) :].toarray().T
            blocks = [np.vstack([model.following @ g, g])]
        else:
            blocks = [attachments(self.factor, rows)]
        again = self.structure.system.M
        if effect.traits.own_loads:
            again = of(MatrixTerm, effect.terms(x))[0].operator
        for _ in range(effect.traits.rounds):  # beyond its dofs are motions of released clamps
            blocks.append(self.factor.solve(again @ blocks[-1][: again.shape[0]]))
        n = model.vectors.shape[0]
        for k, block in enumerate(blocks):
            if len(block) < n:
                blocks[k] = np.pad(block, ((0, n - len(block)), (0, 0)))
        every = np.hstack(blocks) if len(blocks) > 1 else blocks[0]
        del blocks
        return model.extended(every).split_for(effect, x)

    @property
    def shapes(self) -> np.ndarray:
        """Modes of the nominal model up to the highest frequency of interest (n, r)."""
        low = int(np.sum(self.frequency <= self.f_max))
        return self.model.vectors.blocks[0][: len(self.structure.system.dofs), :low]

    def _released(self, release: Release) -> Reduced:
        """The reduced model with clamps released; the structure follows their motion by -K⁻¹ K_qg.

        The factor is that of K + σM; each iteration leaves σ/(σ + λ_1) = 1/5 of the last error.
        """
        if self.model.following is not None:
            return self.model
        if (known := self._known.get(id(release))) is not None:
            return known[1]
        built, K = release.of(self.structure), self.structure.system.elastic
        n = len(self.structure.system.dofs)
        force = -built.system.elastic[:n, n:].toarray()
        R = self.factor.solve(force)
        for _ in range(FOLLOWED):
            R = R + self.factor.solve(force - K @ R)
        model = self.model.released(built, R)
        self._known[id(release)] = release, model
        return model

    @cached_property
    def _known(self) -> dict[int, tuple[Release, Reduced]]:
        """Models with clamps released; each release is kept, so that its id stays its own."""
        return {}


def _pieces(rows: sp.csr_array) -> Iterator[sp.csr_array]:
    """Blocks of rows, to save memory: each static response has all dofs of the structure."""
    yield from (rows[k : k + AT_ONCE] for k in range(0, rows.shape[0], AT_ONCE))


def reduced_problem(
    model: Modelled | Assembly, f_max: float, rows: sp.csr_array | None = None, *,
    groups: int = 64, reach: float = REACH, base: np.ndarray | None = None,
) -> ReducedProblem:  # fmt: skip
    """Build the reduced problem of a structure.

    Parameters
    ----------
    model : its modes are solved to REACH times ``f_max``; an assembly is solved here
    f_max : highest frequency of interest [Hz]
    rows : (k, n) places whose static response the basis must hold (sensors, shakers)
    reach : the basis holds modes up to this many times ``f_max``
    base : (k, 3) unit vectors along which the supports move, where that is the input
    """
    if isinstance(model, Assembly):
        model = modelled(model, reach * f_max)
    built, modes = model.structure, model.up_to(reach * f_max)
    flexible = modes.frequency[modes.frequency > 0.02 * f_max]
    if not len(flexible):  # the first flexible mode lies above the measured band
        modes = normal_modes(built.system, min(FEWEST, len(built.system.dofs)))
        flexible = modes.frequency[modes.frequency > 0.02 * f_max]
    hertz = 0.5 * float(flexible[0]) if len(flexible) else 0.1 * f_max
    factor = shifted(built.system, hertz)
    blocks = [modes.shapes]
    if rows is not None and rows.shape[0]:
        blocks.append(attachments(factor, rows))
    moved = None if base is None else base_motion(built, base)
    if moved is not None:
        blocks.append(factor.solve(moved.force))
    basis = orthonormal(built.system.M, blocks, kept=modes.shapes.shape[1])
    shells = element_groups(built, groups)
    grids = element_grids(shells)
    over, f = reduce(shells, basis, moved), modes.frequency
    candidates = grids.only(grids.spread(MOST_PLACES))
    return ReducedProblem(built, shells, over, f, factor, hertz, grids, candidates, f_max)
