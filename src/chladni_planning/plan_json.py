"""``plan.json``: the summary of a plan as other programs read it."""

from typing import Any

from .plan_summary import PlannedActuator, PlannedSensor, PlanSummary


def plan_json(plan: PlanSummary) -> dict[str, Any]:
    """The contract of ``plan.json``."""
    return {
        "sensors": [_sensor(s) for s in plan.sensors],
        "actuators": [_actuator(a) for a in plan.actuators],
        "actuators_together": [vars(at) for at in plan.actuators_together],
        "hangers": plan.hangers,
        "rattle": vars(plan.rattle),
        "modes": [vars(m) for m in plan.modes],
        "moves": [vars(m) for m in plan.moves],
        "mode_sweep": [{"modes": n, "overlap": share} for n, share in plan.mode_sweep],
        "candidates": {"count": plan.candidates, "refused": plan.refused},
        "scores": vars(plan.scores),
        "test": vars(plan.test),
    }


def _sensor(s: PlannedSensor) -> dict[str, Any]:
    return {"rank": s.rank, **vars(s.at), "for_mode": s.for_mode, "mass_kg": s.mass_kg,
            "cost": s.cost}  # fmt: skip


def _actuator(a: PlannedActuator) -> dict[str, Any]:
    own = {key: value for key, value in vars(a).items() if key != "at"}
    return {**vars(a.at), **own}
