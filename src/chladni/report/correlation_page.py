"""A correlation as a page: paired modes, MAC, Q by band and channel."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from ..case import Case
from ..ema.correlation import Quality
from ..ema.mac_significance import Likeness
from ..view import charts
from ..workflows.correlate import Correlation
from . import frf_charts
from .blocks import Block, Drawing, Facts, PageParts, Section, Table, Text
from .diagnosis_drawings import frequencies
from .mesh_drawings import case_shown, layout, shape_pairs
from .screening_blocks import screening_json, screening_section
from .words import criterion, hertz, number, percent

_SAME = 1e-6  # Q of responses that nobody could tell apart
_WORST = 10  # sensors in the table
_MEANING = (
    "δ = log10(H model / H test) is a complex number at every line of every channel. Its real "
    "part is 0.3 where the model moves twice as much as the test. Its imaginary part is 0.68 "
    "where its phase differs by 90°. Q is the mean of |δ|²: 0 is perfect, resonances and "
    "anti-resonances count equally. Here the model differs by {off}. A resonance that is off by "
    "a few per cent raises Q more than a wrong level."
)
_COMAC = (
    "CoMAC, over all paired modes: 1 where sensor and model move equally. A sensor far below the "
    "others may have a wrong place or direction, or the model lacks physics there."
)
_WORTH = (
    "MAC, and its largest value with the noise of the recording (–: none is stated). Seen on: "
    "sensors whose motion exceeds three standard deviations of its noise, and the MAC on them "
    "alone. By chance: "
    "probability that the best of random shapes, as many as the model has modes here, reaches "
    "that value; sensors that move together count once. With neighbours: share of the test's "
    "shape that the model's modes within 5 % in frequency represent together; close modes may "
    "mix."
)
_HALVES = (
    "The half of the sensors on which the pair agrees best. It shows where a MAC is low. It does "
    "not prove the pair: random mixtures of the model's modes may agree as well on their best "
    "half."
)
_ACROSS = (
    "ΦᵀMΨ is the cross-orthogonality with the model's mass on the sensors (SEREP): 1 for the "
    "model's own mode; the other entries are in correlation.json."
)
_MAC = "Modal assurance criterion in per cent; framed: the pairs of the table. Click one to see it."


def as_page(folder: Path, found: Correlation) -> PageParts:
    """Sections of the page; the test's shapes on the whole model are written into the folder."""
    case, p = found.origin, found.pairs
    shown = case_shown(case)
    drawn: list[Block] = []
    if found.mac is not None and found.mac.size:
        pairs = list(zip(p.test.tolist(), p.model.tolist(), strict=True))
        matrix = {"model": (found.mac.T, found.f_model, pairs)}
        chart = charts.mac(found.f_test, matrix, opens="shapes" if found.shapes else "")
        drawn.append(Drawing("mac", chart, _MAC, wide=found.shapes is None))
    mac = None if found.mac is None else found.mac.T
    drawn += shape_pairs(shown, found.shapes, found.sensors, mac, found.expanded)
    partner = dict(zip(p.test.tolist(), found.f_model[p.model].tolist(), strict=True))
    rows = [(f, partner.get(j), None) for j, f in enumerate(found.f_test.tolist())]
    responses, at = _responses(case, found)
    sensors = _sensors(found, at)
    if shown.outputs or shown.inputs:
        sensors.append(layout("where", shown, "setup", "Sensors and shaker."))
    ladder = frequencies(rows, ("model", "after"))
    return PageParts(
        _lead(found),
        [
            Section("Modes", [*drawn, _modes(found), *ladder, *_worth(found)]),
            Section("Sensors", sensors),
            Section("Responses", [*_scores(found, at), *responses]),
            screening_section(found.screening, folded=True),
        ],
        found.notes,
        expanded_shapes(folder, case, found),
    )


def expanded_shapes(folder: Path, case: Case, found: Correlation) -> list[tuple[str, str]]:
    """Write ``expanded.vtu``: (file, what it is); nothing where shapes were not expanded."""
    from ..io.vtu import write_vtu

    if found.expanded is None:
        return []
    write_vtu(folder / "expanded.vtu", case.assembly, found.expanded, found.f_test)
    return [("expanded.vtu", "the test's shapes on the whole model, for ParaView")]


