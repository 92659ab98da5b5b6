"""The analysis of a deck: subcases, loads, frequencies, damping and excitation (SI)."""

from dataclasses import dataclass, field

import numpy as np

from .following_frequencies import Following


@dataclass(frozen=True)
class Subcase:
    """One subcase: the selected sets, 0 for no set.

    ``outputs`` are the points whose motion is requested, as ranges of ids from first to last;
    ``residual`` requests residual vectors in addition to the modes.
    """

    id: int
    spc: int = 0
    mpc: int = 0
    load: int = 0
    method: int = 0
    frequency: int = 0
    dload: int = 0
    damping: int = 0
    suport: int = 0
    outputs: tuple[tuple[int, int], ...] = field(default=(), kw_only=True)
    residual: bool = field(default=False, kw_only=True)


@dataclass(frozen=True, eq=False)
class Load:
    """A static load."""

    rows: np.ndarray  # (k,) int: rows of points
    components: np.ndarray  # (k,) int: 1-6, in the basic frame (1 at a scalar point)
    values: np.ndarray  # (k,) [N] or [N m]
    # (3,) acceleration field on all masses [m/s²]
    gravity: np.ndarray = field(default_factory=lambda: np.zeros(3))


@dataclass(frozen=True, eq=False)
class Motion:
    """Displacements prescribed at held dofs: rows, components (displacement frame), values."""

    rows: np.ndarray
    components: np.ndarray
    values: np.ndarray


@dataclass(frozen=True, eq=False)
class Tabulated:
    """A tabulated, piecewise linear function with extrapolated ends (Nastran's TABLED1)."""

    x: np.ndarray
    y: np.ndarray
    log_x: bool = False
    log_y: bool = False

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """Values at x."""
        x = np.asarray(x, float)
        if len(self.x) == 1:
            return np.full(x.shape, self.y[0])
        X, Y = (
            (np.log(self.x) if self.log_x else self.x),
            (np.log(self.y) if self.log_y else self.y),
        )
        u = np.log(x) if self.log_x else x
        k = np.clip(np.searchsorted(X, u) - 1, 0, len(X) - 2)
        run = X[k + 1] - X[k]
        slope = np.divide(Y[k + 1] - Y[k], run, out=np.zeros_like(u), where=run > 0)
        y = Y[k] + slope * (u - X[k])
        return np.exp(y) if self.log_y else y


@dataclass(frozen=True, eq=False)
class Excitation:
    """P_k(f) = A_k g(f) exp(i (θ_k - 2π f τ_k)), one harmonic load (RLOAD1, RLOAD2)."""

    kind: str  # "force", "displacement", "velocity" or "acceleration"
    # rows, components: (k,) int: loaded dofs; forces in the basic frame, motions in the
    # displacement frame of the point
    rows: np.ndarray
    components: np.ndarray
    amplitude: np.ndarray  # (k,) A [N, N m or m, m/s, m/s² and their rotations]
    # delay, phase: (k,) τ [s], θ [rad]
    delay: np.ndarray
    phase: np.ndarray
    # first, second: real and imaginary part of g, or its modulus and phase [deg]
    first: Tabulated | None = None
    second: Tabulated | None = None
    polar: bool = False  # g = first exp(i second), as in RLOAD2

    def at(self, frequency: np.ndarray) -> np.ndarray:
        """P (n_f, k) at frequencies [Hz]."""
        f = np.asarray(frequency, float)
        a = np.ones_like(f) if self.first is None and self.polar else np.zeros_like(f)
        a = a if self.first is None else self.first(f)
        b = np.zeros_like(f) if self.second is None else self.second(f)
        g = a * np.exp(1j * np.radians(b)) if self.polar else a + 1j * b
        turn = np.exp(1j * (self.phase - 2 * np.pi * f[:, None] * self.delay))
        return self.amplitude * g[:, None] * turn


@dataclass(frozen=True, eq=False)
class Analysis:
    """All data of a deck other than its structure; dictionaries by set id."""

    solution: int = 0  # SOL number, 0 if not given
    subcases: tuple[Subcase, ...] = ()  # in order
    # static loads, combinations (LOAD) resolved
    loads: dict[int, Load] = field(default_factory=dict)
    # SPCD, and SPC with a displacement
    prescribed: dict[int, Motion] = field(default_factory=dict)
    # frequencies of response [Hz], increasing
    frequency: dict[int, np.ndarray] = field(default_factory=dict)
    # frequencies that follow the modes, by the same ids
    following: dict[int, tuple[Following, ...]] = field(default_factory=dict)
    # (f (k,) [Hz], ζ (k,)) modal damping tables
    damping: dict[int, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    # (lowest [Hz], highest [Hz], count) of eigenvalue requests, NaN or 0 if not limited
    eigen: dict[int, tuple[float, float, int]] = field(default_factory=dict)
    # tuples of Excitation by DLOAD id
    dynamic: dict[int, tuple[Excitation, ...]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  # approximations and omissions, one sentence each
