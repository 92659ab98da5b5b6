"""Corrections of recordings by a case: factor, delay, gains, excluded channels, FRFs of time data.

Their frequencies may be in another unit than Hz, and their FRFs conjugated.

Only corrections stated in the case are made, and each is noted.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..dynamics.frf import FRF
from ..ema.frf_estimate import EstimateSettings, FrfEstimate, estimate
from ..ema.setup import Recording, Role, Sensor, Shapes
from ..errors import ChladniError, FileError
from ..units import HERTZ


def with_frf(
    r: Recording,
    settings: EstimateSettings | None = None,
) -> tuple[Recording, FrfEstimate | None]:
    """A recording of time data with the FRFs estimated from it; any other as it is.

    Raises
    ------
    FileError
        If no FRF can be estimated; the sentence names ``chladni test``, which takes settings.
    """
    if r.time is None or r.frf is not None:
        return r, None
    try:
        found = estimate(r.time, settings or EstimateSettings())
    except ChladniError as error:
        raise FileError(
            f"{r.name}: {error} (chladni test {r.name} estimates FRFs with your settings)"
        ) from error
    notes = tuple(f"{r.name}: {said}" for said in found.notes)
    said = f"{r.name}: FRFs estimated from time data by {found.method}, as in chladni test"
    with_it = replace(
        r, frf=found.frf, notes=(*r.notes, said, *notes), added_damping=found.added_damping
    )
    return with_it, found


def record_length(r: Recording) -> float:
    """1 / Δf of the closest spectral lines [s]: a longer delay looks like a shorter one.

    A recording without lines has no such length: infinite.
    """
    if r.frf is None or len(r.frf.frequency) < 2:
        return float("inf")
    return float(1 / np.diff(r.frf.frequency).min())


def mended(r: Recording, factor: float, delay: float, sensors: Sequence[Sensor]) -> Recording:
    """The FRFs as the case says they are to be read.

    Parameters
    ----------
    factor : on all of them
    delay : of all responses [s], taken off by exp(iωτ)
    sensors : rows of the table, with gains and with outputs that are left out

    Raises
    ------
    FileError
        If no output is left.
    """
    if r.shapes is not None and r.frf is None:
        return _with_shapes_mended(r, r.shapes, {s.label: s for s in sensors if s.role == "output"})
    if r.frf is None:
        return r
    table = {(s.label, s.role): s for s in sensors}
    frf, notes = r.frf, list(r.notes)
    unused = [o for o in frf.outputs if not _row(table, o).use]
    if unused:
        kept = [o for o in frf.outputs if o not in unused]
        if not kept:
            raise FileError(f"{r.name}: the table of sensors excludes every output")
        frf = frf.sel(outputs=kept)
        notes.append(f"{r.name}: {', '.join(unused)} excluded by the table of sensors")
    gains = np.array([_row(table, o).gain for o in frf.outputs])
    drives = np.array([table[i, "input"].gain if (i, "input") in table else 1.0
                       for i in frf.inputs])  # fmt: skip
    if (gains != 1).any() or (drives != 1).any():
        named = [*zip(frf.outputs, gains, strict=True), *zip(frf.inputs, drives, strict=True)]
        said = ", ".join(f"{label} by {g:g}" for label, g in named if g != 1)
        notes.append(f"{r.name}: divided by the gains of the table of sensors: {said}")
        frf = _times(frf, drives[None, None, :] / gains[None, :, None])
    if factor != 1:
        frf = _times(frf, np.array(factor))
        notes.append(f"{r.name}: all FRFs multiplied by [test] factor = {factor:g}")
    if delay:
        frf = _times(frf, np.exp(2j * np.pi * frf.frequency * delay)[:, None, None])
        notes.append(f"{r.name}: [test] delay = {delay:g} s removed")
    return replace(r, frf=frf, notes=tuple(notes))


def _with_shapes_mended(r: Recording, shapes: Shapes, table: dict[str, Sensor]) -> Recording:
    """Shapes divided by the gains of their sensors, without those that are left out."""
    known = [table.get(d, Sensor(d)) for d in shapes.dofs]
    use = np.array([s.use for s in known])
    if not use.any():
        raise FileError(f"{r.name}: the table of sensors excludes every output")
    gains = np.array([s.gain for s in known])[:, None]
    sd = None if shapes.sd is None else shapes.sd / np.abs(gains)
    divided = replace(shapes, values=shapes.values / gains, sd=sd)
    unused = [s.label for s in known if not s.use]
    notes = [f"{r.name}: {', '.join(unused)} excluded by the table of sensors"] * bool(unused)
    said = ", ".join(f"{s.label} by {s.gain:g}" for s in known if s.gain != 1)
    notes += [f"{r.name}: divided by the gains of the table of sensors: {said}"] * bool(said)
    modes = np.arange(len(shapes.frequency))
    return replace(r, shapes=divided.sel(modes, use), notes=(*r.notes, *notes))


def read_as(r: Recording, unit: str, conjugated: bool) -> Recording:
    """A recording whose frequencies are in a unit of ``HERTZ``, or whose phases are reversed."""
    frf, poles, shapes, k, notes = r.frf, r.poles, r.shapes, HERTZ[unit], list(r.notes)
    if k != 1:
        notes.append(f"{r.name}: frequencies read in {unit} ([test] frequency_unit)")
        if frf is not None:
            frf = replace(frf, frequency=frf.frequency * k)
        if poles is not None:
            f, sd = poles.frequency * k, poles.frequency_sd * k
            poles = replace(poles, frequency=f, frequency_sd=sd)
        if shapes is not None:
            shapes = replace(shapes, frequency=shapes.frequency * k)
    if conjugated and frf is not None:
        frf = replace(frf, values=frf.values.conj())
        notes.append(f"{r.name}: all FRFs conjugated ([test] conjugated)")
    return replace(r, frf=frf, poles=poles, shapes=shapes, notes=tuple(notes))


def _row(table: dict[tuple[str, Role], Sensor], output: str) -> Sensor:
    return table.get((output, "output"), Sensor(output))


def _times(frf: FRF, factor: np.ndarray) -> FRF:
    variance = frf.variance
    return replace(
        frf,
        values=frf.values * factor,
        variance=None if variance is None else variance * np.abs(factor) ** 2,
    )
