"""Structures on which the contract of effects is checked, each with a test and an article."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.modes import rigid_modes
from chladni.effects.calibration_parameters import calibration_parameter, random_field
from chladni.effects.effect import Effect
from chladni.effects.effect_context import Setup, element_grids
from chladni.effects.element_groups import element_groups
from chladni.effects.family import Article, Family
from chladni.effects.identified_damping import IdentifiedDamping
from chladni.effects.joint_stiffness import model_families
from chladni.effects.joints import beads, stiffness
from chladni.effects.rigid_ties import on_firm_springs
from chladni.effects.user_parameters import defaults_of_solids, user_parameter
from chladni.errors import ModelError
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.geometry.refine import refined
from chladni.geometry.sampling import farthest_point_sample
from chladni.inference.hypothesis_fit import HypothesisFit, UpdatingProblem, fitted
from chladni.inference.likelihood import Responses
from chladni.inference.pole_data import Poles
from chladni.model.assembly import Assembly
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import ReducedProblem, reduced_problem
from chladni.search.candidates import UpdatingContext
from chladni_specimens import (
    bushed_plates,
    jointed_plates,
    plate,
    solid_plate,
    tied_plates,
    tube_frame,
)

TOP = 300.0  # Hz; six flexible modes of the generated plates lie below
MODES = 6  # flexible modes that are compared
SENSORS = 6
ABOVE = 1.05  # times the sixth flexible mode of a given deck: highest frequency of interest
CORNERS = (1010, 1070, 1570, 1630, 1250, 1390)  # sensors of a plate of 8 x 6 elements
HELD = (1570, 1100, 1630, 1400, 1250, 1390)  # those of the plate in a clamp


@dataclass(frozen=True, eq=False)
class EffectGround:
    """A deck, what is known of its test, two recordings of it, and an article of a finer mesh."""

    deck: Assembly
    reduced: ReducedProblem
    # by_responses, by_poles: searches with FRFs and with natural frequencies alone
    by_responses: UpdatingContext
    by_poles: UpdatingContext
    article: Article
    flexible: slice  # positions of the flexible modes that are compared


def ground(
    deck: Assembly, fine: Assembly, sensors: Sequence[int], top: float = TOP, rigid: int = MODES
) -> EffectGround:
    """Prepare a structure for the contract.

    Parameters
    ----------
    fine : the article, of another mesh
    sensors : six grids of the deck; the fifth is driven, the second and the fourth hang
    top : highest frequency of interest [Hz]
    rigid : number of modes below those that are compared
    """
    reduced = reduced_problem(on_firm_springs(deck), top)
    flexible = slice(rigid, rigid + MODES)
    hangers = sensors[1], sensors[3]
    shares = tuple(((int(g), 1.0),) for g in sensors)
    x, y, z = reduced.grids.normal[reduced.grids.position(int(sensors[4]))].tolist()
    drive = int(sensors[4]), (x, y, z)
    damping = _damped_at_beads(reduced, flexible)
    setup = Setup(
        shares, hangers, mass_properties(deck)[0], top, ((((drive[0], 1.0),), drive[1]),), damping
    )
    f = reduced.frequency[flexible] * 1.02
    every = np.ones(len(f), bool)
    poles = Poles(f, 1e-3 + 0 * f, every, every + 0.0, (5.0, top))
    return EffectGround(
        deck, reduced,
        _context(reduced, _recorded(reduced, sensors, top), setup, sensors),
        _context(reduced, poles, setup, sensors),
        Article(fine, deck, np.array(sensors), np.array(hangers), np.ones(len(sensors)),
                drive=drive),
        flexible,
    )  # fmt: skip


def _context(
    reduced: ReducedProblem, data: Responses | Poles, setup: Setup, sensors: Sequence[int]
) -> UpdatingContext:
    """A search with E free, and its null."""
    base = (
        _modulus(reduced), *_scatter(reduced),
        *(e for e in model_families(reduced.structure) if "shear" not in e.text),
    )  # fmt: skip
    labels = tuple(f"{g}:+Z" for g in sensors)
    problem = UpdatingProblem(reduced, data, None, base, (), setup, labels)
    fit = fitted(reduced.model, base, data, None, problem.mean())
    return UpdatingContext(problem, HypothesisFit(Effect(), fit, reduced.model))


def _modulus(reduced: ReducedProblem) -> Effect:
    """E of the first part that has groups, or of the solids."""
    if not len(reduced.groups):
        return user_parameter(reduced.groups, defaults_of_solids(reduced.structure.assembly)[0])
    return calibration_parameter(reduced.groups, "E", [int(reduced.groups.part.min())])


def _scatter(reduced: ReducedProblem) -> tuple[Effect, ...]:
    """Scatter of the thickness of sheets by 1 %."""
    return (random_field(reduced.groups, "t", 0.01),) if reduced.groups.sheet.any() else ()


def _recorded(reduced: ReducedProblem, sensors: Sequence[int], top: float) -> Responses:
    """A structure 4 % stiffer than the model, with the third sensor at half its level."""
    rows = reduced.grids.rows[[reduced.grids.position(g) for g in sensors]]
    s = 2 * np.pi * np.linspace(0.1 * top, top, 50) * (0.05 + 1j)
    use = np.ones((50, len(sensors)), bool)
    empty = Responses(np.ones((50, len(sensors), 1), complex), s, rows, rows[[4]], use)
    data = empty.rebased(reduced.model)
    stiffer = evaluate(reduced.model, [_modulus(reduced)], np.array([0.04]))
    gains = np.where(np.arange(len(sensors)) == 2, 0.5, 1.0)[:, None]
    return replace(data, values=data.model(stiffer) * gains)


def _damped_at_beads(reduced: ReducedProblem, flexible: slice) -> IdentifiedDamping:
    """1 % of damping, and more by what the adhesive has of each mode's strain energy."""
    f, phi = reduced.frequency[flexible], reduced.model.basis[:, flexible]
    K = sum(stiffness(reduced.structure, bead) for bead in beads(reduced.structure)[:1])
    energy = np.einsum("nr,nr->r", phi, K @ phi) if sp.issparse(K) else 0 * f
    ratio = 0.01 + 0.1 * energy / f**2 / max((energy / f**2).max(), 1e-300)
    return IdentifiedDamping(f, ratio, np.full(len(f), 0.02))


