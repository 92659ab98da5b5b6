"""The reduced model on which every hypothesis is tested.

K(x) = K_0 + Σ_g e^{E+t} A_g + e^{E+3t+b} B_g + Σ c bᵀb + Σ c A over groups g of shells and beams, M
likewise.  E, t, ρ, b (bending alone) are the sums of the log fields of all effects at x.  A state
costs a small dense eigenproblem.  Derivatives are exact, as K and M are known functions of x.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self
from weakref import WeakValueDictionary

import numpy as np
import scipy.sparse as sp

from ..dynamics.reduction import Basis, beyond
from ..effects.effect import (
    ChannelChange,
    Effect,
    FieldChange,
    PointTerm,
    ShapeChange,
    SpinTerm,
    count,
    of,
)
from ..effects.element_groups import COMPONENTS, ElementGroups
from ..fem.assemble import Structure
from ..fem.base_motion import BaseMotion
from ..fem.energy import mass_properties
from .effect_dofs import Acting, acting_at, own_part, own_positions, row, with_own
from .field_factors import Fields, log_fields, mass_log, multiplied, stiffness_log
from .frequency_dependent_stiffness import Rising
from .gyroscopic import Spin, spin
from .matrix_stack import MatrixStack, stacked
from .modal_factors import modal_factors
from .real_modes import real_modes
from .running_sums import BaseParticipation, Participating, RunningSums, participation
from .state import State as State


@dataclass(frozen=True, eq=False)
class Reduced:
    """Projected operators over one basis."""

    groups: ElementGroups  # of the structure's shells and beams
    vectors: Basis  # Φ (n, r), M-orthonormal; dofs of released clamps follow those of the deck
    # linear, cubic: by component, "" alone, or one entry for each of Q11 Q22 Q12 Q66
    linear: Mapping[str, MatrixStack]
    cubic: Mapping[str, MatrixStack]
    mass: MatrixStack  # these three are stacks of r by r matrices, one for each group
    # K0, M0: (r, r), share of everything outside the groups
    K0: np.ndarray
    M0: np.ndarray
    weight0: float  # mass outside the groups [kg]
    # participation of the basis in base motion, or None where forces drive the structure
    base: BaseParticipation | None = None
    # (n, clamps) response of the structure to unit motions of released clamps
    following: np.ndarray | None = None
    axis: np.ndarray | None = None  # (3,) axis 1 of the components; None: that of the deck
    _seen: dict[int, tuple[sp.csr_array, np.ndarray]] = field(default_factory=dict, repr=False)
    _within: "Reduced | None" = None  # over the first vectors of this basis; its results are reused

    @property
    def basis(self) -> np.ndarray:
        """Φ in one array, built at each call."""
        return np.hstack(self.vectors.blocks)

    def rows(self, rows: sp.csr_array, keep: bool = True, strained: bool = False) -> np.ndarray:
        """Rows of the structure in the basis (k, r); projected once where ``keep`` is true.

        Rows over the dofs of the deck are zero at clamps.  ``strained`` rows see only deformation.
        """
        if keep:
            return self._once(rows, lambda: self._rows(rows, strained))
        return self.vectors.seen(self.wide(rows, strained))

    def _rows(self, rows: sp.csr_array, strained: bool) -> np.ndarray:
        """Project rows; an extended model projects on its new vectors alone."""
        wide, inner = self.wide(rows, strained), self._within
        if inner is None or wide.shape[1] > inner.vectors.shape[0]:
            return self.vectors.seen(wide)
        old = inner.rows(rows, True, strained)
        if old.shape[1] == self.vectors.shape[1]:
            return old
        return np.hstack([old, wide @ self.vectors.blocks[-1][: wide.shape[1]]])

    def modes_of(self, coordinates: sp.csr_array) -> np.ndarray:
        """Modes Φ of the deck over the basis (r, k), from the rows ΦᵀM of their coordinates.

        They lie in the basis of the deck. Vectors that were added to it are M-orthogonal to these.
        """
        inner = self
        while inner._within is not None:
            inner = inner._within
        own = inner.rows(coordinates).T
        return np.pad(own, ((0, self.vectors.shape[1] - len(own)), (0, 0)))

    def wide(self, rows: sp.csr_array, strained: bool) -> sp.csr_array:
        """The rows; ``strained`` ones get columns for clamps, less the motion that follows."""
        if not strained or self.following is None:
            return rows
        return sp.csr_array(sp.hstack([rows, sp.csr_array(-(rows @ self.following))]))

    def operator(self, A: sp.csr_array, strained: bool = True) -> np.ndarray:
        """Φᵀ A Φ of a symmetric operator of the structure (r, r); projected once.

        An extended model projects it on its new vectors alone.  A ``strained`` operator sees only
        deformation, without the motion that follows a released clamp.
        """
        return self._once(A, lambda: self._projected(A, strained))

    def _projected(self, A: sp.csr_array, strained: bool) -> np.ndarray:
        vectors = self.deformation if strained else self.vectors
        if self._within is None:
            return vectors.reduced(A)
        old = self._within.operator(A, strained)
        r = len(old)
        if r == self.vectors.shape[1]:  # the same basis: only clamps were released
            return old
        border = vectors.bordering(A)
        return np.block([[old, border[:r]], [border[:r].T, (border[r:] + border[r:].T) / 2]])

    @property
    def deformation(self) -> Basis:
        """The basis at the dofs of the deck, less the motion that follows released clamps."""
        if self.following is None:
            return self.vectors
        n = len(self.following)
        return Basis(tuple(
            b[:n] - self.following @ b[n:] if b[n:].any() else b[:n] for b in self.vectors.blocks
        ))  # fmt: skip

    def deformed(self, u: np.ndarray) -> np.ndarray:
        """Motions (n, k) at the dofs of the deck, less the motion that follows released clamps."""
        n = len(u) if self.following is None else len(self.following)
        return u if self.following is None else np.asarray(u[:n] - self.following @ u[n:])

    def load(self, f: np.ndarray) -> np.ndarray:
        """Loads (n, k) on all dofs, of forces (m, k) on deformations."""
        if self.following is None:
            return np.pad(f, ((0, self.vectors.shape[0] - len(f)), (0, 0)))
        f = np.pad(f, ((0, len(self.following) - len(f)), (0, 0)))
        return np.concatenate([f, -self.following.T @ f])

    def _once(self, key: sp.csr_array, made: Callable[[], np.ndarray]) -> np.ndarray:
        known = self._seen.get(id(key))
        if known is None or known[0] is not key:
            known = self._seen[id(key)] = key, np.asarray(made())
        return known[1]

    def released(self, built: Structure, following: np.ndarray) -> Self:
        """The model on a structure with further dofs, which no vector of the basis moves yet."""
        more = len(built.system.dofs) - self.vectors.shape[0]
        return replace(
            self, groups=replace(self.groups, structure=built), following=following,
            vectors=self.vectors.padded(more),
            base=None if self.base is None else self.base.extended_to(built),
            _seen={}, _within=self,
        )  # fmt: skip

    def extended(self, vectors: np.ndarray) -> Self:
        """The model over a basis that also holds these vectors (n, k); short ones move no clamp."""
        system, (n, r) = self.groups.structure.system, self.vectors.shape
        if len(vectors) < n:
            vectors = np.pad(vectors, ((0, n - len(vectors)), (0, 0)))
        new = beyond(system.M, self.vectors.blocks, vectors)
        if not new.shape[1]:
            return self
        basis, k = self.vectors.grown(new), new.shape[1]
        stiff: dict[str, list[np.ndarray]] = {}
        for name, pair in self.pieces():  # the mass is projected with them, which costs less
            *stiff[name], heavy = self.groups.project([*pair, self.groups.mass], basis, k)

        def rest(old: np.ndarray, A: sp.csr_array, shells: Sequence[np.ndarray]) -> np.ndarray:
            full = basis.projected(A @ new) - sum(stack.sum(axis=0) for stack in shells)
            return np.block([[old, full[:r]], [full[:r].T, full[r:]]])

        return replace(
            self, vectors=basis,
            linear={name: self.linear[name].bordered(A) for name, (A, _) in stiff.items()},
            cubic={name: self.cubic[name].bordered(B) for name, (_, B) in stiff.items()},
            mass=self.mass.bordered(heavy),
            K0=rest(self.K0, system.elastic, [A for pair in stiff.values() for A in pair]),
            M0=rest(self.M0, system.M, [heavy]),
            base=None if self.base is None else self.base.extended(self.groups, new), _seen={},
            _within=self,
        )  # fmt: skip

    def pieces(self) -> Iterator[tuple[str, tuple[np.ndarray, np.ndarray]]]:
        """Element matrices that grow with t and with t³, by the names of ``linear``."""
        if "" in self.linear:
            yield "", (self.groups.linear, self.groups.cubic)
        else:
            yield from self.groups.components(self.axis)

    def with_fields(self, logs: Fields) -> tuple[np.ndarray, np.ndarray]:
        """K and M (r, r) with these log fields of the groups; those of the last fields are kept.

        While an effect alone is optimised that changes no field, they stay as they are.
        """
        key = np.concatenate(list(logs.values()))
        known = self._last.get("fields")
        if known is None or not np.array_equal(known[0], key):
            K, M = self.K0.copy(), self.M0.copy()
            for stacks, power in ((self.linear, 1), (self.cubic, 3)):
                for name, stack in stacks.items():
                    K += stack.weighted(np.exp(stiffness_log(logs, name, power)))
            M += self.mass.weighted(np.exp(mass_log(logs)))
            known = self._last["fields"] = key, K, M
        return known[1].copy(), known[2].copy()

    @cached_property
    def _last(self) -> dict[str, tuple[np.ndarray, np.ndarray, np.ndarray]]:
        return {}

    def split_for(self, effect: Effect, x: np.ndarray) -> Self:
        """The model, split into components and divided into groups as the effect needs it."""
        changes, model = of(FieldChange, effect.terms(x)), self
        if "" in self.linear and any(change.field in COMPONENTS for change in changes):
            model = self.with_components(effect.axis_1)
        for change in changes:
            if change.of is not None:
                model = model.divided(change.of)
        return model

    def divided(self, of: np.ndarray) -> Self:
        """The model with groups divided where their elements have different labels ``of`` (m,)."""
        groups = self.groups.divided(of)
        parent = self.groups.group[groups.first]
        pieces = np.flatnonzero(np.bincount(parent)[parent] > 1)
        if not len(pieces):
            return self
        linear, cubic = dict[str, MatrixStack](), dict[str, MatrixStack]()
        for name, pair in self.pieces():
            A, B, m = groups.project(
                [*pair, self.groups.mass], self.vectors, groups=pieces.tolist()
            )
            linear[name] = self.linear[name].divided(parent, pieces, A)
            cubic[name] = self.cubic[name].divided(parent, pieces, B)
            mass = self.mass.divided(parent, pieces, m)
        base = self.base and participation(groups, self.vectors, self.base.motion)
        return replace(
            self, groups=groups, linear=linear, cubic=cubic, mass=mass, base=base, _seen={},
            _within=self,
        )  # fmt: skip

    def with_components(self, axis: np.ndarray | None = None) -> Self:
        """The model with plane stiffness in four components; one copy serves all its users."""
        key = "" if axis is None else str(axis.tolist())
        if (known := self._split.get(key)) is not None:
            return known
        linear, cubic = dict[str, MatrixStack](), dict[str, MatrixStack]()
        *others, rest = COMPONENTS  # the last is what the others leave of the whole
        for name, (_, pair) in zip(others, self.groups.components(axis), strict=False):
            A, B = self.groups.project(pair, self.vectors)
            linear[name], cubic[name] = self.linear[""].alike(A), self.cubic[""].alike(B)
        linear[rest] = self.linear[""].less(linear.values())
        cubic[rest] = self.cubic[""].less(cubic.values())
        made = self._split[key] = replace(self, linear=linear, cubic=cubic, axis=axis)
        return made

    @cached_property
    def _split(self) -> WeakValueDictionary[str, Self]:
        return WeakValueDictionary()


def reduce(groups: ElementGroups, basis: np.ndarray, base: BaseMotion | None = None) -> Reduced:
    """Project a structure on a basis; ``base`` is given where moving supports are the input."""
    system, vectors = groups.structure.system, Basis((np.ascontiguousarray(basis),))
    linear, cubic, mass = groups.project((groups.linear, groups.cubic, groups.mass), vectors)
    K, M = vectors.reduced(system.elastic), vectors.reduced(system.M)
    rest = mass_properties(groups.structure.assembly)[0] - float(groups.weight.sum())
    return Reduced(
        groups, vectors, {"": stacked(linear)}, {"": stacked(cubic)}, stacked(mass),
        K - linear.sum(axis=0) - cubic.sum(axis=0), M - mass.sum(axis=0), max(rest, 0.0),
        None if base is None else participation(groups, vectors, base),
    )  # fmt: skip


def evaluate(
    model: Reduced, effects: Sequence[Effect], x: np.ndarray, gradient: bool = True
) -> State:
    """Eigenvalues, modes and exact derivatives of the model with these effects at x.

    A :class:`ModelError` says that stiffness or mass lost its positive (semi-)definiteness.
    """
    n_p = count(effects)
    acting = acting_at(effects, x)
    split = "" not in model.linear
    logs, slopes = log_fields(acting, model.groups, n_p, split)
    r, n_own = len(model.K0), sum(effect.traits.own_dofs for effect in effects)
    sums = RunningSums.of_fields(
        *model.with_fields(logs), (model.linear, model.cubic), model.mass, logs, slopes, n_own
    )
    w = model.groups.weight * np.exp(mass_log(logs))
    weight, dweight = float(model.weight0 + w.sum()), np.asarray(w @ mass_log(slopes))
    offset, doffset = None, None
    rising, base = Rising(), None
    if model.base is not None:
        base = Participating(model.base, logs, slopes, n_own)
    for share in multiplied(acting, model.groups, logs, slopes, split):
        part = share.term
        A = with_own(model.operator(part.operator, part.matrix == "K"), n_own)
        if part.rise is None:
            sums.add(share, A)
        else:
            rising.add(part, A, share.at)
        if base is not None:
            base.add_operator(part, model.vectors, share.at)
    sums.limit_geometric()
    for factors in modal_factors(acting):
        U, V = model.modes_of(factors.rows), model.rows(factors.rows, strained=True)
        sums.dK = factors.multiply(U, V, sums.K, sums.dK)
    rising.add_plain(sums.K, sums.dK)
    for (effect, at, terms), first in zip(acting, own_positions(effects), strict=True):
        for term in of(PointTerm, terms):
            b = row(model.rows(term.rows, not term.moving), own_part(term, first, n_own))
            moved = {
                p: np.pad(model.rows(rows, keep=False), ((0, 0), (0, n_own)))
                for p, rows in (term.moving if gradient else {}).items()
            }
            sums.add_points(term, b, moved, at)
            if base is not None:
                base.add_points(term, b, moved, at)
        extra, d_extra, _ = effect.weight(x[at])
        weight, dweight[at] = weight + extra, dweight[at] + d_extra
        for change in of(ChannelChange, terms):
            if offset is None or doffset is None:
                offset = np.zeros(len(change.value), complex)
                doffset = np.zeros((len(change.value), n_p), complex)
            offset = offset + change.value
            doffset[:, at] += change.gradient
    lam, phi = real_modes(sums.K, sums.M)
    dK, dM, lost = sums.dK, sums.dM, None
    if rising.parts:
        lam, phi, dK, dM, lost = rising.over_basis(lam, phi, dK, dM, sums.M, gradient)
    drive, ddrive = (None, None) if base is None else base.loads(phi)
    state = State(
        lam, phi[:r], phi[r:], dK, dM, weight, dweight, offset, doffset, drive, ddrive,
        *_moved(model, acting, phi[:r]), lost, _spin(model, acting, phi[:r]),
    )  # fmt: skip
    return state if gradient else state.without_slopes()


def _moved(
    model: Reduced, acting: Acting, phi: np.ndarray
) -> tuple[np.ndarray | None, dict[int, np.ndarray]]:
    """Change of the modes by effects at the measured places, and its derivatives."""
    total: np.ndarray | None = None
    slopes: dict[int, np.ndarray] = {}
    for _, at, terms in acting:
        for change in of(ShapeChange, terms):
            whole = change.shapes @ (model.rows(change.rows, strained=True) @ phi)
            value = change.coefficient * whole
            total = value if total is None else total + value
            for p in np.flatnonzero(change.gradient).tolist():
                slopes[at.start + p] = slopes.get(at.start + p, 0.0) + change.gradient[p] * whole
    return total, slopes


def _spin(model: Reduced, acting: Acting, phi: np.ndarray) -> Spin | None:
    """The spinning parts of all effects over the modes, or None."""
    parts = [
        (
            term, at, model.rows(term.rows, not term.moving) @ phi,
            {p: model.rows(rows, keep=False) @ phi for p, rows in term.moving.items()},
        )
        for _, at, terms in acting
        for term in of(SpinTerm, terms)
    ]  # fmt: skip
    return spin(parts) if parts else None
