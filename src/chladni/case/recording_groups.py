"""Several recordings of one case: what each says of itself, and which of them are one test.

Recordings of one article, level and state that were driven at different places are one test with
several inputs: their columns are stacked. Driven at the same places they are repeats. Shapes of
one article and state are set-ups of one test.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np

from ..dynamics.frf import FRF
from ..ema.setup import Recording
from ..ema.shape_setups import merged
from ..errors import FileError, ShapeError
from .request import Stated
from .schema import RecordingWords

Relation = Literal["state", "article", "level", "repeat"]
LEAST_SHARED = 0.5  # of the lines of each recording that all must have to be stacked
SAME_LINE = 1e-6  # relative
SAME_NUMBER = 1e-5  # relative: text keeps six digits


def described(
    stated: Sequence[Stated[RecordingWords]], file: str, read: Sequence[Recording]
) -> list[Recording]:
    """The recordings of a file with what its [[recording]] says of them.

    Raises
    ------
    FileError
        If a word of a [[recording]] is said twice, or differently by the file itself.
    """
    found = [s for s in stated if s.words["file"] == file]
    if len(found) > 1:
        raise FileError(f"{found[1].places['file']} = {file!r} is described twice")
    return [_with_stated_words(s, r) for s in found for r in read] if found else list(read)


def _with_stated_words(stated: Stated[RecordingWords], r: Recording) -> Recording:
    words, at = stated.words, stated.places
    article, state = words.get("article") or r.article, words.get("state") or r.state
    level, control = words.get("level"), words.get("control")
    for word, said, own in (("article", article, r.article), ("level", level, r.level)):
        if own not in ("", None) and said not in (None, own):
            raise FileError(f"{at[word]} = {said!r}, but {r.name} states {own!r}")
    level = r.level if level is None else level
    poles, notes = r.poles, r.notes
    if state and poles is not None:
        if any(poles.states):
            raise FileError(f"{at['state']}: {r.name} has its own column state")
        poles = replace(poles, state=(state,) * len(poles.state))
    if control is not None:
        if level is None:
            raise FileError(f"{at['control']} = {control!r}, but {r.name} has no level")
        notes = (*notes, f"{r.name}: the {control} was held at level {level:g}")
    return replace(
        r, article=article, state=state, level=level, mass=words.get("mass"), poles=poles,
        control=control or r.control, notes=notes,
    )  # fmt: skip


def relation(first: Recording, other: Recording) -> Relation:
    """Relation of another recording to the compared one; a missing level counts as equal."""
    if first.state != other.state:
        return "state"
    if first.article != other.article:
        return "article"
    levels = {first.level, other.level} - {None}
    return "level" if len(levels) > 1 else "repeat"


def same_numbers(a: FRF, b: FRF) -> bool:
    """True where both hold the same responses at the same lines, to the digits of a text."""
    if a.values.shape != b.values.shape:
        return False
    lines = np.allclose(a.frequency, b.frequency, rtol=SAME_LINE, atol=0)
    return lines and np.allclose(a.values, b.values, rtol=SAME_NUMBER, atol=0)


def refuse_copies(recordings: Sequence[Recording], where: str) -> None:
    """Refuse a repeat that is no measurement of its own.

    Raises
    ------
    FileError
        Naming both recordings.
    """
    for k, b in enumerate(recordings):
        for a in recordings[:k]:
            if a.frf is None or b.frf is None or relation(a, b) != "repeat":
                continue
            if same_numbers(a.frf, b.frf):
                raise FileError(
                    f"{where}: {b.name} has the same numbers as {a.name}, so it is not a repeat: "
                    "leave one of them out, or name another article, level or state in "
                    "[[recording]]"
                )


def states(recordings: Sequence[Recording]) -> tuple[str, ...]:
    """States of the object in the order of the recordings that are compared."""
    if not recordings:
        return ()
    if recordings[0].modal is not None:
        return tuple(dict.fromkeys(r.state for r in recordings if r.modal is not None))
    if recordings[0].frf is None:
        first = recordings[0].poles
        return ("",) if first is None else first.states
    return tuple(dict.fromkeys(r.state for r in recordings if r.frf is not None))


def of_state(recordings: Sequence[Recording], state: str) -> tuple[Recording, ...]:
    """The recordings of one state."""
    first = recordings[0]
    if first.modal is not None:
        return tuple(r for r in recordings if r.modal is not None and r.state == state)
    if first.frf is None and first.poles is not None:
        return (replace(first, poles=first.poles.of(state)),)
    return tuple(r for r in recordings if r.frf is not None and r.state == state)


def stacked(read: Sequence[Recording]) -> list[Recording]:
    """Recordings of one article, level and state that differ in their inputs, as one each.

    Modal models of one article, level and state are merged.
    """
    out = _of_setups([r for r in read if r.modal is not None])
    for r in (r for r in read if r.modal is None):
        at = next((k for k, other in enumerate(out) if _one_test(other, r)), None)
        if at is None:
            out.append(r)
        else:
            out[at] = _joined(out[at], r)
    return out


def _of_setups(modal: Sequence[Recording]) -> list[Recording]:
    groups: dict[tuple[str, str, float | None], list[Recording]] = {}
    for r in modal:
        groups.setdefault((r.article, r.state, r.level), []).append(r)
    return [group[0] if len(group) == 1 else _merged(group) for group in groups.values()]


def _merged(group: Sequence[Recording]) -> Recording:
    """Shapes of several files as those of one test."""
    first, names = group[0], " + ".join(r.name for r in group)
    try:
        shapes = merged([r.modal for r in group if r.modal is not None])
    except ShapeError as error:
        raise FileError(
            f"{names}: {error}; name several articles or states in [[recording]]"
        ) from error
    poles, least = shapes.poles(), min(len(r.poles.frequency) for r in group if r.poles is not None)
    said = f"{names}: merged as {len(group)} set-ups of one test, {len(poles.frequency)} modes"
    if len(poles.frequency) < least:
        said += "; modes that only some of them show are left out"
    if first.poles is not None:
        poles = replace(poles, state=(first.poles.state[0],) * len(poles.state))
    return replace(
        first, name=names, shapes=shapes, poles=poles,
        nodes={n: x for r in group for n, x in r.nodes.items()},
        axes={n: A for r in group for n, A in r.axes.items()},
        notes=(*(n for r in group for n in r.notes), said),
    )  # fmt: skip


def _one_test(a: Recording, b: Recording) -> bool:
    if a.frf is None or b.frf is None or relation(a, b) != "repeat":
        return False
    apart = not set(a.frf.inputs) & set(b.frf.inputs)
    return apart and a.frf.quantity == b.frf.quantity and bool(_shared(a.frf, b.frf))


def _shared(a: FRF, b: FRF) -> list[str]:
    """Outputs both have, in the order of the first."""
    return [o for o in a.outputs if o in b.outputs]


def _joined(a: Recording, b: Recording) -> Recording:
    """One test with the inputs of both, on the lines and outputs they share."""
    assert a.frf is not None
    assert b.frf is not None
    i, j = _lines(a.frf.frequency, b.frf.frequency)
    most = max(len(a.frf.frequency), len(b.frf.frequency))
    if len(i) < LEAST_SHARED * most:
        raise FileError(
            f"{a.name} and {b.name} drive one article at different places, but only {len(i)} of "
            f"{most} lines are the same: measure them at the same lines, or name them as separate "
            "articles ([[recording]] article)"
        )
    outputs = _shared(a.frf, b.frf)
    left = sorted(set(a.frf.outputs) ^ set(b.frf.outputs))
    inputs = len(a.frf.inputs) + len(b.frf.inputs)
    said = f"{b.name}: stacked with {a.name} as one test with {inputs} inputs"
    if left:
        said += f"; outputs in only one of them are left out: {', '.join(left[:6])}"
    if len(i) < most:
        said += f"; {most - len(i)} lines in only one of them are left out"
    frf = _side_by_side((a.frf, b.frf), (i, j), outputs)
    return replace(
        a, name=f"{a.name} + {b.name}", frf=frf, nodes={**b.nodes, **a.nodes},
        axes={**b.axes, **a.axes}, functions=(*a.functions, *b.functions),
        notes=(*a.notes, *b.notes, said), mass=a.mass or b.mass,
    )  # fmt: skip


def _lines(f: np.ndarray, g: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions of the lines both have."""
    near = np.clip(np.searchsorted(g, f * (1 - SAME_LINE)), 0, len(g) - 1)
    i = np.flatnonzero(np.abs(g[near] - f) <= SAME_LINE * np.maximum(f, 1e-12))
    return i, near[i]


def _side_by_side(frfs: Sequence[FRF], lines: Sequence[np.ndarray], outputs: Sequence[str]) -> FRF:
    """The columns of all on lines of each; variance and coherence where every one has them."""
    chosen = [frf.sel(outputs) for frf in frfs]
    arrays: dict[str, np.ndarray] = {}
    for name in ("values", "variance", "coherence"):
        each = [getattr(frf, name) for frf in chosen]
        if all(a is not None for a in each):
            parts = [a[k] for a, k in zip(each, lines, strict=True)]
            arrays[name] = np.concatenate(parts, axis=2)
    return FRF(
        frequency=chosen[0].frequency[lines[0]], outputs=tuple(outputs),
        inputs=tuple(i for frf in frfs for i in frf.inputs), quantity=chosen[0].quantity, **arrays,
    )  # fmt: skip
