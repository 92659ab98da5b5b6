"""Section 5.4 of the thesis: what can be identified, and the calibrations of tables 11 and 12."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from chladni.case import Case
from chladni.effects.joints import fasteners
from chladni.effects.weld_patch import FIELD as WELD_PATCH
from chladni.inference.calibration_result import Identifiability, ParameterKnowledge
from chladni.inference.identifiability import (
    calibration_positions,
    identifiability,
)
from chladni.inference.likelihood import Responses
from chladni.inference.map_fit import unknowns
from chladni.inference.result import CalibratedParameter
from chladni.io.nastran import write_deck
from chladni.model.assembly import Assembly
from chladni.model.properties import ShellSection
from chladni.parallel import one_blas_thread
from chladni.progress import Progress, within
from chladni.reduced.effect_dofs import slices
from chladni.reduced.reduced_model import evaluate
from chladni.report.blocks import Block, Items, Picture, Section, Table, Text
from chladni.report.words import number
from chladni.search.calibration import about_nominal
from chladni.search.preparation import prepare
from chladni.view import scene
from chladni.workflows.calibrate import calibrate
from chladni.workflows.diagnosis_result import DiagnosisResult
from chladni.workflows.question_of_case import question_of
from chladni.workflows.working_model import WorkingModel

from .thesis_chapter import Chapter
from .thesis_corrections import MAPPED, NU, STIFF, compared, deviations, glued
from .thesis_desk import DECK, Desk
from .thesis_numbers import TABLE_11, TABLE_12
from .thesis_scores import BEYOND, FIT, ModelScore, scored_model

CALIBRATED, WEIGHED = "calibrated.bdf", "weighed.bdf"
FREE_SD = 0.3  # of ln value: wide tolerances of the fit with the weighed mass
DECADES = 1.0  # prior sd of ln value from which a parameter is shown along its range
FARTHEST = 0.5  # of ln value: bounds of the fit without priors
Parameters = list[dict[str, Any]]
_NONE = "–"
_VERDICTS = {  # of section 5.4, by the field and the kind of part
    ("nu", "sheets"): "never", ("E", "hem"): "no, at 210 GPa", ("nu", "hem"): "no",
    ("E", "control"): "no", ("E", "welds"): "poorly", ("E", "screws"): "no influence",
    ("E", "sheets"): "yes", ("rho", "sheets"): "yes", ("t", "sheets"): "by mapping",
    (WELD_PATCH, "welds"): "yes",
}  # fmt: skip
_TABLE_12 = {"E of sheets": TABLE_12["E"], "rho of sheets": TABLE_12["rho"],
             "E of the weld patch": TABLE_12["weld patch"]}  # fmt: skip
_PRIOR = {"E": 0.06, "rho": 0.06, "nu": 0.1, "t": 0.05}  # of sheets; joints have wider ones


def sheets(assembly: Assembly) -> list[str]:
    """Names of the parts of shells."""
    used = np.unique(assembly.shells.part)
    return [p.name for k, p in enumerate(assembly.parts)
            if k in used and isinstance(p.section, ShellSection)]  # fmt: skip


def every_parameter(desk: Desk, assembly: Assembly) -> Iterator[tuple[dict[str, Any], str]]:
    """All parameters of section 5.4 with the verdict of the thesis."""
    s = desk.specimen
    groups = {"sheets": sheets(assembly), "hem": [s.seam], "control": [s.control],
              "welds": [s.welds], "screws": [s.screws]}  # fmt: skip
    for (field, group), said in _VERDICTS.items():
        if not (parts := [name for name in groups[group] if name]):
            continue
        one: dict[str, Any] = {"field": field, "name": f"{field} of {group}"}
        if field != WELD_PATCH:
            soft = field == "E" and group in ("hem", "control")
            sd = 2.0 if soft else _PRIOR[field] if group == "sheets" else 0.3
            one |= {"parts": parts, "sd": sd}
        yield one, said


def identifiability_chapter(desk: Desk, progress: Progress) -> Chapter:
    """Information of the data at the soft and at the stiff adhesive, before any fit."""
    found: dict[str, Identifiability] = {}
    rows_of = list(every_parameter(desk, desk.deck().assembly))
    names = [name for one, _ in rows_of for name in _names(one)]
    verdicts = [said for one, said in rows_of for _ in _names(one)]
    for k, deck in enumerate((MAPPED, STIFF)):
        stage = within(progress, k / 2, (k + 1) / 2)
        case = desk.case(deck, band=FIT, parameters=[one for one, _ in rows_of])
        with one_blas_thread():
            problem = prepare(question_of(case), stage).problem
            found[deck] = _named(identifiability(about_nominal(problem)), names)
    soft, stiff = found[MAPPED], found[STIFF]
    rows = [_row(a, b, said) for a, b, said in
            zip(soft.parameters, stiff.parameters, verdicts, strict=True)]  # fmt: skip
    columns = ("parameter", "thesis", "prior [%]", "single, 6 MPa [%]", "all, 6 MPa [%]",
               "6 MPa", "single, 210 GPa [%]", "all, 210 GPa [%]", "210 GPa")  # fmt: skip
    table = Table(
        columns, rows, ("parameter", "thesis", "6 MPa", "210 GPa"),
        "Standard deviations of ln value from the data alone, formed thickness mapped. Single: all "
        "others known. All: every parameter free. – means more than 100 %. Unknown here: known at "
        "other values only.",
    )  # fmt: skip
    texts = [_along(p, at) for at, known in (("6 MPa", soft), ("210 GPa", stiff))
             for p in known.parameters if p.prior_sd > DECADES]  # fmt: skip
    texts += [p.why for p in stiff.parameters if p.why]
    texts.append(
        "The thesis inverts the Fisher matrix, singly and in pairs, and judges by eye. Here a "
        "parameter is frozen if the data tell less than its prior, with all others and the errors "
        "of the model free. E, rho and t of all sheets trade off in any test that weighs nothing: "
        "the thesis left t to the mapping, as here."
    )
    numbers = {"identifiability": {k: [asdict(p) for p in v.parameters] for k, v in found.items()}}
    unknown = [p.name for p in stiff.parameters if _verdict(p) != "known"]
    lead = (
        f"{len(unknown)} of {len(stiff.parameters)} parameters cannot be identified with a stiff "
        f"adhesive: {', '.join(unknown) or 'none'}"
    )
    return Chapter(lead, (Section("Identifiability", [table, Items(texts)]),), numbers)


def _row(soft: ParameterKnowledge, stiff: ParameterKnowledge, said: str) -> list[str]:
    return [
        soft.name, said, number(100 * soft.prior_sd, 2),
        _percent(soft.sd_single), _percent(soft.sd_data), _verdict(soft),
        _percent(stiff.sd_single), _percent(stiff.sd_data), _verdict(stiff),
    ]  # fmt: skip


def _percent(sd: float | None) -> str:
    return _NONE if sd is None or sd > 1 else number(100 * sd, 2)


def _verdict(p: ParameterKnowledge) -> str:
    if p.frozen:
        return "frozen"
    return "unknown here" if p.sd_after**2 > p.prior_sd**2 / 2 else "known"


def _names(one: dict[str, Any]) -> list[str]:
    """Short names of what a [[parameter]] frees."""
    patch = one["field"] == WELD_PATCH
    return ["E of the weld patch", "R of the weld patch"] if patch else [one["name"]]


def _named(found: Identifiability, names: Sequence[str]) -> Identifiability:
    """The same with short names."""
    long = [(p.name, name) for p, name in zip(found.parameters, names, strict=True)]
    rows = []
    for p, name in zip(found.parameters, names, strict=True):
        why = p.why
        for old, new in long:
            why = why.replace(old, new)
        rows.append(replace(p, name=name, why=why))
    return replace(found, parameters=tuple(rows))


def _along(p: ParameterKnowledge, at: str) -> str:
    points = ", ".join(
        f"{'not at all' if _percent(v.sd_data) == _NONE else f'to {_percent(v.sd_data)} %'} at "
        f"{v.value / 1e6:.3g} MPa"
        for v in p.along
    )
    return f"{p.name} about {at}, all others known: known {points}."


@dataclass(frozen=True, eq=False)
class DeviationFit:
    """Values that minimise the deviation metric, without priors and without a weighed mass."""

    values: dict[str, tuple[float, float]]  # {parameter: (deck's, fitted)} [SI]
    assembly: Assembly  # with the fitted values
    Q: tuple[float, float]  # before and after, of responses with equal damping, 26 to 195 Hz


@one_blas_thread()
def deviation_fit(case: Case, progress: Progress) -> DeviationFit:
    """Minimise Σ |δ|² over the free parameters of a case: Echaniz Granado (2015), section 5.4.

    Every mode of test and model has the same damping. The parameters stay within e^±0.5 of the
    deck's. No error of the mesh is allowed for.
    """
    from scipy.optimize import least_squares

    problem = prepare(question_of(case), progress).problem
    data, model, base = problem.data, problem.reduced.model, problem.base
    assert isinstance(data, Responses)
    own, x = calibration_positions(base), np.array([p.nominal for p in unknowns(base)])

    def left(y: np.ndarray) -> np.ndarray:
        at = x.copy()
        at[own] = y
        d = data.deviation(evaluate(model, base, at, False))[data.use]
        return np.concatenate([d.real.ravel(), d.imag.ravel()]) * np.sqrt(1 / d.size)

    start = x[own]
    found = least_squares(left, start, bounds=(start - FARTHEST, start + FARTHEST),
                          diff_step=1e-4, x_scale=0.05, max_nfev=25)  # fmt: skip
    fitted, made = x.copy(), case.assembly
    fitted[own] = found.x
    every = unknowns(base)
    names = [name for free in case.parameters for name in _names(vars(free))]
    values = {
        name: (every[k].value(every[k].nominal), every[k].value(fitted[k]))
        for name, k in zip(names, own, strict=True)
    }
    for effect, at in slices(base):
        made = effect.apply(made, fitted[at]) if effect.kind == "calibration" else made
    return DeviationFit(values, made, (float((left(start) ** 2).sum()), float(2 * found.cost)))


def calibration_chapter(desk: Desk, progress: Progress) -> Chapter:
    """Calibrate as the thesis does, then with the weighed mass: tables 11 and 12."""
    stiff = desk.deck(STIFF)
    strings = [n for n in (desk.specimen.seam, desk.specimen.control) if n]
    plain = glued(desk.deck(DECK), strings, NU[1])
    names = sheets(stiff.assembly)
    gauges = [{"field": "t", "name": f"t of {n}", "parts": [n]} for n in names]
    fits = {}
    for k, (key, model, parameters) in enumerate((
        ("thickness", plain, [*_three(names), *gauges]), ("calibrated", stiff, _three(names)),
    )):  # fmt: skip
        case = desk.case(model, band=FIT, held_out_band=BEYOND, parameters=parameters)
        fits[key] = deviation_fit(case, within(progress, 0.25 * k, 0.25 * (k + 1)))
    replace(stiff, assembly=fits["calibrated"].assembly).write(desk.folder / CALIBRATED)
    case = desk.case(stiff, band=FIT, held_out_band=BEYOND, parameters=_three(names),
                     mass=desk.weight())  # fmt: skip
    weighed = calibrate(case, progress=within(progress, 0.5, 0.9))
    edits = None if weighed.models is None else weighed.models.calibrated.changes
    assert stiff.deck is not None
    write_deck(stiff.deck, desk.folder / WEIGHED, edits or ())
    progress("scores of the calibrated decks", 0.9)
    scores = [scored_model(desk, name, desk.deck(file)) for name, file in (
        ("stiff", STIFF), ("calibrated", CALIBRATED), ("weighed", WEIGHED))]  # fmt: skip
    sections = (
        Section("Table 11: thickness set free", _gauges(desk, fits["thickness"])),
        Section("Table 12: E, rho and the sheet about welds",
                _values(desk, fits["calibrated"], weighed, scores)),
    )  # fmt: skip
    numbers = {
        "table_11": fits["thickness"].values,
        "table_12": {"thesis": TABLE_12, "ours": fits["calibrated"].values,
                     "Q": fits["calibrated"].Q},
        "weighed_fit": {
            "values": {_called(c): [c.deck_value, c.estimate.value, c.estimate.low, c.estimate.high]
                       for c in weighed.calibrated},
            "verdict": weighed.verdict, "distrust": weighed.distrust,
        },
        "calibrated": scores[1].numbers, "weighed": scores[2].numbers,
    }  # fmt: skip
    moved = [f"{name} {_percent_change(v):+.1f} %" for name, v in fits["calibrated"].values.items()]
    lead = (
        f"E, rho and the sheet about the welds bring Q from {number(scores[0].fit, 3)} to "
        f"{number(scores[1].fit, 3)} (thesis: {TABLE_12['deviation'][0]} to "
        f"{TABLE_12['deviation'][1]}); {', '.join(moved)}"
    )
    files = ((CALIBRATED, "calibrated as in the thesis"), (WEIGHED, "with the weighed mass"))
    return Chapter(lead, sections, numbers, files)


def _percent_change(value: tuple[float, float]) -> float:
    return 100 * (value[1] / value[0] - 1)


def about_welds(model: WorkingModel) -> np.ndarray:
    """True for the shells that touch a weld of solids (n_shells,)."""
    welds = [j for j in fasteners(model.structure) if j.kind == "solids"]
    grids = np.unique(np.concatenate([np.array(j.grids) for j in welds]))
    touching = np.isin(model.assembly.shells.nodes, model.assembly.rows(grids.tolist()))
    return np.asarray(touching.any(axis=1))


def _three(names: Sequence[str]) -> Parameters:
    """The three parameters of table 12, without tolerances."""
    return [
        {"field": "E", "name": "E of sheets", "parts": list(names), "sd": FREE_SD},
        {"field": "rho", "name": "rho of sheets", "parts": list(names), "sd": FREE_SD},
        {"field": WELD_PATCH, "name": "the weld patch"},
    ]


def _gauges(desk: Desk, found: DeviationFit) -> list[Block]:
    nominal, mapped = (desk.deck(name).assembly for name in (DECK, MAPPED))
    rows = []
    for name in sheets(nominal):
        theirs = TABLE_11.get(name, (None, None, None))
        mine = nominal.shells.part == nominal.part(name)
        own, fitted = next(v for k, v in found.values.items() if k == f"t of {name}")
        rows.append((name, *(_mm(x) for x in theirs), _mm(1e3 * fitted), _mm(1e3 * own),
                     _mm(1e3 * mapped.thickness()[mine].mean())))  # fmt: skip
    columns = ("part", "thesis: calibrated", "nominal", "mean of mapped", "ours: calibrated",
               "nominal", "mean of mapped")  # fmt: skip
    others = [f"{k}: {_percent_change(v):+.1f} %" for k, v in found.values.items()
              if not k.startswith("t of ")]  # fmt: skip
    return [
        Table(columns, rows, ("part",), "t [mm]; the mean over the shells. Mass is not weighed."),
        Text([
            f"Free with them: {', '.join(others)}. The thesis states that t then compensates "
            "nothing. It is the reverse. A common thinning acts as a change of rho and E, so the "
            "values need not be those of the sheets. Four of the thesis' six lie below the mapped "
            "mean.",
        ]),
    ]  # fmt: skip


def _mm(x: float | None) -> str:
    return _NONE if x is None else f"{x:.4f}"


def _values(
    desk: Desk, fitted: DeviationFit, weighed: DiagnosisResult, scores: Sequence[ModelScore]
) -> list[Block]:
    model = desk.deck(STIFF)
    seen, patch = model.seen, about_welds(model)
    faces = np.isin(np.arange(len(seen.faces)), np.flatnonzero(patch))
    picture = scene.location(desk.folder / "figure_32.png", seen, faces=faces)
    known = {_called(c): c for c in weighed.calibrated}
    rows = []
    for name, value in fitted.values.items():
        theirs, c = _TABLE_12.get(name), known.get(name)
        rows.append((
            name, _NONE if theirs is None else f"{_percent_change(theirs):+.1f}",
            f"{_percent_change(value):+.1f}",
            *(("frozen", _NONE) if c is None else _interval(c)),
        ))  # fmt: skip
    columns = ("parameter", "thesis [%]", "ours, not weighed [%]", "ours, weighed [%]", "95 % [%]")
    change = compared(desk, "figure_33.png", {"stiff": "before", "calibrated": "after"})
    return [
        Picture(picture, f"Figure 32: {patch.sum()} shells that touch welds."),
        Table(columns, rows, ("parameter",), "Changes from the deck with stiff adhesive."),
        deviations((*TABLE_12["deviation"], None), scores,
                   ("before", "as the thesis", "with the weighed mass")),
        Picture(change, "Figure 33: before and after the calibration."),
        Items([
            "Without the mass the deviation metric alone is minimised, as FEMcali does. Density "
            "and stiffness absorb what the stand-in of the hem leaves.",
            *_on_bounds(fitted),
            f"With the mass as a datum, by `chladni calibrate`. Its verdict: {weighed.verdict}"
            ". Where it is *nothing missing* the deck keeps its values: no change of E and rho is "
            "more probable than the error of the model.",
            *weighed.distrust,
        ]),
    ]  # fmt: skip


def _on_bounds(fitted: DeviationFit) -> list[str]:
    """A sentence where the fit ends on a bound."""
    names = [k for k, (a, b) in fitted.values.items() if abs(np.log(b / a)) > 0.99 * FARTHEST]
    if not names:
        return []
    return [f"On the bound of the fit: {', '.join(names)}. Such a value stands for something else."]


def _called(c: CalibratedParameter) -> str:
    """Short name of a calibrated value."""
    return f"{c.estimate.name} of the weld patch" if "patch" in c.where else c.where.split(":")[0]


def _interval(c: CalibratedParameter) -> tuple[str, str]:
    """Change of a value, and its 95 % interval."""
    base, e = c.deck_value or 1.0, c.estimate
    value, low, high = (_NONE if x is None else f"{100 * (x / base - 1):+.1f}"
                        for x in (e.value, e.low, e.high))  # fmt: skip
    return value, f"{low} to {high}"
