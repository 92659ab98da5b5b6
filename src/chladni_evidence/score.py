"""Answers against sealed truths: who was called what, how far off, how much better."""

from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from chladni.updating.result import Agreement, NamedEffect, Scores
from chladni.workflows.diagnosis_result import DiagnosisResult

NULLS = ("nothing", "calibration")
Row = dict[str, Any]


def scored(found: DiagnosisResult, truth: Row) -> Row:
    """One case: what it was called, distance of the place [mm], held-out Q after over before.

    The ratio is that of the decks as written; ``fine`` that on an infinitely fine mesh, by which
    an effect is judged.
    """
    effect = found.effects[0] if found.effects else None
    called = found.verdict if effect is None else effect.name
    place = None
    if effect is not None and "point_m" in truth and effect.where.point_m:
        place = 1e3 * float(np.linalg.norm(np.subtract(effect.where.point_m, truth["point_m"])))
    agreement = found.agreement or Agreement()
    held = agreement.held_out if effect is not None else Scores()
    channel = effect is None or truth.get("channel") in (None, *effect.where.channels)
    covered = (0, 0) if effect is None or called != truth["effect"] else _covered(effect, truth)
    return {
        "specimen": truth["specimen"],
        "seed": truth["seed"],
        "effect": truth["effect"],
        "called": called,
        "right": _right(called, truth["effect"]) and channel,
        "place_mm": place,
        "ratio": _over(held.with_effect, held.calibrated),
        "fine": _over(held.with_mesh_error, held.calibrated_with_mesh_error),
        "gain": agreement.largest_two_log_bayes_factor or 0.0,
        "covered": covered,
    }


def _over(after: float | None, before: float | None) -> float | None:
    return after / before if after is not None and before else None


def _covered(effect: NamedEffect, truth: Row) -> tuple[int, int]:
    """How many intervals hold the truth, of how many whose truth is known."""
    known = truth.get("parameters", {})
    held = [
        p.low <= value <= p.high
        for p in effect.parameters
        if p.low is not None and p.high is not None and (value := known.get(p.name)) is not None
    ]
    return sum(held), len(held)


def _right(called: str, effect: str) -> bool:
    if effect in NULLS:
        return called in ("nothing missing", "calibration only")
    return called == effect


def confusion(rows: Sequence[Row]) -> str:
    """The confusion matrix as text: concealed effects down, names given across."""
    names = sorted({r["effect"] for r in rows})
    given = sorted({r["called"] for r in rows})
    count = Counter((r["effect"], r["called"]) for r in rows)
    wide = max(map(len, names), default=1) + 2
    heads = "".join(f"{k:>6}" for k in range(1, len(given) + 1))
    lines = [f"{'concealed':<{wide}}{heads}"]
    for n in names:
        cells = "".join(f"{count[n, g] or '.':>6}" for g in given)
        lines.append(f"{n:<{wide}}{cells}")
    legend = [f"{k}: {g}" for k, g in enumerate(given, 1)]
    return "\n".join([*lines, "called " + ", ".join(legend)])


def summary(rows: Sequence[Row]) -> str:
    """Rates by effect: right name, place within 60 mm, held-out Q at least halved, intervals."""
    lines = []
    for n in sorted({r["effect"] for r in rows}):
        mine = [r for r in rows if r["effect"] == n]
        right = sum(r["right"] for r in mine)
        text = f"{n}: {right} of {len(mine)} right"
        places = [r["place_mm"] for r in mine if r["right"] and r["place_mm"] is not None]
        if places:
            near = sum(p <= 60 for p in places)
            text += (
                f"; place within 60 mm {near} of {len(places)}, median {np.median(places):.0f} mm"
            )
        ratios = [r["ratio"] for r in mine if r["right"] and r["ratio"] is not None]
        if ratios:
            half = sum(q <= 0.5 for q in ratios)
            text += f"; held-out Q halved {half} of {len(ratios)}"
            text += f", median x {np.median(ratios):.2f}"
        fine = [r["fine"] for r in mine if r["right"] and r.get("fine") is not None]
        if fine:
            half = sum(q <= 0.5 for q in fine)
            text += f"; on a fine mesh halved {half} of {len(fine)}, median x {np.median(fine):.2f}"
        inside, known = (sum(r.get("covered", (0, 0))[k] for r in mine) for k in (0, 1))
        if known:
            text += f"; intervals hold the truth {inside} of {known}"
        lines.append(text)
    return "\n".join(lines)