def _responses(case: Case, found: Correlation) -> tuple[list[Block], dict[str, int]]:
    """Every channel of test and model on the lines that were compared; their positions."""
    if found.model is None:
        return [], {}
    f = found.model.frequency
    test = case.frfs[0].sel(band=(float(f[0]), float(f[-1])))
    chart, rows = frf_charts.responses(
        {"test": test, "model": found.model}, [case.band] if case.band else [], case.exclude
    )
    stills = {"frf": frf_charts.typical(chart, rows)}
    if len(rows) > 2:
        stills["frf_grid"] = frf_charts.overview(chart)
    at = {name.split(",")[0]: k for k, (name, *_) in enumerate(rows)}
    for k, (_, output, _) in enumerate(rows):
        at.setdefault(output, k)
    return [Drawing("frf", chart, f"{frf_charts.CAPTION} {frf_charts.OF_CURVES}", stills)], at


def in_words(found: Correlation) -> PageParts:
    """The page without its pictures."""
    sections = [
        Section("Modes", [_modes(found), *_worth(found)]),
        Section("Sensors", _sensors(found)),
        Section("Responses", _scores(found)),
        screening_section(found.screening),
    ]
    return PageParts(_lead(found), sections, found.notes)


def _lead(found: Correlation) -> str:
    p = found.pairs
    off = np.abs(found.f_model[p.model] / found.f_test[p.test] - 1)
    mean = f"{number(100 * float(off.mean()), 2)} %" if len(off) else "–"
    q = found.quality
    said = "" if q is None else f" Responses differ by {_off_by(q)} (Q = {number(q.Q, 3)})."
    return (
        f"{len(off)} of {len(found.f_test)} test modes have a partner in the model; the mean "
        f"frequency error is {mean}.{said}"
    )


def _off_by(q: Quality) -> str:
    """Q in words: the rms factor of |H| and the rms angle."""
    if q.Q < _SAME:
        return "next to nothing"
    factor, angle = 10 ** np.sqrt(q.magnitude), np.degrees(np.log(10) * np.sqrt(q.phase))
    return f"a factor of {number(float(factor), 3)} and {angle:.0f}° of phase (rms)"


def _modes(found: Correlation) -> Table:
    p = found.pairs
    across = found.cross_orthogonality
    rows = [
        (
            hertz(found.f_test[j]),
            hertz(found.f_model[i]),
            str(found.numbers[i]) if found.numbers else "–",
            percent(found.f_model[i], found.f_test[j]),
            criterion(value),
            *([] if across is None else [criterion(float(abs(across[i, j])))]),
        )
        for i, j, value in zip(p.model, p.test, p.mac, strict=True)
    ]
    heads = ["test [Hz]", "model [Hz]", "its mode", "off", "MAC"]
    heads += [] if across is None else ["ΦᵀMΨ"]
    caption = _alone(found) if across is None else f"{_alone(found)} {_ACROSS}"
    return Table(tuple(heads), rows, caption=caption, opens="shapes", at=p.test.tolist())


def _worth(found: Correlation) -> list[Block]:
    """Tabulate the significance of every MAC, and the best half of the sensors for poor ones."""
    if not found.likeness:
        return []
    f = [hertz(found.f_test[j]) for j in found.pairs.test]
    n, worth = len(found.sensors), found.likeness
    rows = [
        (at, criterion(w.mac), *_by_noise(w, n), number(w.chance, 2), criterion(w.space))
        for at, w in zip(f, worth, strict=True)
    ]  # fmt: skip
    heads = ("test [Hz]", "MAC", "noise leaves", "seen on", "MAC there", "by chance",
             "with neighbours")  # fmt: skip
    poor = [
        (at, criterion(w.mac), criterion(w.half), number(w.half_chance, 2))
        for at, w in zip(f, worth, strict=True)
        if np.isfinite(w.half)
    ]
    blocks: list[Block] = [Table(heads, rows, caption=_WORTH)]
    if poor:
        names = ("test [Hz]", "MAC", "best half", "random shapes reach it")
        blocks.append(Table(names, poor, caption=_HALVES))
    return blocks


