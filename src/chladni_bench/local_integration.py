"""A linear system with local forces in time: the linear part exact, the forces implicit.

The motions of the local sites are superposed from inputs and local forces. Both are linear between
samples. The only error is that of the local force between two samples, O(h²). Exponential
integrators: Hochbruck and Ostermann 2010, Acta Numerica 19, 209-286.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import toeplitz

from .first_order_hold import HeldRun
from .local_forces import LocalForce
from .pole_model import PoleModel

TOGETHER, LEAST = 64, 8  # steps taken at once on a straight piece of a law
ROUNDS = 3  # Gauss-Seidel over the sites of one step: they couple by h² / m only


@dataclass
class LocalRun:
    """Local forces that run on from block to block."""

    openings: PoleModel  # x of every site; its inputs are the drives, then a force a site
    laws: Sequence[LocalForce]  # what acts at each site
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

        Let r = E q + G_0 b f be the state without a local force at the next sample. The recursion
        is r ← E r + (E G_1 + G_0) b f.
        """
        free = self.free.on(u)
        if len(self.laws) == 1 and self.laws[0].piece(float(self.force[0]), self.memory[0]):
            return self._by_pieces(self.laws[0], free[0])[None]
        return self._by_steps(free)

    def _by_steps(self, free: np.ndarray) -> np.ndarray:
        """Any laws at any number of sites: two products and a sum a step."""
        sites = len(self.laws)
        W, S, c = self._step()
        pushes = list(W.T.copy())
        seen = c.T.conj().copy().view(float)  # Re c r, of real and imaginary parts in turn
        r, pushed = self.state, np.empty_like(self.state)
        flat, out, f = r.view(float), np.empty(free.T.shape), self.force.tolist()
        memory = self.memory
        for n, x in enumerate(free.T.tolist()):
            own = seen @ flat
            a = [x[i] + float(own[i]) for i in range(sites)]
            f, memory = _solved(self.laws, a, S, f, memory)
            np.multiply(r, self.free.step.E, out=r)
            for i in range(sites):
                if f[i]:
                    np.multiply(pushes[i], f[i], out=pushed)
                    r += pushed
            out[n] = f
        self.force, self.memory = np.array(f), memory
        return out.T

    def _by_pieces(self, law: LocalForce, free: np.ndarray) -> np.ndarray:
        """Forces (n,) of one site and a law of straight pieces, all steps on a piece at once.

        On a piece f_j = (F - k a_j) / (1 + S k). Earlier forces move a = free + O r + H f, with
        O_j = Re c Eʲ. Together: (I + k H / (1 + S k)) a = free + O r + H F / (1 + S k).
        """
        W, S, c = (x[..., 0] for x in self._step())
        one = _Together.of(self.free.step.E, W, c, float(S[0]))
        r, f, memory = self.state, float(self.force[0]), self.memory[0]
        out, n, most = np.empty(len(free)), 0, TOGETHER
        while n < len(free):
            k, F = law.piece(f, memory) or (0.0, 0.0)
            x = free[n : n + most] + one.seen[: len(free) - n][:most] @ r.view(float)
            a, forces = one.on_piece(x, k, F)
            m, memory = law.followed(k, a, forces, one.S, memory)
            if m == 0:
                forces[0], memory = law.solve(float(x[0]), one.S, memory)
                m = 1
            out[n : n + m] = forces[:m]
            r = one.after(r, forces[:m])
            f, n = float(forces[m - 1]), n + m
            most = min(TOGETHER, max(LEAST, 2 * m))
        self.state, self.force, self.memory = r, np.array([f]), [memory]
        return out

    def _step(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Gains of a force in a step, on r (m, sites) and on x (sites, sites); c (m, sites)."""
        s, sites = self.free.step, len(self.laws)
        b, c = self.openings.b[:, -sites:], self.openings.c
        S = (c @ (s.G1[:, None] * b)).real
        return (s.E * s.G1 + s.G0)[:, None] * b, S, c.T


@dataclass(frozen=True, eq=False)
class _Together:
    """Several steps of one site at once."""

    powers: np.ndarray  # (n + 1, m) Eʲ
    W: np.ndarray  # (m,) what a unit of force adds to r in a step
    S: float  # what it moves the site in that step
    seen: np.ndarray  # (n, 2 m) a of r, as real and imaginary parts in turn
    H: np.ndarray  # (n, n) a of the forces of earlier steps
    back: np.ndarray = field(init=False)
    inverses: dict[float, np.ndarray] = field(init=False, default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "back", self.powers[-2::-1].copy().view(float))

    @classmethod
    def of(cls, E: np.ndarray, W: np.ndarray, c: np.ndarray, S: float) -> "_Together":
        """From the factors E, W, c (m,) of one step."""
        powers = E ** np.arange(TOGETHER + 1)[:, None]
        moved = np.append(0.0, (powers[: TOGETHER - 1] @ (c * W)).real)
        H = toeplitz(moved, np.zeros(TOGETHER))
        return cls(powers, W, S, (c * powers[:-1]).conj().view(float), H)

    def on_piece(self, x: np.ndarray, k: float, F: float) -> tuple[np.ndarray, np.ndarray]:
        """(a, f) of as many steps on f = F - k x; without forces the site would be at ``x``."""
        n, g = len(x), 1 / (1 + self.S * k)
        if k not in self.inverses:
            self.inverses[k] = np.linalg.inv(np.eye(TOGETHER) + g * k * self.H)
        a = self.inverses[k][:n, :n] @ (x + g * F * self.H[:n, :n].sum(axis=1))
        return a, g * (F - k * a)

    def after(self, r: np.ndarray, f: np.ndarray) -> np.ndarray:
        """State (m,) after the forces f of as many steps."""
        pushed = (f @ self.back[TOGETHER - len(f) :]).view(complex)
        return self.powers[len(f)] * r + self.W * pushed


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
