"""Natural frequencies as data: ln f of every pole against the modes of a state.

They are used if gain or places are unknown. Poles are paired with modes; a pole or a mode without a
partner has a price.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..reduced.pole_assignment import (
    SPURIOUS,
    SPURIOUS_LISTED,
    paired,
    price_missed,
    price_spurious,
)
from ..reduced.reduced_model import Reduced, State

LN10 = np.log(10.0)
ABOVE = 1.7  # times the highest pole: as far as its partner is looked for
SCALE = 0.01  # prior median of that spread: careful models of one structure differ by 0.5 to 2 %
SCALE_SD = 0.35  # of its logarithm: these are the ends of its 95 % interval


@dataclass(frozen=True, eq=False)
class Poles:
    """Natural frequencies, each with the standard deviation of its logarithm.

    Attributes
    ----------
    frequency : (n,) Hz       increasing
    sd : (n,)                 of ln f, from the identification
    use : (n,) bool           poles the fit may see
    strength : (n,)           peak height relative to the highest
    band : (low, high) Hz     in which the test would have shown a mode
    scale : float             irreducible spread of ln f; learned with every hypothesis
    spurious : (n,) or float  chance of each pole to belong to no mode of the structure
    outputs, inputs           rows at the likely places of sensors and shakers, or None
    """

    frequency: np.ndarray
    sd: np.ndarray
    use: np.ndarray
    strength: np.ndarray
    band: tuple[float, float]
    scale: float = SCALE
    outputs: object = None
    inputs: object = None
    spurious: np.ndarray | float = SPURIOUS
    a: np.ndarray | None = None
    b: np.ndarray | None = None

    @property
    def error(self) -> None:
        """No error of form; ``scale`` has its place."""

    def rebased(self, model: Reduced) -> Self:
        """Rows for the visibility of modes in the basis of this model."""
        if self.outputs is None or self.inputs is None:
            return self
        return replace(self, a=model.rows(self.outputs), b=model.rows(self.inputs))  # type: ignore[arg-type]

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
        test, model, unpaired = paired(
            self.frequency[poles], f[modes], self.std()[poles], self._price_unpaired()[poles],
            np.where(ends, 0.0, missed),
        )  # fmt: skip
        return poles[test], modes[model], unpaired

    def _price_unpaired(self) -> np.ndarray:
        """Price of an unpaired pole, on a scale where a pair costs δ²/σ²."""
        price = np.where(np.isinf(self.strength), 1e4, price_spurious(self.spurious))
        return price - 2 * np.log(self.std())

    def visibility(self, state: State, modes: np.ndarray) -> np.ndarray:
        """Visibility of each mode, 1 for the strongest: rms residue over likely places."""
        if self.a is None or self.b is None or not len(modes):
            return np.ones(len(modes))
        seen = np.sqrt(((self.a @ state.phi[:, modes]) ** 2).mean(axis=0))
        hit = np.sqrt(((self.b @ state.phi[:, modes]) ** 2).mean(axis=0))
        both = seen * hit
        return np.asarray(both / both.max()) if both.any() else np.ones(len(modes))

    def deviation(
        self, state: State, among: np.ndarray | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """ln(f_model / f_test) of every pair, with the pairs."""
        test, model, _ = self.pairs(state, among)
        f = np.sqrt(state.lam[model]) / (2 * np.pi)
        return np.log(f / self.frequency[test]), test, model

    def scaled(self, state: State, gradient: bool) -> tuple[np.ndarray, np.ndarray]:
        """ln(f_model / f_test) over its spread; unpaired poles and modes at their price."""
        test, model, unpaired = self.pairs(state)
        lam = state.lam[model]
        delta = np.log(np.sqrt(lam) / (2 * np.pi) / self.frequency[test])
        sd = self.std()
        r = np.append(np.sqrt(self._price_unpaired()), np.sqrt(unpaired))
        r[test] = delta / sd[test]
        use = np.append(self.use, True)
        if not gradient:
            return r[use], np.zeros((int(use.sum()), 0))
        assert state.dK is not None
        assert state.dM is not None
        J, phi = np.zeros((len(r), state.dK.count)), state.vectors[:, model]
        dlam = state.dK.along(phi) - lam * state.dM.along(phi)
        J[test] = (dlam / (2 * lam) / sd[test]).T
        return r[use], J[use]

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

    @classmethod
    def of_list(cls, frequency: np.ndarray, band: tuple[float, float] = (0.0, np.inf)) -> Self:
        """Natural frequencies (n,) [Hz] that a user lists, in increasing order."""
        one = np.ones(len(frequency))
        return cls(frequency, 1e-3 * one, one > 0, one, band, spurious=SPURIOUS_LISTED)

    def partners(self, f_model: np.ndarray) -> np.ndarray:
        """Position of the partner of each pole among modes (m,) [Hz] in increasing order; or -1."""
        lam, none = (2 * np.pi * f_model) ** 2, np.zeros(0)
        state = State(lam, np.eye(len(lam)), np.zeros((0, len(lam))), None, None, 0.0, none, None,
                      None)  # fmt: skip
        return self.forced(state, np.ones(len(self.frequency), bool))[1]

    def forced(self, state: State, real: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """ln(f_model / f_test) and the model mode of every real pole (n,); all are paired."""
        wide = replace(self.all_paired(), scale=0.1)
        delta, mode = np.full(len(real), np.nan), np.full(len(real), -1)
        d, test, model = wide.deviation(state, real)
        delta[test], mode[test] = d, model
        return delta, mode

    def Q(self, state: State, use: np.ndarray, real: np.ndarray | None = None) -> float:
        """Mean |log10(f_model / f_test)|² over the real poles in use."""
        real = np.ones(len(use), bool) if real is None else real
        delta = self.forced(state, real)[0][use & real]
        known = np.isfinite(delta)
        return float(np.mean((delta[known] / LN10) ** 2)) if known.any() else float("nan")
