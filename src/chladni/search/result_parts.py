"""Parts of a diagnosis report: effects, alternatives, calibrated values, the remainder."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from ..effects.effect import Effect
from ..effects.estimate import Estimate, Location
from ..ema.odds import evidence_in_words
from ..inference.hypothesis_fit import HypothesisFit
from ..inference.identifiability import parameter_names
from ..inference.joint_fit import JointFit
from ..inference.likelihood import LN10
from ..inference.map_fit import Fit
from ..inference.own_optimum import LocalOptimum
from ..inference.pole_data import Poles
from ..inference.residual_localisation import ResidualLocalisation
from ..inference.result import (
    Agreement,
    Alternative,
    CalibratedParameter,
    NamedEffect,
    Remainder,
    Scores,
)
from .decision_rules import RULES
from .diagnosis import Diagnosis
from .question import Prepared
from .written_scores import real_poles

STRUCTURED = 5.0  # times the standard deviation of the recording: more than that is not noise
BLIND_SHARE = 0.05  # of the shells and beams that the test cannot see: more is said
HEAVIER = 0.02  # of the deck's mass: paint and sealant, which no deck of sheets contains


def named_effects(diagnosis: Diagnosis) -> tuple[NamedEffect, ...]:
    """The named effects with place and size, largest gain first."""
    found, deck, out = diagnosis.found, diagnosis.as_deck, list[NamedEffect]()
    if found is None or deck is None:
        return ()
    gains = diagnosis.gains or (diagnosis.two_log_bayes_factor(found),)
    for effect, gain in zip(found.effects, gains, strict=True):
        rows = effect.reported(deck.fit.of(effect), deck.fit.sd(effect))
        written = tuple(row.value for row in rows) if effect.traits.writable else ()
        size = _located(found, effect), _reported(found, effect), gain, written
        out.append(NamedEffect(effect.name, effect.claim, -found.neg2_log_evidence / 2, *size))
    return tuple(out)


def _located(hypothesis: HypothesisFit, effect: Effect) -> Location:
    """The place of an effect; its radius includes all optima that are nearly as probable."""
    place = effect.location(hypothesis.fit.of(effect), hypothesis.fit.sd(effect))
    if effect is not hypothesis.effect or place.point_m is None or not hypothesis.nearly:
        return place
    others = [v.effect.location(v.x, v.sd) for v in hypothesis.nearly]
    reach = [place.radius_m or 0.0] + [
        float(np.linalg.norm(np.subtract(o.point_m, place.point_m))) + (o.radius_m or 0.0)
        for o in others
        if o.point_m is not None
    ]
    return replace(place, radius_m=max(reach) or None)


def _reported(hypothesis: HypothesisFit, effect: Effect) -> tuple[Estimate, ...]:
    """The values of an effect; intervals span all local optima that are nearly as probable."""
    rows = effect.reported(hypothesis.fit.of(effect), hypothesis.fit.sd(effect))
    if effect is not hypothesis.effect:
        return rows
    others, out = [r for v in hypothesis.nearly for r in v.effect.reported(v.x, v.sd)], []
    for row in rows:
        same = [row, *(r for r in others if r.name == row.name)]
        low = min((r.low for r in same if r.low is not None), default=None)
        high = max((r.high for r in same if r.high is not None), default=None)
        out.append(replace(row, low=low, high=high))
    return tuple(out)


def otherwise(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Sentences on other optima of the named effect that explain the data nearly as well."""
    found = diagnosis.found
    if found is None or not found.nearly:
        return ()
    rows = found.effect.reported(found.own.x, found.own.sd)
    values = list(dict.fromkeys(w for v in found.nearly if (w := _values_apart(rows, v))))
    own = found.effect.location(found.own.x, found.own.sd).text
    best = found.own.neg2_log_evidence
    places = [
        f"{place} ({100 * np.exp((best - v.neg2_log_evidence) / 2):.0f} % as likely)"
        for v in found.nearly
        if (place := v.effect.location(v.x, v.sd).text) != own
    ]
    if isinstance(found.data, Poles) and values:
        return (
            f"if other poles are spurious, other values of {found.effect.name} explain the poles "
            f"nearly as well: {'; or '.join(values)}; the intervals include all of them",
        )
    if not places:
        return ()
    return (
        f"{found.effect.name} explains the data nearly as well at {'; or at '.join(places)}; the "
        "intervals include all of these places",
    )


def _values_apart(rows: tuple[Estimate, ...], optimum: LocalOptimum) -> str:
    """Values of an optimum that lie outside the intervals of the rows, in words."""
    known = {row.name: row for row in rows if row.low is not None and row.high is not None}
    return ", ".join(
        f"{new.name} {new.value:.3g} {new.unit}".strip()
        for new in optimum.effect.reported(optimum.x, optimum.sd)
        if (row := known.get(new.name)) and not row.low <= new.value <= row.high  # type: ignore[operator]
    )


