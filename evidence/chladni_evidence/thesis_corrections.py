"""Section 5.3 of the thesis: formed thickness mapped, and the adhesive of the hem made stiff."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from chladni.dynamics.frf import UNIT
from chladni.effects.calibration_parameters import value as value_of
from chladni.ema.mode_pairing import pair
from chladni.fem.energy import mass_properties
from chladni.io.nastran import write_deck
from chladni.progress import Progress, within
from chladni.report import map_page
from chladni.report.blocks import Block, Items, Picture, Section, Table
from chladni.report.words import hertz, number
from chladni.view import charts
from chladni.view.chart_png import png
from chladni.workflows.map import map_formed
from chladni.workflows.working_model import WorkingModel
from chladni_bench import FREQUENCIES

from .thesis_chapter import Chapter
from .thesis_desk import FORMED, Desk
from .thesis_modes import BAND, CORDS
from .thesis_numbers import MAPPED_MASS, TABLE_7, TABLE_8, TABLE_9, TABLE_10
from .thesis_scores import BEYOND, FIT, ModelScore, floor_Q, scored_model

MAPPED, STIFF = "mapped.bdf", "stiff.bdf"
STEEL, NU = 210e9, (0.4, 0.49)  # of the adhesive in table 9
_NONE = "–"


def mapping_chapter(desk: Desk, progress: Progress) -> Chapter:
    """Map the forming simulation onto the deck: figures 28 and 29, tables 7 and 8."""
    model = desk.deck()
    found = map_formed(model, desk.folder / FORMED, progress=within(progress, 0.0, 0.3))
    assert model.deck is not None
    write_deck(model.deck, desk.folder / MAPPED, found.changes)
    page = map_page.as_page(desk.folder, found)
    progress("responses", 0.4)
    mapped = desk.deck(MAPPED)
    before, after = (
        scored_model(desk, name, m) for name, m in (("nominal", model), ("mapped", mapped))
    )
    masses = [mass_properties(m.assembly)[0] for m in (model, mapped)]
    mass = [
        (who, number(a, 5), number(b, 5), f"{100 * (b / a - 1):+.2f}")
        for who, (a, b) in (("thesis", MAPPED_MASS), ("ours", masses))
    ]
    blocks: list[Block] = [
        *page.sections[0].blocks,
        Table(("", "nominal [kg]", "mapped [kg]", "change [%]"), mass, ("",)),
    ]
    picture = compared(desk, "figure_29.png", {"nominal": "before", "mapped": "after"})
    scores: list[Block] = [
        Picture(picture, "Figure 29: nominal (before) and mapped thickness (after)."),
        deviations(TABLE_7, (before, after), ("nominal", "mapped")),
        likeness(TABLE_8, (before, after), ("nominal", "mapped")),
        Items(_reasons(before, after)),
    ]
    numbers = {
        "mapping": {"thesis_kg": MAPPED_MASS, "ours_kg": masses},
        "floor_Q": floor_Q(desk),
        "scores": [before.numbers, after.numbers],
        "table_7": {"thesis": TABLE_7, "ours": [before.Q, after.Q]},
        "table_8": {"thesis": TABLE_8, "ours": [before.mac, after.mac]},
    }
    lead = (
        f"mapped thickness changes the mass by {mass[1][3]} % (thesis: {mass[0][3]}) and Q from "
        f"{number(before.Q, 3)} to {number(after.Q, 3)} (thesis: {TABLE_7[0]} to {TABLE_7[1]})"
    )
    sections = (
        Section("Figure 28: formed thickness", blocks),
        Section("Tables 7 and 8: with formed thickness", scores),
    )
    return Chapter(lead, sections, numbers, ((MAPPED, "the deck with mapped thickness"),))


def _reasons(before: ModelScore, after: ModelScore) -> list[str]:
    worse = after.Q > before.Q
    return [
        f"Q becomes {'worse, as in the thesis' if worse else 'better, unlike in the thesis'}. The "
        "article has this thickness, so the correction is right. Thinner sheets lower the "
        "frequencies. With the hem still too soft they are too low, and become lower: the deck "
        "had two errors that compensated in part.",
        "The thesis states Q without its normalisation. Ours is the mean over channels and lines. "
        "The most probable reading of the thesis is a sum over channels of means over lines: the "
        "column of sums.",
    ]


def adhesive_chapter(desk: Desk, progress: Progress) -> Chapter:
    """Give the adhesive the stiffness of steel: tables 9 and 10, figure 31, the control."""
    mapped, specimen = desk.deck(MAPPED), desk.specimen
    strings = [name for name in (specimen.seam, specimen.control) if name]
    scores = [scored_model(desk, "mapped", mapped)]
    for k, nu in enumerate(NU):
        progress(f"adhesive of steel, nu {nu}", 0.2 + 0.25 * k)
        stiff = glued(mapped, strings, nu)
        scores.append(scored_model(desk, f"stiff_{nu}", stiff))
    stiff.write(desk.folder / STIFF)
    soft, _, best = scores
    picture = compared(desk, "figure_31.png", {"mapped": "before", f"stiff_{NU[1]}": "after"})
    heads = ("6 MPa", f"210 GPa, nu {NU[0]}", f"210 GPa, nu {NU[1]}")
    blocks: list[Block] = [
        Picture(picture, "Figure 31: adhesive of 6 MPa (before) and of 210 GPa (after)."),
        likeness(TABLE_9, scores, heads),
        deviations(TABLE_10, (soft, best), ("6 MPa", "210 GPa")),
    ]
    said = [
        "A string of steel holds the sheets together and stands for the hem, whose inner sheet "
        "cannot slide. It is a stand-in: no adhesive has this modulus. The thesis says so too.",
        "Our modes are paired by MAC. The thesis' tables 8 and 9 give mode 6 of one model 0.8591 "
        "and 0.5194: its extra mode at 84.7 Hz changed the pairing.",
    ]
    control: dict[str, Any] = {}
    if specimen.control:
        progress("the string without a hem", 0.75)
        alone = scored_model(desk, "control", glued(mapped, [specimen.seam], NU[1]))
        moved = float(np.nanmax(np.abs(alone.model / best.model - 1)))
        gained = float(np.nanmax(np.abs(best.model / soft.model - 1)))
        control = {"Q": alone.Q, "largest_shift": moved, "shift_by_hem": gained}
        said.append(
            f"Control: with the {specimen.control} soft again, frequencies change by "
            f"{number(100 * moved, 2)} % at most, with the one in the hem by "
            f"{number(100 * gained, 2)} %. The thesis found no influence either: it is the hem, "
            "not the glue."
        )
    numbers = {
        "table_9": {"thesis": TABLE_9, "ours": [s.mac for s in scores]},
        "table_10": {"thesis": TABLE_10, "ours": [soft.Q, best.Q]},
        "control": control,
        "stiff": best.numbers,
    }
    lead = (
        f"adhesive of 210 GPa brings Q from {number(soft.Q, 3)} to {number(best.Q, 3)}, "
        f"{_gain(soft.Q, best.Q)} (thesis: {TABLE_10[0]} to {TABLE_10[1]}, "
        f"{_gain(*TABLE_10)})"
    )
    section = Section("Tables 9 and 10: a stiff adhesive", [*blocks, Items(said)])
    return Chapter(lead, (section,), numbers, ((STIFF, "the same with adhesive of steel"),))


def glued(model: WorkingModel, parts: Sequence[str], nu: float) -> WorkingModel:
    """The model with adhesive as stiff as steel, in steps: a variant changes by a factor of 20."""
    own = next(value_of(p, "E") for p in model.assembly.parts if p.name in parts)
    for E in np.geomspace(own, STEEL, 6)[1:]:
        model = model.variant(E=dict.fromkeys(parts, float(E)))
    return model.variant(nu=dict.fromkeys(parts, nu))


def _gain(before: float | None, after: float | None) -> str:
    if before is None or after is None:
        return _NONE
    return f"{100 * (after / before - 1):+.1f} %"


def deviations(
    thesis: Sequence[float | None], scores: Sequence[ModelScore], heads: Sequence[str]
) -> Table:
    """Q of models, the thesis' and ours, on fitted and on held-out data."""
    columns = ("model", "thesis", "change", "our Q", "change", "our sum", "26 to 195 Hz",
               "B and C", "200 to 300 Hz")  # fmt: skip
    rows = [
        (head, _NONE if q is None else f"{q:g}", _NONE if k == 0 else _gain(thesis[0], q),
         number(s.Q, 3), _NONE if k == 0 else _gain(scores[0].Q, s.Q), number(s.summed, 3),
         number(s.fit, 3), number(s.other, 3), number(s.beyond, 3))
        for k, (head, q, s) in enumerate(zip(heads, thesis, scores, strict=True))
    ]  # fmt: skip
    return Table(
        columns, rows, ("model",),
        "Deviation from tailgate A, 10 to 195 Hz without the cords. The last columns: other bands "
        f"and other articles; B and C from {FIT[0]:g} to {FIT[1]:g} Hz.",
    )  # fmt: skip


