"""Exact steps of a linear system whose inputs are straight between samples (first-order hold)."""

from dataclasses import dataclass, field

import numpy as np
from scipy.signal import lfilter

from .pole_model import PoleModel


@dataclass(frozen=True, eq=False)
class HeldStep:
    """q(t + h) = E q + G_0 b u(t) + G_1 b u(t + h): E = e^z, G_1 = h φ_2, G_0 = h (φ_1 - φ_2).

    z = p h, φ_1 = (e^z - 1)/z, φ_2 = (φ_1 - 1)/z (Franklin, Powell and Workman 1998, Digital
    Control of Dynamic Systems, section 4.3; Hochbruck and Ostermann 2010, Acta Numerica 19).
    """

    E: np.ndarray
    G0: np.ndarray
    G1: np.ndarray

    @classmethod
    def of(cls, poles: np.ndarray, h: float) -> "HeldStep":
        """Factors (m,) of a step of h [s]."""
        z = poles * h
        phi1 = np.expm1(z) / z
        phi2 = (phi1 - 1) / z
        return cls(np.exp(z), h * (phi1 - phi2), h * phi2)


@dataclass
class HeldRun:
    """A system that runs on from block to block: its state and its last input are kept.

    It rests at the beginning.
    """

    model: PoleModel
    h: float
    state: np.ndarray = field(init=False)
    last: np.ndarray = field(init=False)
    step: HeldStep = field(init=False)

    def __post_init__(self) -> None:
        self.state = np.zeros(len(self.model.poles), complex)
        self.last = np.zeros(self.model.d.shape[1])
        self.step = HeldStep.of(self.model.poles, self.h)

    def on(self, u: np.ndarray, every: int = 1) -> np.ndarray:
        """Outputs (n_out, n / every) at every so many samples of the inputs u (n_in, n)."""
        q = self._states(u)
        seen = q[:, every - 1 :: every]
        y = self.model.c.real @ seen.real - self.model.c.imag @ seen.imag
        y += self.model.d @ u[:, every - 1 :: every]
        self.state, self.last = q[:, -1].copy(), u[:, -1].copy()
        return np.asarray(y)

    def _states(self, u: np.ndarray) -> np.ndarray:
        b, s, n_in = self.model.b, self.step, u.shape[0]
        q = np.empty((len(b), u.shape[1]), complex)
        before = b @ self.last
        for k in range(len(b)):
            v = b[k, 0] * u[0] if n_in == 1 else b[k] @ u
            begun = s.G0[k] * before[k] + s.E[k] * self.state[k]
            q[k], _ = lfilter([s.G1[k], s.G0[k]], [1.0, -s.E[k]], v, zi=[begun])
        return q
