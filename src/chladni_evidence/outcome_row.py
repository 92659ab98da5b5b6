"""An answer held against the opened truth: one row of the table."""

import re
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from .blind_diagnosis import Answer
from .pair_kinds import AND, catalogued, members

Row = dict[str, Any]
NULLS = ("nothing", "calibration")
QUANTITIES = ("E", "rho", "t", "wall")
NAMED = ("missing physics", "measurement fault")
PLAINLY = ("nothing missing", "calibration only")
ADMITTED = ("not in catalogue", "nonlinear")
ALSO = {  # names that are right as well
    "duplicated-pair": ("sensor-fault",),
    "local-resonator": ("rattle",),
    "friction-joint": ("joint-friction", "viscoelastic-joint"),
    "foam": ("viscoelastic-joint", "compliant-support"),
}
KIN = (  # what changes the same operator: the right family, if not the right name
    {"thickness-distribution", "orthotropic-material", "stiffness-patch", "crack",
     "membrane-prestress"},
    {"weld-missing", "weld-compliance", "adhesive-stiffness", "hem-contact", "contact-stiffness",
     "over-constraint", "viscoelastic-joint", "joint-friction", "rattle", "friction-joint"},
    {"point-mass", "mass-patch", "sensor-mass"},
    {"local-resonator", "suspension", "extra-support", "compliant-support", "shaker-restraint"},
    {"sensor-fault", "chain-delay", "duplicated-pair"},
)  # fmt: skip
NEAR = {"tailgate": 0.150}  # a place this far off is right [m]; else ``CLOSE``
CLOSE = 0.060
DRAWN_IN = 1.645 / 1.960  # intervals are written for 95 %, and scored for 90 %
VETO = re.compile(
    r"(\S+) gained .* in -2 ln evidence, but the (?:data|deck with it is worse on the data) "
    r"that no fit saw"
)


def row(answer: Answer, truth: Row, plain: Answer | None = None) -> Row:
    """One case.

    ``outcome``: right, part (of several that were hidden some, and nothing else), wrong, none
    (nothing named where something was hidden), admitted (it says it does not know), among (one of
    several it cannot tell, the right one with them), refused, crash. ``by_evidence`` is the outcome
    had the held-out data no veto. ``plain`` is what calibration alone answers, whose figures stand
    beside those of the diagnosis.
    """
    d, kind = answer.result, truth["effect"]
    truth = {**truth, "effect": catalogued(kind)}
    name, vetoed, place = called(d), _vetoed(d), _place(d, truth)
    reach = NEAR.get(truth["structure"], CLOSE)
    return {
        "structure": truth["structure"],
        "seed": truth["seed"],
        "mesh": truth["mesh"],
        "effect": kind,
        "called": name,
        "outcome": outcome_of(answer, name, truth),
        "by_evidence": outcome_of(answer, vetoed or name, truth),
        "vetoed": vetoed,
        "veto_right": None if vetoed is None else not _is(vetoed, truth),
        "kin": _kin(name, truth),
        "place_m": place,
        "near": None if place is None else place <= reach,
        "gain_share": _gain(d),
        "covered": _covered(d, truth),
        "beside": {
            "calibration": None if plain is None else _figures(plain.result, truth),
            "diagnosis": _figures(d, truth),
        },
        "p": (d.get("adequate") or {}).get("p"),
        "times_scatter": _times(truth),
        "seconds": answer.seconds,
        "gigabytes": answer.gigabytes,
        "said": answer.said if answer.code else "",
    }


def called(d: Row) -> str:
    """The names given, else the verdict."""
    if d.get("verdict") in NAMED and d.get("effects"):
        return AND.join(sorted(str(e["name"]) for e in d["effects"]))
    return str(d.get("verdict", ""))


def _vetoed(d: Row) -> str | None:
    """The effect that led in evidence and was refused for what it does to the held-out data."""
    found = [m[1] for note in d.get("notes") or [] if (m := VETO.match(note))]
    return found[0] if found else None


