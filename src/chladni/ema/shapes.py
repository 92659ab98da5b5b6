"""Shapes, scale and complexity of identified modes.

Ewins (2000), Modal Testing, sections 2.4 and 4.4; Pappa, Elliott and Schenk (1993), J. Guidance
16(5) (modal phase collinearity).
"""

from dataclasses import dataclass

import numpy as np

from ..dofs import parse
from ..dynamics.modes import ModalModel
from ..errors import LabelError
from .identification import Identified
from .propagation import propagated, standard_deviations

# condition of Φ at the sensors from which they cannot tell modes apart: the usual noise of a shape,
# 2 %, becomes as large there as a mode
SEPARATE = 50.0


def mixture(phi: np.ndarray, psi: np.ndarray) -> np.ndarray | None:
    """q = Φ⁺ ψ (m, r), the modes that expand shapes at the sensors onto the model (SEREP).

    O'Callahan, Avitabile and Riemer (1989), IMAC VII, 29-37. None where the sensors cannot tell the
    modes apart.

    Parameters
    ----------
    phi : (n, m)   modes of the model at the sensors
    psi : (n, r)   the shapes
    """
    if not phi.size or len(phi) < phi.shape[1] or np.linalg.cond(phi) > SEPARATE:
        return None
    return np.asarray(np.linalg.pinv(phi) @ psi)


@dataclass(frozen=True, eq=False)
class MeasuredShapes:
    """Shapes of identified modes at the outputs."""

    outputs: tuple[str, ...]  # n labels
    values: np.ndarray  # (n, r) complex; Ψ, turned so that they are as real as they can be
    # (n_in, r) complex; ψ at the inputs, R_r ≈ Ψ_r participation_rᵀ / 2i Im p_r
    participation: np.ndarray
    collinearity: np.ndarray  # (r,) 1: all channels move in phase (a normal mode); 0: none do
    rank: np.ndarray  # (r,) share of the residue one mode explains (1 for one input)
    scaled: bool  # 1/√kg, by a drive point; else of largest entry 1
    # (r,) sign of the modal constant at the drive point: -1 is impossible, so that sensor or force
    # gauge is reversed
    polarity: np.ndarray


def constants(identified: Identified) -> np.ndarray:
    """A_r = 2i Im(p_r) R_r, [1/kg] of a receptance (r, n_out, n_in); real of a normal mode."""
    return identified.residues * (2j * identified.poles.imag)[:, None, None]


def driven_shapes(identified: Identified) -> np.ndarray:
    """Shapes (n_out, r) complex: the residues of the input that drives each mode most."""
    if not identified.order:
        return np.zeros((len(identified.outputs), 0))
    best = np.linalg.norm(identified.residues, axis=1).argmax(axis=1)
    return np.stack([R[:, j] for R, j in zip(identified.residues, best, strict=True)], axis=1)


def real_shapes(identified: Identified) -> np.ndarray:
    """Real parts of the shapes (n_out, r), rotated to be as real as possible, of unit norm."""
    psi = turned(driven_shapes(identified).T).T.real
    return psi / np.maximum(np.linalg.norm(psi, axis=0), 1e-300)


def shape_covariance(identified: Identified) -> np.ndarray:
    """Covariance (r, n_out, n_out) of ``real_shapes``, the norm and the sign held.

    Raises
    ------
    ValueError
        If the identification holds no covariance.
    """
    return propagated(identified, lambda moved: real_shapes(moved).T)


def shape_sd(identified: Identified) -> np.ndarray:
    """Standard deviations of real and (as imaginary part) imaginary part of ``shapes`` (n_out, r).

    Raises
    ------
    ValueError
        If the identification holds no covariance.
    """

    def made(moved: Identified) -> np.ndarray:
        found = shapes(moved).values.T
        return np.concatenate([found.real, found.imag], axis=1)

    real, imag = np.split(standard_deviations(identified, made), 2, axis=1)
    return np.asarray((real + 1j * imag).T)


def shape_spread(identified: Identified) -> np.ndarray:
    """Rms length by which noise moves each unit shape, √tr C (r,): 1 - MAC is its square."""
    sd = standard_deviations(identified, lambda moved: real_shapes(moved).T)
    return np.linalg.norm(sd, axis=1)


