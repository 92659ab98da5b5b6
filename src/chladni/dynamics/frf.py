"""Frequency response functions: the labelled array common to test and model."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, Self, get_args

import numpy as np

from ..arguments import checked
from ..arrays import OneScreen, readonly
from ..dofs import positions
from ..errors import LabelError, ShapeError, named
from .massless import static_solver
from .modes import ModalModel
from .system import System

Quantity = Literal["receptance", "mobility", "accelerance", "transmissibility"]
Recorded = Literal[  # quantities that a recording may hold; the last three are force over motion
    "receptance", "mobility", "accelerance", "transmissibility", "dynamic-stiffness", "impedance",
    "apparent-mass",
]  # fmt: skip
MOTION_OVER_FORCE: dict[str, Quantity] = {
    "dynamic-stiffness": "receptance", "impedance": "mobility", "apparent-mass": "accelerance",
}  # fmt: skip
UNIT = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s²/N", "transmissibility": "-"}
_ORDER = {q: k for k, q in enumerate(get_args(Quantity)[:3])}  # displacement, velocity, ...


_LOOSELY = 0.01  # beyond 0 and 1: rounding in the file of a coherence


def _coherence(gamma: np.ndarray) -> np.ndarray:
    """Clip a coherence to 0 and 1; raise ``ShapeError`` for percent or other values."""
    low, high = float(np.min(gamma)), float(np.max(gamma))
    if not (low >= -_LOOSELY and high <= 1 + _LOOSELY):
        raise ShapeError(
            f"a coherence must be between 0 and 1, but runs from {low:g} to {high:g}; convert per "
            "cent to a ratio"
        )
    return np.clip(gamma, 0.0, 1.0)


@dataclass(frozen=True, eq=False, repr=False)
class FRF(OneScreen):
    """H[k, i, j]: response at output i per unit input j at frequency k.

    Attributes
    ----------
    values : (n_f, n_out, n_in) complex
        m/N, (m/s)/N or (m/s²)/N by ``quantity``; transmissibility is response per enforced motion
        of the same kind [-].
    frequency : (n_f,)
        Hz, increasing.
    outputs, inputs : tuple of str
        Labels as 412:+Z.
    variance : (n_f, n_out, n_in), optional
        E|H - E H|², in the square of the unit of ``values``.
    coherence : (n_f, n_out, n_in), optional
        In [0, 1].
    """

    values: np.ndarray
    frequency: np.ndarray
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    quantity: Quantity = "receptance"
    variance: np.ndarray | None = None
    coherence: np.ndarray | None = None

    def __post_init__(self) -> None:
        if self.quantity not in get_args(Quantity):
            raise LabelError(
                f"no quantity {self.quantity!r}; there are {named(get_args(Quantity))}"
            )
        if np.ndim(self.frequency) != 1:
            raise ShapeError(f"frequencies are {np.shape(self.frequency)}; one list is due")
        if np.any(np.diff(self.frequency) <= 0):
            k = int(np.argmax(np.diff(self.frequency) <= 0))
            f = self.frequency[k : k + 2]
            raise ShapeError(f"frequencies must increase; line {k + 1} is {f[0]} Hz, then {f[1]}")
        due = (len(self.frequency), len(self.outputs), len(self.inputs))
        for name in ("values", "variance", "coherence"):
            array = getattr(self, name)
            if array is not None and np.shape(array) != due:
                raise ShapeError(f"{name} are {np.shape(array)}, labels and frequencies say {due}")
            if array is not None:
                object.__setattr__(self, name, readonly(array))
        if self.coherence is not None:
            object.__setattr__(self, "coherence", readonly(_coherence(self.coherence)))
        object.__setattr__(self, "frequency", readonly(self.frequency))
        object.__setattr__(self, "outputs", tuple(self.outputs))
        object.__setattr__(self, "inputs", tuple(self.inputs))

    @checked
    def sel(
        self,
        outputs: Sequence[str] | None = None,
        inputs: Sequence[str] | None = None,
        band: tuple[float, float] = (0.0, np.inf),
    ) -> Self:
        """Select labels (in this order) and a band [Hz]."""
        outputs = self.outputs if outputs is None else tuple(outputs)
        inputs = self.inputs if inputs is None else tuple(inputs)
        if band[0] > band[1]:
            raise LabelError(f"band = {band} is empty; give (low, high) in Hz")
        k = np.flatnonzero((band[0] <= self.frequency) & (self.frequency <= band[1]))
        cut = np.ix_(k, positions(outputs, self.outputs), positions(inputs, self.inputs))
        return replace(
            self,
            values=self.values[cut],
            frequency=self.frequency[k],
            outputs=outputs,
            inputs=inputs,
            variance=None if self.variance is None else self.variance[cut],
            coherence=None if self.coherence is None else self.coherence[cut],
        )

    @checked
    def to(self, quantity: Quantity) -> Self:
        """Convert to another kinematic quantity: each derivative is a factor iω.

        Integration gives NaN at 0 Hz. Transmissibility cannot be converted. The coherence is
        unchanged; the variance is multiplied by the square of the factor.

        Raises
        ------
        LabelError
            If there is no conversion from one quantity to the other.
        """
        if quantity == self.quantity:
            return self
        if quantity not in _ORDER or self.quantity not in _ORDER:
            raise LabelError(
                f"{self.quantity} cannot be converted to {quantity!r}; conversions exist among "
                f"{named(_ORDER)}"
            )
        n = _ORDER[quantity] - _ORDER[self.quantity]
        omega = 2 * np.pi * self.frequency[:, None, None]
        factor = 1j**n * (omega if n > 0 else np.where(omega > 0, omega, np.nan)) ** n
        variance = None if self.variance is None else self.variance * np.abs(factor) ** 2
        return replace(self, values=self.values * factor, quantity=quantity, variance=variance)


@dataclass(frozen=True, eq=False)
class Residual:
    """Contribution of the omitted higher modes, R(s) = R_0 - (s² + σ) R_1 [m/N].

    These are two terms of the series of Σ φφᵀ/(λ_r + s²) about s² = -σ, over the omitted modes.
    """

    static: np.ndarray  # (n_out, n_in) R_0 = Σ φφᵀ/(λ_r - σ) [m/N]
    slope: np.ndarray  # (n_out, n_in) R_1 = Σ φφᵀ/(λ_r - σ)² [m s²/N]
    shift: float = 0.0  # σ [rad²/s²]

    def at(self, s: np.ndarray) -> np.ndarray:
        """R(s) for s (n_f,) [rad/s] -> (n_f, n_out, n_in)."""
        return self.static - (s**2 + self.shift)[:, None, None] * self.slope


def transfer(
    modal: ModalModel,
    phi_out: np.ndarray,
    phi_in: np.ndarray,
    s: np.ndarray,
    *,
    structural: bool = False,
    residual: Residual | None = None,
) -> np.ndarray:
    """Receptance H_ij(s) = Σ_r φ_ir φ_jr / (s² + 2 ζ_r ω_r s + ω_r²) + R_ij(s).

    Parameters
    ----------
    phi_out, phi_in : (n_out, r), (n_in, r)  real rows of Φ, or combinations of rows [1/√kg]
    s : (n_f,) complex                       [rad/s]; i ω on the frequency axis
    structural : bool                        ω_r² (1 + 2 i ζ_r) instead of the viscous term
    residual : Residual, optional            of the omitted modes

    Returns
    -------
    (n_f, n_out, n_in) complex [m/N]
    """
    omega_r, s = 2 * np.pi * modal.frequency, np.asarray(s, dtype=complex)
    loss = 2j * omega_r**2 * modal.damping if structural else 0.0
    viscous = 0.0 if structural else 2 * modal.damping * omega_r * s[:, None]
    h = 1 / (s[:, None] ** 2 + viscous + omega_r**2 + loss)  # (n_f, r)
    H = _weighted(h, phi_out, phi_in)
    return H if residual is None else H + residual.at(s)


def _weighted(h: np.ndarray, phi_out: np.ndarray, phi_in: np.ndarray) -> np.ndarray:
    """Σ_r h_kr φ_ir φ_jr as two real matrix products (three times as fast as one einsum)."""
    shape = (len(h), len(phi_out), len(phi_in))
    phi = (phi_out[:, None, :] * phi_in).reshape(-1, h.shape[1]).T
    H = np.empty((len(h), phi.shape[1]), dtype=complex)
    H.real, H.imag = np.ascontiguousarray(h.real) @ phi, np.ascontiguousarray(h.imag) @ phi
    return H.reshape(shape)


@checked
def synthesise(
    modal: ModalModel,
    phi_out: np.ndarray,
    phi_in: np.ndarray,
    frequency: np.ndarray,
    *,
    outputs: Sequence[str],
    inputs: Sequence[str],
    quantity: Quantity = "receptance",
    structural: bool = False,
    residual: Residual | None = None,
) -> FRF:
    """Modal superposition on the frequency axis, H(ω) of :func:`transfer` at s = i ω.

    At 0 Hz the receptance of a rigid mode is infinite: use higher frequencies.

    Parameters
    ----------
    modal : frequencies, damping and shapes
    phi_out, phi_in : (n_out, r), (n_in, r)   rows of Φ (``modal.at(labels)``), or any directions
    frequency : (n_f,) [Hz]
    outputs, inputs : labels of these rows
    quantity : of the result
    structural : True takes ω_r² (1 + 2 i ζ_r) instead of the viscous term
    residual : contribution of the modes that were left out
    """
    frequency = np.asarray(frequency, dtype=float)
    s = 2j * np.pi * frequency
    H = transfer(modal, phi_out, phi_in, s, structural=structural, residual=residual)
    return FRF(H, frequency, tuple(outputs), tuple(inputs)).to(quantity)


def residual_flexibility(
    system: System,
    modal: ModalModel,
    pick: np.ndarray,
    load: np.ndarray,
    *,
    shift: float | None = None,
) -> Residual:
    """R_0 = b_oᵀ A⁻¹ b_i - Σ φφᵀ/(λ_r - σ), R_1 = b_oᵀ A⁻¹ M A⁻¹ b_i - ..., A = K - σ M.

    The static attachment modes need one factorisation; σ < 0 makes a free structure solvable
    (Craig and Kurdila 2006, §17.5 treats σ = 0).

    Parameters
    ----------
    pick, load : (n, n_out), (n, n_in)  output and input directions as columns
    shift : float, optional             σ [rad²/s²]; default: a hundredth of the highest kept λ
    """
    lam = (2 * np.pi * modal.frequency) ** 2
    sigma = -1e-2 * lam[-1] if shift is None else shift
    solve = static_solver(system, sigma)
    X = solve(np.asarray(load, dtype=float))
    Y = solve(system.M @ X)
    phi_o, phi_i = pick.T @ modal.shapes, load.T @ modal.shapes
    static = pick.T @ X - (phi_o / (lam - sigma)) @ phi_i.T
    slope = pick.T @ Y - (phi_o / (lam - sigma) ** 2) @ phi_i.T
    return Residual(static, slope, sigma)


def residual_shift(modal: ModalModel, f_max: float) -> float:
    """σ = -λ/100 [rad²/s²], λ the highest kept, at least (2π f_max)²."""
    return -1e-2 * (2 * np.pi * max(float(modal.frequency.max(initial=0.0)), f_max)) ** 2
