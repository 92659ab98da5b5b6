"""Natural frequencies as data: ln f of every pole against the modes of a state.

They are used if gain or places are unknown, and with the shapes of a modal model. Poles are paired
with modes; a pole or a mode without a partner has a price.
"""

from dataclasses import dataclass, replace
from typing import Literal, Self

import numpy as np

from ..reduced.pole_assignment import (
    FORBIDDEN,
    SPURIOUS,
    SPURIOUS_LISTED,
    assigned,
    paired,
    price_missed,
    price_spurious,
)
from ..reduced.reduced_model import Reduced, State
from .shape_data import ShapeData, shape_slopes

LN10 = np.log(10.0)
ABOVE = 1.7  # times the highest pole: as far as its partner is looked for
MIXED = 2.5  # times the highest pole: modes up to there may mix into a measured shape
SCALE = 0.01  # prior median of that spread: careful models of one structure differ by 0.5 to 2 %
SCALE_SD = 0.35  # of its logarithm: these are the ends of its 95 % interval


@dataclass(frozen=True, eq=False)
class Poles:
    """Natural frequencies, each with the standard deviation of its logarithm."""

    frequency: np.ndarray  # (n,) [Hz], increasing
    sd: np.ndarray  # (n,) of ln f, from the identification
    use: np.ndarray  # (n,) bool, poles the fit may see
    strength: np.ndarray  # (n,) peak height relative to the highest
    band: tuple[float, float]  # (low, high) [Hz] in which the test would have shown a mode
    scale: float = SCALE  # irreducible spread of ln f; learned with every hypothesis
    # outputs, inputs: rows at the likely places of sensors and shakers, or None
    outputs: object = None
    inputs: object = None
    # (n,) chance of each pole to belong to no mode of the structure
    spurious: np.ndarray | float = SPURIOUS
    a: np.ndarray | None = None
    b: np.ndarray | None = None
    shapes: ShapeData | None = None  # of every pole at the first of the outputs, or None

    @property
    def compared(self) -> Literal["frequencies", "modes"]:
        """Natural frequencies alone, or modes with shapes."""
        return "frequencies" if self.shapes is None else "modes"

    @property
    def error(self) -> None:
        """No error of form; ``scale`` has its place."""

    def rebased(self, model: Reduced) -> Self:
        """Rows for the visibility of modes in the basis of this model."""
        if self.outputs is None or (self.inputs is None and self.shapes is None):
            return self
        b = None if self.inputs is None else model.rows(self.inputs)  # type: ignore[arg-type]
        return replace(self, a=model.rows(self.outputs), b=b)  # type: ignore[arg-type]

    def std(self) -> np.ndarray:
        """Standard deviation of ln f of every pole (n,)."""
        return np.sqrt(self.sd**2 + self.scale**2)

    def pairs(
        self, state: State, among: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Return positions (test pole, model mode) of each pair, and the price of other modes."""
        poles = np.flatnonzero(self.use if among is None else among)
        if not len(poles):
            return poles, poles, 0.0
        f = np.sqrt(np.maximum(state.lam, 0)) / (2 * np.pi)
        f_max = self.frequency[poles[-1]]
        modes = np.flatnonzero((f > 0.02 * self.frequency[0]) & (f < ABOVE * f_max))
        missed = price_missed(self.visibility(state, modes))
        ends = (f[modes] < self.band[0]) | (f[modes] > min(self.band[1], f_max * (1 + 1e-9)))
        missed = np.where(ends, 0.0, missed)
        alone, sd = self._price_unpaired()[poles], self.std()[poles]
        if self.shapes is None:
            test, model, unpaired = paired(self.frequency[poles], f[modes], sd, alone, missed)
        else:
            cost = (np.log(f[modes] / self.frequency[poles, None]) / sd[:, None]) ** 2
            t, m = np.nonzero(cost < alone[:, None] + missed)
            near = self._mixed(state)
            at = np.searchsorted(near, modes[m])
            phi, lam = self.at_sensors(state)[:, near], state.lam[near]
            of_shapes = self.shapes.costs(phi, lam, self.scale, poles[t], at)
            whole = np.full(cost.shape, FORBIDDEN)
            whole[t, m] = cost[t, m] + of_shapes
            test, model, unpaired = assigned(whole, alone, missed)
        return poles[test], modes[model], unpaired

    def _mixed(self, state: State) -> np.ndarray:
        """Positions of the modes that may mix into a measured shape."""
        return np.flatnonzero(state.lam <= (2 * np.pi * MIXED * self.frequency[-1]) ** 2)

    def at_sensors(self, state: State) -> np.ndarray:
        """Modes of a state where shapes were measured (n_out, m)."""
        assert self.a is not None
        assert self.shapes is not None
        phi = self.a[: self.shapes.values.shape[1]] @ state.phi
        return phi if state.moved is None else phi + state.moved[: len(phi)]

    def _price_unpaired(self) -> np.ndarray:
        """Price of an unpaired pole, on a scale where a pair costs δ²/σ² and that of its shape."""
        price = np.where(np.isinf(self.strength), 1e4, price_spurious(self.spurious))
        price = price - 2 * np.log(self.std())
        return price if self.shapes is None else np.maximum(price + self.shapes.spurious(), 0.0)

    def visibility(self, state: State, modes: np.ndarray) -> np.ndarray:
        """Visibility of each mode, 1 for the strongest: rms residue over likely places."""
        if self.a is None or not len(modes):
            return np.ones(len(modes))
        both = np.sqrt(((self.a @ state.phi[:, modes]) ** 2).mean(axis=0))
        if self.b is not None:
            both *= np.sqrt(((self.b @ state.phi[:, modes]) ** 2).mean(axis=0))
        return np.asarray(both / both.max()) if both.any() else np.ones(len(modes))

    def deviation(
        self, state: State, among: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """ln(f_model / f_test) of every pair, with the pairs."""
        test, model, _ = self.pairs(state, among)
        f = np.sqrt(state.lam[model]) / (2 * np.pi)
        return np.log(f / self.frequency[test]), test, model

    def scaled(
        self,
        state: State,
        gradient: bool,
        pairs: tuple[np.ndarray, np.ndarray, float] | None = None,
    ) -> tuple[np.ndarray, np.ndarray]:
        """ln(f_model / f_test) over its spread; unpaired poles and modes at their price; shapes.

        ``pairs`` are those of :meth:`pairs` where nothing else is given.
        """
        test, model, unpaired = self.pairs(state) if pairs is None else pairs
        lam = state.lam[model]
        delta = np.log(np.sqrt(lam) / (2 * np.pi) / self.frequency[test])
        sd = self.std()
        r = np.append(np.sqrt(self._price_unpaired()), np.sqrt(unpaired))
        r[test] = delta / sd[test]
        use = np.append(self.use, True)
        J = np.zeros((len(r), 0))
        if gradient:
            assert state.dK is not None
            assert state.dM is not None
            J, phi = np.zeros((len(r), state.dK.count)), state.vectors[:, model]
            dlam = state.dK.along(phi) - lam * state.dM.along(phi)
            J[test] = (dlam / (2 * lam) / sd[test]).T
        if self.shapes is None:
            return r[use], J[use]
        R, dR, wide = self._of_shapes(state, gradient, test, model)
        r[-1] = np.sqrt(unpaired + wide)
        return np.concatenate([r[use], R]), np.concatenate([J[use], dR])

    def scaled_slopes(self, state: State) -> np.ndarray:
        """The slopes of :meth:`scaled` alone."""
        return self.scaled(state, True)[1]

    def _of_shapes(
        self, state: State, gradient: bool, test: np.ndarray, model: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, float]:
        """Residuals of the shapes of poles in use, zero without a partner; their slopes; ln det."""
        assert self.shapes is not None
        n, n_out = self.shapes.values.shape
        at, near = self.at_sensors(state), self._mixed(state)
        slopes = shape_slopes(state, at, model) if gradient else np.zeros((0, n_out, len(model)))
        found = self.shapes.scaled(
            at[:, near], state.lam[near], self.scale, test, np.searchsorted(near, model), slopes
        )
        R, J = np.zeros((n, n_out)), np.zeros((len(slopes), n, n_out))
        R[test], J[:, test], wide = found
        used = R[self.use].ravel()
        return used, J[:, self.use].reshape(len(slopes), len(used)).T, max(wide, 0.0)

    @property
    def listed(self) -> bool:
        """True for modes that the user lists, False for poles of a recording."""
        return np.ndim(self.spurious) == 0

    def all_paired(self) -> Self:
        """Return these poles with a partner for each, at any distance."""
        return replace(self, strength=np.full(len(self.strength), np.inf))

    def only(self, use: np.ndarray) -> Self:
        """Return these poles with others in use."""
        return replace(self, use=use)

    using = only  # poles are independent

    def forced(self, state: State, real: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """ln(f_model / f_test) and the model mode of every real pole (n,); all are paired."""
        wide = replace(self.all_paired(), scale=0.1)
        delta, mode = np.full(len(real), np.nan), np.full(len(real), -1)
        d, test, model = wide.deviation(state, real)
        delta[test], mode[test] = d, model
        return delta, mode

    def Q(self, state: State, use: np.ndarray, real: np.ndarray | None = None) -> float:
        """Mean |log10(f_model / f_test)|² over the real poles in use.

        With shapes (1 - MAC) / ln² 10 is added, which is a squared relative deviation, too.
        """
        real = np.ones(len(use), bool) if real is None else real
        delta, mode = self.forced(state, real)
        square = delta**2
        if self.shapes is not None:
            square = square + 1 - self.shapes.mac(self.at_sensors(state)[:, mode])
        square = square[use & real]
        known = np.isfinite(square)
        return float(np.mean(square[known]) / LN10**2) if known.any() else float("nan")

    def noise(self, use: np.ndarray) -> np.ndarray:
        """Expected terms of :meth:`Q` from the noise of the poles in use (k,)."""
        of_shapes = 0.0 if self.shapes is None else self.shapes.variance[use].sum(axis=1)
        return np.asarray((self.sd[use] ** 2 + of_shapes) / LN10**2)


def partners(frequency: np.ndarray, f_model: np.ndarray, band: tuple[float, float]) -> np.ndarray:
    """Position of the partner of each listed frequency (n,) among modes (m,) [Hz]; or -1.

    Both are in increasing order.
    """
    one, none, lam = np.ones(len(frequency)), np.zeros(0), (2 * np.pi * f_model) ** 2
    poles = Poles(frequency, 1e-3 * one, one > 0, one, band, spurious=SPURIOUS_LISTED)
    own = np.zeros((0, len(lam)))
    state = State(lam, np.eye(len(lam)), own, None, None, 0.0, none, None, None)
    return poles.forced(state, one > 0)[1]
