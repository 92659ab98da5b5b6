"""The bands of a case, its held-out sensors, and the effects that are tried."""

from collections.abc import Sequence

import numpy as np

from ..effects.registry import names
from ..ema.setup import Recording
from ..errors import FileError, LabelError, did_you_mean, named
from .key import Band, refuse_beyond
from .request import Stated
from .schema import OnceWords


def covered(
    band: Band | None, key: str, at: str, recordings: Sequence[Recording], notes: list[str]
) -> Band | None:
    """The band, cut to what every FRF holds; refused where less than half of it is there."""
    if band is None:
        return None
    for r in recordings:
        if r.frf is None:
            continue
        f = r.frf.frequency[r.frf.frequency > 0]
        low, high = max(band[0], float(f[0])), min(band[1], float(f[-1]))
        lines = int(np.count_nonzero((low <= f) & (f <= high)))
        if high - low < 0.5 * (band[1] - band[0]) or lines < 2:
            raise FileError(
                f"{at} = [{band[0]:g}, {band[1]:g}] Hz lies outside {r.name}, which "
                f"covers {f[0]:g} to {f[-1]:g} Hz ({lines} lines in common)"
            )
        if (low, high) != band and max(low - band[0], band[1] - high) > 0.02 * (high - low):
            notes.append(f"{key} cut to {low:g}-{high:g} Hz, as in {r.name}")
        band = (low, high)
    return band


def held_out(
    stated: Stated[OnceWords], recordings: Sequence[Recording]
) -> int | tuple[str, ...] | None:
    """Held-out sensors: a number, or their labels."""
    wanted = stated.words.get("held_out_sensors")
    if wanted is None:
        return None
    at = stated.places["held_out_sensors"]
    outputs = next((r.frf.outputs for r in recordings if r.frf is not None), ())
    if not outputs:
        raise FileError(f"{at}: there are no FRFs to hold out")
    if isinstance(wanted, int):
        refuse_beyond(at, wanted, 0, len(outputs) - 1)
        return wanted
    for label in wanted:
        if label not in outputs:
            raise LabelError(f"{at}: no output {label!r}; there are {named(outputs, 8)}")
    if set(wanted) >= set(outputs):
        raise FileError(f"{at} names every output, so none is left to fit")
    return tuple(wanted)


def searched_effects(stated: Stated[OnceWords], notes: list[str]) -> tuple[str, ...]:
    """Names of the effects that a diagnosis tries; empty: all.

    Raises
    ------
    LabelError
        If there is no effect of a name.
    """
    wanted, at = stated.words.get("effects"), stated.places["effects"]
    if wanted is None:
        return ()
    if not wanted:
        raise FileError(f"{at} is empty; leave it out to try all effects")
    there = names()
    for name in wanted:
        if name not in there:
            hint = did_you_mean(name, there)
            raise LabelError(f"{at} names {name!r}; {hint}there are {', '.join(there)}")
    notes.append(f"the case limits the search to {', '.join(wanted)}")
    return tuple(dict.fromkeys(wanted))
