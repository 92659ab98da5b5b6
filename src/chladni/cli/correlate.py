"""``chladni correlate``: how far model and recording are apart, before anything is changed."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer

from ..case import Case, load_case
from ..dynamics.frf import FRF
from ..dynamics.modes import ModalModel, rigid_modes
from ..ema.correlation import Quality, comac, deviation, mac, quality
from ..ema.identification import Identified, identify
from ..ema.mode_pairing import ModePairs, pair
from ..errors import ChladniError, FileError
from ..report.blocks import Block, Facts, Picture, Table
from ..report.words import number, percent
from ..workflows.case_model import DAMPING, markers, model_frf
from ..workflows.loaded_model import Model, is_case
from .frf import REACH
from .identify import firm
from .run import Out, Run, started

if TYPE_CHECKING:
    from ..report.figures import Shown

_BANDS = 6


@dataclass(frozen=True, eq=False)
class Correlation:
    """Test and model side by side: paired modes with shapes at the sensors, and Q."""

    test: ModalModel | Identified | None
    f_test: np.ndarray
    f_model: np.ndarray
    mac: np.ndarray | None  # (model, test)
    pairs: ModePairs
    comac: np.ndarray | None
    quality: Quality | None
    model: FRF | None


def run(
    source: Annotated[Path, typer.Argument(metavar="CASE")],
    out: Out = None,
) -> None:
    """Paired modes, MAC, and the deviation Q by channel and band, nothing calibrated."""
    with started("correlate", source, out) as job:
        case, model = opened(source)
        found = correlated(job, case, model)
        d = summary(case, found)
        job.json("correlation.json", d)
        job.progress("pictures", 0.8)
        _page(job, case, model, found, d)


def opened(source: Path) -> tuple[Case, Model]:
    """A case and its model.

    Raises
    ------
    FileError
        If it is no case.
    """
    if source.exists() and not is_case(source):
        raise FileError(f"{source} is no case; give a folder with case.toml")
    case = load_case(source)
    return case, Model(source, case.assembly)


def correlated(job: Run, case: Case, model: Model) -> Correlation:
    """Identify the first recording, pair its modes with the model's, score the responses."""
    job.notes.extend(case.notes)
    test = case.frfs[0] if case.frfs else None
    top = _top(case, test)
    job.progress(f"modes of {len(model.structure.system.dofs)} degrees of freedom", 0.1)
    modal = _modes(model, REACH * top).with_damping(case.damping or DAMPING)
    inside = ~rigid_modes(modal) & (modal.frequency <= 1.3 * top)
    near = modal.sel(np.flatnonzero(inside))
    if test is None:
        return _by_poles(case, near)
    job.progress("modes of the test", 0.4)
    found = identify(test, case.band, use=case.lines(test.frequency))
    found = found.sel(firm(found) & (found.frequency >= found.band[0]))
    phi = case.outputs.rows(model.structure) @ near.shapes
    psi = _shapes(found)
    M = mac(phi, psi) if len(test.outputs) > 2 else None
    pairs = pair(near.frequency, found.frequency, M)
    job.progress("responses", 0.6)
    modelled, q = _scored(job, case, model, modal, test)
    by_dof = (
        comac(phi[:, pairs.model], psi[:, pairs.test]) if M is not None and len(pairs) else None
    )
    return Correlation(found, found.frequency, near.frequency, M, pairs, by_dof, q, modelled)


def _top(case: Case, test: FRF | None) -> float:
    """Highest frequency the test speaks of [Hz]."""
    if case.band is not None:
        return case.band[1]
    if test is not None:
        return float(test.frequency[-1])
    return max(float(r.poles.frequency.max()) for r in case.recordings if r.poles is not None)


def _modes(model: Model, limit: float) -> ModalModel:
    from ..dynamics.eigen import normal_modes

    return normal_modes(model.structure.system, band=limit, points=model.places)


def _by_poles(case: Case, near: ModalModel) -> Correlation:
    poles = next(r.poles for r in case.recordings if r.poles is not None)
    f = poles.of(poles.states[0]).frequency
    pairs = pair(near.frequency, f)
    return Correlation(None, f, near.frequency, None, pairs, None, None, None)


def _shapes(found: Identified) -> np.ndarray:
    """Shapes of the test (n_out, r): the residues of the input that drives each mode most."""
    size = np.linalg.norm(found.residues, axis=1)
    best = size.argmax(axis=1)
    return np.stack([R[:, j] for R, j in zip(found.residues, best, strict=True)], axis=1)


def _scored(
    job: Run, case: Case, model: Model, modal: ModalModel, test: FRF
) -> tuple[FRF, Quality | None]:
    use = case.lines(test.frequency) if case.band or case.exclude else test.frequency > 0
    low, high = test.frequency[use][[0, -1]]
    seen = test.sel(band=(max(float(low), 1e-9), float(high)))
    modelled = model_frf(case, model, modal, seen)
    ends = np.linspace(low, high, _BANDS + 1)
    bands = tuple(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True))
    weight = case.lines(seen.frequency)[:, None, None].astype(float)
    try:
        delta = deviation(modelled, seen)
    except ChladniError as error:
        job.notes.append(f"No Q could be formed: {error}.")
        return modelled, None
    if not case.gain_known:
        delta = delta - np.median(delta.real)
        job.notes.append("The gain is unknown, so Q was taken after one common factor was removed.")
    return modelled, quality(delta, seen.frequency, bands, weight)


