"""A plan as plain data: ``plan.json`` (DESIGN §7), the table of sensors, lines and duration."""

import csv
from io import StringIO
from typing import Any

import numpy as np

from .layouts.information import candidates, value
from .measurement_lines import (
    burst_random_time,
    delay_at,
    even_lines,
    half_bandwidth,
    lines_per_bandwidth,
    lines_time,
)
from .whole_plan import Plan

PER_BANDWIDTH = (
    4  # lines in every half-bandwidth; three are enough, Echaniz Granado 2015, section 5.2
)
AVERAGES = 20
SHOWN = 20  # actuators listed


def summary(found: Plan) -> dict[str, Any]:
    """Ordered sensors, ranked actuators, modes, scores."""
    return {
        "sensors": _sensors(found),
        "actuators": [_actuator(found, int(i)) for i in found.actuators.order[:SHOWN]],
        "actuators_together": [_mount(found, int(i)) for i in found.together],
        "hangers": found.hangers,
        "rattle": _rattle(found),
        "modes": _modes(found),
        "moves": [
            {
                "mode": found.first + 1 + m.mode,
                "given_up": found.mounts.labels[m.out],
                "taken": found.mounts.labels[m.into],
                "before": m.before,
                "after": m.after,
            }
            for m in found.moves
        ],
        "mode_sweep": [{"modes": n, "overlap": share} for n, share in found.sweep],
        "candidates": {"count": len(found.places), "refused": dict(found.places.refused)},
        "scores": _scores(found),
        "test": durations(found),
    }


def _mount(found: Plan, i: int) -> dict[str, Any]:
    """What is known of one place and direction."""
    m = found.mounts
    return {
        "label": m.labels[i],
        "grid": int(m.ids[i]) if found.places.is_grid[m.place[i]] else None,
        "direction": m.directions[i],
        "point_m": m.points[i],
        "mounted": "flat" if m.normal[i] else "on a block",
        "side": int(m.side[i]),
    }


def _sensors(found: Plan) -> list[dict[str, Any]]:
    moved = {m.into: found.first + 1 + m.mode for m in found.moves}
    return [
        {"rank": k + 1, **_mount(found, i), "for_mode": moved.get(i)}
        for k, i in enumerate(found.layout.tolist())
    ]


def _actuator(found: Plan, i: int) -> dict[str, Any]:
    place = int(found.rattle.place[i])
    return {
        **_mount(found, i),
        "condition": found.actuators.condition[i],
        "least_over_mean_residue": found.actuators.residue[i],
        "straight_way_to_it": bool(found.places.straight[found.mounts.place[i]]),
        "rattles_from_n": None if place < 0 else found.rattle.force[i],
        "rattles_between": None if place < 0 else found.openings.pairs[found.openings.pair[place]],
        "rattles_in_mode": None if place < 0 else found.first + 1 + int(found.rattle.mode[i]),
        "vetoed": not bool(found.actuators.allowed[i]),
        "is_sensor": bool(i in found.layout),
    }


def _rattle(found: Plan) -> dict[str, Any]:
    """What the mesh says of clearances, whichever place is shaken."""
    return {
        "force_n": found.settings.force,
        "places_vetoed": int((found.rattle.force < found.settings.force).sum()),
        "without_a_straight_way": int((~found.places.straight).sum()),
        "open_places": len(found.openings.clearance),
        "least_clearance_m": float(found.openings.clearance.min(initial=np.inf))
        if len(found.openings.clearance)
        else None,
        "touching_pairs": [list(pair) for pair in found.openings.touching],
    }


def _modes(found: Plan) -> list[dict[str, Any]]:
    return [
        {
            "mode": found.first + 1 + k,
            "frequency_hz": f,
            "visibility": found.visible[k],
            "visibility_before": found.visible_before[k],
            "seen_by_normals": bool(found.aimed[k]),
            "seen": bool(found.visible[k] >= found.settings.floor),
            "with_sensor_mass_hz": found.loaded[k],
        }
        for k, f in enumerate(found.modal.frequency)
    ]


def _scores(found: Plan) -> dict[str, Any]:
    kept = candidates(found.phi).fisher(found.layout)
    return {
        "log_det": value("D", kept),
        "log_det_by_method": found.log_det,
        "auto_mac_highest": float((found.auto_mac - np.eye(len(found.modal))).max(initial=0.0)),
        "observability_rank": found.observable[0],
        "states": found.observable[1],
        "gramian_quotient": found.quotient,
    }


def durations(found: Plan) -> dict[str, Any]:
    """Lines and time of a stepped-sine sweep and of burst random."""
    f, zeta = found.modal.frequency, found.modal.damping
    low, high = 0.7 * f[0], 1.05 * f[-1]
    lines = even_lines(low, high, float(zeta.min()), PER_BANDWIDTH)
    wait = delay_at(lines, f, zeta)
    resolution = float(half_bandwidth(f[0], zeta[0]) / PER_BANDWIDTH)
    return {
        "band_hz": [low, high],
        "lines": len(lines),
        "lines_hz": lines,
        "lines_per_octave": float(np.log(2) / np.log(lines[1] / lines[0])),
        "lines_per_half_bandwidth": lines_per_bandwidth(lines, f, zeta),
        "stepped_sine_s": lines_time(lines, wait),
        "longest_wait_cycles": float(wait.max()),
        "burst_random_s": burst_random_time(resolution, AVERAGES),
        "burst_random_resolution_hz": resolution,
    }


def sensors_csv(found: Plan) -> str:
    """The table a case reads: sensors in order of rank, then the shakers.

    A place that is no grid is given by x, y, z [m]; its label is a number no grid has.
    """
    text = StringIO()
    write = csv.writer(text, lineterminator="\n").writerow
    write(["label", "grid", "x", "y", "z", "nx", "ny", "nz", "role", "mass"])
    rows = [(int(i), "output", found.settings.mass) for i in found.layout]
    for i, role, mass in [*rows, *((int(i), "input", 0.0) for i in found.together)]:
        m = _mount(found, i)
        place = [""] * 3 if m["grid"] is not None else [f"{x:.7g}" for x in m["point_m"]]
        direction = [f"{x:.9g}" for x in m["direction"]]
        write([m["label"], m["grid"], *place, *direction, role, f"{mass:g}"])
    return text.getvalue()
