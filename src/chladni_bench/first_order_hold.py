"""Exact steps of a linear system whose inputs are straight between samples (first-order hold)."""

from dataclasses import dataclass, field

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.linalg import toeplitz

from chladni.errors import ShapeError

from .pole_model import PoleModel

STRIDE = 64  # samples from state to state where outputs are seen at all: products in place of steps


@dataclass(frozen=True, eq=False)
class HeldStep:
    """q(t + h) = E q + G_0 b u(t) + G_1 b u(t + h): E = e^z, G_1 = h φ_2, G_0 = h (φ_1 - φ_2).

    z = p h, φ_1 = (e^z - 1)/z, φ_2 = (φ_1 - 1)/z. Franklin, Powell and Workman 1998, Digital
    Control of Dynamic Systems, section 4.3; Hochbruck and Ostermann 2010, Acta Numerica 19.
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
        """Outputs (n_out, n / every) at every so many samples of the inputs u (n_in, n).

        Raises
        ------
        ShapeError
            If ``every`` does not divide n.
        """
        if u.shape[1] % every:
            raise ShapeError(f"{u.shape[1]} samples are no multiple of {every}")
        if every == 1 and (whole := u.shape[1] - u.shape[1] % STRIDE):
            return np.hstack([self._within(u[:, :whole]), self._at(u[:, whole:], 1)])
        return self._at(u, every)

    def _at(self, u: np.ndarray, every: int) -> np.ndarray:
        """Outputs of the states at every so many samples."""
        q = self._states(u, every)
        return np.asarray(_seen(self.model.c, q) + self.model.d @ u[:, every - 1 :: every])

    def _within(self, u: np.ndarray) -> np.ndarray:
        """Outputs at all samples from states that are ``STRIDE`` samples apart.

        y(t + i h) = Re c Eⁱ q(t) + Σ_j κ_ij u(t + j h) + D u(t + i h). Straight lines between
        samples are a sum of hats. A hat at j moves κ_ij = Re c E^{i-j-1} (E G_1 + G_0) b after it
        and Re c G_1 b at it. The hat at 0 has only its falling half within the stride.
        """
        m, s = self.model, self.step
        held = np.hstack([self.last[:, None], u])
        begun = self.state[:, None]
        q = np.hstack([begun, self._states(u, STRIDE)[:, :-1]])
        powers = s.E ** np.arange(STRIDE + 1)[:, None]
        y = np.empty((len(m.c), q.shape[1], STRIDE))
        for o, c in enumerate(m.c):
            y[o] = _seen(c * powers[1:], q).T
            for k, b in enumerate(m.b.T):
                after = (powers[:-1] @ (c * b * (s.E * s.G1 + s.G0))).real
                hat = np.append((c @ (b * s.G1)).real, after[:-1])
                first = (powers[:-1] @ (c * b * s.G0)).real
                kernel = np.column_stack([first, toeplitz(hat, np.zeros(STRIDE))])
                y[o] += sliding_window_view(held[k], STRIDE + 1)[::STRIDE] @ kernel.T
        return y.reshape(len(m.c), -1) + m.d @ u

    def _states(self, u: np.ndarray, every: int) -> np.ndarray:
        """States (m, n / every) at every so many samples, from where the last block ended.

        q(t + R h) = E^R q(t) + Σ_j w_j b u(t + j h), j = 0 .. R: w_j = E^{R-1-j} (E G_1 + G_0),
        but E^{R-1} G_0 at 0 and G_1 at R.
        """
        from scipy.signal import lfilter

        s = self.step
        powers = s.E[:, None] ** np.arange(every, -1, -1)
        w = np.zeros_like(powers)
        w[:, :-1] += powers[:, 1:] * s.G0[:, None]
        w[:, 1:] += powers[:, 1:] * s.G1[:, None]
        q = np.zeros((len(w), u.shape[1] // every), complex)
        if not q.size:
            return q
        for b, last, x in zip(self.model.b.T, self.last, u, strict=True):
            windows = sliding_window_view(np.append(last, x), every + 1)[::every]
            pushed = b[:, None] * w
            q.real += pushed.real @ windows.T
            q.imag += pushed.imag @ windows.T
        for k, whole in enumerate(powers[:, 0]):
            q[k], _ = lfilter([1.0], [1.0, -whole], q[k], zi=[whole * self.state[k]])
        self.state, self.last = q[:, -1].copy(), u[:, -1].copy()
        return q


def _seen(c: np.ndarray, q: np.ndarray) -> np.ndarray:
    """Re c q."""
    return np.asarray(c.real @ q.real - c.imag @ q.imag)
