"""Comparison of an answer with the opened truth: one row of the table."""

import re
from collections import Counter
from collections.abc import Iterator
from typing import Any

import numpy as np

from chladni.search.decision_in_words import Reason

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
    "rotor": ("rotating-part",),
    "stiffener": ("doubler", "stiffness-patch", "thickness-distribution"),
    "doubler": ("thickness-distribution",),
}
KIN = (  # effects that change the same operator: the right family, if not the right name
    {"thickness-distribution", "orthotropic-material", "stiffness-patch", "crack",
     "membrane-prestress", "doubler", "stiffener"},
    {"weld-missing", "weld-compliance", "adhesive-stiffness", "hem-contact", "contact-stiffness",
     "over-constraint", "viscoelastic-joint", "joint-friction", "rattle", "friction-joint"},
    {"point-mass", "mass-patch", "sensor-mass"},
    {"local-resonator", "suspension", "extra-support", "compliant-support", "shaker-restraint"},
    {"sensor-fault", "chain-delay", "duplicated-pair"},
)  # fmt: skip
NEAR_PLACE = {"tailgate": 0.150}  # largest distance of a right place [m]; else ``CLOSE``
CLOSE = 0.060
IN_A_PART = ("membrane-prestress",)  # effects whose place is a whole part
DRAWN_IN = 1.645 / 1.960  # intervals are written for 95 %, and scored for 90 %
_VETOES = "|".join(re.escape(why.value) for why in (Reason.AGAINST, Reason.WORSE))
VETO = re.compile(rf"(\S+) gained .* in -2 ln evidence, but (?:{_VETOES})")


def row(answer: Answer, truth: Row, plain: Answer | None = None) -> Row:
    """The row of one case.

    ``outcome`` is right, wrong, refused, crash or one of these. Part: some of several hidden
    effects, and nothing else. None: no name, though an effect was hidden. Admitted: the answer is
    "not known". Among: several indistinguishable names, one of them right.

    ``by_evidence`` is the outcome without the veto of held-out data. ``listed`` is true if a list
    of "one of" holds all of the truth; without a hidden effect, if there is any list. ``plain`` is
    the answer of calibration alone, for comparison.
    """
    d, kind = answer.result, truth["effect"]
    truth = {**truth, "effect": catalogued(kind)}
    name, vetoed, place = called(d), _vetoed(d), _place(d, truth)
    near = _near(d, truth, place)
    return {
        "structure": truth["structure"],
        "seed": truth["seed"],
        "mesh": truth["mesh"],
        "effect": kind,
        "called": name,
        "outcome": outcome_of(answer, name, truth),
        "by_evidence": outcome_of(answer, vetoed or name, truth),
        "listed": _listed(d, truth),
        "vetoed": vetoed,
        "veto_right": None if vetoed is None else not _is(vetoed, truth),
        "kin": _kin(name, truth),
        "place_m": place,
        "near": near,
        "gain_share": _gain(d),
        "covered": _covered(d, truth, near is not False),
        "beside": {
            "calibration": None if plain is None else _figures(plain.result, truth),
            "diagnosis": _figures(d, truth),
        },
        "p": (d.get("adequate") or {}).get("p"),
        "times_scatter": _times(truth),
        "times": truth.get("times"),
        "seconds": answer.seconds,
        "gigabytes": answer.gigabytes,
        "said": answer.said if answer.code else "",
    }


def called(d: Row) -> str:
    """The names in an answer, else its verdict."""
    if d.get("verdict") in NAMED and d.get("effects"):
        return AND.join(sorted(str(e["name"]) for e in d["effects"]))
    return str(d.get("verdict", ""))


def _vetoed(d: Row) -> str | None:
    """The effect that led in evidence and was refused because of the held-out data."""
    found = [m[1] for note in d.get("notes") or [] if (m := VETO.match(note))]
    return found[0] if found else None


def outcome_of(answer: Answer, name: str, truth: Row) -> str:
    """Outcome of an answer with this name, compared with the truth."""
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
    listed = any(apart <= names for names in among) or _listed(answer.result, truth)
    return "among" if listed else "wrong"


def _listed(d: Row, truth: Row) -> bool:
    lists = [set(names) for names in d.get("one_of") or []]
    hidden = set() if truth["effect"] in NULLS else set(members(truth["effect"]))
    if any(_is(name, truth) for names in lists for name in names):  # also of a kind without a name
        return True
    return any(hidden <= names for names in lists)


def _is(called: str, truth: Row) -> bool:
    names = sorted(members(called)), sorted(members(truth["effect"]))
    return names[0] == names[1] or called in ALSO.get(truth["effect"], ())


def _kin(called: str, truth: Row) -> bool:
    """True where the name belongs to the family of the hidden effect."""
    alike = any({called, truth["effect"]} <= family for family in KIN)
    null = called in PLAINLY and truth["effect"] in NULLS
    return _is(called, truth) or alike or null


