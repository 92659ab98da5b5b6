"""Superposition of 100 modes to 40 x 1 x 1500 responses: this package against the obvious ways.

python benchmarks/frf.py
"""

import numpy as np

from chladni.dynamics.frf import transfer
from chladni.dynamics.modes import ModalModel
from timing import timed

OUTPUTS, LINES, MODES = 40, 1500, 100


def specimen():
    """Random shapes, frequencies 10 to 500 Hz, one per cent of damping."""
    rng = np.random.default_rng(0)
    dofs = np.c_[np.arange(1, OUTPUTS + 1), np.full(OUTPUTS, 3)]
    frequency = np.sort(rng.uniform(10, 500, MODES))
    shapes = rng.standard_normal((OUTPUTS, MODES))
    return ModalModel(frequency, np.full(MODES, 0.01), shapes, dofs), np.linspace(5, 450, LINES)


def einsum(modal, f):
    """One einsum over modes."""
    w, wr = 2 * np.pi * f[:, None], 2 * np.pi * modal.frequency
    h = 1 / (wr**2 - w**2 + 2j * modal.damping * wr * w)
    return np.einsum("ir,kr,jr->kij", modal.shapes, h, modal.shapes[:1])


def by_modes(modal, f):
    """A loop over modes, outer products added up."""
    w, H = 2 * np.pi * f, np.zeros((LINES, OUTPUTS, 1), complex)
    for wr, z, phi in zip(2 * np.pi * modal.frequency, modal.damping, modal.shapes.T, strict=True):
        h = 1 / (wr**2 - w**2 + 2j * z * wr * w)
        H += h[:, None, None] * np.outer(phi, phi[:1])
    return H


def ours(modal, f):
    """Real and imaginary part as two matrix products."""
    return transfer(modal, modal.shapes, modal.shapes[:1], 2j * np.pi * f)


def main():
    """Print the table."""
    modal, f = specimen()
    due = ours(modal, f)
    base = 1e3 * timed(lambda: ours(modal, f), 20)[0]
    print("| way | ms | times ours | largest difference |\n|---|---|---|---|")
    for name, way in {"chladni": ours, "einsum": einsum, "loop over modes": by_modes}.items():
        difference = np.abs(way(modal, f) - due).max() / np.abs(due).max()
        ms = 1e3 * timed(lambda way=way: way(modal, f), 20)[0]
        print(f"| {name} | {ms:.1f} | {ms / base:.1f} | {difference:.0e} |")


if __name__ == "__main__":
    main()
