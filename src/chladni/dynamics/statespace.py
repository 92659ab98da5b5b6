"""First-order systems x' = A x + B u, y = C x + D u in real modal blocks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from ..arrays import readonly
from ..errors import LabelError, ShapeError
from ..results import ShownBriefly
from .frf import FRF, Quantity
from .modes import ModalModel


@dataclass(frozen=True, eq=False, repr=False)
class StateSpace(ShownBriefly):
    """x' = A x + B u, y = C x + D u."""

    # A, B, C, D: (n, n), (n, n_in), (n_out, n), (n_out, n_in) real
    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    # outputs, inputs: labels as 412:+Z
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    quantity: Quantity = "receptance"  # of y: receptance (displacement), mobility or accelerance

    def __post_init__(self) -> None:
        n, o, i = len(self.A), len(self.outputs), len(self.inputs)
        for name, due in {"A": (n, n), "B": (n, i), "C": (o, n), "D": (o, i)}.items():
            if (shape := np.shape(getattr(self, name))) != due:
                raise ShapeError(f"{name} is {shape}, states and labels say {due}")
            object.__setattr__(self, name, readonly(getattr(self, name)))

    def poles(self) -> np.ndarray:
        """Eigenvalues of A [rad/s], by increasing modulus, the conjugate with Im < 0 first."""
        p = np.linalg.eigvals(self.A)
        return p[np.lexsort((p.imag, np.round(np.abs(p), 9)))]

    def frf(self, frequency: np.ndarray) -> FRF:
        """H(ω) = C (iω - A)⁻¹ B + D, by the eigenvectors of A."""
        p, X = np.linalg.eig(self.A)
        left, right = self.C @ X, np.linalg.solve(X, self.B.astype(complex))
        resolvent = 1 / (2j * np.pi * np.asarray(frequency)[:, None] - p)
        H = np.einsum("kr,ir,rj->kij", resolvent, left, right, optimize=True) + self.D
        return FRF(H, np.asarray(frequency, float), self.outputs, self.inputs, self.quantity)


def state_space(
    modal: ModalModel,
    phi_out: np.ndarray,
    phi_in: np.ndarray,
    *,
    outputs: Sequence[str],
    inputs: Sequence[str],
    quantity: Quantity = "receptance",
) -> StateSpace:
    """Blocks [[0, w], [-ω²/w, -2 ζ ω]] over (η, η'/w) of η'' + 2 ζ ω η' + ω² η = φ_iᵀ u; w = ω.

    ``phi_out`` (n_out, r) and ``phi_in`` (n_in, r) are rows of Φ. A rigid mode has w = 1, and its
    two states make A defective: ``frf`` needs ω > 0 for every mode.
    """
    omega = 2 * np.pi * modal.frequency
    w, damp = np.where(omega > 0, omega, 1.0), 2 * modal.damping * omega
    k, zero = omega**2 / w, np.zeros_like(omega)
    A = block_diag(*(np.array([[0, a], [-b, -c]]) for a, b, c in zip(w, k, damp, strict=True)))
    B = _interleaved(zero * phi_in, phi_in / w).T
    C = {
        "receptance": lambda: _interleaved(phi_out, zero * phi_out),
        "mobility": lambda: _interleaved(zero * phi_out, phi_out * w),
        "accelerance": lambda: _interleaved(-(omega**2) * phi_out, -damp * w * phi_out),
    }.get(quantity)
    if C is None:
        raise LabelError(f"no state space of {quantity!r}; use receptance, mobility, accelerance")
    D = phi_out @ phi_in.T if quantity == "accelerance" else np.zeros((len(phi_out), len(phi_in)))
    return StateSpace(A, B, C(), D, tuple(outputs), tuple(inputs), quantity)


def _interleaved(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Columns a_0, b_0, a_1, b_1, ..."""
    return np.stack([a, b], axis=-1).reshape(len(a), -1)
