"""Tables of a blind benchmark: rates by hidden effect, confusion matrix, overall rates."""

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from .outcome_row import NULLS, QUANTITIES, Row
from .outside_kinds import OUTSIDE

OUTCOMES = ("right", "part", "among", "wrong", "none", "admitted", "refused", "crash")
FIGURES = {  # figures compared with plain calibration: text and factor
    "mass": ("mass off, %", 100.0),
    "E": ("E off, %", 100.0),
    "rho": ("rho off, %", 100.0),
    "t": ("t off, %", 100.0),
    "Q": ("held-out Q", 1.0),
    "Q_floor": ("its floor", 1.0),
}


def tables(rows: Sequence[Row]) -> str:
    """All tables of a score."""
    return "\n\n".join(
        [table(rows), confusion(rows), overall(rows), calibration_against_diagnosis(rows)]
    )


def table(rows: Sequence[Row]) -> str:
    """Table by hidden effect: outcomes, right family, right by evidence alone, place, gain.

    ``near`` and ``gain>50%`` count right answers. ``near`` are those at the right place.
    ``gain>50%`` are those that went half of the way from calibration's held-out Q to the floor.
    """
    wide = 2 + max([len(r["effect"]) for r in rows], default=6)
    heads = (*OUTCOMES, "family", "evidence", "near", "gain>50%")
    lines = [f"{'hidden':<{wide}}{'n':>4}" + "".join(f"{h:>10}" for h in heads)]
    for name in dict.fromkeys(r["effect"] for r in rows):
        mine = [r for r in rows if r["effect"] == name]
        cells = [str(sum(r["outcome"] == o for r in mine)) for o in OUTCOMES]
        cells.append(str(sum(r["kin"] for r in mine)))
        cells.append(str(sum(r["by_evidence"] == "right" for r in mine)))
        right = _right([r for r in mine if name not in NULLS])
        cells.append(_of([r["near"] for r in right if r["near"] is not None]))
        cells.append(_of([r["gain_share"] >= 0.5 for r in right if r["gain_share"] is not None]))
        lines.append(f"{name:<{wide}}{len(mine):>4}" + "".join(f"{c:>10}" for c in cells))
    return "\n".join(lines)


def confusion(rows: Sequence[Row]) -> str:
    """The confusion matrix: hidden effects in rows, names of the answers in columns."""
    names = sorted({r["effect"] for r in rows})
    given = sorted({_given(r) for r in rows})
    count = Counter((r["effect"], _given(r)) for r in rows)
    wide = max(map(len, names), default=6) + 2
    lines = [f"{'hidden':<{wide}}" + "".join(f"{k:>6}" for k in range(1, len(given) + 1))]
    for n in names:
        cells = "".join(f"{count[n, g] or '.':>6}" for g in given)
        lines.append(f"{n:<{wide}}{cells}")
    legend = [f"{k}: {g}" for k, g in enumerate(given, 1)]
    return "\n".join([*lines, "called " + ", ".join(legend)])


def _given(r: Row) -> str:
    """The name or verdict of an answer; the outcome where it has neither."""
    return str(r["outcome"] if r["outcome"] == "crash" else r["called"] or r["outcome"])


def overall(rows: Sequence[Row]) -> str:
    """Rates over all cases."""
    return "\n".join([*_names(rows), *_figures(rows), *_costs(rows)])


