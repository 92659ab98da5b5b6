"""A plan as a page: pictures of the layout and of what it sees, tables, sentences."""

from pathlib import Path
from typing import Any

import numpy as np

from ..fem.assemble import Structure
from ..report.blocks import Facts, Items, Picture, Section, Table, Text
from ..report.words import number
from ..view import plots, scene
from ..view.surface import Surface
from .plan import Plan, motion
from .summary import AVERAGES, PER_BANDWIDTH

PICTURES = {
    "sensors.png": "the layout",
    "auto_mac.png": "AutoMAC at the sensors",
    "modes.png": "the modes the sensors see least",
}


def lead(result: dict[str, Any]) -> str:
    """The plan in two sentences."""
    f = [m["frequency_hz"] for m in result["modes"]]
    shake = ", ".join(a["label"] for a in result["actuators_together"])
    unseen = [str(m["mode"]) for m in result["modes"] if not m["seen"]]
    text = (
        f"{len(result['sensors'])} sensors tell {len(f)} modes from {number(f[0])} to "
        f"{number(f[-1])} Hz apart; shake at {shake}."
    )
    return text + (f" Hardly seen: mode {', '.join(unseen)}." if unseen else "")


def notes(found: Plan) -> list[str]:
    """What was decided on the way, and what to mind."""
    refused = [f"{count} grids {why}" for why, count in found.places.refused.items()]
    out = [
        f"{len(found.places)} places were looked at, spread over all flat surfaces that can be "
        f"reached; left out: {', '.join(refused)}."
    ]
    shift = np.abs(found.loaded / found.modal.frequency - 1).max()
    if shift > 0.005:
        out.append(
            f"The sensors' mass moves frequencies by up to {100 * shift:.1f} %: put their mass "
            "into the model before comparing."
        )
    if not found.aimed.all():
        blind = ", ".join(str(found.first + 1 + k) for k in np.flatnonzero(~found.aimed))
        out.append(
            f"No sensor glued flat sees mode {blind}, which moves along the sheets or where no "
            "sensor fits, and no shaker at a normal drives it well; the layout was made for the "
            "others, and a sensor on a block was moved to it where that helps."
        )
    if found.wishes.draws:
        out.append(
            f"The layout serves {found.wishes.draws} models with the thickness of every part drawn "
            f"with a standard deviation of {100 * found.wishes.spread:g} %."
        )
    return out


def sections(
    found: Plan, result: dict[str, Any], seen: Surface, built: Structure, folder: Path
) -> list[Section]:
    """The page; its pictures (:data:`PICTURES`) are written into the folder."""
    return [
        Section("Sensors", _sensors(found, result, seen, folder / "sensors.png")),
        Section("Modes", _modes(found, result, seen, built, folder)),
        Section("Shaker and cords", _shaker(result)),
        Section("Lines and duration", [Text([_test(result["test"])])]),
    ]


def _sensors(
    found: Plan, result: dict[str, Any], seen: Surface, path: Path
) -> list[Picture | Table | Facts | Items]:
    outputs = [_marker(s, str(s["rank"])) for s in result["sensors"]]
    shakers = [_marker(a, "shaker") for a in result["actuators_together"]]
    picture = scene.sensors(path, seen, outputs, shakers)
    rows = [
        (str(s["rank"]), s["label"], str(s["grid"]), _vector(s["direction"]))
        for s in result["sensors"]
    ]
    table = Table(
        ("rank", "label", "grid", "direction"),
        rows,
        words=("label", "direction"),
        caption="The most informative first; the last is the one to give up for something else.",
    )
    moves = [
        f"Mode {m['mode']} was hardly seen ({number(m['before'], 2)} of its largest motion): the "
        f"sensor at {m['given_up']} moves to {m['taken']} ({number(m['after'], 2)})."
        for m in result["moves"]
    ]
    return [
        Picture(picture, "Sensors by rank (blue), shaker (red)."),
        table,
        Facts([(f"log det, {name}", number(value)) for name, value in found.log_det.items()]),
        Items(moves or ["No sensor had to move for a mode to be seen."]),
    ]


def _marker(mount: dict[str, Any], text: str) -> scene.Marker:
    x, y, z = (float(v) for v in mount["point_m"])
    a, b, c = (float(v) for v in mount["direction"])
    return scene.Marker((x, y, z), (a, b, c), text)


def _modes(
    found: Plan, result: dict[str, Any], seen: Surface, built: Structure, folder: Path
) -> list[Table | Picture]:
    shift = found.loaded / found.modal.frequency - 1
    rows = [
        (
            str(m["mode"]),
            number(m["frequency_hz"], 5),
            number(m["visibility"], 2),
            "" if m["seen"] else "hardly",
            f"{100 * shift[k]:.2f} %",
        )
        for k, m in enumerate(result["modes"])
    ]
    table = Table(
        ("mode", "Hz", "visibility", "seen", "shift by sensors"),
        rows,
        words=("seen",),
        caption="Visibility: largest motion a sensor sees over the largest anywhere.",
    )
    sweep = [(str(n), f"{100 * share:.0f} %") for n, share in found.sweep]
    steps = Table(("target modes", "layout kept"), sweep, caption="When more modes are targeted.")
    names = [str(m["mode"]) for m in result["modes"]]
    mac = plots.mac_matrix(folder / "auto_mac.png", found.auto_mac, names, names, "AutoMAC")
    least = _least_seen(found, seen, built, folder / "modes.png")
    return [table, Picture(least, "Those the sensors see least."), Picture(mac), steps]


def _least_seen(found: Plan, seen: Surface, built: Structure, path: Path) -> Path:
    faint = np.sort(np.argsort(found.visible, kind="stable")[:12])
    shown = found.modal.sel(faint)
    numbers = [found.first + 1 + int(k) for k in faint]
    return scene.montage(path, seen, motion(built, shown), shown.frequency, numbers=numbers)


def _shaker(result: dict[str, Any]) -> list[Facts | Table]:
    rows = [
        (
            str(k + 1),
            a["label"],
            str(a["grid"]),
            number(a["condition"]),
            number(a["least_over_mean_residue"], 2),
            "yes" if a["is_sensor"] else "",
        )
        for k, a in enumerate(result["actuators"][:10])
    ]
    s = result["scores"]
    facts = [
        ("Observability", f"rank {s['observability_rank']} of {s['states']}"),
        ("Quotient of the observability gramian", number(s["gramian_quotient"])),
        ("Cords at grids", ", ".join(str(g) for g in result["hangers"])),
    ]
    caption = (
        "Condition: greatest over least Hankel singular value, the lower the better. Least "
        "residue: driving-point residue of the mode driven worst, over the mean."
    )
    columns = ("rank", "label", "grid", "condition", "least residue", "also a sensor")
    return [Facts(facts), Table(columns, rows, words=("label", "also a sensor"), caption=caption)]


def _test(t: dict[str, Any]) -> str:
    low, high = t["band_hz"]
    return (
        f"Stepped sine from {number(low)} to {number(high)} Hz needs {t['lines']} lines "
        f"({number(t['lines_per_octave'], 3)} per octave, {PER_BANDWIDTH} in every half-bandwidth) "
        f"and {number(t['stepped_sine_s'] / 60, 3)} minutes a sweep, waiting up to "
        f"{t['longest_wait_cycles']:.0f} cycles until 1 % of a transient is left. Burst random "
        f"with {AVERAGES} averages of {number(t['burst_random_resolution_hz'], 3)} Hz needs "
        f"{number(t['burst_random_s'] / 60, 3)} minutes."
    )


def _vector(direction: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:.3f}" for x in direction) + ")"
