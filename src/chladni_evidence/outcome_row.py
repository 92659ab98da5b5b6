"""An answer held against the opened truth: one row of the table, and the table."""

import re
from collections import Counter
from collections.abc import Sequence
from typing import Any

import numpy as np

from .blind_diagnosis import Answer
from .outside_kinds import OUTSIDE
from .pair_kinds import AND, members

Row = dict[str, Any]
NULLS = ("nothing", "calibration")
NAMED = ("missing physics", "measurement fault")
ADMITTED = ("not in catalogue", "nonlinear")
ALSO = {  # names that are right as well
    "duplicated-pair": ("sensor-fault",),
    "local-resonator": ("rattle",),
    "friction-joint": ("joint-friction", "viscoelastic-joint"),
    "foam": ("viscoelastic-joint", "compliant-support"),
}
NEAR = {"tailgate": 0.150}  # a place this far off is right [m]; else ``CLOSE``
CLOSE = 0.060
VETO = re.compile(r"(\S+) gained .* in -2 ln evidence but left the data no fit saw")


def row(answer: Answer, truth: Row) -> Row:
    """One case.

    ``outcome``: right, part (of several that were hidden some, and nothing else), wrong, none
    (nothing named where something was hidden), admitted (it says it does not know), among (one of
    several it cannot tell, the right one with them), refused, crash. ``by_evidence`` is the outcome
    had the held-out data no veto.
    """
    d = answer.result
    called, vetoed = _called(d), _vetoed(d)
    return {
        "structure": truth["structure"],
        "seed": truth["seed"],
        "mesh": truth["mesh"],
        "effect": truth["effect"],
        "called": called,
        "outcome": _outcome(answer, called, truth),
        "by_evidence": _outcome(answer, vetoed or called, truth),
        "vetoed": vetoed,
        "veto_right": None if vetoed is None else not _is(vetoed, truth),
        "place_m": _place(d, truth),
        "gain_share": _gain(d),
        "covered": _covered(d, truth),
        "p": (d.get("adequate") or {}).get("p"),
        "times_scatter": _times(truth),
        "seconds": answer.seconds,
        "gigabytes": answer.gigabytes,
        "said": answer.said if answer.code else "",
    }


def _called(d: Row) -> str:
    """The names given, else the verdict."""
    if d.get("verdict") in NAMED and d.get("effects"):
        return AND.join(sorted(str(e["name"]) for e in d["effects"]))
    return str(d.get("verdict", ""))


def _vetoed(d: Row) -> str | None:
    """The effect that led in evidence and was refused for what it does to the held-out data."""
    found = [m[1] for note in d.get("notes") or [] if (m := VETO.match(note))]
    return found[0] if found else None


def _outcome(answer: Answer, called: str, truth: Row) -> str:
    if answer.crashed:
        return "crash"
    if answer.code == 2:
        return "refused"
    among = [set(names) for names in answer.result.get("one_of") or []]
    if answer.code == 3 or called in ADMITTED:
        return "admitted"
    if called in ("nothing missing", "calibration only"):
        return "right" if truth["effect"] in NULLS else "none"
    if _is(called, truth):
        return "right" if _channel(answer.result, truth) else "wrong"
    if not Counter(members(called)) - Counter(members(truth["effect"])):
        return "part"
    return "among" if any({called, truth["effect"]} <= names for names in among) else "wrong"


def _is(called: str, truth: Row) -> bool:
    names = sorted(members(called)), sorted(members(truth["effect"]))
    return names[0] == names[1] or called in ALSO.get(truth["effect"], ())


def _channel(d: Row, truth: Row) -> bool:
    """A fault must be found in its channel (of a pair: in either)."""
    if "channel" not in truth or not d.get("effects"):
        return True
    return bool(
        {truth["channel"], truth.get("copy_of")} & set(d["effects"][0]["where"]["channels"])
    )


def _place(d: Row, truth: Row) -> float | None:
    """Distance of the place named from the true one [m]; of several the largest.

    One effect is held against the truth whatever its name, one of several against its namesake.
    """
    hidden = truth.get("effects") or [{**truth, "effect": None}]
    away = [
        min(float(np.linalg.norm(np.subtract(p, t["point_m"]))) for p in known)
        for t in hidden
        if "point_m" in t and (known := _points(d, t["effect"]))
    ]
    return max(away, default=None)


def _points(d: Row, name: str | None) -> list[list[float]]:
    """Places that were named, of this effect, or of the first."""
    effects = d.get("effects") or []
    those = effects[:1] if name is None else [e for e in effects if e["name"] == name]
    return [e["where"]["point_m"] for e in those if e["where"].get("point_m")]


def _gain(d: Row) -> float | None:
    """How far the effect brings the held-out Q from plain calibration's to the floor."""
    held = (d.get("fit") or {}).get("held_out") or {}
    before, after = held.get("Q_calibrated"), held.get("Q_with_effect")
    if before is None or after is None or not d.get("effects"):
        return None
    way = before - (held.get("Q_floor") or 0.0)
    return float((before - after) / way) if way > 0 else None