def _names(rows: Sequence[Row]) -> Iterator[str]:
    known = [r for r in rows if r["effect"] not in (*NULLS, *OUTSIDE)]
    right = _right(known)
    family = _of([r["kin"] for r in known])
    yield f"right name: {len(right)}/{len(known)}; right family: {family}"
    count = Counter(r["outcome"] for r in known)
    yield "effects of the catalogue: " + ", ".join(f"{count[o]} {o}" for o in OUTCOMES)
    better = [r["gain_share"] > 0 for r in rows if r["gain_share"] is not None]
    yield f"decks with an effect better than the calibrated one on held-out data: {_of(better)}"
    placed = [r["near"] for r in right if r["near"] is not None]
    yield f"right place, of the right names that have one: {_of(placed)}"
    nulls = [r for r in rows if r["effect"] in NULLS]
    alarms = sum(r["outcome"] in ("wrong", "among") for r in nulls)
    alone = sum(r["by_evidence"] in ("wrong", "among") for r in nulls)
    unsure = sum(r["outcome"] == "admitted" for r in nulls)
    yield (
        f"false alarms: {alarms} of {len(nulls)} that are exact or merely mis-calibrated "
        f"({alone} by evidence alone); {unsure} called unknown"
    )
    vetoes = [r for r in rows if r["vetoed"]]
    rightly = sum(r["veto_right"] for r in vetoes)
    yield f"the veto of the held-out data decided {len(vetoes)} times, {rightly} rightly"
    outside = [r for r in rows if r["effect"] in OUTSIDE]
    admitted, wrong = (sum(r["outcome"] == o for r in outside) for o in ("admitted", "wrong"))
    yield f"outside the catalogue: {admitted} admitted, {wrong} wrong of {len(outside)}"


def _figures(rows: Sequence[Row]) -> Iterator[str]:
    for name, what in {**{q: q for q in QUANTITIES}, "effect": "values of effects"}.items():
        inside, every = (sum(r["covered"][name][k] for r in rows) for k in (0, 1))
        if every:
            yield f"{what} inside the 90 % interval: {inside} of {every}"
    shares = [r["gain_share"] for r in _right(rows) if r["gain_share"] is not None]
    if shares:
        median = float(np.median(shares))
        yield (
            f"held-out Q of the right names: {median:.0%} of the way from calibration to the "
            f"floor (median of {len(shares)})"
        )
    yield from _tests_of_fit([r for r in rows if r["outcome"] == "right"])


def _tests_of_fit(right: Sequence[Row]) -> Iterator[str]:
    """Median and uniformity of p for right answers, by the mesh of their articles."""
    from scipy.stats import kstest

    for mesh in sorted({r["mesh"] for r in right}):
        p = np.array([r["p"] for r in right if r["mesh"] == mesh and r["p"] is not None], float)
        if len(p := p[np.isfinite(p)]):
            yield (
                f"p of the test of fit, {mesh}: {len(p)} right, median {np.median(p):.2f}, "
                f"least {p.min():.2f}, uniform p {kstest(p, 'uniform').pvalue:.2g}"
            )


def _costs(rows: Sequence[Row]) -> Iterator[str]:
    t, g = [r["seconds"] for r in rows], [r["gigabytes"] for r in rows]
    if rows:
        yield f"seconds: median {np.median(t):.0f}, most {max(t):.0f}; most {max(g):.1f} GB"


def calibration_against_diagnosis(rows: Sequence[Row]) -> str:
    """Plain calibration and the diagnosis on the same cases with effects: medians."""
    both = [
        (r["beside"]["calibration"], r["beside"]["diagnosis"])
        for r in rows
        if r["effect"] not in NULLS and r["beside"]["calibration"] is not None
    ]
    if not both:
        return "plain calibration was not tested"
    lines = [f"{'something hidden, medians':<28}{'calibration':>12}{'diagnosis':>12}{'n':>5}"]
    for key, (what, factor) in FIGURES.items():
        pairs = [(a[key], b[key]) for a, b in both if None not in (a[key], b[key])]
        if pairs:
            cells = "".join(f"{factor * x:>12.3g}" for x in np.median(pairs, axis=0))
            lines.append(f"{what:<28}{cells}{len(pairs):>5}")
    return "\n".join(lines)


def _right(rows: Sequence[Row]) -> list[Row]:
    return [r for r in rows if r["outcome"] == "right" and r["effect"] not in NULLS]


def _of(flags: Sequence[bool]) -> str:
    return f"{sum(flags)}/{len(flags)}" if flags else "-"