def shapes(identified: Identified) -> MeasuredShapes:
    """Ψ_r of R_r = Ψ_r ψ_rᵀ / (2i Im p_r): the first singular vectors of every residue.

    Mass-normalised where an input is also an output (with either sign), Ψ_drive = ψ_drive.
    """
    A = constants(identified)
    U, S, Vh = np.linalg.svd(A, full_matrices=False)
    left, right = U[:, :, 0] * np.sqrt(S[:, :1]), Vh[:, 0] * np.sqrt(S[:, :1])
    drive = _drive(identified)
    if drive is None:
        peak = np.take_along_axis(left, np.abs(left).argmax(axis=1)[:, None], axis=1)
        factor = 1 / np.where(peak == 0, 1, peak)
        real = turned(left * factor)
        values = real / np.abs(real).max(axis=1, keepdims=True)
        factor, polarity = np.ones_like(factor), np.ones(len(A))
    else:
        i, j, sign = drive
        at_output, at_input = sign * left[:, i], right[:, j]
        factor = np.sqrt(at_input / np.where(at_output == 0, 1, at_output) + 0j)[:, None]
        values = left * factor
        flip = np.where((values * values).sum(axis=1).real < 0, 1j, 1.0)[:, None]
        values, factor = values * flip, factor * flip
        polarity = np.where((sign * A[:, i, j]).real < 0, -1.0, 1.0)
    return MeasuredShapes(
        identified.outputs,
        values.T,
        (right / factor).T,
        collinearity(values.T),
        S[:, 0] ** 2 / np.maximum((S**2).sum(axis=1), 1e-300),
        drive is not None,
        polarity,
    )


def _drive(identified: Identified) -> tuple[int, int, int] | None:
    """(output, input, relative sign) of the first dof that is both."""
    try:
        outputs = [parse(label) for label in identified.outputs]
        inputs = [parse(label) for label in identified.inputs]
    except LabelError:
        same = [o for o in identified.outputs if o in identified.inputs]
        if not same:
            return None
        return identified.outputs.index(same[0]), identified.inputs.index(same[0]), 1
    for j, (node, component, sign) in enumerate(inputs):
        for i, (n, c, s) in enumerate(outputs):
            if (n, c) == (node, component) and node:  # node 0 is no place
                return i, j, s * sign
    return None


def turned(psi: np.ndarray) -> np.ndarray:
    """Each row turned by the phase that makes Σ ψ² real and positive (r, n)."""
    phase = 0.5 * np.angle((psi**2).sum(axis=1))
    return psi * np.exp(-1j * phase)[:, None]


def collinearity(psi: np.ndarray) -> np.ndarray:
    """Modal phase collinearity |ψᵀψ|² / (ψᴴψ)² by mode: 1 for a normal mode (r,).

    >>> collinearity(np.array([[1j, 1.0], [-2j, 1j]]))
    array([1., 0.])
    """
    power = (np.abs(psi) ** 2).sum(axis=0)
    return np.abs((psi**2).sum(axis=0)) ** 2 / np.maximum(power, 1e-300) ** 2


def modal_model(identified: Identified) -> ModalModel:
    """Real modes over the measured dofs, for MAC and synthesis."""
    found = shapes(identified)
    if not found.scaled:
        raise LabelError(
            "no input is also an output, so the shapes have no scale; use shapes() for MAC"
        )
    dofs = np.array([parse(label) for label in identified.outputs])
    return ModalModel(
        identified.frequency,
        identified.damping,
        dofs[:, 2:] * found.values.real,
        dofs[:, :2],
    )


def lines_per_bandwidth(identified: Identified, frequency: np.ndarray) -> np.ndarray:
    """Lines within the half-power bandwidth 2 ζ f of each mode, over two: per half bandwidth (r,).

    Three or more are needed for the damping (Echaniz Granado 2015, section 5.2).
    """
    f, half = identified.frequency, identified.damping * identified.frequency
    inside = (frequency >= (f - half)[:, None]) & (frequency <= (f + half)[:, None])
    return inside.sum(axis=1) / 2