def _covered(d: Row, truth: Row) -> dict[str, list[int]]:
    """{E, rho, t: [intervals that hold the truth, intervals]}; of parts together: their mean.

    The mean is of logarithms, weighted with the parts' mass.
    """
    count = {name: [0, 0] for name in ("E", "rho", "t")}
    for entry in d.get("calibrated") or []:
        quantity, _, parts = entry["where"].partition(" of ")
        known = truth["values"].get(quantity, {})
        names = [n for n in parts.split(", ") if n in known]
        if quantity not in count or not names:
            continue
        weights = [truth["part_mass_kg"][n] for n in names]
        true = np.exp(np.average(np.log([known[n] for n in names]), weights=weights))
        count[quantity][0] += int(entry["low"] <= true <= entry["high"])
        count[quantity][1] += 1
    return count


def _times(truth: Row) -> float | None:
    if truth["effect"] == "nothing":
        return None
    return float(truth["moved_by_effect_decades"] / truth["moved_by_scatter_decades"])


def line(r: Row) -> str:
    """One case in a line."""
    words = [f"{r['structure']}, {r['mesh']}, seed {r['seed']}: {r['effect']}"]
    if r["times_scatter"] is not None:
        words[0] += f" ({r['times_scatter']:.1f} x scatter)"
    words[0] += f" -> {r['called'] or r['said'][:90]} [{r['outcome']}]"
    if r["place_m"] is not None:
        words.append(f"{1e3 * r['place_m']:.0f} mm off")
    if r["gain_share"] is not None:
        words.append(f"held-out gain {100 * r['gain_share']:.0f} %")
    if r["vetoed"]:
        words.append(f"veto of {r['vetoed']} {'right' if r['veto_right'] else 'WRONG'}")
    if r["p"] is not None:
        words.append(f"p {r['p']:.3f}")
    return ", ".join([*words, f"{r['seconds']:.0f} s, {r['gigabytes']:.1f} GB"])


OUTCOMES = ("right", "part", "among", "wrong", "none", "admitted", "refused", "crash")


def table(rows: Sequence[Row]) -> str:
    """Rates by hidden effect, then coverage, veto, time and memory over all."""
    wide = 2 + max([len(r["effect"]) for r in rows], default=6)
    heads = (*OUTCOMES, "evidence", "near", "gain>50%")
    lines = [f"{'hidden':<{wide}}{'n':>4}" + "".join(f"{h:>10}" for h in heads)]
    for name in dict.fromkeys(r["effect"] for r in rows):
        mine = [r for r in rows if r["effect"] == name]
        cells = [str(sum(r["outcome"] == o for r in mine)) for o in OUTCOMES]
        cells.append(str(sum(r["by_evidence"] == "right" for r in mine)))
        right = [r for r in mine if r["outcome"] == "right" and name not in NULLS]
        cells.append(_of([_near(r) for r in right if r["place_m"] is not None]))
        cells.append(_of([r["gain_share"] >= 0.5 for r in right if r["gain_share"] is not None]))
        lines.append(f"{name:<{wide}}{len(mine):>4}" + "".join(f"{c:>10}" for c in cells))
    return "\n".join([*lines, "", *_overall(rows)])


def _near(r: Row) -> bool:
    return bool(r["place_m"] <= NEAR.get(r["structure"], CLOSE))


def _of(flags: Sequence[bool]) -> str:
    return f"{sum(flags)}/{len(flags)}" if flags else "-"


def _overall(rows: Sequence[Row]) -> list[str]:
    lines = []
    for name in ("E", "rho", "t"):
        inside, every = (sum(r["covered"][name][k] for r in rows) for k in (0, 1))
        if every:
            lines.append(f"{name} inside its interval: {inside} of {every}")
    nulls = [r for r in rows if r["effect"] in NULLS]
    alarms = sum(r["by_evidence"] in ("wrong", "among") for r in nulls)
    lines.append(f"false alarms by evidence alone: {alarms} of {len(nulls)} nulls")
    vetoes = [r for r in rows if r["vetoed"]]
    rightly = sum(r["veto_right"] for r in vetoes)
    lines.append(f"the veto decided {len(vetoes)} times, {rightly} rightly")
    outside = [r for r in rows if r["effect"] in OUTSIDE]
    if outside:
        admitted, wrong = (sum(r["outcome"] == o for r in outside) for o in ("admitted", "wrong"))
        lines.append(f"outside the catalogue: {admitted} admitted, {wrong} wrong of {len(outside)}")
    t, g = [r["seconds"] for r in rows], [r["gigabytes"] for r in rows]
    if rows:
        lines.append(f"seconds: median {np.median(t):.0f}, most {max(t):.0f}; most {max(g):.1f} GB")
    return lines
