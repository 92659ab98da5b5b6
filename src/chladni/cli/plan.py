"""``chladni plan``: where to put sensors and shakers, and which lines to measure."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ..dynamics.modes import ModalModel, rigid_modes
from ..effects.catalogue import spread
from ..ema import pretest
from ..errors import ModelError
from ..output import write_text
from ..report.blocks import Facts, Picture, Table
from ..report.words import number
from .model import Model, load_model, normals_at
from .run import Out, Run, Units, started

_CREASE = 15.0  # degrees of a fold on which no sensor is glued


@dataclass(frozen=True, eq=False)
class Plan:
    """A layout: candidates, who was chosen in order of worth, and what it is worth."""

    grids: np.ndarray
    normals: np.ndarray
    modal: ModalModel  # elastic modes aimed at
    phi: np.ndarray  # (candidates, modes)
    ranked: np.ndarray
    shakers: pretest.ActuatorRanking
    chosen: np.ndarray  # shakers that work best together
    seen: np.ndarray  # visibility of each mode


def run(
    source: Annotated[Path, typer.Argument(metavar="DECK_or_CASE")],
    modes: Annotated[int, typer.Option(help="Elastic modes to tell apart.", min=1)] = 24,
    sensors: Annotated[int, typer.Option(help="How many sensors.", min=1)] = 30,
    shakers: Annotated[int, typer.Option(help="How many shakers.", min=1)] = 1,
    candidates: Annotated[int, typer.Option(help="Grids to choose from.", min=2)] = 400,
    damping: Annotated[float, typer.Option(help="Expected damping ratio.", min=1e-5)] = 0.01,
    units: Units = None,
    out: Out = None,
) -> None:
    """Sensors by effective independence and exchange, shakers by gramians, lines by bandwidth."""
    with started("plan", source, out) as job:
        job.progress("reading the model", 0.0)
        model = load_model(source, units)
        job.progress("modes", 0.1)
        modal = elastic(model, modes)
        job.progress("candidates", 0.5)
        grids = flat_grids(model, candidates)
        job.progress("layout", 0.6)
        plan = planned(model, modal, grids, sensors, shakers, damping)
        lines = _lines(modal, damping)
        job.json("plan.json", summary(model, plan, lines))
        write_text(job.keep("sensors.csv", "sensors and shakers, for case.toml"), _csv(plan))
        job.progress("pictures", 0.8)
        _page(job, model, plan, lines)


def elastic(model: Model, count: int) -> ModalModel:
    """The lowest elastic modes, up to ``count`` of them."""
    modal = model.modes(count + 6)
    modal = modal.sel(np.flatnonzero(~rigid_modes(modal))[:count])
    if not len(modal):
        raise ModelError("the model has no elastic modes to plan for")
    return modal


def flat_grids(model: Model, count: int) -> np.ndarray:
    """Grids on shells away from edges, folds and where parts meet, spread evenly (k,).

    Raises
    ------
    ModelError
        If no grid is fit for a sensor.
    """
    a = model.assembly
    on_shell = np.unique(a.shells.nodes)
    fit = np.setdiff1d(on_shell, model.seen.outline(_CREASE).ravel())
    fit = fit if len(fit) else on_shell
    if not len(fit):
        raise ModelError(f"{model.source} has no shells, so there is nowhere to glue a sensor")
    return np.asarray(a.ids[fit[spread(a.points[fit], min(count, len(fit)))]])


def planned(
    model: Model, modal: ModalModel, grids: np.ndarray, sensors: int, shakers: int, damping: float
) -> Plan:
    """Effective independence, exchange, then actuators by the Hankel condition number."""
    normals = normals_at(model.assembly, grids)
    phi = np.asarray(model.structure.along(grids, normals) @ modal.shapes)
    kept = pretest.best_layout(phi, sensors)
    order = kept[pretest.deletion(phi[kept], len(kept)).ranked]
    most = np.linalg.norm(model.motion(modal.shapes), axis=1).max(axis=0)
    shaker = pretest.shaking(modal.frequency, damping, phi[order], phi, "accelerance")
    ranking = pretest.ranked_actuators(shaker, modal.frequency, phi)
    together = pretest.best_actuators(shaker, shakers)
    seen = pretest.visibility(phi[order], most)
    return Plan(grids, normals, modal, phi, order, ranking, together, seen)


def summary(model: Model, plan: Plan, lines: np.ndarray) -> dict[str, Any]:
    """What ``plan.json`` holds."""
    E = pretest.independence(plan.phi[plan.ranked])
    auto = pretest.auto_mac(plan.phi[plan.ranked])
    return {
        "sensors": [
            {**_place(model, plan, k), "independence": e}
            for k, e in zip(plan.ranked, E, strict=True)
        ],
        "actuators": [
            {**_place(model, plan, k), "condition": plan.shakers.condition[k]}
            for k in plan.shakers.order[:20]
        ],
        "actuators_together": [_place(model, plan, k) for k in plan.chosen],
        "log_det": pretest.log_det_fisher(plan.phi[plan.ranked]),
        "auto_mac_largest": float((auto - np.eye(len(auto))).max()),
        "modes": {"frequency_hz": plan.modal.frequency, "visibility": plan.seen},
        "lines_hz": lines,
    }


def _place(model: Model, plan: Plan, k: int) -> dict[str, Any]:
    grid = int(plan.grids[k])
    return {
        "label": f"{grid}:n",
        "grid": grid,
        "direction": plan.normals[k],
        "point_m": model.assembly.points[model.assembly.rows([grid])[0]],
    }


def _lines(modal: ModalModel, damping: float) -> np.ndarray:
    f = modal.frequency
    return pretest.lines_for_poles(0.8 * f[0], 1.1 * f[-1], f, np.full(len(f), damping))


def _csv(plan: Plan) -> str:
    outputs = [f"{g}:n,{g},n,output" for g in plan.grids[plan.ranked]]
    inputs = [f"{g}:n,{g},n,input" for g in plan.grids[plan.chosen]]
    return "\n".join(["label,grid,direction,role", *outputs, *inputs, ""])


def _page(job: Run, model: Model, plan: Plan, lines: np.ndarray) -> None:
    from ..view import plots, scene

    auto = pretest.auto_mac(plan.phi[plan.ranked])
    names = [f"{f:.4g}" for f in plan.modal.frequency]
    picture = scene.sensors(
        job.keep("plan.png", "sensors and shakers"),
        model.seen,
        [_marker(model, plan, k) for k in plan.ranked],
        [_marker(model, plan, k) for k in plan.chosen],
    )
    matrix = plots.mac_matrix(
        job.keep("auto_mac.png", "auto-MAC of the layout"), auto, names, names, "Auto-MAC"
    )
    off = float((auto - np.eye(len(auto))).max())
    facts = [
        ("Sensors", str(len(plan.ranked))),
        ("Modes told apart", f"{len(names)}, largest off-diagonal auto-MAC {number(off, 2)}"),
        ("Least visible mode", f"{number(100 * plan.seen.min(), 2)} % of its largest motion"),
        ("Lines to measure", f"{len(lines)}, {number(lines[0])} to {number(lines[-1])} Hz"),
    ]
    rows = [(str(k + 1), f"{g}:n") for k, g in enumerate(plan.grids[plan.ranked])]
    best = [
        (str(k + 1), f"{plan.grids[i]}:n", number(plan.shakers.condition[i], 3))
        for k, i in enumerate(plan.shakers.order[:10])
    ]
    job.section("The layout", [Facts(facts), Picture(picture), Picture(matrix)])
    job.section("Sensors, the most informative first", [Table(("rank", "sensor"), rows)])
    heads = ("rank", "shaker", "condition number")
    job.section("Shakers, each alone", [Table(heads, best, caption="Lower is better.")])
    drive = ", ".join(f"{g}:n" for g in plan.grids[plan.chosen])
    job.lead = f"{len(rows)} sensors for {len(names)} modes; shake at {drive}."
    job.say(job.lead)


def _marker(model: Model, plan: Plan, k: int) -> Any:
    from ..view.scene import Marker

    place = _place(model, plan, k)
    x, n = place["point_m"].tolist(), place["direction"].tolist()
    return Marker((x[0], x[1], x[2]), (n[0], n[1], n[2]), place["label"])
