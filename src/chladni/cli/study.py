"""``chladni study``: cases with an effect concealed, all of them, and the confusion matrix."""

import json
from pathlib import Path
from typing import Annotated, Any

import typer
from threadpoolctl import threadpool_limits

from ..errors import ChladniError, LabelError
from ..output import write_json, write_text
from .diagnose import opened
from .run import Out


def run(
    seeds: Annotated[str, typer.Option(help="First and last seed, as 100-109.")] = "100-101",
    effects: Annotated[str, typer.Option(help="Names, with commas; all where empty.")] = "",
    structures: Annotated[str, typer.Option(help="plate, panel.")] = "plate,panel",
    workers: Annotated[int, typer.Option(help="Processes.", min=1)] = 1,
    out: Out = None,
) -> None:
    """Conceal effects, diagnose every case blindly, open the seals, print who was called what."""
    from chladni_evidence.concealed import SPECIMENS, concealable
    from chladni_evidence.score import confusion, summary

    first, _, last = seeds.partition("-")
    if not (first.isdecimal() and (last or first).isdecimal()):
        raise LabelError(f"seeds {seeds!r} are no range; write 100-109")
    known = concealable()
    chosen = [e for e in effects.split(",") if e] or list(known)
    if unknown := sorted(set(chosen) - set(known)):
        raise LabelError(f"no effect {unknown}; there are {', '.join(known)}")
    names = [s for s in structures.split(",") if s]
    if unknown := sorted(set(names) - set(SPECIMENS)):
        raise LabelError(f"no structure {unknown}; there are {', '.join(SPECIMENS)}")
    place = out or Path("runs") / "study"
    jobs = [
        (name, effect, seed, place)
        for seed in range(int(first), int(last or first) + 1)
        for name in names
        for effect in chosen
    ]
    rows = []
    for row in _mapped(jobs, workers):
        rows.append(row)
        typer.echo(_line(row))
        write_json(place / "study.json", rows)
    text = f"{confusion(rows)}\n\n{summary(rows)}"
    write_text(place / "confusion.txt", text + "\n")
    typer.echo(text)


def _mapped(jobs: list[tuple[str, str, int, Path]], workers: int) -> Any:
    if workers == 1:
        yield from map(one, jobs)
        return
    from concurrent.futures import ProcessPoolExecutor

    with ProcessPoolExecutor(workers) as pool:
        yield from pool.map(one, jobs)


def one(job: tuple[str, str, int, Path]) -> dict[str, Any]:
    """Make a case, diagnose its folder on one BLAS thread, then open the seal and score."""
    with threadpool_limits(1):
        return _one(*job)


def _one(name: str, effect: str, seed: int, place: Path) -> dict[str, Any]:
    from chladni_evidence.concealed import SPECIMENS, made, write
    from chladni_evidence.score import scored

    from ..updating.diagnosis import diagnose
    from ..updating.outcome import effect_entry, judged, scores
    from ..updating.preparation import prepare
    from ..workflows.question_of_case import question

    folder = place / "cases" / f"{name}-{EFFECT_CODE.get(effect, effect)}-{seed}"
    seal = place / "sealed" / f"{folder.name}.json"
    write(made(SPECIMENS[name], effect, seed), folder, seal)
    try:
        prepared = prepare(question(opened(folder)))
        found = judged(prepared, diagnose(prepared.search))
    except ChladniError as error:
        answer: dict[str, Any] = {"verdict": f"error: {error}", "effects": [], "held_out": None}
    else:
        fitted, held = scores(prepared, found)
        best = found.found
        answer = {
            "verdict": found.verdict,
            "effects": [] if best is None else [effect_entry(best)],
            "held_out": held.as_dict(),
            "fit": fitted.as_dict(),
            "gain": {t.effect.name: found.gain(t) for t in found.trials},
            "misfit": found.null.fit.misfit,
        }
    write_json(folder / "diagnosis.json", answer)
    return scored(answer, json.loads(seal.read_text(encoding="utf-8")))


EFFECT_CODE = {"nothing": "n", "calibration": "c"}


def _line(row: dict[str, Any]) -> str:
    place = "" if row["place_mm"] is None else f", {row['place_mm']:.0f} mm off"
    ratio = "" if row["ratio"] is None else f", held-out Q x {row['ratio']:.2f}"
    return (
        f"{row['specimen']} {row['seed']}: {row['effect']} -> {row['called']} "
        f"(gain {row['gain']:.0f}{place}{ratio})"
    )
