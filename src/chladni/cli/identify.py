"""``chladni identify``: modes of a recording."""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

from ..dynamics.frf import FRF, UNIT
from ..ema.identification import Identified, evaluate, identify
from ..ema.setup import PoleTable, Recording
from ..errors import AccuracyError, FileError
from ..io.tables.write_tables import write_poles
from ..report.blocks import Block, Picture, Table
from ..report.words import number
from ..workflows.loaded_model import is_case
from ..workflows.recordings_of import load_recordings
from .frf import limits
from .run import Out, Run, started

_SHOWN = 6  # channels drawn
_TRUST = 5.0  # rms of the whitened residual above which poles are not to be trusted


def run(
    source: Annotated[Path, typer.Argument(metavar="CASE_or_RECORDING")],
    band: Annotated[str, typer.Option(help="From and to, in Hz; default the whole.")] = "",
    quantity: Annotated[
        str, typer.Option(help="receptance, mobility, ... where the file does not say.")
    ] = "",
    averages: Annotated[
        int, typer.Option(help="Averages of the estimate, for the noise.", min=1)
    ] = 1,
    out: Out = None,
) -> int:
    """Poles with their spread, damping and residues; a stabilisation diagram and the fit."""
    limit = limits(band) if band else None
    with started("identify", source, out) as job:
        held = [r for r in load_recordings(source, quantity or None) if r.frf is not None]
        if not held:
            raise FileError(f"{source} holds no frequency responses to identify from")
        if limit is None and is_case(source):
            from ..case import load_case

            limit = load_case(source).band
        found = [_one(job, k, r, limit, averages, len(held)) for k, r in enumerate(held)]
        job.json("identified.json", {"recordings": found})
        job.lead = "; ".join(_sentence(entry) for entry in found)
        job.say(job.lead)
    return _trusted(found)


def _one(
    job: Run,
    k: int,
    recording: Recording,
    band: tuple[float, float] | None,
    averages: int,
    total: int,
) -> dict[str, Any]:
    job.progress(f"poles of {recording.name}", k / total)
    frf = recording.frf
    assert frf is not None
    whole = identify(frf, band, averages=averages)
    modal = whole.sel((whole.frequency >= whole.band[0]) & (whole.frequency <= whole.band[1]))
    stem = "" if total == 1 else f"_{k + 1}"
    write_poles(job.keep(f"poles{stem}.csv", f"poles of {recording.name}"), _poles(modal))
    job.notes.extend(recording.notes)
    if frf.variance is None and frf.coherence is None:
        job.notes.append(
            f"{recording.name} holds neither variance nor coherence, so its noise was taken from "
            "the residual; spreads are weaker for it."
        )
    job.section(recording.name, [_table(modal), *_pictures(job, stem, frf, modal, whole)])
    return {
        "name": recording.name,
        "band_hz": modal.band,
        "frequency_hz": modal.frequency,
        "frequency_sd_hz": modal.frequency_sd,
        "damping": modal.damping,
        "damping_sd": modal.damping_sd,
        "firm": firm(modal),
        "chi": modal.chi,
        "outputs": modal.outputs,
        "inputs": modal.inputs,
    }


def firm(modal: Identified) -> np.ndarray:
    """Poles known to 2 % in frequency and to half their damping: (r,) bool."""
    known = modal.frequency_sd < 0.02 * modal.frequency
    return np.asarray(known & (modal.damping_sd < 0.5 * modal.damping))


def _poles(modal: Identified) -> PoleTable:
    modal = modal.sel(firm(modal))
    r = len(modal.poles)
    return PoleTable(
        modal.frequency, modal.frequency_sd, modal.damping, np.arange(1, r + 1), ("",) * r
    )


def _table(modal: Identified) -> Table:
    sure = firm(modal)
    columns = (modal.frequency, modal.frequency_sd, 100 * modal.damping, 100 * modal.damping_sd)
    rows = [
        (str(k + 1), number(f, 5), number(sf, 2), number(z, 3), number(sz, 2))
        for k, (f, sf, z, sz) in enumerate(zip(*(c[sure] for c in columns), strict=True))
    ]
    heads = ("mode", "Hz", "± Hz", "damping [%]", "± %")
    caption = f"Residual over noise: {number(modal.chi, 3)} (1: only noise is left)."
    if weak := int((~sure).sum()):
        caption += f" {weak} more poles shape the curve but are too uncertain to be called modes."
    return Table(heads, rows, caption=caption)


def _pictures(job: Run, stem: str, frf: FRF, modal: Identified, whole: Identified) -> list[Block]:
    from ..view import plots

    inside = (modal.band[0] <= frf.frequency) & (frf.frequency <= modal.band[1])
    f = frf.frequency[inside]
    H, fitted = frf.values[inside], evaluate(whole, 2j * np.pi * f)
    size = np.sqrt((np.abs(H) ** 2).mean(axis=(1, 2)))
    sweep = modal.diagram
    poles = [
        (
            int(n),
            np.abs(sweep.poles[at := sweep.order == n]) / (2 * np.pi),
            _stable(modal, sweep.poles[at]),
        )
        for n in sweep.orders
    ]
    diagram = job.keep(f"stabilisation{stem}.png", "stabilisation diagram")
    plots.stabilisation(diagram, poles, modal.frequency[firm(modal)], (f, size))
    channels = {
        f"{o} from {i}": {"test": (f, H[:, a, b]), "identified": (f, fitted[:, a, b])}
        for b, i in enumerate(frf.inputs)
        for a, o in enumerate(frf.outputs)
    }
    grid = job.keep(f"fit{stem}.png", "the recording and the identified model")
    chosen = dict(list(channels.items())[:_SHOWN])
    plots.frf_grid(grid, chosen, UNIT.get(frf.quantity, ""), columns=min(2, len(chosen)))
    return [Picture(diagram, "Poles of every order; lines: what was kept."), Picture(grid)]


def _stable(modal: Identified, poles: np.ndarray) -> np.ndarray:
    """Within half a bandwidth of a pole that was kept."""
    gap = np.abs(np.abs(poles)[:, None] - np.abs(modal.poles))
    return np.asarray((gap < np.abs(modal.poles.real)).any(axis=1))


def _sentence(entry: dict[str, Any]) -> str:
    f = entry["frequency_hz"][entry["firm"]]
    low, high = entry["band_hz"]
    span = f" from {number(f[0])} to {number(f[-1])} Hz" if len(f) else ""
    return f"{entry['name']}: {len(f)} modes{span} in the band {number(low)} to {number(high)} Hz"


def _trusted(found: list[dict[str, Any]]) -> int:
    """Exit code: poles that leave far more than noise are written, but said to be weak."""
    weak = [e["name"] for e in found if not e["firm"].any() or e["chi"] > _TRUST]
    if weak:
        raise AccuracyError(
            f"{', '.join(weak)}: the poles leave {max(e['chi'] for e in found):.3g} times the "
            "noise, so they are not to be trusted; narrow the band (--band) or give --averages"
        )
    return 0
