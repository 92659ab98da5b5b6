"""First-order systems x' = A x + B u, y = C x + D u in real modal blocks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from ..arrays import readonly
from ..dofs import parse
from ..errors import AccuracyError, LabelError, ShapeError, named
from .frf import FRF, Quantity
from .modes import ModalModel

_ORDER = {"receptance": 0, "mobility": 1, "accelerance": 2}


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B u, y = C x + D u.

    Attributes
    ----------
    A, B, C, D : (n, n), (n, n_in), (n_out, n), (n_out, n_in) real
    outputs, inputs : tuple of str  labels as 412:+Z
    quantity : str                  of y: receptance (displacement), mobility or accelerance
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    outputs: tuple[str, ...]
    inputs: tuple[str, ...]
    quantity: Quantity = "receptance"

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


def modal_model(system: StateSpace) -> ModalModel:
    """Normal modes of a state space, φ_o φ_iᵀ = Re 2 i ω_d R_r with R_r the receptance's residue.

    Shapes are given at the outputs, then at the inputs that are not outputs; a point that is both
    fixes their scale. Real poles give no mode; the imaginary part of complex shapes is dropped.

    Raises
    ------
    LabelError
        If no label is both output and input.
    AccuracyError
        If a mode has no positive real residue at such a point: the structure is not passive.
    """
    drive = [text for text in system.outputs if text in system.inputs]
    if not drive:
        raise LabelError(
            f"no label is both output and input, so the shapes' scale is unknown; outputs are "
            f"{named(system.outputs)}, inputs {named(system.inputs)}"
        )
    p, X = np.linalg.eig(system.A)
    left, right = system.C @ X, np.linalg.solve(X, system.B.astype(complex))
    modes = [r for r in np.argsort(np.abs(p), kind="stable") if p[r].imag > 1e-9 * abs(p[r])]
    order = _ORDER[system.quantity]
    shapes = [
        _shape(system, 2j * p[r].imag * np.outer(left[:, r], right[r]) / p[r] ** order, drive)
        for r in modes
    ]
    also = [text for text in system.inputs if text not in system.outputs]
    dofs = np.array([parse(text) for text in (*system.outputs, *also)])
    return ModalModel(
        np.abs(p[modes]) / (2 * np.pi),
        -p[modes].real / np.abs(p[modes]),
        dofs[:, 2:] * np.array(shapes).T.reshape(len(dofs), len(modes)),
        dofs[:, :2],
    )


def _shape(system: StateSpace, product: np.ndarray, drive: list[str]) -> np.ndarray:
    """φ at outputs and further inputs from its product φ_o φ_iᵀ (best rank one, real)."""
    U, sigma, Vt = np.linalg.svd(product.real)
    o, i = np.sqrt(sigma[0]) * U[:, 0], np.sqrt(sigma[0]) * Vt[0]
    at = [(system.outputs.index(text), system.inputs.index(text)) for text in drive]
    k, j = max(at, key=lambda pair: abs(o[pair[0]] * i[pair[1]]))
    if o[k] * i[j] <= 0:
        raise AccuracyError(f"a mode supplies energy at {system.outputs[k]}: not passive")
    scale = np.sqrt(i[j] / o[k])
    further = [n for n, text in enumerate(system.inputs) if text not in system.outputs]
    return np.r_[o * scale, i[further] / scale]


def _interleaved(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Columns a_0, b_0, a_1, b_1, ..."""
    return np.stack([a, b], axis=-1).reshape(len(a), -1)
