"""``chladni demo``: an effect is concealed in a recording, and found."""

import json
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated, Any

import typer

from ..errors import LabelError
from ..output import write_json
from ..progress import within
from .correlate import opened
from .diagnose import diagnosed
from .run import Out, started


def run(
    effect: Annotated[str, typer.Option(help="What is concealed.")] = "point-mass",
    specimen: Annotated[str, typer.Option(help="plate or panel.")] = "plate",
    seed: Annotated[int, typer.Option(help="Of the draw.")] = 1,
    out: Out = None,
) -> int:
    """Conceal an effect in a noisy recording, diagnose it blind, then compare with the truth."""
    from ..study.concealed import EFFECTS, SPECIMENS, conceal

    if specimen not in SPECIMENS or effect not in EFFECTS:
        raise LabelError(
            f"no specimen {specimen!r} or effect {effect!r}; there are {', '.join(SPECIMENS)} "
            f"and {', '.join(EFFECTS)}"
        )
    with (
        started("demo", Path("demo"), out or Path("runs/demo")) as job,
        TemporaryDirectory() as box,
    ):
        sealed = Path(box) / "truth.json"
        job.progress(f"concealing an effect in a {specimen}", 0.0)
        conceal(SPECIMENS[specimen], effect, seed, job.folder / "case", sealed)
        case, model = opened(job.folder / "case")
        later = replace(job, progress=within(job.progress, 0.1, 1.0))
        code = diagnosed(later, case, model)  # the truth is opened only after the answer is written
        truth: dict[str, Any] = json.loads(sealed.read_text(encoding="utf-8"))
        write_json(job.folder / "truth.json", truth)
        job.say(f"concealed was: {truth['effect']} ({_values(truth)})")
        return code


def _values(truth: dict[str, Any]) -> str:
    left_out = ("effect", "seed", "specimen")
    return ", ".join(f"{k} {v}" for k, v in truth.items() if k not in left_out and v is not None)
