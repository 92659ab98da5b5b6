"""The pictures of a result: its place, the improvement, frequencies, responses."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..dynamics.frf import UNIT
from ..effects.estimate import Location
from ..ema.correlation import deviation
from ..fem.energy import shell_energies
from ..geometry.cells import point_means
from ..geometry.facets import cell_areas
from ..inference.calibration_result import CalibrationStudy
from ..inference.result import Alternative, NamedEffect, Scores
from ..view import calibration_plots, plots, scene
from ..workflows.diagnosis_result import DiagnosisResult
from .level_blocks import draw_levels
from .shown import CALM, Shown
from .words import hertz

_GRID = 8  # channels in the overview
_SHAPES = 6
MOST_ENERGY = 0.98  # share of the shells whose colours are within the limits


def figures(folder: Path, result: DiagnosisResult, shown: Shown) -> dict[str, Path]:
    """Draw all that the result allows into ``folder``: {name known to the page: path}."""
    rows = [(r.test_hz, r.before_hz, r.after_hz) for r in result.frequencies]
    made = _places(folder, result, shown) | setup(folder, shown)
    made |= _scores(folder, result) | _left(folder, result, shown)
    made |= frequencies(folder, rows) | mac_picture(folder, shown) | _modes(folder, result, shown)
    made |= {path.stem: path for path in draw_levels(folder, result.levels).values()}
    made |= _energy(folder, result, shown)
    return made | _study(folder, result.study) | curves(folder, shown)


def _energy(folder: Path, result: DiagnosisResult, shown: Shown) -> dict[str, Path]:
    """Draw where the worst modes store more strain energy than the others."""
    found = None if result.study is None else result.study.guidance
    if found is None or result.models is None or not found.good:
        return {}
    model = result.models.final.model
    shells = model.assembly.shells
    if not len(shells):
        return {}
    f, area = model.modes.frequency, cell_areas(model.assembly.points, shells.nodes)
    sides = []
    for modes in (found.worst, found.good):
        at = [int(np.abs(f - m.model_hz).argmin()) for m in modes]
        energy = shell_energies(model.structure, model.modes.shapes[:, at])
        sides.append((energy / energy.sum(axis=0)).mean(axis=1) / area * area.sum())
    values = np.full(len(shown.seen.faces), np.nan)  # faces of shells come first
    values[: len(shells)] = sides[0] - sides[1]
    top = float(np.quantile(np.abs(values[: len(shells)]), MOST_ENERGY))
    name = "strain energy of the worst modes less that of the others"
    path = scene.scalar_map(
        folder / "energy.png", shown.seen, values, name, cmap="RdBu_r", limits=(-top, top)
    )
    return {"energy": path}


def _study(folder: Path, study: CalibrationStudy | None) -> dict[str, Path]:
    """Draw profiles, the posterior by pairs and response bands of a calibration."""
    made: dict[str, Path] = {}
    if study is None:
        return made
    if study.profiles:
        rows = [(p.name, p.neg2_log_likelihood, p.quadratic) for p in study.profiles]
        path = folder / "profiles.png"
        made["profiles"] = calibration_plots.likelihood_profiles(path, rows)
    names, C, draws = study.names, np.array(study.covariance), None
    if (sample := study.sample) is not None:
        names = tuple(p.name for p in sample.parameters)
        C = np.array(sample.gaussian_covariance)
        draws = np.array(sample.draws) - np.array(sample.gaussian_mean)
    if len(names) > 1:
        made["corner"] = calibration_plots.corner(folder / "corner.png", names, C, draws)
    if study.articles:
        units = [(p.name, p.spread, [a.away for a in p.articles], [a.reach for a in p.articles])
                 for p in study.articles]  # fmt: skip
        each = [a.article for a in study.articles[0].articles]
        made["articles"] = calibration_plots.unit_places(folder / "articles.png", units, each)
    if study.bands:
        bands = [
            (
                f"{b.label}, {'held out' if b.held_out else 'fitted'}", np.array(b.frequency),
                np.array(b.measured), np.array(b.low), np.array(b.high),
            )
            for b in study.bands
        ]  # fmt: skip
        made["bands"] = calibration_plots.response_bands(folder / "bands.png", bands)
    return made


def _places(folder: Path, result: DiagnosisResult, shown: Shown) -> dict[str, Path]:
    made = {}
    for k, effect in enumerate(result.effects):
        name = "where" if k == 0 else f"where_{k + 1}"
        if (path := _where(folder / f"{name}.png", effect, shown)) is not None:
            made[name] = path
    return made


def setup(folder: Path, shown: Shown) -> dict[str, Path]:
    """Draw the places of sensors and shakers."""
    if not (shown.outputs or shown.inputs):
        return {}
    path, ends = folder / "setup.png", (shown.outputs, shown.inputs)
    return {"setup": scene.sensors(path, shown.seen, *ends, cords=shown.cords)}


def _where(path: Path, effect: NamedEffect, shown: Shown) -> Path | None:
    """A marked point, else the grids, else the parts in colour."""
    where, place = effect.where, None
    if where.point_m is not None:
        place = np.array(where.point_m, dtype=float)
    elif len(shown.ids) and (marked := np.isin(shown.ids, where.grids)).any():
        place = shown.seen.points[marked]  # rows as ids
    faces = None if place is not None else _of_parts(where, shown)
    if place is None and faces is None:
        return None
    text = " – ".join(t for t in (effect.name, where.text) if t)
    return scene.location(path, shown.seen, place, where.radius_m or 0.0, text, faces)


def _of_parts(where: Location, shown: Shown) -> np.ndarray | None:
    """Faces of the parts that are named (m,) bool."""
    named = np.isin(list(shown.parts), list(where.parts))
    return named[np.asarray(shown.seen.part)] if named.any() else None


def _scores(folder: Path, result: DiagnosisResult) -> dict[str, Path]:
    made = {}
    if result.agreement is not None:
        sides = (("waterfall", result.agreement.fitted), ("held_out", result.agreement.held_out))
        for name, q in sides:
            if len(steps := q_steps(q, bool(result.effects))) > 1:
                made[name] = plots.waterfall(folder / f"{name}.png", steps, q.floor)
    named = {" and ".join(e.name for e in result.effects): e for e in result.effects[:1]}
    tried: dict[str, NamedEffect | Alternative] = named | {a.name: a for a in result.alternatives}
    evidence = {k: h.log_evidence for k, h in tried.items() if h.log_evidence is not None}
    if len(evidence) > 1:
        made["evidence"] = plots.evidence_bars(folder / "evidence.png", evidence)
    if result.adequate is not None and result.adequate.statistics:
        rows = {s.name: (s.value, s.median, s.low, s.high) for s in result.adequate.statistics}
        made["fit_test"] = plots.fit_test(folder / "fit_test.png", rows)
    return made


def _modes(folder: Path, result: DiagnosisResult, shown: Shown) -> dict[str, Path]:
    """Shapes of the updated deck that have a partner in the test."""
    found = [r.after_hz for r in result.frequencies if r.after_hz][:_SHAPES]
    if result.models is None or not found:
        return {}
    model = result.models.final.model
    f = model.modes.frequency
    at = [int(np.abs(f - one).argmin()) for one in found]
    motion = np.asarray(model.structure.T @ model.modes.shapes[:, at])
    deck = model.structure.assembly  # an added effect may have brought grids
    rows = deck.rows(shown.ids) if len(shown.ids) else slice(None)
    motion = motion.reshape(len(deck.points), 6, -1)[rows, :3]
    path, numbers = folder / "modes.png", [k + 1 for k in at]
    return {"modes": scene.montage(path, shown.seen, motion, f[at], numbers)}


def _left(folder: Path, result: DiagnosisResult, shown: Shown) -> dict[str, Path]:
    """Draw the residual of the explanation on the mesh: grey where the test is blind."""
    left = result.residual_localisation
    if left is None:
        return {}
    if len(left.gain):
        values = np.full(len(shown.seen.faces), np.nan)  # faces of shells come first
        values[: len(left.gain)] = left.gain
    else:
        beams = shown.seen.lines[: len(left.on_beams)]  # without shells all of them are members
        ends = np.repeat(left.on_beams[:, None], 2, axis=1)
        values = point_means(beams, ends, len(shown.seen.points))
    top = max(float(np.nanmax(values)), CALM)
    name = "gain of a local change of stiffness or mass [-2 ln p]"
    path = scene.scalar_map(
        folder / "left.png", shown.seen, values, name, cmap="magma_r", limits=(0.0, top)
    )
    return {"left": path}


def q_steps(q: Scores, named: bool) -> dict[str, float]:
    """Draw Q of the decks, in the order of the updating; without an effect there are two."""
    steps = {"nominal": q.nominal, "calibrated": q.calibrated}
    if named:
        steps["with the effect"] = q.with_effect
    return {name: value for name, value in steps.items() if value is not None}


def frequencies(
    folder: Path, rows: Sequence[tuple[float, float | None, float | None]]
) -> dict[str, Path]:
    """Draw frequencies of the test, of the model before and, if there is one, after [Hz]."""
    held = [r for r in rows if r[0]]
    if not held:
        return {}
    test, before, after = np.array([[v or np.nan for v in r] for r in held], dtype=float).T
    changed = after if np.isfinite(after).any() else None
    path = folder / "frequencies.png"
    return {"frequencies": plots.frequency_ladder(path, test, before, changed)}


def mac_picture(folder: Path, shown: Shown) -> dict[str, Path]:
    """MAC of test and model modes."""
    if shown.mac is None:
        return {}
    mac, test, model = shown.mac
    rows, columns = ([hertz(f) for f in side] for side in (test, model))
    title = "Test (rows), model (columns) [Hz]" + (", pairs framed" if shown.pairs else "")
    path = folder / "mac.png"
    return {"mac": plots.mac_matrix(path, mac, rows, columns, title, shown.pairs)}


def curves(folder: Path, shown: Shown) -> dict[str, Path]:
    """Draw one channel of each kind, the median and not the best, and an overview."""
    if "test" not in shown.curves:
        return {}
    test, made = shown.curves["test"], {}
    held = [o for o in test.outputs if o in set(shown.held_out)]
    kinds = {"frf_fitted": [o for o in test.outputs if o not in held], "frf_held_out": held}
    if not shown.compared:
        kinds = {"frf": list(test.outputs)}
    typical = {name: _typical(shown, labels) for name, labels in kinds.items() if labels}
    for name, (output, drive) in typical.items():
        title = f"{output} from {drive}" + (" (held out)" if name == "frf_held_out" else "")
        made[name] = plots.frf(
            folder / f"{name}.png",
            _channel(shown, output, drive),
            title,
            UNIT.get(test.quantity, ""),
            shown.fitted,
            shown.excluded,
        )
    if len(test.outputs) * len(test.inputs) > 2:
        made["frf_grid"] = _overview(folder / "frf_grid.png", shown, held)
    return made


def _overview(path: Path, shown: Shown, held: Sequence[str]) -> Path:
    """Channels spread evenly over the list."""
    test = shown.curves["test"]
    every = [(o, i) for i in test.inputs for o in test.outputs]
    some = [every[k] for k in np.unique(np.linspace(0, len(every) - 1, _GRID).astype(int))]
    channels = {
        f"{o} from {i}" + (" (held out)" if o in held else ""): _channel(shown, o, i)
        for o, i in some
    }
    return plots.frf_grid(path, channels, UNIT.get(test.quantity, ""), shown.fitted, shown.excluded)


def _channel(shown: Shown, output: str, drive: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    found = {}
    for name, frf in shown.curves.items():
        one = frf.sel(outputs=[output], inputs=[drive])
        found[name] = (one.frequency, one.values[:, 0, 0])
    return found


def _typical(shown: Shown, outputs: Sequence[str]) -> tuple[str, str]:
    """The channel whose deviation after is the median one."""
    test = shown.curves["test"].sel(outputs=outputs)
    names = [name for name in ("after", "before", "model") if name in shown.curves]
    model = shown.curves[names[0]] if names else None
    if model is None:
        return test.outputs[0], test.inputs[0]
    delta = np.abs(deviation(model.sel(outputs=outputs), test)) ** 2
    size = np.nanmean(delta, axis=0)
    i, j = np.unravel_index(np.argsort(size, axis=None)[size.size // 2], size.shape)
    return test.outputs[i], test.inputs[j]
