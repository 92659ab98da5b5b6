"""Sensor placement: candidates are deleted, or sensors added, one a step."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import gymnasium as gym
import numpy as np

from chladni.errors import LabelError, ShapeError, named
from chladni_planning import Candidates, Rules, Walk, candidates

from . import drawing
from .reset_first import refuse_before_reset
from .small_specimens import ModalSpecimen, plate

if TYPE_CHECKING:
    from chladni.search.next_measurement import Outlook
    from chladni.workflows.given_case import Source

Reset = tuple[np.ndarray, dict[str, Any]]
Step = tuple[np.ndarray, float, bool, bool, dict[str, Any]]


def of_case(
    case: "Source | None",
    modes: int,
    units: str | None,
    places: dict[str, Any],
    usual: ModalSpecimen,
) -> ModalSpecimen:
    """Candidates and target modes of a case folder or deck (see :mod:`.environment_cases`).

    Parameters
    ----------
    places : words on places; None and empty ones are left out
    usual : without a case

    Raises
    ------
    ShapeError
        If there are words on places, but no case.
    """
    words = {name: value for name, value in places.items() if value}
    if case is None:
        if words:
            raise ShapeError(f"{named(words)}: these words name places on a mesh; give case= too")
        return usual
    from .environment_cases import specimen  # the finite element part is loaded only here

    return specimen(case, modes, units=units, **words)


def _of_outlook(
    outlook: "Outlook | Sequence[Outlook] | str | Path",
) -> tuple[Candidates, np.ndarray | None, tuple[str, ...], np.ndarray]:
    """Candidates, places, labels and costs of the sensors of an outlook."""
    from chladni.search.next_measurement import Outlook, read_outlook, with_common_candidates
    from chladni_planning import separating

    known = read_outlook(Path(outlook)) if isinstance(outlook, str | Path) else outlook
    every = with_common_candidates([known] if isinstance(known, Outlook) else known)
    made = separating(every)
    sensors = [c for c in every[0].candidates if c.kind == "sensor"]
    places = [c.point_m for c in sensors if c.point_m is not None]
    points = np.array(places) if len(places) == len(sensors) else None
    return made, points, tuple(c.label for c in sensors), np.array([c.cost for c in sensors])


def kept_labels(labels: tuple[str, ...], kept: np.ndarray) -> tuple[str, ...]:
    """Labels of the kept candidates; their positions from 0 where candidates have no labels."""
    at = np.flatnonzero(kept).tolist()
    return tuple(labels[k] if labels else str(k) for k in at)


def with_notes(info: dict[str, Any], notes: tuple[str, ...]) -> dict[str, Any]:
    """Add the sentences on the deck of an environment to the info of a reset."""
    return {**info, "notes": "; ".join(notes)} if notes else info


class SensorPlacementEnv(gym.Env[np.ndarray, np.int64]):
    """Reach a layout of ``n_sensors`` that distinguishes modes, parameters or explanations.

    Observation
        (n,) in [0, 1]. With moves = "delete" it is the effective independence of the remaining
        candidates. With "add" it is the growth of log det F by each further candidate, over 30. It
        is 0 elsewhere.
    Action
        Position of the candidate to delete (or to add). ``action_masks()`` and
        ``info["action_mask"]`` give the legal ones: rules are obeyed, no mode is lost. An illegal
        action changes nothing.
    Reward
        Change of log det F. The rewards of an episode add up to the score ``info["score"]``: log
        det of the layout less that of the start (all candidates, or the faint prior). Layouts
        compare by ``info["log_det"]``. With costs the information of each place is divided by its
        cost.
    Info
        ``info["labels"]`` names the places kept, as ``info["kept"]`` masks them. ``info["cost"]``
        is the sum of their costs, 1 each by default.
    End
        Terminated with ``n_sensors`` kept (or without a legal action); truncated after four times
        the number of steps needed.

    Parameters
    ----------
    phi : (n, p), (n_draws, n, p), (n_draws, n, k, p) or Candidates
        Target shapes, see :func:`chladni_planning.candidates`; a plate by default.
    n_sensors : int               by default five for four modes
    moves : "delete" or "add"
    points : (n, 2) or (n, 3)     places [m], for pictures
    labels : n texts              of the candidates; those of a case are known
    noise, prior, rules : as in :func:`chladni_planning.effective_independence`
    unusable : float              share of candidates that are unusable, drawn at each reset
    case : folder, deck or model  its mesh gives candidates and modes (phi is then None)
    modes : int                   number of target modes of a case
    outlook : Outlook or several, or the folder of a diagnosis; its sensors are candidates, and the
                                  layout separates the tied explanations. ``log_det`` is then
                                  ln(1 + d²), the mean over pairs of explanations, with their
                                  distance d in units of all that is not known; sensors are added
    units : str                   unit system of a bare deck, as mm-t-s; a case states its own.
                                  Where it is missing, the materials show it, and ``notes`` and the
                                  info of a reset name it.
    regions, fixed, forbidden, cost : places of a case, in the words of ``chladni.plan``; without
                                  them those of [plan] of the case

    A frame of ``render_mode="rgb_array"`` is 256 pixels high and 320 wide.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 4}

    def __init__(
        self,
        phi: np.ndarray | Candidates | None = None,
        n_sensors: int | None = None,
        *,
        moves: Literal["delete", "add"] = "delete",
        points: np.ndarray | None = None,
        labels: tuple[str, ...] = (),
        noise: np.ndarray | None = None,
        prior: np.ndarray | None = None,
        rules: Rules | None = None,
        unusable: float = 0.0,
        case: "Source | None" = None,
        outlook: "Outlook | Sequence[Outlook] | str | Path | None" = None,
        modes: int = 24,
        units: str | None = None,
        regions: Sequence[str] = (),
        fixed: Sequence[str] = (),
        forbidden: Sequence[str] = (),
        cost: Sequence[str] | Mapping[str, float] = (),
        render_mode: str | None = None,
    ) -> None:
        self.outline: np.ndarray | None = None
        self.notes: tuple[str, ...] = ()
        self.criterion: Literal["D", "S"] = "D" if outlook is None else "S"
        price: np.ndarray | None = None
        if outlook is not None:
            moves, (phi, points, labels, price) = "add", _of_outlook(outlook)
        places = {"regions": regions, "fixed": fixed, "forbidden": forbidden, "cost": cost}
        specimen = of_case(case, modes, units, places, plate())
        price = specimen.cost if phi is None else price
        rules = rules or Rules()
        if phi is None:
            phi, points, self.outline = specimen.phi, specimen.points, specimen.outline
            self.notes, labels = specimen.notes, labels or specimen.labels
            if specimen.fixed is not None:
                rules = replace(rules, fixed=rules.masks(len(phi))[0] | specimen.fixed)
        self.labels = tuple(labels)
        self.candidates = candidates(phi, noise, prior)
        n = len(self.candidates)
        self.cost = np.ones(n)
        if price is not None:
            rows = self.candidates.rows / np.sqrt(price)[:, None, None]
            self.cost, self.candidates = price, replace(self.candidates, rows=rows)
        if self.labels and len(self.labels) != n:
            raise LabelError(f"{len(self.labels)} labels were given for {n} candidates")
        usual = min(n, -(-5 * self.candidates.unknowns // 4)) if outlook is None else min(n, 3)
        self.n_sensors = usual if n_sensors is None else n_sensors
        if moves not in ("delete", "add"):
            raise LabelError(f"moves {moves!r}; there are delete and add")
        self.grow, self.rules, self.unusable = moves == "add", rules, unusable
        self.points, self.render_mode = points, render_mode
        self.walk = self._walk(np.zeros(n, bool))  # an impossible request raises here
        self.action_space = gym.spaces.Discrete(n)
        self.observation_space = gym.spaces.Box(0.0, 1.0, (n,), dtype=np.float64)

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Reset:
        """Start from all candidates, or from none."""
        super().reset(seed=seed)
        n = len(self.candidates)
        broken = np.zeros(n, bool)
        if self.unusable:
            broken[self.np_random.permutation(n)[: int(self.unusable * n)]] = True
            broken &= ~self.rules.masks(n)[0]
        self.walk = self._walk(broken)
        self.start, self.steps = self.walk.log_det, 0
        self.needed = abs(int(self.walk.kept.sum()) - self.n_sensors)
        return self.walk.worth.copy(), with_notes(self._info(), self.notes)

    def step(self, action: np.int64) -> Step:
        """Delete, or add, one candidate."""
        self.steps += 1
        legal = bool(self.mask[action])
        reward = self.walk.move(int(action)) if legal else 0.0
        info = self._info()
        terminated = self.walk.done() or not self.mask.any()
        truncated = not terminated and self.steps >= 4 * self.needed
        return self.walk.worth.copy(), float(reward), bool(terminated), bool(truncated), info

    def action_masks(self) -> np.ndarray:
        """Mask of legal actions (n,) bool, known from the first reset on."""
        refuse_before_reset(self, "mask", "action_masks()")
        return self.mask.copy()

    def render(self) -> np.ndarray | None:  # type: ignore[override]
        """Draw the layout as a picture (height, width, 3) uint8."""
        if self.render_mode != "rgb_array":
            return None
        refuse_before_reset(self, "mask", "render()")
        xy, lines = drawing.places(len(self.candidates), self.points, self.outline)
        title = f"{int(self.walk.kept.sum())} sensors, log det {self.walk.log_det:.2f}"
        return drawing.layout(xy, self.walk.kept, self.mask, title, lines)

    def _walk(self, broken: np.ndarray) -> Walk:
        rules = self.rules
        if broken.any():
            rules = replace(rules, forbidden=rules.masks(len(broken))[1] | broken)
        return Walk(self.candidates, self.n_sensors, rules, self.grow, self.criterion)

    def _info(self) -> dict[str, Any]:
        self.mask = np.zeros(len(self.candidates), bool) if self.walk.done() else self.walk.may()
        return {
            "action_mask": self.mask.astype(np.int8),
            "log_det": float(self.walk.log_det),
            "score": float(self.walk.log_det - self.start),
            "kept": self.walk.kept.copy(),
            "cost": float(self.cost[self.walk.kept].sum()),
            "labels": kept_labels(self.labels, self.walk.kept),
        }
