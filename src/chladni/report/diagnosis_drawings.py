"""Drawings of the page of a diagnosis: the place, the responses, the improvement, the modes."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from ..case import Case
from ..dynamics.modes import ModalModel
from ..effects.estimate import Location
from ..fem.energy import shell_energies
from ..fem.modelled import Modelled
from ..geometry.cells import point_means
from ..geometry.facets import cell_areas
from ..inference.result import Agreement, LeftPlace, NamedEffect, Scores
from ..view import charts, scene
from ..workflows.diagnosis_result import DiagnosisResult
from . import frf_charts, live_mesh
from .blocks import Drawing, Still, still
from .calibration_charts import study_drawings
from .information_map import information_map
from .level_blocks import level_drawings
from .mesh_drawings import TURN, field, layout, spatial
from .shown import CALM, Shown

MOST_MODES = 60  # of a matrix that can be read
_SHAPES = 6  # in a picture
MOST_ENERGY = 0.98  # share of the shells whose colours are within the limits
_FRF = (
    f"{frf_charts.CAPTION} White: fitted; grey: not fitted. Each mode of a deck has the damping "
    "identified for its partner in the test; without a partner, the damping of the case. "
    f"{frf_charts.OF_CURVES}"
)
_ONLY_SHOWN = " Frequencies were compared, not responses."
_LEFT = (
    "Gain of a small local change of stiffness or mass, with the named effects in place. Grey: the "
    "test is blind there; half of the stiffness or mass could be missing."
)
_SHAPES_SHOWN = (
    "The test shows motion at its sensors; the decks show the whole structure. Colour: share of "
    "the largest motion."
)
_MAC = "Modal assurance criterion, test against model; framed: the pairs of the table."
_ODDS = (
    "2 ln Bayes factor of the best explanation against each; up to 2 is no evidence, more than 10 "
    "is very strong (Kass and Raftery, 1995). Point at a bar for its reason."
)
_FIT = (
    "Residual of the explanation (dot) and of recordings drawn from the model (bar: 99 % of "
    "them). A dot to the right of its bar is not explained; a dot to the left means that the "
    "assumed noise is too large."
)


def drawings(case: Case, result: DiagnosisResult, shown: Shown) -> list[Drawing]:
    """All that the result allows, that of the first screen first."""
    made = [first] if (first := where(result, shown)).content or first.pictures else []
    made += [*_responses(shown), *_scores(result), *_left(result, shown)]
    made += _modes(case, result, shown)
    made += [*level_drawings(result.levels).values()]
    made += [*study_drawings(result.study), *_energy(result, shown)]
    if result.outlook is not None and result.next_measurements:
        made += [replace(d, place="next") for d in information_map(shown, [result.outlook])]
    if shown.outputs or shown.inputs:
        made.append(replace(layout("setup", shown, "setup", "Sensors and shaker."), place="test"))
    return made


def where(result: DiagnosisResult, shown: Shown) -> Drawing:
    """Places of named effects, sensors and shakers; without an effect, where the fit fails."""
    named: list[tuple[str, str, Location | LeftPlace, int]] = [
        (e.name, _words(e.name, e.where.text), e.where, 0) for e in result.effects
    ]
    if not named and result.adequate is not None:
        named = [("not explained", _words("not explained", place.text), place, 0)
                 for place in result.adequate.where]  # fmt: skip
    tied = set(result.one_of[0] if result.one_of else ()) - {e.name for e in result.effects}
    named += [(a.name, _words(a.name, a.where.text), a.where, 1)
              for a in result.alternatives if a.where is not None and a.name in tied]  # fmt: skip
    content = spatial("structure", shown, lambda: _structure(named, shown))
    stills = {}
    for k, effect in enumerate(result.effects):
        if (picture := _place_still(effect, shown)) is not None:
            stills["where" if k == 0 else f"where_{k + 1}"] = picture
    caption = f"{TURN} Point at anything for its name."
    if any(rank for *_, rank in named):
        caption += " Ochre: explanations that the data cannot distinguish from the finding."
    return Drawing("where", content, caption, stills, first="where", place="first")


def _words(name: str, place: str) -> str:
    return ": ".join(t for t in (name, place) if t)


def _structure(
    named: Sequence[tuple[str, str, Location | LeftPlace, int]], shown: Shown
) -> dict[str, object]:
    """Data of the first screen, seen from where the places are visible."""
    found, faces = live_mesh.spots(named, shown), shown.seen.points[shown.seen.faces].mean(axis=1)
    part = np.asarray(shown.seen.part)
    meant = [p for s in found for p in (s["at"], faces[np.isin(part, s["parts"])])]
    focus = np.concatenate([np.zeros((0, 3)), *meant])
    return {"spots": found, "setup": live_mesh.setup(shown),
            "from": live_mesh.view_of(focus, shown)}  # fmt: skip


def _place_still(effect: NamedEffect, shown: Shown) -> Still | None:
    """A marked point, else the grids, else the parts in colour; None without any."""
    where, faces = effect.where, None
    place, radius = live_mesh.marked(where, shown)
    if not len(place):
        if not (named := np.isin(list(shown.parts), list(where.parts))).any():
            return None
        faces = named[np.asarray(shown.seen.part)]
    text = " – ".join(t for t in (effect.name, where.text) if t)
    return partial(scene.location, seen=shown.seen, point=place if len(place) else None,
                   radius=radius, text=text, faces=faces)  # fmt: skip


def _responses(shown: Shown) -> Iterator[Drawing]:
    if "test" not in shown.curves:
        return
    chart, rows = frf_charts.responses(
        shown.curves, shown.fitted, shown.excluded, shown.held_out if shown.compared else ()
    )
    held = [o for o in shown.curves["test"].outputs if o in set(shown.held_out)]
    fitted = [o for o in shown.curves["test"].outputs if o not in held]
    kinds = {"frf_fitted": fitted, "frf_held_out": held} if shown.compared else {"frf": []}
    known = {output for _, output, _ in rows}
    stills = {name: frf_charts.typical(chart, rows, outputs) for name, outputs in kinds.items()
              if known.intersection(outputs) or name == "frf"}  # fmt: skip
    if len(rows) > 2:
        stills["frf_grid"] = frf_charts.overview(chart)
    caption = _FRF if shown.compared else _FRF + _ONLY_SHOWN
    yield Drawing("frf", chart, caption, stills, place="frf")


def _scores(result: DiagnosisResult) -> Iterator[Drawing]:
    q = result.agreement or Agreement()
    both = {"fitted": q.fitted, "held out": q.held_out}
    sides = {name: q_steps(scores, bool(result.effects)) for name, scores in both.items()}
    sides = {name: side for name, side in sides.items() if len(side) > 1}
    floors = {name: scores.floor for name, scores in both.items() if scores.floor is not None}
    if sides:
        files = {"fitted": "waterfall", "held out": "held_out"}
        stills = {files[n]: still(charts.steps({n: side}, floors)) for n, side in sides.items()}
        caption = "Deviation Q, step by step; dashed: the noise of the recording alone."
        yield Drawing("steps", charts.steps(sides, floors), caption, stills, place="scores")
    if result.adequate is not None and result.adequate.statistics:
        rows = {s.name: (s.value, s.median, s.low, s.high) for s in result.adequate.statistics}
        yield Drawing("fit_test", charts.fit_test(rows), _FIT, place="scores")
    named = " and ".join(e.name for e in result.effects)
    tried = [(named, e.log_evidence, "named") for e in result.effects[:1]]
    tried += [(a.name, a.log_evidence, a.why_not) for a in result.alternatives]
    known = [(name, float(value), why) for name, value, why in tried if value is not None]
    if len(known) > 1:
        chart = charts.odds(known)
        yield Drawing("odds", chart, _ODDS, {"evidence": still(chart)}, place="why")
    pairs = [(r.test_hz, r.before_hz, r.after_hz) for r in result.frequencies]
    yield from frequencies(pairs, ("before", "after"))


def frequencies(
    rows: Sequence[tuple[float, float | None, float | None]], names: tuple[str, str]
) -> Iterator[Drawing]:
    """Frequencies of the test, of the model before and, if there is one, after [Hz]."""
    held = [r for r in rows if r[0]]
    if not held:
        return
    test, before, after = np.array([[v or np.nan for v in r] for r in held], dtype=float).T
    sides = {names[0]: before}
    if np.isfinite(after).any():
        sides[names[1]] = after
    chart, text = charts.ladder(test, sides, "shapes"), "Deviation of each frequency from the test."
    yield Drawing("ladder", chart, text, {"frequencies": still(chart)}, place="modes")


def q_steps(q: Scores, named: bool) -> dict[str, float]:
    """Q of the decks, in the order of the updating; without an effect there are two."""
    steps = {"nominal": q.nominal, "calibrated": q.calibrated}
    if named:
        steps["with the effect"] = q.with_effect
    return {name: value for name, value in steps.items() if value is not None}


def _left(result: DiagnosisResult, shown: Shown) -> Iterator[Drawing]:
    """Draw the residual of the explanation on the mesh: grey where the test is blind."""
    left = result.residual_localisation
    if left is None:
        return
    of_faces = len(left.gain) > 0
    if of_faces:
        values = np.full(len(shown.seen.faces), np.nan)  # faces of shells come first
        values[: len(left.gain)] = left.gain
    else:
        beams = shown.seen.lines[: len(left.on_beams)]  # without shells all of them are members
        ends = np.repeat(left.on_beams[:, None], 2, axis=1)
        values = point_means(beams, ends, len(shown.seen.points))
    limits = (0.0, max(float(np.nanmax(values)), CALM))
    name = "gain of a local change of stiffness or mass [-2 ln p]"
    picture = {"left": partial(scene.scalar_map, seen=shown.seen, values=values, name=name,
                               cmap="magma_r", limits=limits)}  # fmt: skip
    content = spatial(
        "remainder", shown, lambda: live_mesh.field(values, shown, limits, "gain", "YlOrRd")
    ) if of_faces else None  # fmt: skip
    yield Drawing("left", content, _LEFT, picture, place="scores")


def stages(result: DiagnosisResult) -> dict[str, Modelled]:
    """Return the deck before and, if there is another, after."""
    if (models := result.models) is None:
        return {}
    found = {"before": models.nominal}
    return found | ({"after": models.final.model} if result.deck_changed else {})


def near_test(
    case: Case, result: DiagnosisResult
) -> dict[str, tuple[Modelled, ModalModel, np.ndarray | None, list[tuple[int, int]]]]:
    """Each deck with its modes near the test's, their MAC (test, model), and the pairs."""
    made = {}
    for name, model in stages(result).items():
        assert result.models is not None
        test, every = result.models.test, [getattr(r, f"{name}_hz") for r in result.frequencies]
        modes = test.near(model)
        modes = modes.sel(modes.frequency <= 1.1 * max([*filter(None, every), *test.frequency]))
        value = test.mac(case.outputs, model, modes)
        pairs = [(k, int(np.abs(modes.frequency - f).argmin())) for k, f in enumerate(every) if f]
        made[name] = (model, modes, None if value is None else value.T, pairs)
    return made


