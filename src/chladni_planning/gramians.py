"""Observability and controllability of modes: ranks, closed-form gramians, balanced realisation.

States are those of :func:`chladni.dynamics.statespace.state_space`, (η_r, η_r'/ω_r) mode by mode.
A lightly damped mode has equal entries in these states. Moore (1981), IEEE Trans. Autom. Control
26(1), 17-32; Laub et al. (1987), IEEE Trans. Autom. Control 32(2), 115-122; Gawronski, Dynamics and
Control of Structures (1998), ch. 4.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import solve_continuous_lyapunov

from chladni.dynamics.frf import Quantity
from chladni.dynamics.statespace import StateSpace
from chladni.errors import AccuracyError, LabelError, ShapeError


def controllability_gramian(
    frequency: np.ndarray, damping: np.ndarray, phi_in: np.ndarray
) -> np.ndarray:
    """Gramian W_c of A W + W Aᵀ + B Bᵀ = 0 in closed form (2r, 2r).

    Parameters
    ----------
    frequency : (r,)      [Hz], all above zero
    damping : (r,)        fraction of critical, all above zero
    phi_in : (n_in, r)    mode shapes at the actuators [1/√kg]
    """
    omega, zeta = _stable(frequency, damping, phi_in)
    return _gramian(omega, zeta, np.zeros_like(phi_in), phi_in)


def observability_gramian(
    frequency: np.ndarray,
    damping: np.ndarray,
    phi_out: np.ndarray,
    quantity: Quantity = "receptance",
) -> np.ndarray:
    """Gramian W_o of Aᵀ W + W A + Cᵀ C = 0 (2r, 2r), in closed form.

    It uses Aᵀ = S A S with S = diag(-1, 1). ``phi_out`` (n_out, r) are the mode shapes at the
    sensors, ``quantity`` is the measured quantity.
    """
    omega, zeta = _stable(frequency, damping, phi_out)
    displacement, velocity = _readings(omega, zeta, phi_out, quantity)
    S = np.tile([-1.0, 1.0], len(omega))
    return S[:, None] * _gramian(omega, zeta, -displacement, velocity * omega**2) * S


def _stable(
    frequency: np.ndarray, damping: np.ndarray, phi: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Angular frequencies [rad/s] and damping of a system that decays."""
    omega = 2 * np.pi * np.asarray(frequency, dtype=float)
    zeta = np.broadcast_to(np.asarray(damping, dtype=float), omega.shape)
    if np.ndim(phi) != 2 or np.shape(phi)[1] != len(omega):
        raise ShapeError(f"shapes are {np.shape(phi)}, there are {len(omega)} frequencies")
    if np.any(omega <= 0) or np.any(zeta <= 0):
        raise ShapeError("rigid or undamped modes have no gramian: leave them out, give damping")
    return omega, zeta


def _readings(
    omega: np.ndarray, zeta: np.ndarray, phi: np.ndarray, quantity: Quantity
) -> tuple[np.ndarray, np.ndarray]:
    """Output matrices over η and over η' (n_out, r)."""
    if quantity == "receptance":
        return phi, np.zeros_like(phi)
    if quantity == "mobility":
        return np.zeros_like(phi), phi
    if quantity == "accelerance":
        return -(omega**2) * phi, -2 * zeta * omega * phi
    raise LabelError(f"no sensor measures {quantity!r}; use receptance, mobility, accelerance")


def _gramian(omega: np.ndarray, zeta: np.ndarray, b1: np.ndarray, b2: np.ndarray) -> np.ndarray:
    """Stationary second moments of η'' + 2ζω η' + ω² η with white noise in η' (b2) and η (b1).

    Take modes r, s with a = ω_r, c = ω_s, d = 2 ζ_r a, e = 2 ζ_s c. The Lyapunov equation gives
    four equations in X = E[η_r η_s], Y = E[η_r η_s'], Z = E[η_r' η_s] and V = E[η_r' η_s'].
    """
    a, c = omega[:, None], omega[None]
    d, e = 2 * (zeta * omega)[:, None], 2 * (zeta * omega)[None]
    q11, q12, q21, q22 = b1.T @ b1, b1.T @ b2, b2.T @ b1, b2.T @ b2
    D, s = (a - c) * (a + c), d + e
    skew = d * q11 + q21 - q12
    X = (D + e * s) * skew + s * (s * q12 + q22 + c**2 * q11)
    X /= D**2 + s * (d * c**2 + e * a**2)
    Y = (D * X - skew) / s
    Z = -Y - q11
    V = c**2 * X + e * Y - q12
    W = np.stack([np.stack([X, Y / c], -1), np.stack([Z / a, V / (a * c)], -1)], -2)
    W = W.transpose(0, 2, 1, 3).reshape(2 * len(omega), -1)
    return (W + W.T) / 2


