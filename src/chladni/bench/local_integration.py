"""A linear system with local forces in time: the linear part exact, the forces implicit.

The openings answer to inputs and to local forces by superposition. Both are straight between
samples, so the only error is that of the local force's line between two samples, O(h²) (exponential
integrators: Hochbruck and Ostermann 2010, Acta Numerica 19, 209-286).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from .first_order_hold import HeldRun, HeldStep
from .local_forces import LocalForce
from .pole_model import PoleModel

ROUNDS = 3  # Gauss-Seidel over the sites of one step: they couple by h² / m only


@dataclass
class LocalRun:
    """Local forces that run on from block to block.

    Attributes
    ----------
    openings : PoleModel      x of every site; its inputs are the drives, then a force a site
    laws : what acts at each site
    """

    openings: PoleModel
    laws: Sequence[LocalForce]
    h: float
    free: HeldRun = field(init=False)
    state: np.ndarray = field(init=False)
    force: np.ndarray = field(init=False)
    memory: list[float] = field(init=False)

    def __post_init__(self) -> None:
        sites = len(self.laws)
        self.free = HeldRun(self.openings.inputs(slice(0, -sites)), self.h)
        self.state = np.zeros(len(self.openings.poles), complex)
        self.force, self.memory = np.zeros(sites), [0.0] * sites

    def on(self, u: np.ndarray) -> np.ndarray:
        """Forces (sites, n) at every sample of the driving inputs u (n_in, n)."""
        sites, step = len(self.laws), HeldStep.of(self.openings.poles, self.h)
        b, c = self.openings.b[:, -sites:], self.openings.c
        E, B0, B1 = step.E, step.G0[:, None] * b, step.G1[:, None] * b
        S = (c @ B1).real
        free = self.free.on(u).T.tolist()
        q, f, memory, out = self.state, self.force, self.memory, np.empty((len(free), sites))
        for n, x_free in enumerate(free):
            q = E * q
            if f.any():
                q += B0 @ f
            own = (c @ q).real
            f, memory = _solved(self.laws, own + x_free, S, f, memory)
            if f.any():
                q += B1 @ f
            out[n] = f
        self.state, self.force, self.memory = q, f, memory
        return out.T


def _solved(
    laws: Sequence[LocalForce], a: np.ndarray, S: np.ndarray, before: np.ndarray,
    memory: list[float],
) -> tuple[np.ndarray, list[float]]:  # fmt: skip
    """Forces f with x = a + S f and f_i the law of x_i, and the memories after the step."""
    if len(laws) == 1:
        one, after = laws[0].solve(float(a[0]), float(S[0, 0]), memory[0])
        return np.array([one]), [after]
    f, new = before.copy(), list(memory)
    for _ in range(ROUNDS):
        for i, law in enumerate(laws):
            others = float(a[i] + S[i] @ f - S[i, i] * f[i])
            f[i], new[i] = law.solve(others, float(S[i, i]), memory[i])
    return f, new