def summary(case: Case, found: Correlation) -> dict[str, Any]:
    """What ``correlation.json`` holds."""
    p, q = found.pairs, found.quality
    held: dict[str, Any] = {
        "modes": [
            {
                "test_hz": found.f_test[j],
                "model_hz": found.f_model[i],
                "deviation": found.f_model[i] / found.f_test[j] - 1,
                "mac": value,
            }
            for i, j, value in zip(p.model, p.test, p.mac, strict=True)
        ],
        "alone_test_hz": found.f_test[p.alone_test],
        "alone_model_hz": found.f_model[p.alone_model],
    }
    if found.comac is not None:
        held["comac"] = dict(zip(case.outputs.labels, found.comac, strict=True))
    if q is not None:
        channels = [f"{o} from {i}" for o in case.outputs.labels for i in case.inputs.labels]
        held["Q"] = {
            "mean": q.Q,
            "total": q.total,
            "channel": dict(zip(channels, q.channel.ravel(), strict=True)),
            "band": [{"band_hz": b, "Q": x} for b, x in zip(q.bands, q.band, strict=True)],
        }
    return held


def _page(job: Run, case: Case, model: Model, found: Correlation, d: dict[str, Any]) -> None:
    from ..report.figures import figures

    off = [abs(m["deviation"]) for m in d["modes"]]
    mean = f"{number(100 * float(np.mean(off)), 2)} %" if off else "–"
    q = "" if found.quality is None else f", Q = {number(found.quality.Q, 3)}"
    job.lead = (
        f"{len(off)} of {len(found.f_test)} test modes have a partner in the model, "
        f"{mean} off on average{q}."
    )
    drawn = figures(job.folder, _like_diagnosis(d), _shown(case, model, found))
    job.files += [(p.name, p.stem.replace("_", " ")) for p in drawn.values()]
    job.section("Modes", [_modes_table(d), *_pictures(drawn, ("frequencies", "mac"))])
    job.section("Responses", [*_scores(d), *_pictures(drawn, ("frf_fitted", "frf_grid"))])
    job.section("The test", _pictures(drawn, ("setup",)))
    job.say(job.lead)


def _shown(case: Case, model: Model, found: Correlation) -> "Shown":
    from ..report.figures import Shown

    curves, mac_of = {}, None
    if found.model is not None:
        f = found.model.frequency
        test = case.frfs[0].sel(band=(float(f[0]), float(f[-1])))
        curves = {"test": test, "model": found.model}
    if found.mac is not None:
        mac_of = (found.mac.T, found.f_test, found.f_model)
    return Shown(
        model.seen,
        curves=curves,
        fitted=[case.band] if case.band else [],
        excluded=case.exclude,
        outputs=markers(case.outputs),
        inputs=markers(case.inputs),
        mac=mac_of,
    )


def _like_diagnosis(d: dict[str, Any]) -> dict[str, Any]:
    """The paired modes as the page of a diagnosis holds them."""
    return {
        "frequencies": [{"test_hz": m["test_hz"], "before_hz": m["model_hz"]} for m in d["modes"]]
    }


def _pictures(drawn: dict[str, Path], names: Sequence[str]) -> list[Block]:
    return [Picture(drawn[name]) for name in names if name in drawn]


def _modes_table(d: dict[str, Any]) -> Table:
    rows = [
        (
            number(m["test_hz"], 5),
            number(m["model_hz"], 5),
            percent(m["model_hz"], m["test_hz"]),
            number(m["mac"], 3),
        )
        for m in d["modes"]
    ]
    alone = [f"{number(f, 4)} Hz" for f in d["alone_test_hz"]]
    caption = f"Without a partner in the model: {', '.join(alone)}." if alone else ""
    return Table(("test [Hz]", "model [Hz]", "off", "MAC"), rows, caption=caption)


def _scores(d: dict[str, Any]) -> list[Block]:
    if "Q" not in d:
        return []
    q = d["Q"]
    worst = sorted(q["channel"].items(), key=lambda item: -item[1])[:8]
    bands = [
        (f"{number(b['band_hz'][0])} to {number(b['band_hz'][1])}", number(b["Q"], 3))
        for b in q["band"]
    ]
    meaning = "Q: mean over channels and lines of |log10(H model / H test)|²; lower is better."
    return [
        Facts([("Q", number(q["mean"])), ("Σ|δ|², the thesis' own", number(q["total"]))]),
        Table(("band [Hz]", "Q"), bands, caption=meaning),
        Table(("worst channels", "Q"), [(c, number(x, 3)) for c, x in worst], ("worst channels",)),
    ]