def gramians(system: StateSpace) -> tuple[np.ndarray, np.ndarray]:
    """Gramians W_c and W_o of any stable system, by the Lyapunov equations."""
    A, B, C = system.A, system.B, system.C
    if np.linalg.eigvals(A).real.max(initial=-1.0) >= 0:
        raise ShapeError("a system with rigid, undamped or unstable poles has no gramians")
    return solve_continuous_lyapunov(A, -B @ B.T), solve_continuous_lyapunov(A.T, -C.T @ C)


def gramian_quotient(W: np.ndarray, frequency: np.ndarray | None = None) -> float:
    """Largest over smallest diagonal entry of a gramian; inf where one vanishes.

    It depends on the coordinates. With ``frequency`` they are (η, η') of Echaniz Granado (2015),
    section 4.1.1.  There an observability gramian has ω_r² W for the velocity states.
    """
    diagonal = np.diag(W).copy()
    if frequency is not None:
        diagonal[1::2] /= (2 * np.pi * frequency) ** 2
    return float(diagonal.max() / diagonal.min()) if diagonal.min() > 0 else np.inf


def hankel_values(Wc: np.ndarray, Wo: np.ndarray) -> np.ndarray:
    """Hankel singular values σ = √λ(W_c W_o), decreasing; they do not depend on coordinates.

    ``Wc`` may be a stack (..., n, n): one row of values for each.
    """
    U, L = _factors(Wo)
    values = np.linalg.eigvalsh(L.T @ (U.T @ Wc @ U) @ L)
    return np.sqrt(np.clip(values[..., ::-1], 0, None))


def _factors(W: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Factors U, L with W = (U L)(U L)ᵀ for a symmetric, positive semi-definite W (n, n).

    Eigenvalues below n ε of the largest are rounding and count as zero on every machine.
    """
    lam, U = np.linalg.eigh(W)
    rounding = len(W) * np.finfo(float).eps * lam[-1]
    return U, np.diag(np.sqrt(np.where(lam > rounding, lam, 0.0)))


def condition(hankel: np.ndarray) -> np.ndarray:
    """Largest over smallest Hankel value; low where all modes are well observed and driven.

    It is infinite where the smallest squared is below n ε of the largest squared: that is rounding.
    """
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = hankel[..., 0] / hankel[..., -1]
    rounding = np.sqrt(hankel.shape[-1] * np.finfo(float).eps)
    return np.where(hankel[..., -1] > rounding * hankel[..., 0], ratio, np.inf)


@dataclass(frozen=True, eq=False)
class Balanced:
    """A realisation in which both gramians are diag(hankel).

    Attributes
    ----------
    system : StateSpace
    hankel : (n,)        decreasing
    T : (n, n)           x = T x_balanced
    """

    system: StateSpace
    hankel: np.ndarray
    T: np.ndarray


def balanced(system: StateSpace, *, check: float = 1e-6) -> Balanced:
    """Balanced realisation T = R V Σ^(-1/2), from W_c = R Rᵀ, W_o = L Lᵀ and LᵀR = U Σ Vᵀ (Laub).

    Raises
    ------
    AccuracyError
        If the gramians in the new coordinates are not diag(σ) to within ``check``: some state is
        (nearly) unobservable or uncontrollable.
    """
    Wc, Wo = gramians(system)
    R, L = (U @ root for U, root in (_factors(Wc), _factors(Wo)))
    U, sigma, Vt = np.linalg.svd(L.T @ R)
    if sigma[-1] <= 1e-13 * sigma[0]:
        raise AccuracyError(
            "a state is not both observable and controllable: there is no balanced realisation"
        )
    T, inverse = R @ Vt.T / np.sqrt(sigma), (U / np.sqrt(sigma)).T @ L.T
    new = replace(system, A=inverse @ system.A @ T, B=inverse @ system.B, C=system.C @ T)
    for W in (inverse @ Wc @ inverse.T, T.T @ Wo @ T):
        if (gap := np.abs(W - np.diag(sigma)).max() / sigma[0]) > check:
            raise AccuracyError(f"the balanced gramians differ from diag(σ) by {gap:.1e} of σ_1")
    return Balanced(new, sigma, T)


def modal_rank(
    frequency: np.ndarray, phi: np.ndarray, *, gap: float = 1e-6, tolerance: float = 1e-9
) -> int:
    """Rank of the observability (or controllability) matrix of 2r states, mode by mode.

    A pole is observable when every combination of the modes that share it moves some sensor
    (Popov-Belevitch-Hautus).  So the rank is 2 Σ rank Φ[:, cluster]. Modes nearer than ``gap`` in
    relative frequency share a pole; ``tolerance`` is relative to the greatest shape value.
    """
    order = np.argsort(frequency, kind="stable")
    f = np.asarray(frequency, dtype=float)[order]
    starts = np.flatnonzero(np.diff(f) > gap * f[1:]) + 1
    floor = tolerance * np.abs(phi).max(initial=0.0)
    clusters = np.split(order, starts)
    return 2 * sum(int(np.linalg.matrix_rank(phi[:, k], tol=floor)) for k in clusters)
