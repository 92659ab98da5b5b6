"""A correlation as a page: paired modes, MAC, Q by band and channel."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ..case import Case
from ..view.surface import surface
from ..workflows.case_model import markers
from ..workflows.correlate import Correlation
from .blocks import Block, Facts, PageParts, Picture, Section, Table
from .figures import Shown, curves, frequencies, mac_picture, setup
from .screening_blocks import screening_section
from .words import number, percent


def correlation_page(folder: Path, case: Case, found: Correlation) -> PageParts:
    """Sections of the page; its pictures are written into the folder."""
    p, shown = found.pairs, _shown(case, found)
    rows = [(found.f_test[j], found.f_model[i], None) for i, j in zip(p.model, p.test, strict=True)]
    drawn = frequencies(folder, rows) | mac_picture(folder, shown)
    drawn |= curves(folder, shown) | setup(folder, shown)
    return PageParts(
        _lead(found),
        [
            screening_section(found.screening),
            Section("Modes", [_modes(found), *_pictures(drawn, ("frequencies", "mac"))]),
            Section("Responses", [*_scores(found), *_pictures(drawn, ("frf", "frf_grid"))]),
            Section("The test", _pictures(drawn, ("setup",))),
        ],
        found.notes,
        [(path.name, path.stem.replace("_", " ")) for path in drawn.values()],
    )


def _lead(found: Correlation) -> str:
    p = found.pairs
    off = np.abs(found.f_model[p.model] / found.f_test[p.test] - 1)
    mean = f"{number(100 * float(off.mean()), 2)} %" if len(off) else "–"
    q = "" if found.quality is None else f", Q = {number(found.quality.Q, 3)}"
    return (
        f"{len(off)} of {len(found.f_test)} test modes have a partner in the model, "
        f"{mean} off on average{q}."
    )


def _shown(case: Case, found: Correlation) -> Shown:
    curves_of, mac_of = {}, None
    if found.model is not None:
        f = found.model.frequency
        test = case.frfs[0].sel(band=(float(f[0]), float(f[-1])))
        curves_of = {"test": test, "model": found.model}
    if found.mac is not None and found.mac.size:
        mac_of = (found.mac.T, found.f_test, found.f_model)
    return Shown(
        surface(case.assembly),
        curves=curves_of,
        compared=False,
        fitted=[case.band] if case.band else [],
        excluded=case.exclude,
        outputs=markers(case.outputs),
        inputs=markers(case.inputs),
        mac=mac_of,
    )


def _pictures(drawn: dict[str, Path], names: Sequence[str]) -> list[Block]:
    return [Picture(drawn[name]) for name in names if name in drawn]


def _modes(found: Correlation) -> Table:
    p = found.pairs
    rows = [
        (
            number(found.f_test[j], 5),
            number(found.f_model[i], 5),
            percent(found.f_model[i], found.f_test[j]),
            number(value, 3),
        )
        for i, j, value in zip(p.model, p.test, p.mac, strict=True)
    ]
    alone = [f"{number(f, 4)} Hz" for f in found.f_test[p.alone_test]]
    caption = f"Without a partner in the model: {', '.join(alone)}." if alone else ""
    return Table(("test [Hz]", "model [Hz]", "off", "MAC"), rows, caption=caption)


def _scores(found: Correlation) -> list[Block]:
    q = found.quality
    if q is None:
        return []
    channels = zip(found.channels, q.channel.ravel().tolist(), strict=True)
    worst = sorted(channels, key=lambda item: -item[1])[:8]
    bands = [
        (f"{number(low)} to {number(high)}", number(x, 3))
        for (low, high), x in zip(q.bands, q.band, strict=True)
    ]
    meaning = "Q: mean over channels and lines of |log10(H model / H test)|²; lower is better."
    return [
        Facts([("Q", number(q.Q)), ("Σ|δ|², the thesis' own", number(q.total))]),
        Table(("band [Hz]", "Q"), bands, caption=meaning),
        Table(("worst channels", "Q"), [(c, number(x, 3)) for c, x in worst], ("worst channels",)),
    ]