def _modes(case: Case, result: DiagnosisResult, shown: Shown) -> Iterator[Drawing]:
    if result.models is None or not result.frequencies:
        return
    decks = near_test(case, result)
    content = spatial("shapes", shown, lambda: _shapes(case, result, decks, shown))
    partners = any(r.after_hz for r in result.frequencies)
    picture = {"modes": partial(_montage, result, shown)} if partners else {}
    yield Drawing("shapes", content, f"{TURN} {_SHAPES_SHOWN}", picture, place="modes")
    found = {name: (mac, modes.frequency, pairs) for name, (_, modes, mac, pairs) in decks.items()
             if mac is not None and mac.size and max(mac.shape) <= MOST_MODES}  # fmt: skip
    if found:
        chart = charts.mac(result.models.test.frequency, found, opens="shapes")
        yield Drawing("mac", chart, _MAC, place="modes")


def _shapes(
    case: Case, result: DiagnosisResult,
    decks: Mapping[str, tuple[Modelled, ModalModel, np.ndarray | None, list[tuple[int, int]]]],
    shown: Shown,
) -> dict[str, object]:  # fmt: skip
    """Every mode of the test at its sensors, and the whole motion of the decks' modes."""
    assert result.models is not None
    rows = result.frequencies
    f = np.array([r.test_hz for r in rows], dtype=float)
    test = live_mesh.ModeSet(
        f, sensors=result.models.test.shapes, damping=[r.damping for r in rows]
    )
    sides = {"test": test}
    for name, (model, modes, *_) in decks.items():
        s = model.structure
        motion = np.asarray(s.T @ modes.shapes).reshape(-1, 6, len(modes))
        sides[name] = live_mesh.ModeSet(
            modes.frequency, motion[s.assembly.rows(shown.ids), :3],
            case.outputs.rows(s) @ modes.shapes,
        )  # fmt: skip
    partners = {name: dict(pairs) for name, (*_, pairs) in decks.items()}
    belong = [[k, *(of.get(k) for of in partners.values())] for k in range(len(rows))]
    mac = {f"test|{name}": value for name, (_, _, value, _) in decks.items() if value is not None}
    return live_mesh.shapes(sides, belong, shown, shown.outputs, mac)