def likeness(
    thesis: Mapping[int, Sequence[float]], scores: Sequence[ModelScore], heads: Sequence[str]
) -> Table:
    """MAC of the paired modes, the thesis' next to ours; partners nearest in frequency."""
    test = scores[0].test
    partner = pair(test, FREQUENCIES[0])
    theirs = {int(i): int(j) + 1 for i, j in zip(partner.model, partner.test, strict=True)}
    rows = []
    for k, f in enumerate(test):
        printed = thesis.get(theirs.get(k, 0), [None] * len(heads))
        rows.append((
            str(k + 1), hertz(f), str(theirs.get(k, _NONE)), *(_fixed(x) for x in printed),
            *(_fixed(s.mac[k]) for s in scores),
        ))  # fmt: skip
    columns = ("our mode", "Hz", "mode of the thesis", *(f"thesis, {h}" for h in heads),
               *(f"ours, {h}" for h in heads))  # fmt: skip
    return Table(columns, rows, (), "MAC between tailgate A and the model; – has no partner.")


def _fixed(x: float | None) -> str:
    return _NONE if x is None or not np.isfinite(x) else f"{x:.4f}"


def compared(desk: Desk, name: str, models: Mapping[str, str]) -> Path:
    """Draw tailgate A and stored responses of models: next to the shaker, and a typical sensor.

    Parameters
    ----------
    models : name of the responses -> "before" or "after"
    """
    frf = desk.recording("A").sel(band=(BAND[0], BEYOND[1]))
    size = np.abs(frf.values[:, :, 0]).mean(axis=0)
    order = np.argsort(size)
    drive = frf.outputs.index(frf.inputs[0]) if frf.inputs[0] in frf.outputs else int(order[-1])
    channels = {}
    for row in (drive, int(order[len(order) // 2])):
        curves = {"test": (frf.frequency, frf.values[:, row, 0])}
        for model, style in models.items():
            with np.load(desk.folder / f"responses_{model}.npz", allow_pickle=False) as held:
                curves[style] = held["frequency"], held["values"][:, row, 0]
        near = ", next to the shaker" if row == drive else ""
        channels[f"{frf.outputs[row]}{near}"] = curves
    unit = UNIT["accelerance"]
    chart = charts.responses(channels, f"|H| [{unit}]", [CORDS])
    return png(chart.grid(columns=1), desk.folder / name)