def laid_on_sheets(diagnosis: Diagnosis, weighed: float | None, deck: float) -> tuple[str, ...]:
    """Sentence on a weighed mass [kg] far from the given deck's, where no effect is named."""
    off = 0.0 if weighed is None else weighed / deck - 1
    if diagnosis.found is not None or abs(off) < HEAVIER:
        return ()
    return (
        f"the article weighs {100 * abs(off):.1f} % {'more' if off > 0 else 'less'} than the deck, "
        "so calibration changes density and thickness; trim or mastic on a whole sheet has the "
        "same effect; the drawing, or one part weighed alone, distinguishes them",
    )


def alternatives(diagnosis: Diagnosis) -> tuple[Alternative, ...]:
    """All tested hypotheses that are not the answer, with the reason; most probable first."""
    found = diagnosis.found
    best = found if found is not None else diagnosis.null
    named = () if found is None else tuple(e.name for e in found.effects)
    out = []
    for h in (h for h in diagnosis.hypotheses if h.effect.name not in named):
        why, place = why_not(diagnosis, h, best), _located(h, h.effect)
        out.append(Alternative(h.effect.name, -h.neg2_log_evidence / 2, why, place))
    if found is not None:
        gap = (diagnosis.null.neg2_log_evidence - best.neg2_log_evidence) / 2
        reason = f"{evidence_in_words(gap)} compared with E, rho and t alone"
        out.append(Alternative("calibration only", -diagnosis.null.neg2_log_evidence / 2, reason))
    return tuple(sorted(out, key=lambda a: -(a.log_evidence or 0.0)))


def why_not(diagnosis: Diagnosis, hypothesis: HypothesisFit, best: HypothesisFit) -> str:
    """Reason why a hypothesis was not named, with a number."""
    gain, due = diagnosis.two_log_bayes_factor(hypothesis), diagnosis.due_of(hypothesis)
    if refused := dict(diagnosis.passed_over).get(hypothesis.effect.name):
        return f"gains {gain:.1f} in -2 ln evidence, but {refused}"
    if diagnosis.found is None and gain > due:
        lead = diagnosis.hypotheses[0]
        but = diagnosis.refused if hypothesis is lead else f"{lead.name}, ahead of it, is not named"
        return f"gains {gain:.1f} in -2 ln evidence, but {but or 'is not named'}"
    if diagnosis.found is None:
        change = f"{'loses' if round(gain, 1) < 0 else 'gains'} {abs(gain):.1f} in -2 ln evidence"
        return f"{change} over plain calibration; {due:.0f} are required to name an effect"
    if best.name in (hypothesis.remarks.becomes, hypothesis.remarks.nearly):
        return f"these data cannot distinguish its fitted form from {best.name}"
    gap = (hypothesis.neg2_log_evidence - best.neg2_log_evidence) / 2
    if hypothesis.effect.name in diagnosis.one_of:
        return (
            f"these data do not distinguish it from {best.name}: 2 ln B = {2 * gap:.1f}, and "
            f"{RULES.tied:.0f} are required to separate two explanations"
        )
    return (
        f"{evidence_in_words(gap)} for {best.name} compared with it; its weighted sum of squares "
        f"is {hypothesis.fit.misfit:.0f}, that of {best.name} {best.fit.misfit:.0f}"
    )


def agreement(
    prepared: Prepared, diagnosis: Diagnosis, fitted: Scores, held_out: Scores
) -> Agreement:
    """The scores, the held-out data in words, and the gain of the leading effect."""
    found = diagnosis.found
    last, what = found or diagnosis.null, prepared.what
    if last.channels:
        what = f"channel {', '.join(last.channels)} on the held-out lines of {what}"
    gain = None if found is None else diagnosis.two_log_bayes_factor(found)
    largest = max(map(diagnosis.two_log_bayes_factor, diagnosis.hypotheses), default=None)
    return Agreement(fitted, held_out, what, gain, largest, diagnosis.due)


def foretells_worse(agreement: Agreement | None, named: bool = False) -> tuple[str, ...]:
    """Reason not to use a deck that predicts the held-out data worse than the deck before it."""
    said, held = last_step_in_words(agreement, named), (agreement or Agreement()).held_out
    known, (before, _) = held.with_nuisances, held.last_step(named).values()
    if said and known is not None and before is not None and known < before:
        said += (
            f"; with errors of mesh, joints and scatter Q is {known:.3g}: the deck lacks these, so "
            "refine its mesh where it bends most"
        )
    return (said,) if said else ()


def last_step_in_words(agreement: Agreement | None, named: bool) -> str:
    """Sentence on a deck that predicts the held-out data worse than the deck before it; else "".

    An increase of Q within the noise of the recording may be chance and is accepted.
    """
    held = (agreement or Agreement()).held_out
    (one, before), (last, after) = held.last_step(named).items()
    if before is None or after is None or after <= before + (held.floor or 0.0):
        return ""
    return (
        f"the {last} deck predicts the held-out data worse than the {one} deck "
        f"(Q {after:.3g}, {before:.3g} before)"
    )


