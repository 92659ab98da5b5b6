"""``chladni demo``: a case whose answer is sealed; diagnose it, then open the seal."""

import json
from pathlib import Path
from typing import Any

from ..io.package_files import mesh_path
from .diagnose import answer, opened
from .run import Out, started


def run(out: Out = None) -> None:
    """Diagnose the case that ships with chladni, then compare with its sealed truth."""
    source = mesh_path("demo/case.toml").parent
    place = out or Path("runs") / "demo"
    with started("diagnose", source, place) as job:
        d = answer(job, opened(source))
    truth = json.loads(mesh_path("demo.truth.json").read_text(encoding="utf-8"))
    job.say(f"Page: {place / 'report.html'}")
    job.say("The answer is on disk; now the seal is opened.")
    for line in compared(d, truth):
        job.say(line)


def compared(d: dict[str, Any], truth: dict[str, Any]) -> list[str]:
    """Answer and truth side by side."""
    effect = d["effects"][0] if d["effects"] else {"name": d["verdict"], "parameters": []}
    lines = [f"  concealed: {truth['effect']}    found: {effect['name']}"]
    if "point_m" in truth and effect.get("where", {}).get("point_m"):
        a, b = truth["point_m"], effect["where"]["point_m"]
        apart = 1e3 * sum((x - y) ** 2 for x, y in zip(a, b, strict=True)) ** 0.5
        lines.append(f"  place: {apart:.0f} mm from the true one")
    if "value" in truth and effect["parameters"]:
        p = effect["parameters"][0]
        lines.append(
            f"  {p['name']}: true {truth['value']:.4g}, found {p['value']:.4g} {p['unit']} "
            f"({p['low']:.4g} to {p['high']:.4g})"
        )
    held = d["fit"]["held_out"]
    lines.append(
        f"  held-out Q: nominal {held['Q_nominal']:.4f}, calibrated {held['Q_calibrated']:.4f}, "
        f"with the effect {held['Q_with_effect']:.4f}"
    )
    return lines
