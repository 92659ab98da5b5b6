"""A study of levels in sentences."""

import numpy as np

from .finding import probability
from .level_study import CALM, MEANING, SETTLED_BY, LevelStudy, ModeStudy


def level_notes(study: LevelStudy) -> list[str]:
    """Return a sentence per changing mode, or one that none changes; [] if levels are too few."""
    if not study.modes:
        return []
    said = ", ".join(f"{x:g}" for x in sorted({x for m in study.modes for x in m.mode.level}))
    if study.drift:
        return [
            f"all modes change by one factor from level to level ({said}) and keep their damping: "
            "the article drifted (temperature, mass) and is not nonlinear; to settle it, "
            f"{SETTLED_BY}"
        ]
    moving = [f"nonlinear: {mode_sentence(m)}" for m in study.moving]
    calm = [mode_sentence(m) for m in study.modes if m.signature in ("runs differ", "overlapped")]
    if moving:
        return [*moving, *calm, f"to settle it, {SETTLED_BY}"]
    return [*calm, f"no natural frequency or damping changes with level ({said})"]


def mode_sentence(study: ModeStudy) -> str:
    """Describe the change of a mode over levels, its signature, and the prediction."""
    m = study.mode
    at = f"{m.level[0]:g} to {m.level[-1]:g}"
    what = []
    if m.frequency_moves:
        f = ", ".join(f"{x:.5g}" for x in m.frequency)
        what.append(f"natural frequencies change with level: {f} Hz at level {at} "
                    f"({probability(m.p_frequency)})")  # fmt: skip
    if m.damping_moves:
        z = ", ".join(f"{100 * x:.3g}" for x in m.damping)
        near = "" if m.frequency_moves else f" of {m.frequency[0]:.5g} Hz"
        what.append(
            f"damping{near} changes with level: {z} % at level {at} ({probability(m.p_damping)})"
        )
    return f"{'; '.join(what)}: {study.signature}, {MEANING[study.signature]}{_elements(study)}"


def _elements(study: ModeStudy) -> str:
    """Name the element that fits, its equals, and the prediction of held-out levels."""
    best = study.explained
    if study.signature in CALM:
        return ""
    if not study.fits:
        return "; three levels would show which element causes it"
    if best is None:
        lead = study.fits[0]
        said = f"; no element explains it, {lead.element.name} is closest ({probability(lead.p)})"
    else:
        said = f"; {best.element.name} explains it (p = {best.p:.2g})"
        said += f", not distinguished from {', '.join(study.as_good)}" if study.as_good else ""
    return said + held_out_sentence(study)


def held_out_sentence(study: ModeStudy) -> str:
    """Compare the prediction of held-out levels with that of one linear model."""
    held = study.held_out
    if held is None:
        return ""
    levels = study.mode.level
    seen = np.setdiff1d(np.arange(len(levels)), held.rows)
    f, z, f0, z0 = (100 * x for x in held.misses(study.mode))
    return (
        f"; fitted on levels {', '.join(f'{x:g}' for x in levels[seen])} alone, "
        f"{held.fit.element.name} predicts {', '.join(f'{x:g}' for x in levels[held.rows])} with "
        f"an error of {f:.2g} % in frequency and {z:.2g} % in damping; one linear model has "
        f"{f0:.2g} % and {z0:.2g} %"
    )
