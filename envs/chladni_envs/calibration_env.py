"""Calibration: continuous steps on scaled parameters until model and recording agree."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np

from . import drawing
from .calibration_questions import CalibrationQuestion, plate_question
from .reset_first import refuse_before_reset
from .sensor_placement import Reset, Step

if TYPE_CHECKING:
    from chladni.case import Case

DONE = 1e-5  # Q at which model and recording agree
STRIDE = 0.2  # greatest step, in units in which the bounds are -1 and 1


class CalibrationEnv(gym.Env[np.ndarray, np.ndarray]):
    """Move parameters until Q falls below its limit.

    Observation
        (p + 1 + bands n_out,) in [-1, 1]: the parameters; log10 Q / 5; the mean of
        log10 |H_model / H_recorded| for each band and output.
    Action
        (p,) in [-1, 1]: step of each parameter in units of 0.2 of half its range. The parameters
        stay within their bounds.
    Reward
        log10 Q_before/Q_after, Q = mean |log10(H_model / H_recorded)|² with wrapped phase
        (Echaniz Granado 2015, eq. 4), floored at 1e-12. The rewards add up to
        ``info["score"]``: decades of Q gained.
    End
        Terminated when Q < 1e-5, truncated after ``max_steps``.

    Parameters
    ----------
    question : model and recording; by default a simply supported plate with unknown E, ρ, a mass
               and a spring, the truth drawn at every reset
    case : folder              a case with FRFs: its calibration parameters within two prior
                               standard deviations, its fitted lines and channels, damping equalised
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}

    def __init__(
        self,
        question: CalibrationQuestion | None = None,
        *,
        case: "str | Path | Case | None" = None,
        bands: int = 8,
        max_steps: int = 60,
        render_mode: str | None = None,
    ) -> None:
        if case is not None:
            from .environment_cases import Recorded

            question = Recorded(case).calibration()
        self.question = question or plate_question()
        self.p, self.bands = len(self.question.names), bands
        self.max_steps, self.render_mode = max_steps, render_mode
        n_out = self.question.predict(np.zeros(self.p)).shape[1]
        self._edges = np.linspace(0, len(self.question.frequency), bands + 1).astype(int)
        self.action_space = gym.spaces.Box(-1.0, 1.0, (self.p,), dtype=np.float32)
        size = self.p + 1 + bands * n_out
        self.observation_space = gym.spaces.Box(-1.0, 1.0, (size,), dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Reset:
        """Return to the nominal model; draw a new truth unless a recording was given."""
        super().reset(seed=seed)
        self.x, self.steps = np.zeros(self.p), 0
        if self.question.recorded is None:
            self.recorded = self.question.predict(self.np_random.uniform(-0.8, 0.8, self.p))
        else:
            self.recorded = self.question.recorded
        self._judge()
        self.start = self.Q
        return self._observation(), self._info()

    def step(self, action: np.ndarray) -> Step:
        """Move the parameters."""
        self.steps += 1
        before = self.Q
        self.x = np.clip(self.x + STRIDE * np.clip(np.asarray(action, float), -1, 1), -1, 1)
        self._judge()
        terminated = bool(self.Q < DONE)
        truncated = bool(not terminated and self.steps >= self.max_steps)
        reward = float(np.log10(before / self.Q))
        return self._observation(), reward, terminated, truncated, self._info()

    def deviation(self, x: np.ndarray) -> np.ndarray:
        """Deviation δ = log10(H_model / H_recorded) (n_f, n_out) complex."""
        return np.log(self.question.predict(x) / self.recorded) / np.log(10)

    def _judge(self) -> None:
        """Compute δ at the present x, and Q = mean |δ|², at least 1e-12."""
        self.delta = self.deviation(self.x)
        self.Q = max(float(np.vdot(self.delta, self.delta).real / self.delta.size), 1e-12)

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """Draw recording and model at the first output (height, width, 3) uint8."""
        if self.render_mode != "rgb_array":
            return None
        refuse_before_reset(self, "delta", "render()")
        model = self.recorded * 10**self.delta
        pairs = [(np.abs(self.recorded[:, 0]), "recorded"), (np.abs(model[:, 0]), "model")]
        return drawing.curves(self.question.frequency, pairs, f"Q = {self.Q:.2e}")

    def _observation(self) -> np.ndarray:
        mean = np.add.reduceat(self.delta.real, self._edges[:-1], axis=0)
        mean /= np.diff(self._edges)[:, None]
        out = np.concatenate([self.x, [np.log10(self.Q) / 5], mean.ravel()])
        return np.clip(out, -1.0, 1.0)

    def _info(self) -> dict[str, Any]:
        score = float(np.log10(self.start / self.Q))
        return {"score": score, "Q": self.Q, "x": self.x.copy(), "labels": self.question.names}
