"""Natural frequencies against the level of excitation: those of linear structures stay."""

from collections.abc import Sequence

import numpy as np

from .identification import Identified

PARTNER = 0.05  # of a frequency: farther away is another mode
MOVED = 1e-3, 4.0  # a frequency has moved: by this share of it and this many standard deviations
STANDS_OUT = 3.0  # of χ² a pole must bring, over what it pays, to be followed

Track = list[tuple[float, float, float]]  # (level, frequency, its standard deviation)


def level_notes(levels: Sequence[tuple[float | None, Identified]]) -> list[str]:
    """A sentence on frequencies against level; none where fewer than two levels are known.

    Parameters
    ----------
    levels : of each recording [N] or [m/s²], with its modes; those of the first are followed
    """
    known = sorted(((a, m) for a, m in levels if a is not None), key=lambda pair: pair[0])
    if len({level for level, _ in known}) < 2:
        return []
    first = levels[0][1]
    tracks = [_track(first, int(k), known) for k in np.flatnonzero(_clear(first))]
    moved = [t for t in tracks if len(t) > 1 and _moves(t)]
    said = ", ".join(dict.fromkeys(f"{level:g}" for level, _ in known))
    if not moved:
        return [f"no natural frequency moves with level ({said})"]
    rows = [", ".join(f"{f:.5g} Hz at level {level:g}" for level, f, _ in track) for track in moved]
    return [f"nonlinear: natural frequencies move with level: {'; '.join(rows)}"]


def _clear(found: Identified) -> np.ndarray:
    """Modes that stand out (r,)."""
    return np.asarray(found.inside & (found.relative_delta_chi2 > STANDS_OUT))


def _track(first: Identified, mode: int, known: Sequence[tuple[float, Identified]]) -> Track:
    """A mode of the first recording at every level where it has a partner."""
    f, out = first.frequency[mode], []
    for level, found in known:
        near = np.flatnonzero(_clear(found))
        if not len(near):
            continue
        k = near[np.abs(np.log(found.frequency[near] / f)).argmin()]
        if abs(np.log(found.frequency[k] / f)) < PARTNER:
            out.append((level, float(found.frequency[k]), float(found.frequency_sd[k])))
    return out


def _moves(track: Track) -> bool:
    """Whether the frequencies of a mode differ by more than they are known."""
    (_, f, sd), away = track[0], np.array(track)
    change = np.abs(away[:, 1] - f)
    return bool(np.any(change > np.maximum(MOVED[0] * f, MOVED[1] * np.hypot(away[:, 2], sd))))
