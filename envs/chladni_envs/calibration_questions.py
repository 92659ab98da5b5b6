"""Problems of a calibration environment: a model over parameters and a recording."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .small_specimens import plate


@dataclass(frozen=True, eq=False)
class CalibrationQuestion:
    """A model over parameters in [-1, 1] and a recording."""

    names: tuple[str, ...]
    frequency: np.ndarray  # (n_f,) [Hz]
    predict: Callable[[np.ndarray], np.ndarray]  # x (p,) -> (n_f, n_out) complex
    # (n_f, n_out) complex, or None: drawn at each reset, x uniform within ±0.8
    recorded: np.ndarray | None = None


def plate_question(modes: int = 8, lines: int = 96) -> CalibrationQuestion:
    """Mobility of a simply supported plate with E and ρ wrong by up to 20 %, a mass, a spring.

    In its nominal modes K = E/E_0 diag ω² + k φ_s φ_sᵀ and M = ρ/ρ_0 I + m φ_m φ_mᵀ.
    """
    s = plate(8, 8, modes, zeta=0.01)
    omega_r = 2 * np.pi * s.frequency
    frequency = np.geomspace(0.7 * s.frequency[0], 1.1 * s.frequency[-1], lines)
    omega = 2 * np.pi * frequency
    out, drive, at_mass, at_spring = s.phi[[9, 29, 44]], s.phi[18], s.phi[13], s.phi[51]
    plate_mass = 0.6 * 0.5 * 1e-3 * 7850.0
    mass, spring = 0.1 * plate_mass, 0.05 * plate_mass * omega_r[2] ** 2

    def predict(x: np.ndarray) -> np.ndarray:
        E, rho = 1 + 0.2 * x[0], 1 + 0.2 * x[1]
        m, k = mass * (1 + x[2]) / 2, spring * (1 + x[3]) / 2
        K = E * np.diag(omega_r**2) + k * np.outer(at_spring, at_spring)
        M = rho * np.eye(modes) + m * np.outer(at_mass, at_mass)
        L = np.linalg.inv(np.linalg.cholesky(M))
        lam, X = np.linalg.eigh(L @ K @ L.T)
        psi = L.T @ X
        h = 1j * omega[:, None] / (lam * (1 + 0.02j) - omega[:, None] ** 2)
        return (h * (drive @ psi)) @ (out @ psi).T

    return CalibrationQuestion(("E", "rho", "mass", "spring"), frequency, predict)
