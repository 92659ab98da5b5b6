"""A layout that changes by one sensor at a time, for searches and environments."""

import numpy as np

from chladni.errors import ShapeError

from .deletion import REFRESH, faint, start, updated
from .information import Candidates, Criterion, changed, combined, value, whitened
from .layout_rules import Rules

FULL_GAIN = 30.0  # growth of log det a row that counts as 1: more than the faint prior's 18.4
INDISPENSABLE = 1 - 1e-9  # independence from which on a deletion loses a mode


class Walk:
    """A set of candidates that shrinks (delete) or grows (add) to ``n_sensors`` under rules.

    Growing starts without sensors, so a faint prior replaces the missing information
    (:func:`chladni_planning.layouts.deletion.faint`).  Shrinking needs none.

    Attributes
    ----------
    kept : (n,) bool
    reachable : (n,) bool   candidates that a complete layout may hold
    worth : (n,)      in [0, 1], for candidates that may move: independence E of the kept
                      (shrinking), growth of log det over ``full`` (growing); 0 for the others
    full : float      30 for each row a candidate adds to the information
    log_det : float   log det F, prior included; with the criterion S the information on the first
                      unknown
    """

    def __init__(
        self, c: Candidates, n_sensors: int, rules: Rules | None, grow: bool,
        criterion: Criterion = "D",
    ) -> None:  # fmt: skip
        if criterion not in ("D", "S") or (criterion == "S" and not grow):
            raise ShapeError(f"a walk by {criterion} is not known; by S sensors are added")
        self.c, self.n_sensors, self.grow, self.criterion = c, n_sensors, grow, criterion
        everyone, self.rules = start(c, n_sensors, rules)
        self.reachable = everyone if not grow else ~self.rules.forbidden
        self.kept = np.zeros(len(c), bool) if grow else everyone.copy()
        self.prior = c.prior + faint(c) if grow else c.prior
        self.full = FULL_GAIN * (min(c.rows.shape[2], c.unknowns) if criterion == "D" else 1)
        self._simple = c.noise is None and c.rows.shape[2] == 1 and criterion == "D"
        if not grow:
            self._Q = np.zeros((len(c.rows), len(c), c.rows.shape[2], c.unknowns))
            self._Q[:, everyone] = whitened(c, np.flatnonzero(everyone))
            F = self._Q.reshape(len(c.rows), -1, c.unknowns)
            self._F0 = np.eye(c.unknowns) - F.mT @ F
        else:
            self._Q, self._F0 = c.rows, np.broadcast_to(self.prior, (len(c.rows), *c.prior.shape))
        self._C: np.ndarray = np.zeros((len(c.rows), c.unknowns, c.unknowns))
        self._E: np.ndarray = np.zeros((len(c.rows), len(c)))
        self.log_det = self.exact()
        self._anew()

    def exact(self) -> float:
        """log det F of the kept, computed without updates."""
        F = self.c.fisher(np.flatnonzero(self.kept)) + (self.prior - self.c.prior)
        return value(self.criterion, F)

    def may(self) -> np.ndarray:
        """Mask of candidates that may move next by the rules, without loss of a mode (n,) bool."""
        if self.grow:
            return self.rules.addable(self.kept, self.n_sensors)
        may = self.kept if self.rules.free else self.rules.deletable(self.kept, self.n_sensors)
        return may & (self.worth < INDISPENSABLE)

    def done(self) -> bool:
        """True where the layout is complete."""
        return bool(self.kept.sum() == self.n_sensors)

    def move(self, i: int) -> float:
        """Move candidate i out or in; return the change of log det F."""
        if self.kept[i] == self.grow:
            raise ShapeError(f"candidate {i} has moved before")
        worth, before = float(self.worth[i]), self.log_det
        self.kept[i] = self.grow
        self._age += 1
        if self.done():
            self.log_det = self.exact()
        else:
            self.log_det += self.full * worth if self.grow else float(np.log1p(-worth))
        if self._simple and self._age < REFRESH and worth < (0.15 if self.grow else 0.99):
            sign = 1 if self.grow else -1
            self._C, self._E = updated(self._Q[:, :, 0], self._C, self._E, i, sign)
            self._judge(self._E)
        else:
            self._anew()
        return self.log_det - before

    def _anew(self) -> None:
        """Compute independence without updates, so that rounding does not accumulate."""
        self._age = 0
        if self.criterion == "S":
            self._judge_growth()
        elif not self._simple:
            self._judge(self._blocks())
        if not self._simple:
            return
        Q, kept = self._Q[:, :, 0], self._Q[:, self.kept, 0]
        self._C = np.linalg.inv(self._F0 + kept.mT @ kept)
        self._E = np.einsum("dip,dip->di", Q @ self._C, Q)
        self._judge(self._E)

    def _judge_growth(self) -> None:
        """Worth of the candidates by the growth of the criterion."""
        at, others = np.flatnonzero(self.kept), np.flatnonzero(~self.kept)
        F, U = self.c.fisher(at) + (self.prior - self.c.prior), self.c.joining(at, others)
        grown = changed(self.criterion, F, U, np.ones(U.shape[2])) - self.log_det
        self.worth = np.zeros(len(self.c))
        self.worth[others] = np.clip(grown / self.full, 0.0, 1.0)

    def _blocks(self) -> np.ndarray:
        """Independence (d, n) of candidates with several readings or correlated noise."""
        at, out = np.flatnonzero(self.kept), np.zeros((len(self.c.rows), len(self.c)))
        if not self.grow:
            Q = whitened(self.c, at)
            out[:, at] = 1 - np.linalg.det(np.eye(Q.shape[2]) - Q @ Q.mT)
            return out
        others = np.flatnonzero(~self.kept)
        C = np.linalg.inv(self.c.fisher(at) + (self.prior - self.c.prior))
        U = self.c.joining(at, others)
        out[:, others] = np.linalg.det(np.eye(U.shape[2]) + U @ C[:, None] @ U.mT) - 1
        return out

    def _judge(self, E: np.ndarray) -> None:
        """Worth of the candidates from q_jᵀ C q_j of every row."""
        if self.grow:
            worth = np.log1p(np.maximum(E, 0.0)).mean(axis=0) / self.full
            self.worth = np.where(self.kept, 0.0, np.minimum(worth, 1.0))
        else:
            worth = combined(np.where(self.kept, E, 0.0))
            self.worth = np.clip(np.where(self.kept, worth, 0.0), 0.0, 1.0)