def outcome_of(answer: Answer, name: str, truth: Row) -> str:
    """What an answer that gives this name is, held against the truth."""
    if answer.crashed:
        return "crash"
    if answer.code == 2:
        return "refused"
    among = [set(names) for names in answer.result.get("one_of") or []]
    if answer.code == 3 or name in ADMITTED:
        return "admitted"
    if name in PLAINLY:
        return "right" if truth["effect"] in NULLS else "none"
    if _is(name, truth):
        return "right" if _channel(answer.result, truth) else "wrong"
    given, hidden = (Counter(members(names)) for names in (name, truth["effect"]))
    if not given - hidden:
        return "part"
    apart = set((given - hidden) + (hidden - given))
    return "among" if any(apart <= names for names in among) else "wrong"


def _is(called: str, truth: Row) -> bool:
    names = sorted(members(called)), sorted(members(truth["effect"]))
    return names[0] == names[1] or called in ALSO.get(truth["effect"], ())


def _kin(called: str, truth: Row) -> bool:
    """Whether the name given is of the family of what was hidden."""
    alike = any({called, truth["effect"]} <= family for family in KIN)
    null = called in PLAINLY and truth["effect"] in NULLS
    return _is(called, truth) or alike or null


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
    """{E, rho, t, wall, effect: [90 % intervals that hold the truth, intervals]}."""
    count = {name: [0, 0] for name in (*QUANTITIES, "effect")}
    of_effect = (("effect", entry, true) for entry, true in _named(d, truth))
    for name, entry, true in (*_ordinary(d, truth), *of_effect):
        count[name][0] += int(_holds(entry, true))
        count[name][1] += 1
    return count


def _holds(entry: Row, true: float) -> bool:
    """Whether the 90 % interval within a written one of 95 % holds the truth.

    Of positive numbers the ends are drawn in by their logarithms, as they were laid out.
    """
    value, ends = entry["value"], (entry["low"], entry["high"])
    if min(value, *ends) > 0:
        low, high = (value * (end / value) ** DRAWN_IN for end in ends)
    else:
        low, high = (value + DRAWN_IN * (end - value) for end in ends)
    return bool(low <= true <= high)


def _ordinary(d: Row, truth: Row) -> Iterator[tuple[str, Row, float]]:
    """(E, rho, t or wall, what was calibrated, the truth); of parts together their mean.

    The mean is of logarithms, weighted with the parts' mass.
    """
    for entry in d.get("calibrated") or []:
        quantity, _, parts = entry["where"].partition(" of ")
        known = truth["values"].get(quantity, {})
        names = [n for n in parts.split(", ") if n in known]
        if quantity in QUANTITIES and names and _is_estimate(entry):
            weights = [truth["part_mass_kg"][n] for n in names]
            mean = np.average(np.log([known[n] for n in names]), weights=weights)
            yield quantity, entry, float(np.exp(mean))


def _named(d: Row, truth: Row) -> Iterator[tuple[Row, float]]:
    """(what is said of an effect, the truth): by its name, or the first of it the value.

    Two of one family are not told apart here.
    """
    hidden = Counter(members(truth["effect"]))
    if Counter(members(called(d))) != hidden:
        return
    for true in truth.get("effects") or [truth]:
        mine = [e for e in d["effects"] if e["name"] == true["effect"]]
        for k, entry in enumerate(mine[0].get("parameters") or [] if len(mine) == 1 else []):
            value = true.get(entry["name"], true.get("value") if k == 0 else None)
            if value is not None and _is_estimate(entry):
                yield entry, float(value)


def _is_estimate(entry: Row) -> bool:
    return None not in (entry.get("value"), entry.get("low"), entry.get("high"))


def _figures(d: Row, truth: Row) -> Row:
    """How far off an answer is: mass, E, rho and t (mean |ln|), held-out Q and its floor."""
    off: Row = {"mass": _mass_off(d, truth)}
    for name in ("E", "rho", "t"):
        each = [abs(np.log(e["value"] / x)) for q, e, x in _ordinary(d, truth) if q == name]
        off[name] = float(np.mean(each)) if each else None
    held = (d.get("fit") or {}).get("held_out") or {}
    after = held.get("Q_with_effect")
    off["Q"] = held.get("Q_calibrated") if after is None else after
    off["Q_floor"] = held.get("Q_floor")
    return off


def _mass_off(d: Row, truth: Row) -> float | None:
    """Of what the deck weighs without its sensors."""
    model = (d.get("mass") or {}).get("model_kg")
    return None if model is None else float(abs(np.log(model / truth["mass_kg"])))


def _times(truth: Row) -> float | None:
    if truth["effect"] == "nothing" or "moved_by_scatter_decades" not in truth:
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
