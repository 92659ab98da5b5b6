"""NetCDF file of a study, for xarray."""

from pathlib import Path
from typing import Any

import numpy as np

from chladni.dynamics.frf import UNIT
from chladni.output import atomic

from .parameter_study import ParameterStudy
from .study_store import FRFS

LARGEST = 1_500_000_000  # bytes of whole responses; beyond it they stay in files of their own


def write_netcdf(path: Path, found: ParameterStudy) -> list[str]:
    """Write parameters, results and whole responses with units, for ``xarray.open_dataset``.

    Dimensions are sample, mode, channel ("output from input") and line. Returns notes for the user.
    """
    from scipy.io import netcdf_file

    frfs, notes = response_files(found)

    def write(part: Path) -> None:
        with netcdf_file(str(part), "w", version=2) as file:
            file.createDimension("sample", len(found.rows))
            _variable(file, "sample", ("sample",), np.arange(len(found.rows), dtype=np.int32))
            for v in found.varied:
                _variable(file, v.name, ("sample",), found.column(v.name), v.unit)
            done = np.array([r["status"] == "done" for r in found.rows], np.int32)
            _variable(file, "done", ("sample",), done)
            _modes(file, found)
            _channels(file, found)
            if frfs:
                _whole(file, found, frfs)
            _attributes(file, found)

    atomic(path, write)
    return notes


def _variable(
    file: Any, name: str, dims: tuple[str, ...], values: np.ndarray, unit: str = ""
) -> None:
    kind = "d" if values.dtype.kind == "f" else values.dtype.kind
    made = file.createVariable(_plain(name), kind, dims)
    made[:] = values
    if unit:
        made.units = _plain(unit)


def _plain(text: str) -> str:
    """Text in ASCII, as NetCDF 3 requires."""
    return text.encode("ascii", "backslashreplace").decode()


def _modes(file: Any, found: ParameterStudy) -> None:
    count = sum(c.startswith("mac") for c in found.columns)
    file.createDimension("mode", count)
    _variable(file, "mode", ("mode",), np.arange(1, count + 1, dtype=np.int32))
    for name, form, unit in (("frequency", "f{}_hz", "Hz"), ("mac", "mac{}", "1")):
        values = [found.column(form.format(k + 1)) for k in range(count)]
        _variable(file, name, ("sample", "mode"), np.stack(values, axis=1), unit)
    for name in ("mass_kg", "mass", "Q"):
        if name in found.columns:
            _variable(file, name, ("sample",), found.column(name))


def _channels(file: Any, found: ParameterStudy) -> None:
    channels = [c.removeprefix("rms ") for c in found.columns if c.startswith("rms ")]
    if not channels:
        return
    file.createDimension("channel", len(channels))
    _texts(file, "channel", channels)
    for kind in ("rms", "peak", "peak_hz"):
        values = np.stack([found.column(f"{kind} {c}") for c in channels], axis=1)
        _variable(file, kind, ("sample", "channel"), values)


def _texts(file: Any, name: str, texts: list[str]) -> None:
    """Write texts as rows of characters, which xarray joins."""
    texts = [_plain(t) for t in texts]
    width = max(len(t) for t in texts)
    file.createDimension(f"{name}_letters", width)
    rows = np.array([list(t.encode().ljust(width)) for t in texts], dtype=np.uint8)
    made = file.createVariable(f"{name}_name", "c", (name, f"{name}_letters"))
    made[:] = rows.view("S1").reshape(rows.shape)


def response_files(found: ParameterStudy) -> tuple[dict[int, Path], list[str]]:
    """Files of the whole responses; no file, and a note, where they are too large together."""
    if found.store is None or not found.settings.keep_frf:
        return {}, []
    folder = found.store / FRFS
    done = [r["sample"] for r in found.rows if r["status"] == "done"]
    files = {k: folder / f"{k:06d}.npz" for k in done}
    files = {k: p for k, p in files.items() if p.is_file()}
    if not files:
        return {}, []
    with np.load(next(iter(files.values())), allow_pickle=False) as held:
        size = 16 * held["values"].size * len(found.rows)
    if size > LARGEST:
        return {}, [f"Whole responses ({size / 1e9:.1f} GB) stay in {FRFS}/, one file per sample."]
    return files, []


def _whole(file: Any, found: ParameterStudy, files: dict[int, Path]) -> None:
    with np.load(next(iter(files.values())), allow_pickle=False) as held:
        f, shape, quantity = held["frequency_hz"], held["values"].shape, str(held["quantity"])
    file.createDimension("line", len(f))
    _variable(file, "frequency_hz", ("line",), f, "Hz")
    dims = ("sample", "line", "channel")
    real, imag = (file.createVariable(n, "d", dims) for n in ("frf_real", "frf_imag"))
    for made in (real, imag):
        made.units = UNIT.get(quantity, "1").replace("²", "2")  # NetCDF 3 is ASCII
        made.quantity = quantity
        made[:] = np.full((len(found.rows), len(f), shape[1] * shape[2]), np.nan)
    for k, path in files.items():
        with np.load(path, allow_pickle=False) as held:
            values = held["values"].reshape(len(f), -1)
        real[k], imag[k] = values.real, values.imag


def _attributes(file: Any, found: ParameterStudy) -> None:
    """Write the provenance of the study as attributes."""
    made = found.provenance
    file.source, file.sampler, file.seed = _plain(made["source"]), made["sampler"], made["seed"]
    file.versions = " ".join(f"{k} {v}" for k, v in made["versions"].items())
    file.files = _plain(" ".join(f"{Path(k).name}:{v}" for k, v in made["files"].items()))