def calibrated(diagnosis: Diagnosis) -> tuple[CalibratedParameter, ...]:
    """Calibrated parameters as estimated with scatter, joints and folds, and as written.

    The written deck has no such nuisances, so it may need other values for the same response.  Its
    values are therefore no estimates.  Parameters shared by several states serve as both.
    """
    deck = (diagnosis.as_deck or diagnosis.plain).fit
    whole = (diagnosis.found or diagnosis.null).fit
    changed = diagnosis.verdict != "nothing missing"
    out = []
    for effect in (e for e in deck.effects if e.kind == "calibration"):
        fit = whole if effect in whole.effects else deck
        numbers = _numbers(effect, (deck if diagnosis.shared else fit).of(effect), fit)
        written = effect.reported(deck.of(effect), fit.sd(effect))
        for (where, row, given), other in zip(numbers, written, strict=True):
            called = getattr(effect, "called", "")  # the user's name of the parameter
            where = f"{called}: {where}" if called not in ("", row.name) else where
            out.append(CalibratedParameter(where, row, given, other.value if changed else given))
    return tuple(out)


def _numbers(effect: Effect, x: np.ndarray, fit: Fit) -> Iterator[tuple[str, Estimate, float]]:
    """Name, value at x and value of the deck of every number that an effect reports."""
    nominal = np.array([p.nominal for p in effect.parameters])
    rows, given = (effect.reported(at, fit.sd(effect)) for at in (x, nominal))
    return zip(parameter_names([effect]), rows, (row.value for row in given), strict=True)


def values_kept(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Sentence on found values that are not written: the given ones explain the data as well."""
    if diagnosis.verdict != "nothing missing":
        return ()
    gain = diagnosis.nominal.neg2_log_evidence - diagnosis.null.neg2_log_evidence
    return (
        f"the deck keeps its values, and those that were found are not written: they gain "
        f"{gain:.1f} in -2 ln evidence, and {RULES.changed:.0f} are required to change a deck",
    )


def shared_values(joint: JointFit) -> tuple[CalibratedParameter, ...]:
    """Calibrated parameters that several states share, fitted to all of them at once."""
    seen: dict[tuple[str, str], CalibratedParameter] = {}
    for one in joint.fits:
        for effect in (e for e in one.fit.effects if e.kind == "calibration"):
            for where, row, given in _numbers(effect, one.fit.of(effect), one.fit):
                seen.setdefault((where, row.name), CalibratedParameter(where, row, given))
    return tuple(seen.values())


def remainder(prepared: Prepared, diagnosis: Diagnosis) -> Remainder:
    """The residual of calibration compared with the recording's noise, in rms."""
    plain = diagnosis.plain
    if isinstance(prepared.score, Poles):
        real = real_poles(prepared, diagnosis.found or diagnosis.null)
        assert real is not None
        if not real.any():
            return Remainder(False, np.nan, np.nan, "no pole has a partner in the model")
        delta, _ = prepared.score.forced(plain.fit.state, real)
        left = 100 * float(np.sqrt(np.nanmean(delta[real] ** 2)))
        known = 100 * float(np.median(prepared.score.sd[real]))
        text = f"{left:.2g} % rms of the frequencies, whose standard deviation is {known:.1g} %"
    else:
        data = prepared.score.rebased(plain.model)
        left = float(np.sqrt(data.Q(plain.fit.state, prepared.score.use)))
        chi = 1.0 if prepared.identified is None else prepared.identified.chi
        known = 0.01 * chi / LN10
        text = f"{left:.2g} decades rms, and the standard deviation of the recording is about "
        text += f"{known:.1g}"
    far = left > STRUCTURED * known
    sentence = f"after calibration alone the residual is {text}: {_meaning(diagnosis, far)}"
    return Remainder(bool(far and diagnosis.found is not None), left, known, sentence)


def _meaning(diagnosis: Diagnosis, far: bool) -> str:
    if not far:
        return "it contains no further information"
    if diagnosis.found is not None:
        return "it is structured, not noise"
    if not diagnosis.hypotheses:
        return "it exceeds the noise; a diagnosis shows whether physics is missing"
    if diagnosis.unexplained and diagnosis.one_of:
        open_ = ", ".join(diagnosis.one_of)
        return f"mesh error and scatter do not account for it, and one of these may: {open_}"
    if diagnosis.unexplained:
        return "no effect tried accounts for it, nor do mesh error and scatter in the parts"
    lead = diagnosis.hypotheses[0]
    if diagnosis.two_log_bayes_factor(lead) > RULES.tied:
        return f"{lead.effect.name} accounts for more of it than mesh error and scatter"
    return "no effect tried accounts for more of it than mesh error and scatter within the parts"


def blind_note(spot: ResidualLocalisation | None) -> tuple[str, ...]:
    """Return a warning if the sensors are blind to local losses on much of the structure."""
    if spot is None or spot.blind < BLIND_SHARE:
        return ()
    return (
        f"on {100 * spot.blind:.0f} % of the structure the test is blind; half the stiffness or "
        "mass could be missing there (grey in the map of the remaining gain)",
    )