def _channel(d: Row, truth: Row) -> bool:
    """True where a fault is found in its channel (for a pair: in either)."""
    if "channel" not in truth or not d.get("effects"):
        return True
    return bool(
        {truth["channel"], truth.get("copy_of")} & set(d["effects"][0]["where"]["channels"])
    )


def _place(d: Row, truth: Row) -> float | None:
    """Distance between the named and the true place [m]; the largest where there are several.

    A single effect is compared with the truth under any name.  One of several is compared with the
    hidden effect of the same name.
    """
    hidden = truth.get("effects") or [{**truth, "effect": None}]
    away = [
        min(float(np.linalg.norm(np.subtract(p, t["point_m"]))) for p in known)
        for t in hidden
        if "point_m" in t and (known := _points(d, t["effect"]))
    ]
    return max(away, default=None)


def _near(d: Row, truth: Row, place: float | None) -> bool | None:
    """True at the right place or in the right part; None where the effect has neither."""
    if place is not None:
        return place <= NEAR_PLACE.get(truth["structure"], CLOSE)
    named = [e["where"] for e in d.get("effects") or [] if e["name"] == truth["effect"]]
    if truth["effect"] not in IN_A_PART or not named:
        return None
    return truth["part"] in (named[0].get("parts") or [])


def _points(d: Row, name: str | None) -> list[list[float]]:
    """Named places of this effect, or of the first one without a name."""
    effects = d.get("effects") or []
    those = effects[:1] if name is None else [e for e in effects if e["name"] == name]
    return [e["where"]["point_m"] for e in those if e["where"].get("point_m")]


def _gain(d: Row) -> float | None:
    """Share of the way from plain calibration's held-out Q to the floor that the effect gains."""
    held = (d.get("fit") or {}).get("held_out") or {}
    before, after = held.get("Q_calibrated"), held.get("Q_with_effect")
    if before is None or after is None or not d.get("effects"):
        return None
    possible = before - (held.get("Q_floor") or 0.0)
    return float((before - after) / possible) if possible > 0 else None


def _covered(d: Row, truth: Row, there: bool) -> dict[str, list[int]]:
    """Numbers of 90 % intervals that hold the truth, and of all, for E, rho, t, wall, effect.

    Intervals of an effect hold its values if the explanation is right: those of one that is not
    ``there`` do not count. A wrong place is counted for itself.
    """
    count = {name: [0, 0] for name in (*QUANTITIES, "effect")}
    of_effect = (("effect", entry, true) for entry, true in _named(d, truth) if there)
    for name, entry, true in (*_calibration_parameters(d, truth), *of_effect):
        count[name][0] += int(_holds(entry, true))
        count[name][1] += 1
    return count


def _holds(entry: Row, true: float) -> bool:
    """True where the 90 % interval within a written one of 95 % holds the truth.

    Intervals of positive numbers are narrowed in the logarithm, in which they were computed.
    """
    value, ends = entry["value"], (entry["low"], entry["high"])
    if min(value, *ends) > 0:
        low, high = (value * (end / value) ** DRAWN_IN for end in ends)
    else:
        low, high = (value + DRAWN_IN * (end - value) for end in ends)
    return bool(low <= true <= high)


def _calibration_parameters(d: Row, truth: Row) -> Iterator[tuple[str, Row, float]]:
    """Name (E, rho, t or wall), calibrated entry and truth; parts together have a mean truth.

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
    """Reported entry of an effect and its truth: by name, or the first entry for ``value``.

    Two effects of one family are not distinguished here.
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
    """Errors of an answer: mass, E, rho and t (mean |ln|), held-out Q and its floor."""
    off: Row = {"mass": _mass_off(d, truth)}
    for name in ("E", "rho", "t"):
        each = [
            abs(np.log(e["value"] / x))
            for q, e, x in _calibration_parameters(d, truth)
            if q == name
        ]
        off[name] = float(np.mean(each)) if each else None
    held = (d.get("fit") or {}).get("held_out") or {}
    after = held.get("Q_with_effect")
    off["Q"] = held.get("Q_calibrated") if after is None else after
    off["Q_floor"] = held.get("Q_floor")
    return off


def _mass_off(d: Row, truth: Row) -> float | None:
    """Error of the mass of the deck without its sensors."""
    model = (d.get("mass") or {}).get("model_kg")
    return None if model is None else float(abs(np.log(model / truth["mass_kg"])))


def _times(truth: Row) -> float | None:
    if truth["effect"] == "nothing" or "moved_by_scatter_decades" not in truth:
        return None
    return float(truth["moved_by_effect_decades"] / truth["moved_by_scatter_decades"])


def line(r: Row) -> str:
    """A line of text for one case."""
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
