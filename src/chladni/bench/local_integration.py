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
        """Forces (sites, n) at every sample of the driving inputs u (n_in, n).

        With r = E q + G_0 b f, what the sites would do without a force at the next sample, the
        recursion is r ← E r + (E G_1 + G_0) b f: two products and a sum a step.
        """
        sites = len(self.laws)
        s = HeldStep.of(self.openings.poles, self.h)
        b, c = self.openings.b[:, -sites:], self.openings.c
        S = (c @ (s.G1[:, None] * b)).real
        W = list(((s.E * s.G1 + s.G0)[:, None] * b).T.copy())
        seen = np.stack([c.real, -c.imag], axis=-1).reshape(sites, -1)
        free = self.free.on(u).T.tolist()
        r, pushed = self.state, np.empty_like(self.state)
        flat, out, f = r.view(float), np.empty((len(free), sites)), self.force.tolist()
        # flat: real and imaginary parts of r in turn, as ``seen`` takes them
        memory = self.memory
        for n, x in enumerate(free):
            own = seen @ flat
            a = [x[i] + float(own[i]) for i in range(sites)]
            f, memory = _solved(self.laws, a, S, f, memory)
            np.multiply(r, s.E, out=r)
            for i in range(sites):
                if f[i]:
                    np.multiply(W[i], f[i], out=pushed)
                    r += pushed
            out[n] = f
        self.force, self.memory = np.array(f), memory
        return out.T


def _solved(
    laws: Sequence[LocalForce], a: list[float], S: np.ndarray, before: list[float],
    memory: list[float],
) -> tuple[list[float], list[float]]:  # fmt: skip
    """Forces f with x = a + S f and f_i the law of x_i, and the memories after the step."""
    if len(laws) == 1:
        one, after = laws[0].solve(a[0], float(S[0, 0]), memory[0])
        return [one], [after]
    f, new = list(before), list(memory)
    for _ in range(ROUNDS):
        for i, law in enumerate(laws):
            others = a[i] + sum(float(S[i, j]) * f[j] for j in range(len(f)) if j != i)
            f[i], new[i] = law.solve(others, float(S[i, i]), memory[i])
    return f, new
