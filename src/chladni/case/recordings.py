"""The recordings of a case: which one is compared with the model, what of the rest is not used."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..dynamics.frf import FRF
from ..ema.response_correlations import responses
from ..ema.setup import PoleTable, Recording
from ..errors import FileError
from .recording_groups import relation, same_numbers, states
from .request import Stated
from .schema import OnceWords

DEAD = "is zero throughout and left out"  # so ends what is said of a dead channel


def compared_first(stated: Stated[OnceWords], read: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings with the one that is compared in front.

    That is the one ``use`` names; else the first with FRFs, else the first with poles.
    """
    wanted, at = stated.words.get("use"), stated.places["use"]
    ranked = sorted(read, key=lambda r: (r.frf is None, r.poles is None))
    if not wanted:
        return tuple(ranked)
    chosen = [r for r in ranked if wanted in _names(r)]
    if len(chosen) != 1:
        known = ", ".join(dict.fromkeys(n for r in read for n in _names(r))) or "none"
        count = f"{len(chosen)} recordings are" if chosen else "no recording is"
        raise FileError(f"{at} = {wanted!r}: {count} so named; there are {known}")
    first = chosen[0]
    rest = [r for r in ranked if r is not first]
    if first.frf is None and first.poles is None:
        raise FileError(f"{at} = {wanted!r} has neither FRFs nor poles")
    if first.poles is not None and wanted in first.poles.states:
        first = replace(first, poles=_state_first(first.poles, wanted))
    return (first, *rest)


def without_dead_channels(r: Recording) -> Recording:
    """The recording without outputs that are zero throughout, and a note that names them."""
    if r.frf is None:
        return r
    pairs = [(o, bool(r.frf.values[:, k].any())) for k, o in enumerate(r.frf.outputs)]
    if all(lives for _, lives in pairs):
        return r
    dead = ", ".join(o for o, lives in pairs if not lives)
    note = f"{r.name}: {dead} {DEAD}"
    return replace(r, frf=r.frf.sel(outputs=[o for o, lives in pairs if lives]),
                   notes=(*r.notes, note))  # fmt: skip


def _names(r: Recording) -> list[str]:
    """All a recording may be called by."""
    level = "" if r.level is None else f"{r.level:g}"
    states = () if r.poles is None else r.poles.states
    files = [part.partition(", ")[0] for part in r.name.split(" + ")]
    names = (r.name, *files, r.article, level, r.state, *states)
    return [n for n in dict.fromkeys(names) if n]


def _state_first(poles: PoleTable, state: str) -> PoleTable:
    """The poles with those of one state in front."""
    order = np.argsort([s != state for s in poles.state], kind="stable")
    return PoleTable(
        poles.frequency[order],
        poles.frequency_sd[order],
        poles.damping[order],
        poles.mode[order],
        tuple(poles.state[k] for k in order),
    )


def notes_of(recordings: Sequence[Recording], alone: bool = True) -> list[str]:
    """Which recording is compared, what is not, and how far the others are from it.

    Parameters
    ----------
    alone : whether one state alone is asked about
    """
    out = [note for r in recordings for note in r.notes]
    if not recordings:
        return out
    first = recordings[0]
    modal = first.modal is not None
    among = states(recordings) if first.frf is not None or modal else ()
    if len(among) > 1 and not alone:
        out.append(_every_state(among))
    both = [r for r in recordings[1:] if first.frf is not None and r.frf is not None]
    held = [_other(first, r) for r in both if r.state == first.state]
    idle = [_other(first, r) for r in both if alone and r.state != first.state]
    idle += [
        r.name for r in recordings[1:]
        if (first.frf is None or r.frf is None)
        and not (modal and r.modal is not None and r.state != first.state and not alone)
    ]  # fmt: skip
    if held:
        out.append(
            f"{first.name} is compared with the model; the others are held out, and calibrate and "
            f"diagnose score the decks on them: {'; '.join(held)}"
        )
    if idle:
        out.append(f"{first.name} is compared with the model; not used: {'; '.join(idle)}")
    if first.frf is None and first.poles is not None:
        out += _poles(first, alone)
    elif first.level is not None or first.article:
        level = "" if first.level is None else f"level {first.level:g}"
        said = ", ".join(s for s in (first.article and f"article {first.article}", level) if s)
        out.append(f"{first.name} ({said}) is fitted; no quantity scales with level")
    for r in recordings:
        out += _idle(r)
    return out


def _every_state(among: Sequence[str]) -> str:
    """How states are gone about."""
    named = ", ".join(repr(s) for s in among)
    return (
        f"states {named}: calibrate and diagnose use all of them with shared parameters; other "
        "commands use the first ([test] use names another)"
    )


def _other(first: Recording, r: Recording) -> str:
    """Name, relation to the first recording, and difference from it."""
    assert first.frf is not None
    assert r.frf is not None
    away = deviation(first.frf, r.frf)
    far = "at other lines" if away is None else f"{away:.2g} decades rms apart"
    if same_numbers(first.frf, r.frf):
        far = "the same numbers: a copy, or simulated without noise"
    said = [f"state {r.state!r}"] * (r.state != first.state)
    said += [f"article {r.article}"] * (r.article != first.article)
    said += [f"level {r.level:g}"] if r.level is not None and r.level != first.level else []
    if r.mass is not None:
        far += f"; its mass of {r.mass:g} kg is not used"
    return f"{r.name} ({', '.join(said) or relation(first, r)}; {far})"


def deviation(a: FRF, b: FRF) -> float | None:
    """Root mean square of |log10 (H_b / H_a)| over the lines both have; None where none is."""
    _, i, j = np.intersect1d(a.frequency, b.frequency, return_indices=True)
    x, y = np.abs(a.values[i]), np.abs(b.values[j])
    use = (x > 0) & (y > 0)
    if not use.any():
        return None
    return float(np.sqrt(np.mean(np.log10(y[use] / x[use]) ** 2)))


def _poles(r: Recording, alone: bool) -> list[str]:
    """Unused parts of a table of poles."""
    assert r.poles is not None
    out = []
    states = r.poles.states
    if len(states) > 1 and not alone:
        out.append(_every_state(states))
    elif len(states) > 1:
        rest = ", ".join(repr(s) for s in states[1:])
        out.append(
            f"{r.name}: the poles of state {states[0]!r} are compared; not used: {rest} "
            "([test] use names another)"
        )
    if np.isfinite(r.poles.damping).any():
        out.append(f"{r.name}: the damping of the poles is shown; no damping is fitted")
    return out


def _idle(r: Recording) -> list[str]:
    """Contents of a file other than FRFs and poles."""
    out = []
    if r.frf is None and r.poles is None and (used := responses(r.functions)):
        out.append(
            f"{r.name}: {len(used)} records of responses ({used[0].kind}) and no force: "
            "correlate, calibrate and diagnose use their natural frequencies"
        )
    if r.shapes is not None and r.poles is None:
        out.append(f"{r.name}: its {len(r.shapes.frequency)} mode shapes are not used")
    if (modal := r.modal) is not None and r.shapes is not None:
        few, every = (len({d.partition(":")[0] for d in s.dofs}) for s in (modal, r.shapes))
        if few < every:
            out.append(f"{r.name}: shapes are compared at {few} of its {every} nodes")
    return out
