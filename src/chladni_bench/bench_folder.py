"""The folder of a virtual test: a case for every other command, time data, the sealed truth."""

import json
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from chladni.case import Case
from chladni.case.schema import ONCE
from chladni.fem.measured_dofs import MeasuredDofs
from chladni.io.nastran import write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.io.tables.csv_table import csv_text
from chladni.io.uff.estimate_stamp import stamp
from chladni.io.uff.write_time import write_time_uff
from chladni.io.uff.write_uff import write_uff
from chladni.output import write_json, write_text

from .bench_recording import BenchRecording
from .bench_workflow import BenchResult, level_unit

Files = list[tuple[str, str]]
CLEAR = 0.04  # of a cord's frequency to either side: two of its half-bandwidths
RENEWED = {  # words that do not hold for the new recordings, or stand in the deck that is written
    "model": {"deck", "thickness", "thickness_units", "thickness_place", "outside"},
    "test": {
        *("recordings", "use", "quantity", "factor", "delay", "frequency_unit", "conjugated"),
        *("sensors", "mass", "mass_sd"),
    },
    "held_out": {"band"},
    "search": set(),
    "plan": set(),
}
LEAST_OVERLAP = 0.5  # of a band of the case must be in the test's, or all of the test's in it


def write_bench(folder: Path, case: Case, found: BenchResult) -> Files:
    """``case/`` with deck, sensors and recordings, ``sealed/truth.json``; what was written."""
    place = folder / "case"
    place.mkdir(parents=True, exist_ok=True)
    formed = case.assembly is not case.as_deck
    edits = changes(case.deck, case.as_deck, case.assembly, case.units) if formed else []
    write_deck(case.deck, place / "deck.bdf", edits)
    write_text(place / "sensors.csv", _sensors(found))
    names = file_names(found.recordings)
    files: Files = [("case/case.toml", "a case with these recordings")]
    nodes = found.outputs.nodes | found.inputs.nodes  # as the user believes
    unit = level_unit(found.inputs)
    for name, r in zip(names, found.recordings, strict=True):
        write_uff(place / f"{name}.uff", r.frf, nodes, stamp(r.averages, r.added_damping))
        files.append(
            (f"case/{name}.uff", f"FRFs of article {r.article}, {r.test.level:.3g} {unit}")
        )
        if r.time is not None:
            write_time_uff(place / f"{name}_time.uff", r.time, nodes)
            files.append((f"case/{name}_time.uff", "its time data, for chladni test"))
    write_text(place / "case.toml", _toml(case, found, names, _plan(case, place)))
    write_json(folder / "sealed" / "truth.json", found.truth)
    files.append(("sealed/truth.json", "the concealed effects: open it when the answer is on disk"))
    return files


def file_names(recordings: tuple[BenchRecording, ...]) -> list[str]:
    """article_A, with the level where there are several of one article."""
    count = Counter(r.article for r in recordings)
    unit = ["" if r.frf.quantity == "transmissibility" else "N" for r in recordings]
    return [
        f"article_{r.article}" + f"_{r.test.level:.3g}{u}" * (count[r.article] > 1)
        for r, u in zip(recordings, unit, strict=True)
    ]


def _sensors(found: BenchResult) -> str:
    """Return the text of ``sensors.csv``, with the nominal masses of the sensors."""
    uncertain = ["position_sd"] * bool((found.outputs.sd > 0).any() or (found.inputs.sd > 0).any())
    head = ["label", "grid", "x", "y", "z", "nx", "ny", "nz", "role", "mass", *uncertain]
    usual, shaker = found.setup.accelerometer.mass, found.setup.shaker
    behind = shaker.gauge.mass * shaker.gauge.beyond if shaker else 0.0
    masses = np.where(found.outputs.mass > 0, found.outputs.mass, usual)
    rows = _rows(found.outputs, "output", masses)
    if not found.inputs.base[0]:  # its label says all there is to a table
        rows += _rows(found.inputs, "input", np.full(len(found.inputs.labels), behind))[:1]
    return csv_text([head, *(row if uncertain else row[:-1] for row in rows)])