def _by_noise(one: Likeness, sensors: int) -> tuple[str, str, str]:
    """The largest MAC with the noise, and the sensors above it; dashes where none is stated."""
    if np.isnan(one.noise_leaves):
        return "–", "–", "–"
    return criterion(one.noise_leaves), f"{one.seen} of {sensors}", criterion(one.seen_mac)


def _alone(found: Correlation) -> str:
    """List modes without a partner, on either side, and how modes are counted."""
    said = ["Mode numbers of the model include its rigid motions, as in `chladni modes`."]
    p, top = found.pairs, found.f_test.max(initial=0.0)
    test = [hertz(f) for f in found.f_test[p.alone_test]]
    model = [hertz(f) for f in found.f_model[p.alone_model] if f <= top]
    if test:
        said.append(f"Test modes without a partner in the model: {', '.join(test)} Hz.")
    if model:
        said.append(f"Model modes without a partner in the test: {', '.join(model)} Hz.")
    return " ".join(said)


def _sensors(found: Correlation, at: Mapping[str, int] = MappingProxyType({})) -> list[Block]:
    """CoMAC of every output, the worst first; ``at`` are the positions of the responses."""
    if found.comac is None:
        return []
    order = np.argsort(found.comac, kind="stable")[:_WORST]
    rows = [(found.sensors[k], criterion(float(found.comac[k]))) for k in order]
    more = len(found.comac) - len(rows)
    rest = f" The other {more} have at least {rows[-1][1]}." if more else ""
    places = [at.get(name) for name, _ in rows]
    return [Table(("sensor", "CoMAC"), rows, ("sensor",), _COMAC + rest, "frf", places)]


def _scores(found: Correlation, at: Mapping[str, int] = MappingProxyType({})) -> list[Block]:
    q = found.quality
    if q is None:
        return []
    channels = zip(found.channels, q.channel.ravel().tolist(), strict=True)
    worst = sorted(channels, key=lambda item: -item[1])[:8]
    bands = [
        (f"{low:.0f} to {high:.0f}", number(x, 3))
        for (low, high), x in zip(q.bands, q.band, strict=True)
    ]
    facts = [
        ("Q", f"{number(q.Q)}, of all {len(found.channels)} channels"),
        ("magnitude, phase", f"{number(q.magnitude, 3)}, {number(q.phase, 3)}"),
        ("Σ|δ|², not averaged", number(q.total)),
    ]
    return [
        Facts(facts),
        Text([_MEANING.format(off=_off_by(q))]),
        Table(("band [Hz]", "Q"), bands),
        Table(
            ("worst channels", "Q"),
            [(c, number(x, 3)) for c, x in worst],
            ("worst channels",),
            opens="frf",
            at=[at.get(c) for c, _ in worst],
        ),
    ]


def as_json(result: Correlation) -> dict[str, Any]:
    """The result for ``correlation.json``."""
    p, q, f, test = result.pairs, result.quality, result.f_model, result.f_test
    held: dict[str, Any] = {
        "modes": [
            {
                "test_hz": test[j],
                "model_hz": f[i],
                "model_mode": result.numbers[i],
                "deviation": f[i] / test[j] - 1,
                "mac": value,
            }
            for i, j, value in zip(p.model, p.test, p.mac, strict=True)
        ],
        "alone_test_hz": test[p.alone_test],
        "alone_model_hz": f[p.alone_model],
    }
    for mode, worth in zip(held["modes"], result.likeness, strict=False):
        mode["shape"] = vars(worth)
    if (across := result.cross_orthogonality) is not None:
        held["cross_orthogonality"] = {
            "model_mode": result.numbers, "test_hz": test, "values": across,
        }  # fmt: skip
    if result.screening is not None:
        held["screening"] = screening_json(result.screening)
    if result.comac is not None:
        held["comac"] = dict(zip(result.sensors, result.comac, strict=True))
    if q is not None:
        held["Q"] = {
            "mean": q.Q,
            "total": q.total,
            "magnitude": q.magnitude,
            "phase": q.phase,
            "channel": dict(zip(result.channels, q.channel.ravel(), strict=True)),
            "band": [{"band_hz": b, "Q": x} for b, x in zip(q.bands, q.band, strict=True)],
        }
    return held
