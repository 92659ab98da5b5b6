"""``chladni demo``: a case whose answer is sealed; diagnose it, then open the seal."""

import json
from pathlib import Path
from typing import Any

from ..inference.result import NamedEffect
from ..io.package_files import mesh_path
from ..workflows.diagnose import diagnose
from ..workflows.diagnosis_result import DiagnosisResult
from .console import say
from .run import Out, Pictures, diagnosed


def run(pictures: Pictures = False, out: Out = None) -> None:
    """Diagnose the case that ships with chladni, then compare with its sealed truth."""
    source = mesh_path("demo/case.toml").parent
    found = diagnosed("diagnose", source, out or Path("runs") / "demo", diagnose, pictures)
    truth = json.loads(mesh_path("demo.truth.json").read_text(encoding="utf-8"))
    say("The answer is on disk; the concealed effect is now shown.")
    for line in compared(found, truth):
        say(line)


def compared(found: DiagnosisResult, truth: dict[str, Any]) -> list[str]:
    """Answer and truth side by side."""
    effect = found.effects[0] if found.effects else NamedEffect(found.verdict)
    lines = [f"  concealed: {truth['effect']}    found: {effect.name}"]
    if "point_m" in truth and effect.where.point_m:
        pairs = zip(truth["point_m"], effect.where.point_m, strict=True)
        apart = 1e3 * sum((x - y) ** 2 for x, y in pairs) ** 0.5
        lines.append(f"  place: {apart:.0f} mm from the true one")
    if "value" in truth and effect.parameters:
        p = effect.parameters[0]
        lines.append(
            f"  {p.name}: true {truth['value']:.4g}, found {p.value:.4g} {p.unit} "
            f"({p.low:.4g} to {p.high:.4g})"
        )
    if found.agreement is not None:
        q = found.agreement.held_out
        lines.append(
            f"  held-out Q: nominal {q.nominal:.4f}, calibrated {q.calibrated:.4f}, "
            f"with the effect {q.with_effect:.4f}"
        )
    return lines