def _montage(result: DiagnosisResult, shown: Shown, path: Path) -> None:
    """Shapes of the updated deck that have a partner in the test."""
    found = [r.after_hz for r in result.frequencies if r.after_hz][:_SHAPES]
    assert result.models is not None
    model = result.models.final.model
    f = model.modes.frequency
    at = [int(np.abs(f - one).argmin()) for one in found]
    motion = np.asarray(model.structure.T @ model.modes.shapes[:, at])
    deck = model.structure.assembly  # an added effect may have brought grids
    rows = deck.rows(shown.ids) if len(shown.ids) else slice(None)
    motion = motion.reshape(len(deck.points), 6, -1)[rows, :3]
    scene.montage(path, shown.seen, motion, f[at], [k + 1 for k in at])


def _energy(result: DiagnosisResult, shown: Shown) -> Iterator[Drawing]:
    """Draw where the worst modes store more strain energy than the others."""
    found = None if result.study is None else result.study.guidance
    if found is None or result.models is None or not found.good:
        return
    model = result.models.final.model
    shells = model.assembly.shells
    if not len(shells):
        return
    f, area = model.modes.frequency, cell_areas(model.assembly.points, shells.nodes)
    sides = []
    for modes in (found.worst, found.good):
        at = [int(np.abs(f - m.model_hz).argmin()) for m in modes]
        energy = shell_energies(model.structure, model.modes.shapes[:, at])
        sides.append((energy / energy.sum(axis=0)).mean(axis=1) / area * area.sum())
    values = np.full(len(shown.seen.faces), np.nan)  # faces of shells come first
    values[: len(shells)] = sides[0] - sides[1]
    top = float(np.quantile(np.abs(values[: len(shells)]), MOST_ENERGY))
    caption = "Strain energy per area of the worst modes less that of the others, over the mean."
    name = "strain energy, worst less other modes"
    made = field(shown, values, (-top, top), "energy", name, caption, "RdBu_r")
    yield replace(made, place="guidance")
