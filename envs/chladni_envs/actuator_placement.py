"""Actuator placement: shakers are chosen one a step; places that would rattle are vetoed."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gymnasium as gym
import numpy as np

from chladni.dynamics.frf import Quantity
from chladni.errors import ShapeError
from chladni_planning import Rules, best_layout, rattle_margin, shaking

from . import drawing
from .reset_first import refuse_before_reset
from .sensor_placement import Reset, Step, kept_labels, of_case, with_notes
from .small_specimens import ModalSpecimen, plate

if TYPE_CHECKING:
    from chladni.workflows.given_case import Source

WORST = 1e6  # limit of the condition number: places beyond it are equally useless


class ActuatorPlacementEnv(gym.Env[np.ndarray, np.int64]):
    """Choose ``n_actuators`` shaker places so that all modes are driven about equally.

    Observation
        (n,) in [0, 1]: least over greatest Hankel value with the candidate added to the chosen ones
        and modes taken one by one (Gregory 1984). It is 0 for illegal candidates.
    Action
        Position of the next actuator. ``action_masks()`` and ``info["action_mask"]`` give the legal
        ones: not chosen yet, accessible, without rattle. An illegal action changes nothing.
    Reward
        Change of -log10 κ, with κ the condition number of the Hankel values (Echaniz Granado 2015,
        table 2), limited to 1e6; at the first step -log10 κ itself. The rewards add up to
        ``info["score"]`` = -log10 κ.
    Info
        ``info["labels"]`` names the chosen places.
    End
        Terminated with ``n_actuators`` chosen, truncated after four times as many steps.

    Parameters
    ----------
    specimen : modes at the candidates; a plate by default
    n_actuators : int
    sensors : (m,) int        positions of the sensors among the candidates; EFI by default
    access : (n,) bool        True where a shaker can be mounted
    gap_shapes : (g, r)       relative motion across each gap [1/√kg]
    clearance : (g,)          [m]; access and gaps are found on the mesh of a case
    force : amplitude for which nothing may rattle [N]
    quantity : quantity that the sensors measure
    case : folder, deck or model  its mesh gives candidates and modes
    modes : int               number of target modes of a case
    units : str               unit system of a bare deck, as mm-t-s; a case states its own. Where it
                              is missing, the materials show it, and ``notes`` and the info of a
                              reset name it.
    regions, fixed, forbidden : places of a case, in the words of ``chladni.plan``; without them
                              those of [plan] of the case. Fixed ones are sensors.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 2}

    def __init__(
        self,
        specimen: ModalSpecimen | None = None,
        n_actuators: int = 2,
        *,
        sensors: np.ndarray | None = None,
        access: np.ndarray | None = None,
        gap_shapes: np.ndarray | None = None,
        clearance: np.ndarray | None = None,
        force: float = 1.0,
        quantity: Quantity = "receptance",
        case: "Source | None" = None,
        modes: int = 24,
        units: str | None = None,
        regions: Sequence[str] = (),
        fixed: Sequence[str] = (),
        forbidden: Sequence[str] = (),
        render_mode: str | None = None,
    ) -> None:
        if specimen is None:
            places = {"regions": regions, "fixed": fixed, "forbidden": forbidden}
            specimen = of_case(case, modes, units, places, plate(7, 7, 6))
        s = self.specimen = specimen
        self.notes = s.notes
        n, r = s.phi.shape
        access = s.access if access is None else access
        if gap_shapes is None and clearance is None:
            gap_shapes, clearance = s.gap_shapes, s.clearance
        if sensors is None:
            held = np.zeros(n, bool) if s.fixed is None else s.fixed
            count = max(min(n, r + 2), int(held.sum()))
            sensors = best_layout(s.phi, count, rules=Rules(fixed=held))
        at = np.asarray(sensors)
        self.shaker = shaking(s.frequency, s.damping, s.phi[at], s.phi, quantity)
        self.allowed = np.ones(n, bool) if access is None else np.asarray(access, bool).copy()
        self.margin = np.full(n, np.inf)
        if gap_shapes is not None and clearance is not None:
            self.margin = rattle_margin(s.frequency, s.damping, s.phi, gap_shapes, clearance, force)
            self.allowed &= self.margin >= 1
        if self.allowed.sum() < n_actuators:
            raise ShapeError(
                f"{n_actuators} actuators were requested; access and rattle leave "
                f"{self.allowed.sum()} of {n} candidates"
            )
        seen = np.sqrt(np.diag(self.shaker.observed)[::2])
        self._drive = np.diagonal(self.shaker.each, axis1=1, axis2=2)[:, ::2] * seen**2
        self.n_actuators, self.render_mode = n_actuators, render_mode
        self.action_space = gym.spaces.Discrete(n)
        self.observation_space = gym.spaces.Box(0.0, 1.0, (n,), dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Reset:
        """Start without actuators."""
        super().reset(seed=seed)
        self.chosen, self.steps, self.score = np.zeros(len(self.allowed), bool), 0, 0.0
        return self._observation(), with_notes(self._info(), self.notes)

    def step(self, action: np.int64) -> Step:
        """Choose one more actuator."""
        self.steps += 1
        before = self.score
        if self.action_masks()[action]:
            self.chosen[action] = True
            kappa = self.shaker.condition(np.flatnonzero(self.chosen))
            self.score = -float(np.log10(min(kappa, WORST)))
        terminated = bool(self.chosen.sum() == self.n_actuators)
        truncated = bool(not terminated and self.steps >= 4 * self.n_actuators)
        return self._observation(), self.score - before, terminated, truncated, self._info()

    def action_masks(self) -> np.ndarray:
        """Mask of legal actions (n,) bool, known from the first reset on."""
        refuse_before_reset(self, "chosen", "action_masks()")
        if self.chosen.sum() == self.n_actuators:
            return np.zeros_like(self.allowed)
        return self.allowed & ~self.chosen

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """Draw the places as a picture (height, width, 3) uint8."""
        if self.render_mode != "rgb_array":
            return None
        refuse_before_reset(self, "chosen", "render()")
        s = self.specimen
        xy, lines = drawing.places(len(self.allowed), s.points, s.outline)
        title = f"{int(self.chosen.sum())} actuators, condition {10**-self.score:.1f}"
        return drawing.layout(xy, self.chosen, self.action_masks(), title, lines)

    def _observation(self) -> np.ndarray:
        """Ratio σ_min/σ_max of each candidate with the chosen ones, σ² = diag W_c diag W_o."""
        squares = self._drive + self._drive[self.chosen].sum(axis=0)
        with np.errstate(invalid="ignore"):
            ratio = np.sqrt(squares.min(axis=1) / squares.max(axis=1))
        return np.where(self.action_masks(), np.nan_to_num(ratio), 0.0)

    def _info(self) -> dict[str, Any]:
        return {
            "action_mask": self.action_masks().astype(np.int8),
            "score": float(self.score),
            "condition": float(10**-self.score),
            "kept": self.chosen.copy(),
            "labels": kept_labels(self.specimen.labels, self.chosen),
        }
