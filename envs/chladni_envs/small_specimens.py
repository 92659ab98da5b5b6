"""Default problems of the environments: small structures with known modes."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class ModalSpecimen:
    """Modes at places where a sensor or shaker may be mounted."""

    points: np.ndarray  # (n, 2) or (n, 3) places [m]
    phi: np.ndarray  # (n, r) mass-normalised shapes along each place's direction [1/√kg]
    # frequency, damping: (r,) [Hz], fraction of critical
    frequency: np.ndarray
    damping: np.ndarray
    labels: tuple[str, ...] = ()  # labels of the places
    outline: np.ndarray | None = None  # (k, 2, 3) edges of the structure, for pictures [m]
    # (n,) bool: True where a free line leads to the place, for a shaker's rod
    access: np.ndarray | None = None
    gap_shapes: np.ndarray | None = None  # (g, r) opening of gaps between sheets [1/√kg]
    clearance: np.ndarray | None = None  # (g,) of these gaps [m]
    notes: tuple[str, ...] = ()  # sentences on the deck, as the unit system that was guessed


def plate(
    nx: int = 8,
    ny: int = 8,
    modes: int = 8,
    *,
    length: float = 0.6,
    width: float = 0.5,
    thickness: float = 1e-3,
    zeta: float = 0.01,
) -> ModalSpecimen:
    """A simply supported steel plate: ω_mn = √(D/ρt) ((mπ/a)² + (nπ/b)²), φ = 2/√(ρtab) sin sin.

    Leissa, Vibration of Plates (NASA SP-160, 1969), 4.1. Places on a grid of nx by ny inside the
    edges; the lowest ``modes`` modes.
    """
    E, nu, rho = 210e9, 0.3, 7850.0
    x = np.linspace(0, length, nx + 2)[1:-1]
    y = np.linspace(0, width, ny + 2)[1:-1]
    X, Y = (g.ravel() for g in np.meshgrid(x, y, indexing="ij"))
    m, n = (g.ravel() for g in np.meshgrid(np.arange(1, 13), np.arange(1, 13), indexing="ij"))
    flexural = np.sqrt(E * thickness**2 / (12 * (1 - nu**2) * rho))
    omega = flexural * ((m * np.pi / length) ** 2 + (n * np.pi / width) ** 2)
    low = np.argsort(omega, kind="stable")[:modes]
    phi = np.sin(np.outer(X, m[low] * np.pi / length)) * np.sin(np.outer(Y, n[low] * np.pi / width))
    phi *= 2 / np.sqrt(rho * thickness * length * width)
    labels = tuple(f"{k + 1}:+Z" for k in range(len(X)))
    points = np.column_stack([X, Y])
    return ModalSpecimen(points, phi, omega[low] / (2 * np.pi), np.full(modes, zeta), labels)
