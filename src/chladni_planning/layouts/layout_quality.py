"""Quality of a layout beyond its determinant: kinetic energy, visibility of each mode, mass."""

from dataclasses import dataclass

import numpy as np

from chladni.errors import ShapeError

from .information import positions_of
from .layout_rules import Rules


def visibility(seen: np.ndarray, largest: np.ndarray) -> np.ndarray:
    """Largest motion the sensors see of each mode over its largest motion anywhere (r,) in [0, 1].

    Parameters
    ----------
    seen : (m, r)       shapes at the sensors, along their directions
    largest : (r,)      greatest displacement magnitude of each mode over the whole structure
    """
    if len(seen) == 0:
        return np.zeros(len(largest))
    return np.clip(np.abs(seen).max(axis=0) / largest, 0.0, 1.0)


@dataclass(frozen=True)
class Move:
    """A sensor that was moved so that a mode is seen (Echaniz Granado 2015, section 4.2.4.6)."""

    mode: int
    out: int
    into: int
    before: float
    after: float


def with_visible_modes(
    phi: np.ndarray,
    ranked: np.ndarray,
    largest: np.ndarray,
    *,
    floor: float = 0.2,
    rules: Rules | None = None,
) -> tuple[np.ndarray, tuple[Move, ...]]:
    """A ranked layout in which every mode reaches the floor of visibility, where that is possible.

    For each mode below the floor the least ranked sensor that no other mode needs moves to the
    candidate that sees the mode best.

    Parameters
    ----------
    phi : (n, r)        shapes at all candidates, of any direction
    ranked : (m,) int   the layout, the most informative first
    """
    kept = positions_of(ranked, len(phi))
    checked = (rules or Rules()).checked(len(phi), len(kept))
    moves: list[Move] = []
    for mode in np.argsort(visibility(phi[kept], largest), kind="stable").tolist():
        before = visibility(phi[kept], largest)
        if before[mode] >= floor:
            continue
        found = _move(phi, kept, largest, mode, floor, checked)
        if found is not None:
            k, into = found
            after = visibility(np.vstack([np.delete(phi[kept], k, axis=0), phi[into]]), largest)
            moves.append(Move(mode, int(kept[k]), into, float(before[mode]), float(after[mode])))
            kept = np.r_[np.delete(kept, k), into]
    return kept, tuple(moves)


def _move(
    phi: np.ndarray, kept: np.ndarray, largest: np.ndarray, mode: int, floor: float, rules: Rules
) -> tuple[int, int] | None:
    """Rank of the sensor to give up and candidate to take, or None where no move helps."""
    now = visibility(phi[kept], largest)
    for k in range(len(kept) - 1, -1, -1):
        rest = np.delete(kept, k)
        left = visibility(phi[rest], largest)
        needed = (left < floor) & (now >= floor)
        if rules.fixed[kept[k]] or needed.any():
            continue
        mask = np.zeros(len(phi), bool)
        mask[rest] = True
        may = np.flatnonzero(rules.addable(mask, len(kept)))
        gain = np.abs(phi[may, mode]) / largest[mode]
        if len(may) and gain.max() > now[mode]:
            return k, int(may[gain.argmax()])
    return None


def loaded_frequency(
    frequency: np.ndarray, phi: np.ndarray, mass: np.ndarray | float
) -> np.ndarray:
    """Frequencies with masses added, λ of (Ω², I + Σ m φᵀφ) in the space of the given modes (r,).

    Parameters
    ----------
    frequency : (r,)         [Hz]
    phi : (n, k, r)          shapes at the sensors in the k directions in which the mass moves
                             (three: a mass is carried in every direction, whichever it measures)
    mass : of each sensor [kg]
    """
    if np.ndim(phi) != 3:
        raise ShapeError(f"shapes at the sensors are {np.shape(phi)}; give (sensors, 3, modes)")
    m = np.broadcast_to(np.asarray(mass, dtype=float), len(phi))
    M = np.eye(len(frequency)) + np.einsum("n,nkr,nks->rs", m, phi, phi)
    inverse_root = np.linalg.inv(np.linalg.cholesky(M))
    squares = inverse_root * (np.asarray(frequency) ** 2) @ inverse_root.T
    return np.sqrt(np.clip(np.linalg.eigvalsh(squares), 0, None))


def overlap(layout: np.ndarray, other: np.ndarray) -> float:
    """Share of the sensors of one layout that the other also has, in [0, 1]."""
    return len(np.intersect1d(layout, other)) / max(len(layout), 1)
