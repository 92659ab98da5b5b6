"""A linear system by its poles: exact responses, exact steps in time, filters in series."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from scipy.linalg import eigh

from chladni.arrays import readonly
from chladni.errors import ShapeError

_REAL = 1e-9  # of its modulus: an imaginary part below is rounding


@dataclass(frozen=True, eq=False)
class PoleModel:
    """q_k' = p_k q_k + b_k u, y = Re Σ_k c_k q_k + D u, one pole of each conjugate pair.

    Attributes
    ----------
    poles : (m,) complex            [rad/s]
    b : (m, n_in) complex
    c : (n_out, m) complex          twice the residue's factor where the pole is one of a pair
    d : (n_out, n_in) real
    """

    poles: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray

    def __post_init__(self) -> None:
        m = len(self.poles)
        due = {"b": (m, self.d.shape[1]), "c": (self.d.shape[0], m)}
        for name, shape in due.items():
            if (found := getattr(self, name).shape) != shape:
                raise ShapeError(f"{name} is {found}, poles and feedthrough say {shape}")
        for name in ("poles", "b", "c", "d"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    def response(self, s: np.ndarray) -> np.ndarray:
        """H(s) = Σ ½ [c b / (s - p) + (c b)* / (s - p*)] + D for s (n_s,) -> (n_s, n_out, n_in)."""
        s = np.asarray(s, complex)[:, None]
        one, other = 0.5 / (s - self.poles), 0.5 / (s - self.poles.conj())
        H = np.einsum("sk,ok,ki->soi", one, self.c, self.b, optimize=True)
        H += np.einsum("sk,ok,ki->soi", other, self.c.conj(), self.b.conj(), optimize=True)
        return H + self.d

    def outputs(self, rows: slice | np.ndarray) -> Self:
        """Some of the outputs."""
        return type(self)(self.poles, self.b, self.c[rows], self.d[rows])

    def inputs(self, columns: slice | np.ndarray) -> Self:
        """Some of the inputs."""
        return type(self)(self.poles, self.b[:, columns], self.c, self.d[:, columns])


def one_of_pairs(p: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Which poles to keep, one of each conjugate pair (m,) bool; what each counts, 2 or real 1."""
    rounding = _REAL * np.abs(p)
    keep = p.imag >= -rounding
    return keep, np.where(p.imag > rounding, 2.0, 1.0)[keep]


def by_poles(
    matrices: tuple[np.ndarray, np.ndarray, np.ndarray],
    load: np.ndarray,
    seen: tuple[np.ndarray, np.ndarray, np.ndarray],
    through: np.ndarray,
) -> PoleModel:
    """M z'' + C z' + K z = F u, y = P_d z + P_v z' + P_a z'' + D_0 u, by its complex modes.

    In the real modes of M and K the state (Ω η, η') has the generator [[0, Ω], [-Ω, -ΦᵀCΦ]]. It is
    normal except for the damping, so its eigenvectors are well conditioned (Ewins 2000, section
    2.7).

    Parameters
    ----------
    matrices : M, C, K        (n, n), M and K symmetric and positive definite
    load : (n, n_in)          F
    seen : P_d, P_v, P_a      (n_out, n) each
    through : (n_out, n_in)   D_0
    """
    M, C, K = matrices
    lam, phi = eigh(K, M)
    omega = np.sqrt(lam)
    n, damping, push = len(lam), phi.T @ C @ phi, phi.T @ load
    A = np.block([[np.zeros((n, n)), np.diag(omega)], [-np.diag(omega), -damping]])
    at, speed, force = (P @ phi for P in seen)
    rows = np.hstack([at / omega - force * omega, speed - force @ damping])
    p, X = np.linalg.eig(A)
    b = np.linalg.solve(X, np.vstack([np.zeros_like(push), push]).astype(complex))
    keep, pair = one_of_pairs(p)
    return PoleModel(p[keep], b[keep], (rows @ X)[:, keep] * pair, force @ push + through)


@dataclass(frozen=True, eq=False)
class PoleFilter:
    """G(s) = Σ_j ½ [w_j / (s - a_j) + conj], one of each conjugate pair, nothing at infinity."""

    poles: np.ndarray
    weights: np.ndarray

    def at(self, s: np.ndarray) -> np.ndarray:
        """G(s) (n_s,)."""
        s = np.asarray(s, complex)[:, None]
        one = 0.5 * self.weights / (s - self.poles)
        other = 0.5 * self.weights.conj() / (s - self.poles.conj())
        return (one + other).sum(axis=1)


def filtered(model: PoleModel, low_pass: PoleFilter) -> PoleModel:
    """G(s) H(s): every output behind the same filter, by partial fractions.

    The poles of the model keep their inputs and are seen through G(p); each input brings the poles
    of the filter, seen through H(a). The direct feedthrough vanishes, because G falls to zero.
    """
    n_in, a = model.d.shape[1], low_pass.poles
    H = model.response(a)  # (n_a, n_out, n_in)
    own = np.einsum("j,joi->oij", low_pass.weights, H).reshape(len(model.d), -1)
    return PoleModel(
        np.concatenate([model.poles, np.tile(a, n_in)]),
        np.concatenate([model.b, np.repeat(np.eye(n_in), len(a), axis=0).astype(complex)]),
        np.hstack([model.c * low_pass.at(model.poles), own]),
        np.zeros_like(model.d),
    )
