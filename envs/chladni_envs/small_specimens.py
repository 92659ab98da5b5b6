"""Default problems of the environments: small structures with known modes."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from chladni.search.next_measurement import Outlook


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
    fixed: np.ndarray | None = None  # (n,) bool: True where every layout has a sensor
    cost: np.ndarray | None = None  # (n,) of a sensor at each place, relative
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


def tied_plate(noise: float = 0.15) -> "Outlook":
    """The plate with a lump at one of four places that a sensor and a drive in its middle tie.

    Two mirror planes make the four places equal for what is driven and seen in the middle.  Unknown
    are ln E, ln rho, the ln of the lump's mass, and errors of every modal stiffness.  Each
    candidate is predicted linear about the first test.

    Parameters
    ----------
    noise : of |H|, at every line
    """
    from chladni.inference.expected_information import Predicted, Rivals
    from chladni.search.next_measurement import FurtherTest, Outlook

    side, lump, put = 7, 0.004, 0.02
    spec = plate(side, side, 6)
    phi, lam = spec.phi, (2 * np.pi * spec.frequency) ** 2
    prior = np.r_[0.03, 0.01, 0.3, np.full(len(lam), 0.01)]  # of ln E, ln rho, ln mass, G
    middle, corners = side**2 // 2, [8, 12, 36, 40]
    s = 2j * np.pi * np.linspace(0.8 * spec.frequency[0], 1.1 * spec.frequency[-1], 10)
    s = s + 0.04 * np.abs(s)

    def shown(at: int, x: np.ndarray, rows: list[int], on: int | None = None) -> np.ndarray:
        """ln H over the noise, real and imaginary (2 n,), for a drive in the middle."""
        K = np.diag(lam * np.exp(x[0]) * (1 + x[3:]))
        M = np.exp(x[1]) * np.eye(len(lam)) + lump * np.exp(x[2]) * np.outer(phi[at], phi[at])
        if on is not None:
            M = M + put * np.outer(phi[on], phi[on])
        u = np.linalg.solve(K + s[:, None, None] ** 2 * M, phi[middle][:, None])[..., 0]
        H = np.log(u @ phi[rows].T).ravel() / noise
        return np.concatenate([H.real, H.imag])

    def sloped(at: int, rows: list[int], on: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        zero, h = np.zeros(len(prior)), 1e-4
        steps = h * np.diag(prior)
        J = [(shown(at, e, rows, on) - shown(at, -e, rows, on)) / (2 * h) for e in steps]
        return shown(at, zero, rows, on), np.stack(J, axis=1)

    tests = [FurtherTest("sensor", f"a sensor at {n}", n) for n in spec.labels]
    tests += [
        FurtherTest("mass", f"20 g put on at {spec.labels[k]}", spec.labels[k], None, 2.0, put)
        for k in (9, 11, 23, 30)
    ]
    where = [([k], None) for k in range(side**2)] + [([middle], k) for k in (9, 11, 23, 30)]
    roots = []
    for at in corners:
        J = sloped(at, [middle])[1]
        lam_, U = np.linalg.eigh(J.T @ J)
        roots.append(U / np.sqrt(1 + np.maximum(lam_, 0.0)))
    seen = []
    for rows, on in where:
        each = [sloped(at, rows, on) for at in corners]
        off = np.stack([y - each[0][0] for y, _ in each])
        turn, n = 2 * np.pi / noise, len(s) * len(rows)
        off[:, n:] -= turn * np.round(off[:, n:] / turn)  # of the phase
        factors = tuple(J @ L for (_, J), L in zip(each, roots, strict=True))
        seen.append(Predicted(off, factors).short)
    names = tuple(f"lump at {spec.labels[k]}" for k in corners)
    return Outlook(names, Rivals(np.full(4, 0.25)), tuple(tests), tuple(seen))
