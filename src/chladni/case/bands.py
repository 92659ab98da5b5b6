"""The bands of a case, its held-out sensors, and the effects that are tried."""

from collections.abc import Sequence

import numpy as np

from ..effects.registry import names
from ..ema.setup import Recording
from ..errors import FileError, LabelError, did_you_mean, named
from .schema import known
from .toml_sections import KeyFile, TomlSection


def bands(
    keys: KeyFile, recordings: Sequence[Recording], notes: list[str]
) -> tuple[tuple[float, float] | None, tuple[tuple[float, float], ...]]:
    """The band to fit, cut to what every FRF holds, and the bands left out [Hz]."""
    section = keys.section("band", known("band"))
    band = section.band("fit")
    if band is not None:
        band = _inside(section, "fit", band, recordings, notes)
    return band, section.bands("exclude")


def _inside(
    section: TomlSection,
    key: str,
    band: tuple[float, float],
    recordings: Sequence[Recording],
    notes: list[str],
) -> tuple[float, float]:
    """The band, cut to what every FRF holds; refused where less than half of it is there."""
    for r in recordings:
        if r.frf is None:
            continue
        f = r.frf.frequency[r.frf.frequency > 0]
        low, high = max(band[0], float(f[0])), min(band[1], float(f[-1]))
        lines = int(np.count_nonzero((low <= f) & (f <= high)))
        if high - low < 0.5 * (band[1] - band[0]) or lines < 2:
            raise FileError(
                f"{section.at(key)} = [{band[0]:g}, {band[1]:g}] Hz lies outside {r.name}, which "
                f"covers {f[0]:g} to {f[-1]:g} Hz ({lines} lines in common)"
            )
        if (low, high) != band and max(low - band[0], band[1] - high) > 0.02 * (high - low):
            notes.append(f"[{section.name}] {key} cut to {low:g}-{high:g} Hz, as in {r.name}")
        band = (low, high)
    return band


def held_out(
    keys: KeyFile, recordings: Sequence[Recording], notes: list[str]
) -> tuple[int | tuple[str, ...] | None, tuple[float, float] | None]:
    """Held-out sensors (a number, or their labels) and band."""
    section = keys.section("held_out", known("held_out"))
    band = section.band("band")
    if band is not None:
        band = _inside(section, "band", band, recordings, notes)
    value = section.values.get("sensors")
    outputs = next((r.frf.outputs for r in recordings if r.frf is not None), ())
    if value is None:
        return None, band
    if not outputs:
        raise FileError(f"{section.at('sensors')}: there are no FRFs to hold out")
    if isinstance(value, list):
        labels = section.list("sensors", str) or []
        for label in labels:
            if label not in outputs:
                raise LabelError(
                    f"{section.at('sensors')}: no output {label!r}; there are {named(outputs, 8)}"
                )
        if set(labels) >= set(outputs):
            raise FileError(f"{section.at('sensors')} names every output, so none is left to fit")
        return tuple(labels), band
    count = section.number("sensors", low=0, high=max(len(outputs) - 1, 0)) or 0.0
    if count != int(count):
        raise FileError(f"{section.at('sensors')} = {count:g} is not a whole number")
    return int(count), band


def searched_effects(keys: KeyFile, notes: list[str]) -> tuple[str, ...]:
    """Names of the effects that a diagnosis tries; empty: all.

    Raises
    ------
    LabelError
        If there is no effect of a name.
    """
    section = keys.section("search", known("search"))
    wanted = section.list("effects", str)
    if wanted is None:
        return ()
    if not wanted:
        raise FileError(f"{section.at('effects')} is empty; leave it out to try all effects")
    there = names()
    for name in wanted:
        if name not in there:
            hint = did_you_mean(name, there)
            raise LabelError(
                f"{section.at('effects')} names {name!r}; {hint}there are {', '.join(there)}"
            )
    notes.append(f"the case limits the search to {', '.join(wanted)}")
    return tuple(dict.fromkeys(wanted))