def _rows(dofs: MeasuredDofs, role: str, masses: np.ndarray) -> list[list[str]]:
    out = []
    for k, label in enumerate(dofs.labels):
        grid = int(dofs.grids[k])
        place = [""] * 3 if grid else [f"{x:.7g}" for x in dofs.points[k]]
        axis = [f"{x:.9g}" for x in dofs.directions[k]]
        own = [role, f"{masses[k]:.6g}", f"{dofs.sd[k]:.6g}"]
        out.append([label, str(grid) if grid else "", *place, *axis, *own])
    return out


def _plan(case: Case, place: Path) -> dict[str, Any]:
    """Return the words of [plan]; their files are copied to ``place`` under a name of their own."""
    asked = case.asked

    def copied(name: str, text: str) -> str:
        if not text.lower().endswith(".csv"):
            return text
        file = asked.file(text, asked.said.places[name])
        write_text(place / f"plan_{file.name}", file.read_text(encoding="utf-8"))
        return f"plan_{file.name}"

    return {name: [copied(name, t) for t in words] for name, words in _kept(case, "plan").items()}


def _toml(case: Case, found: BenchResult, names: list[str], plan: dict[str, Any]) -> str:
    """Copy every word of the case, except those that the test replaces."""
    files = [f"{n}.uff" for n in names]
    weighed = {"mass": float(f"{found.mass:.6g}"), "mass_sd": float(f"{1e-3 * found.mass:.2g}")}
    lines = ["[model]", *_words({"deck": "deck.bdf"} | _kept(case, "model"))]
    test = {"recordings": files, "sensors": "sensors.csv"} | weighed | _kept(case, "test")
    lines += ["", "[test]", *_words(test)]
    if len(names) > 1:
        for name, r in zip(files, found.recordings, strict=True):
            level = float(f"{r.test.level:.6g}")
            said = {"file": name, "article": r.article, "level": level}
            lines += ["", "[[recording]]", *_words(said)]
    band = _covered(case.band, found.band) or found.band
    lines += ["", "[band]", f"fit = [{band[0]:g}, {band[1]:g}]", *_left_out(case, found, band)]
    held, kept = _covered(case.held_band, found.band), _kept(case, "held_out")
    if held is not None or kept:
        lines += ["", "[held_out]", *_words(kept)]
        lines += [f"band = [{held[0]:g}, {held[1]:g}]"] if held is not None else []
    for section, words in (("search", _kept(case, "search")), ("plan", plan)):
        lines += ["", f"[{section}]", *_words(words)] if words else []
    for stated in case.asked.parameters:
        lines += ["", "[[parameter]]", *_words(dict(stated.words))]
    return "\n".join([*lines, ""])


def _kept(case: Case, section: str) -> dict[str, Any]:
    """Return the words of a section that also apply to the new recordings."""
    said: Mapping[str, Any] = case.asked.said.words
    kept = [k for k in ONCE if k.section == section and k.name not in RENEWED[section]]
    return {k.name: said[k.argument] for k in kept if k.argument in said}


def _words(values: dict[str, Any]) -> list[str]:
    """Return lines of TOML; text, numbers and lists are written as in JSON."""
    return [f"{k} = {json.dumps(v)}" for k, v in values.items()]


def _left_out(case: Case, found: BenchResult, band: tuple[float, float]) -> list[str]:
    """Return the excluded bands of the case, and that of the cords, known by tapping."""
    out = [list(b) for b in case.exclude]
    low, high = band
    tapped = [f for f in found.cords if low <= f <= high]
    if tapped:
        out.append([round((1 - CLEAR) * min(tapped), 2), round((1 + CLEAR) * max(tapped), 2)])
    if not out:
        return []
    rung = f"  # the cords ring at {', '.join(f'{f:.3g}' for f in tapped)} Hz" * bool(tapped)
    return [f"exclude = {out}{rung}"]


def _covered(
    band: tuple[float, float] | None, by: tuple[float, float]
) -> tuple[float, float] | None:
    """Return the part of a band that the test covers [Hz]; None if it is less than half."""
    if band is None:
        return None
    low, high = max(band[0], by[0]), min(band[1], by[1])
    enough = (
        high - low >= LEAST_OVERLAP * (band[1] - band[0]) or band[0] <= by[0] < by[1] <= band[1]
    )
    return (low, high) if enough else None
