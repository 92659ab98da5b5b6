"""The next measurement: explanations are open, and measurements are made until one has the odds."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np

from chladni.errors import ShapeError
from chladni.inference.expected_information import Rivals, nothing
from chladni.search.next_measurement import ODDS, Outlook, read_outlook, with_common_candidates

from . import drawing
from .reset_first import refuse_before_reset
from .sensor_placement import Reset, Step
from .small_specimens import tied_plate

if TYPE_CHECKING:
    from chladni.workflows.loaded_model import Model


class NextMeasurementEnv(gym.Env[np.ndarray, np.int64]):
    """Make measurements until one of several tied explanations has the odds.

    The true explanation is drawn from the odds.  The data of a measurement are drawn from its
    prediction; what is not known of the object is drawn once in an episode.

    Observation
        (m + 2 + 3 c,) in [0, 1] for m explanations and c candidates. First the probabilities of the
        explanations, then their entropy over ln m, and the share of the budget that is left. Then
        for each candidate: Σ p_i p_j (1 - e^-B_ij) over pairs of explanations, with the
        Bhattacharyya distance B of their predictions before the episode; its cost over the
        budget; 1 if it was made.
    Action
        Position of a candidate. ``action_masks()`` and ``info["action_mask"]`` give the legal ones:
        not made yet, within the budget. An illegal action changes nothing.
    Reward
        Bits gained, the change of log2 of the probability of the true explanation, less ``price``
        times the cost. The rewards add up to ``info["score"]``.
    End
        Terminated when one explanation has the ``odds``, or no candidate is within the budget.
        Truncated after four times as many steps as there are candidates.

    Parameters
    ----------
    outlook : Outlook or several, or the folder of a diagnosis; a plate by default, on which four
        places of a lump are tied by symmetry. Of several, one is drawn at each reset.
    odds : that settle an explanation
    budget : in units of one more sensor
    price : bits that a unit of cost takes
    without : kinds or dofs that are no candidates; with drive, mass, band and weighing, sensors
        are placed so that they separate the explanations
    case : a deck, a model or a case; with ``effects`` it gives outlooks, as ``chladni next`` does
        before any test
    effects : names of effects, two and more
    words : ``top``, ``articles``, ``seed``, ``units`` as ``before_any_test`` has them; ``sensors``
        may be a number too. ``regions``, ``fixed`` and ``forbidden`` as ``chladni.plan`` has them:
        no candidate is elsewhere.

    ``info`` holds the ``names`` of the explanations and their ``probability``, the ``labels`` of
    the candidates, ``kept``: those that were made, and ``truth``, the position of the true name.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 2}

    def __init__(
        self,
        outlook: "Outlook | Sequence[Outlook] | str | Path | None" = None,
        *,
        odds: float = ODDS,
        budget: float = 6.0,
        price: float = 0.1,
        without: Sequence[str] = (),
        case: "str | Path | Model | None" = None,
        effects: Sequence[str] = (),
        render_mode: str | None = None,
        **words: Any,
    ) -> None:
        every = _outlooks(outlook, case, effects, odds, words)
        self.outlooks = tuple(o.without(without) for o in every)
        first = self.outlooks[0]
        if len(first.names) < 2:
            raise ShapeError("nothing is tied in this outlook; the game needs two explanations")
        self.cost = np.array([c.cost for c in first.candidates])
        self.odds, self.budget, self.price, self.render_mode = odds, budget, price, render_mode
        self._apart = [_apart(o) for o in self.outlooks]
        m, c = len(first.names), len(self.cost)
        self.action_space = gym.spaces.Discrete(c)
        self.observation_space = gym.spaces.Box(0.0, 1.0, (m + 2 + 3 * c,), dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Reset:
        """Draw the truth and the object; nothing is measured yet."""
        super().reset(seed=seed)
        rng = self.np_random
        self.drawn = int(rng.integers(len(self.outlooks)))
        self.outlook = self.outlooks[self.drawn]
        self.probability = self.outlook.rivals.probability.copy()
        self.truth = int(rng.choice(len(self.probability), p=self.probability))
        self.object = rng.standard_normal(self.outlook.seen[0].factors[self.truth].shape[1])
        self.made, self.kept = nothing(self.outlook.seen[0]), np.zeros(len(self.cost), bool)
        self.data, self.spent, self.steps, self.score = np.zeros(0), 0.0, 0, 0.0
        return self._observation(), self._info()

    def step(self, action: np.int64) -> Step:
        """Make one measurement."""
        self.steps += 1
        before = self.score
        if self.action_masks()[action]:
            self._measure(int(action))
        terminated = not self.action_masks().any()
        truncated = not terminated and self.steps >= 4 * len(self.cost)
        return self._observation(), self.score - before, terminated, truncated, self._info()

    def _measure(self, k: int) -> None:
        seen, j = self.outlook.seen[k], self.truth
        noise = self.np_random.standard_normal(seen.mean.shape[1])
        y = seen.mean[j] + seen.factors[j] @ self.object + noise
        self.made, self.data = self.made + seen, np.append(self.data, y)
        before, self.kept[k] = self.probability[j], True
        self.probability = self.outlook.rivals.posterior(self.made, self.data[:, None])[:, 0]
        self.spent += float(self.cost[k])
        bits = np.log2(max(self.probability[j], 1e-300) / before)
        self.score += float(bits - self.price * self.cost[k])

    @property
    def open(self) -> Outlook:
        """The explanations with their present odds, and what candidates would show now."""
        seen = tuple(s.after(self.made, self.data) for s in self.outlook.seen)
        return replace(self.outlook, rivals=Rivals(self.probability), seen=seen)

    def action_masks(self) -> np.ndarray:
        """Mask of legal actions (c,) bool, known from the first reset on."""
        refuse_before_reset(self, "kept", "action_masks()")
        settled = self.probability.max() >= self.odds / (1 + self.odds)
        return ~self.kept & (self.cost <= self.budget - self.spent + 1e-9) & (not settled)

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """Draw the probabilities as bars (height, width, 3) uint8."""
        if self.render_mode != "rgb_array":
            return None
        refuse_before_reset(self, "kept", "render()")
        title = f"{int(self.kept.sum())} measured, score {self.score:.2f} bits"
        best = np.arange(len(self.probability)) == np.argmax(self.probability)
        return drawing.bars(self.probability, best, title)

    def _observation(self) -> np.ndarray:
        p = self.probability
        apart = np.einsum("i,j,cij->c", p, p, self._apart[self.drawn])
        entropy = Rivals(p).entropy / np.log(len(p))
        left = 1 - self.spent / self.budget
        costs = np.minimum(self.cost / self.budget, 1.0)
        return np.clip(np.concatenate([p, [entropy, left], apart, costs, self.kept]), 0.0, 1.0)

    def _info(self) -> dict[str, Any]:
        return {
            "action_mask": self.action_masks().astype(np.int8),
            "score": float(self.score),
            "kept": self.kept.copy(),
            "probability": self.probability.copy(),
            "truth": self.truth,
            "names": self.outlook.names,
            "labels": tuple(f"{c.kind} {c.label}".strip() for c in self.outlook.candidates),
        }


def _outlooks(
    outlook: "Outlook | Sequence[Outlook] | str | Path | None", case: Any, effects: Sequence[str],
    odds: float, words: dict[str, Any],
) -> tuple[Outlook, ...]:  # fmt: skip
    """The outlooks of an environment, with the same candidates."""
    if case is not None:
        from .environment_cases import outlooks

        return outlooks(case, tuple(effects), odds=odds, **words)
    if words or effects:
        raise ShapeError(f"{', '.join([*words, *effects])}: only a case takes these; give case=")
    if outlook is None:
        return (tied_plate(),)
    if isinstance(outlook, str | Path):
        outlook = read_outlook(Path(outlook))
    return (outlook,) if isinstance(outlook, Outlook) else with_common_candidates(outlook)


def _apart(known: Outlook) -> np.ndarray:
    """1 - e^-B of each candidate and pair of explanations (c, m, m).

    B = (μ_i - μ_j)ᵀ S⁻¹ (μ_i - μ_j) / 8 + ln(det S / √(det S_i det S_j)) / 2, S the mean of S_i and
    S_j (Bhattacharyya 1943, Bull. Calcutta Math. Soc. 35, 99-109).
    """
    m = len(known.names)
    out = np.zeros((len(known.seen), m, m))
    for k, seen in enumerate(known.seen):
        S = [np.eye(len(F)) + F @ F.T for F in seen.factors]
        logs = [np.linalg.slogdet(C)[1] for C in S]
        for i in range(m):
            for j in range(i):
                C, d = (S[i] + S[j]) / 2, seen.mean[i] - seen.mean[j]
                B = d @ np.linalg.solve(C, d) / 8
                B += (np.linalg.slogdet(C)[1] - (logs[i] + logs[j]) / 2) / 2
                out[k, i, j] = out[k, j, i] = -np.expm1(-B)
    return out
