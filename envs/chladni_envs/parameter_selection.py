"""Parameter selection: effects to free in a calibration, judged on held-out data."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np

from chladni.errors import ShapeError
from chladni_planning import Linearised

from . import drawing
from .reset_first import refuse_before_reset
from .sensor_placement import Reset, Step, kept_labels

if TYPE_CHECKING:
    from chladni.case import Case


class ParameterSelectionEnv(gym.Env[np.ndarray, np.int64]):
    """Free parameters one by one, or stop.

    Observation
        (4, p) in [-1, 1]. Row 1: freed or not (0, 1). Row 2: posterior over prior standard
        deviation, once it is freed (1: the data do not inform it). Row 3: share of the fitted
        misfit that freeing it would remove. Row 4: greatest correlation with the freed columns.
    Action
        0 ... p - 1 frees that parameter, p stops. A parameter already free is illegal and changes
        nothing.
    Reward
        Change of the score: log10 Q_nominal/Q_fitted of the **held-out** data (decades gained) less
        ``cost`` times Σ s_k², the effective number of freed parameters that the data do not inform.
        The rewards add up to ``info["score"]``.
    End
        Terminated by stop, or with all freed; truncated after 4 p steps.

    Parameters
    ----------
    problem : Linearised       residuals and sensitivities; by default one is drawn at every reset:
                               p parameters of which one to three are wrong, two of them nearly
                               equal in effect
    case : folder              a case with FRFs: its calibration parameters, linearised at the deck
    effects : bool             for a case, also the effects of the catalogue: every candidate that a
                               diagnosis would try is a choice, at the place and of the size of
                               its best score. ``names`` describes each choice. ``gain(kept)`` is
                               the worth of a set fitted as in a diagnosis: it takes seconds, where
                               a step takes microseconds
    p : int                    parameters of the drawn problems
    cost : float               decades that an uninformed parameter costs
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 2}

    def __init__(
        self,
        problem: Linearised | None = None,
        *,
        case: "str | Path | Case | None" = None,
        effects: bool = False,
        p: int = 8,
        cost: float = 0.2,
        render_mode: str | None = None,
    ) -> None:
        self.names, self.catalogue = tuple[str, ...](), None
        if case is not None:
            from .environment_cases import Recorded

            recorded = Recorded(case)
            problem, self.names = recorded.linearised(effects), recorded.names
            if effects:
                self.catalogue = recorded.catalogue
                self.names += self.catalogue.names
        elif effects:
            raise ShapeError("effects of the catalogue need a case; give case= a folder")
        self.given, self.cost, self.render_mode = problem, cost, render_mode
        self.p = len(problem) if problem is not None else p
        self.own = self.p - (len(self.catalogue.candidates) if self.catalogue else 0)  # ordinary
        self.action_space = gym.spaces.Discrete(self.p + 1)
        self.observation_space = gym.spaces.Box(-1.0, 1.0, (4, self.p), dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Reset:
        """Start without freed parameters; draw a new problem unless one was given."""
        super().reset(seed=seed)
        self.problem = self.given or drawn(self.np_random, self.p)
        J = self.problem.jacobian
        self._unit = J / np.maximum(np.linalg.norm(J, axis=0), 1e-300)
        self.freed, self.steps, self.score, self.over = np.zeros(self.p, bool), 0, 0.0, False
        return self._observation(), self._info()

    def step(self, action: np.int64) -> Step:
        """Free one parameter, or stop."""
        self.steps += 1
        before, legal = self.score, self.action_masks()[action]
        if legal and action < self.p:
            self.freed[action] = True
            self.score = self.score_of(self.freed)
        self.over = bool((legal and action == self.p) or self.freed.all())
        truncated = bool(not self.over and self.steps >= 4 * self.p)
        return self._observation(), self.score - before, self.over, truncated, self._info()

    def action_masks(self) -> np.ndarray:
        """Mask of legal actions (p + 1,) bool, known from the first reset on."""
        refuse_before_reset(self, "over", "action_masks()")
        return np.zeros(self.p + 1, bool) if self.over else np.r_[~self.freed, True]

    def gain(self, kept: np.ndarray) -> float:
        """Joint gain of the effects in a selection in -2 ln evidence, less their price.

        Above 0 a diagnosis would name them all if held-out data had no vote. Calibration parameters
        are free in every such fit.

        Raises
        ------
        ShapeError
            If this environment was not made with ``effects``.
        """
        if self.catalogue is None:
            raise ShapeError(
                "no effect of the catalogue can be fitted here; make it with effects=True"
            )
        return self.catalogue.gain(np.flatnonzero(kept[self.own :]).tolist())

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """Draw estimates of the parameters as bars (height, width, 3) uint8."""
        if self.render_mode != "rgb_array":
            return None
        refuse_before_reset(self, "over", "render()")
        title = f"{int(self.freed.sum())} freed, score {self.score:.2f} decades"
        return drawing.bars(self.problem.fitted(self.freed), self.freed, title)

    def score_of(self, freed: np.ndarray) -> float:
        """Score of any selection (p,) bool: decades gained less the cost of uninformed ones."""
        return self.problem.improvement(freed) - self.cost * self.problem.unlearned(freed)

    def _observation(self) -> np.ndarray:
        problem, freed = self.problem, self.freed
        J = self._unit
        left = problem.residual + problem.jacobian @ problem.fitted(freed)
        out = np.zeros((4, self.p))
        out[0] = freed
        out[1, freed] = problem.posterior(freed)
        out[2] = (J.T @ left) ** 2 / max(float(left @ left), 1e-300)
        out[3] = np.abs(J.T @ J[:, freed]).max(axis=1, initial=0.0)
        return np.clip(out, -1.0, 1.0)

    def _info(self) -> dict[str, Any]:
        return {
            "action_mask": self.action_masks().astype(np.int8),
            "score": float(self.score),
            "kept": self.freed.copy(),
            "labels": kept_labels(self.names, self.freed),
        }


def drawn(rng: np.random.Generator, p: int, m: int = 60) -> Linearised:
    """A problem r = J (θ - θ*) + noise, with one to three θ* several prior sd from the mean."""
    truth = np.zeros(p)
    wrong = rng.permutation(p)[: rng.integers(1, 4)]
    truth[wrong] = rng.choice([-1.0, 1.0], len(wrong)) * rng.uniform(1.5, 3.0, len(wrong))
    scale = np.geomspace(0.02, 2.0, p)[rng.permutation(p)]  # some parameters hardly matter
    J = rng.normal(size=(2 * m, p)) * scale
    twin, other = rng.permutation(p)[:2]
    J[:, twin] = J[:, other] + 0.05 * J[:, twin]
    r = -J @ truth + rng.normal(size=2 * m)
    return Linearised(r[:m], J[:m], r[m:], J[m:])