def plain_plate(times: int = 1) -> Assembly:
    """A free steel plate of 400 x 300 x 1.5 mm of 8 x 6 elements, or more on each side."""
    return spaced(plate(0.4, 0.3, 8 * times, 6 * times, 1.5e-3))


def spaced(made: Assembly) -> Assembly:
    """The structure with ids of grids 1010, 1020, ...: a row of points is never an id."""
    return replace(made, ids=1000 + 10 * made.ids)


def clamped_plate(times: int = 1) -> Assembly:
    """The plate with all of its edge x = 0 held."""
    free = plain_plate(times)
    edge = np.flatnonzero(free.points[:, 0] == 0)
    return replace(free, supports=np.array([(row, c) for row in edge for c in range(1, 7)]))


def _of_plates(deck: Assembly, fine: Assembly) -> EffectGround:
    """Ground on two plates, with sensors on the lower one."""
    deck, fine = spaced(deck), spaced(fine)
    lower = np.unique(deck.shells.nodes[deck.shells.part == 0])
    spread = lower[farthest_point_sample(deck.points[lower], SENSORS)]
    return ground(deck, fine, deck.ids[spread].tolist())


def tubes(times: int = 1) -> Assembly:
    """A free ladder of steel tubes of 700 x 300 mm, its beams 50 mm long or shorter."""
    d = dict(
        length=0.7, width=0.3, height=0.2, bay=0.45, narrow=0.8, rail=0.02, brace=0.016
    ) | {"t rail": 1.5e-3, "t brace": 1.5e-3}  # fmt: skip
    return spaced(tube_frame(d, 0.06 / times))


def block(times: int = 1) -> Assembly:
    """A free steel plate of 400 x 300 x 20 mm of 8 x 6 solids, or more on each side."""
    return spaced(solid_plate(0.4, 0.3, 0.02, 8 * times, 6 * times))


def _without_shells(made: Callable[[int], Assembly], top: float) -> EffectGround:
    """Ground on a structure of beams or solids, with sensors far from each other."""
    deck = made(1)
    spread = deck.ids[farthest_point_sample(deck.points, SENSORS)]
    return ground(deck, made(2), spread.tolist(), top)


GROUNDS: Mapping[str, Callable[[], EffectGround]] = {
    "plate": lambda: ground(plain_plate(), plain_plate(2), CORNERS),
    "clamped plate": lambda: ground(clamped_plate(), clamped_plate(2), HELD),
    "frame": lambda: _without_shells(tubes, 900.0),
    "block": lambda: _without_shells(block, 3000.0),
    "two plates with joints": lambda: _of_plates(jointed_plates(), jointed_plates(0.03)),
    "two plates with joints and a rigid element": lambda: _of_plates(
        tied_plates(), tied_plates(0.03)
    ),
    "two plates on bushes": lambda: _of_plates(bushed_plates(), bushed_plates(2)),
}


def usual_grounds(family: Family) -> tuple[str, ...]:
    """Names of generated structures that may have what a family needs, the most likely first."""
    known = {
        "": "plate", "a shaker": "plate", "supports": "clamped plate", "beams that meet": "frame",
        "solids": "block",
    }  # fmt: skip
    if family.needs in known:
        return (known[family.needs],)
    joined = [name for name in GROUNDS if name.startswith("two plates")]
    rigid = [name for name in joined if "rigid" in name and "rigid" in family.needs]
    return tuple(dict.fromkeys([*rigid, *joined]))


def ground_of(deck: Assembly) -> EffectGround:
    """Ground on a given deck: six sensors far from each other, up to its sixth flexible mode.

    Raises
    ------
    ModelError
        If it has fewer flexible modes, or fewer places for sensors.
    """
    built = structure(deck)
    count = min(2 * MODES + 1, len(built.system.dofs))
    modes = normal_modes(built.system, count)
    rigid = int(rigid_modes(modes).sum())
    if len(modes) < rigid + MODES:
        raise ModelError(
            f"the deck has {len(modes) - rigid} flexible modes; the check of an effect compares "
            f"{MODES}, so give a finer deck"
        )
    top = ABOVE * float(modes.frequency[rigid + MODES - 1])
    grids = element_grids(element_groups(built))
    spread = list(dict.fromkeys(grids.grids[grids.spread(2 * SENSORS)].tolist()))[:SENSORS]
    if len(spread) < SENSORS:
        raise ModelError(
            f"the deck has {len(spread)} grids on shells and beams; the check of an effect "
            f"needs {SENSORS}, so give a finer deck"
        )
    return ground(deck, refined(deck), spread, top, rigid)
