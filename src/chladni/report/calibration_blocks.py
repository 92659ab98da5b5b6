"""Tables of a calibration's page: information, basins, profiles; and ``calibration.json``."""

from collections.abc import Sequence
from typing import Any

from ..inference.calibration_result import (
    ArticleParameter,
    CalibrationStudy,
    Identifiability,
    ParameterKnowledge,
)
from ..workflows.diagnosis_result import DiagnosisResult
from .blocks import Block, Code, Items, Section, Table, Text
from .typed_fields import as_data
from .words import interval, number, percent, quantity, share

_NONE = "–"
_FAR = 1.0  # standard deviation of ln value from which a parameter counts as unbounded
_KNOWN = (
    "Plausible: values beyond stand for something else. Standard deviations before the fit, at the "
    "deck's values. Single: all other parameters "
    "known. All: every parameter free. Both from the data alone; mesh error, scatter, joints and "
    "folds free. With priors: what the fit can reach. A parameter is frozen if its prior "
    "determines it better than the data; the intervals of the others include its prior."
)
_BASINS = (
    "Fits from a Latin hypercube of {n} starts. Starts that end within 1 in -2 ln evidence and one "
    "standard deviation of every parameter are one basin. The calibration's own fit, from the "
    "deck's values, is not counted: where it alone ended, starts is 0."
)
_PROFILE = (
    "-2 ln profile likelihood above the best, all other parameters fitted again, at one and two "
    "standard deviations; all priors count. In brackets: the value assumed by the interval of the "
    "table."
)
_DRAWN = (
    "Draws: median and 95 % interval of the posterior, frozen parameters free with their priors. "
    "Gaussian: most probable value and 95 % interval of the Hessian, of the same unknowns."
)
_TOGETHER = (
    "Mean and spread (one standard deviation) of nominally equal articles with 95 % intervals. The "
    "error of the model's form is common to them and widens the interval of the mean. In brackets: "
    "deviation of each article from the mean, which contains none of that error."
)
_REGIONS = (
    "They deviate most or have the lowest MAC. Share of each part in their strain energy, and in "
    "that of the other paired modes. Change of its stiffness that alone fits all frequencies best, "
    "and share of the squared deviations that this removes."
)
_NEXT = "Words for the next case.toml, in addition to the parameters that are free now:"
_NO_REGION = (
    "No further part explains more of the deviations than one at random would. Parts that are "
    "free, or frozen because the data do not know them, are left out. chladni diagnose looks for "
    "what is missing."
)
_LOSSES = (
    "Fitted afterwards: 2 ζ of a paired mode is the sum of the loss factors, each times the "
    "share of its part in the strain energy. An interval that reaches 0 does not show damping."
)
MOST_REGIONS = 12  # parts in the table


def study_sections(
    study: CalibrationStudy | None, pictures: Sequence[Block] = (), energy: Sequence[Block] = ()
) -> list[Section]:
    """Sections of a calibration's page; none after a diagnosis.

    Parameters
    ----------
    pictures, energy : of the uncertainty, and of the regions to free next
    """
    if study is None:
        return []
    return [
        Section("Identifiability", _known(study.identifiability)),
        Section("Basins of the fit", [_basins(study)]),
        Section("Articles fitted together", [_articles(study)]),
        Section("Uncertainty of the values", [_profiles(study), *_sample(study), *pictures]),
        Section("Regions to free next", [*_regions(study), *energy]),
        Section("Damping of the parts", [_damping(study)]),
    ]


def _known(found: Identifiability) -> list[Block]:
    rows = [
        (p.name, _plausible(p), _percent(p.prior_sd), _percent(p.sd_single), _percent(p.sd_data),
         _percent(p.sd_after), _verdict(p))
        for p in found.parameters
    ]  # fmt: skip
    heads = ("parameter", "plausible", "prior", "single", "all", "with priors", "verdict")
    index = _NONE if found.collinearity is None else number(found.collinearity, 3)
    caption = f"{_KNOWN} Collinearity index: {index} (above 10 to 15 the set trades off)."
    table = Table(heads, rows, ("parameter", "verdict"), caption)
    reasons = {p.name.split(" of ")[0]: p.reason for p in found.parameters if p.reason}
    texts = [f"prior of {name}: {reason}" for name, reason in reasons.items()]
    texts += [p.why for p in found.parameters if p.why]
    texts += [
        "the data hardly change where "
        f"{' and '.join(f'{name} changes by {c:+.2f} %' for name, c in direction)}"
        for direction in found.directions
        if len(direction) > 1
    ]
    texts += [_along(p) for p in found.parameters if p.along]
    return [table, Items(texts)]


def _plausible(p: ParameterKnowledge) -> str:
    if p.low is None or p.high is None:
        return _NONE
    return f"{quantity(p.low, p.unit)} to {quantity(p.high, p.unit)}"


def _verdict(p: ParameterKnowledge) -> str:
    if p.frozen:
        return "frozen"
    if p.sd_after**2 > p.prior_sd**2 / 2:
        return "its prior: not known at the deck's values"
    return "known by the weighed mass" if p.why else "known"


def _along(p: ParameterKnowledge) -> str:
    """Information on a parameter along its range, in one sentence."""
    points = ", ".join(f"{_percent(v.sd_data)} at {number(v.value, 3)}" for v in p.along)
    return f"standard deviation of {p.name} from the data alone, all others known: {points}"


def _percent(sd: float | None) -> str:
    return _NONE if sd is None or sd > _FAR else f"{number(100 * sd, 2)} %"


def _basins(study: CalibrationStudy) -> Table:
    names = [v.name for b in study.basins[:1] for v in b.values]
    rows = [
        (number(b.above, 3), str(b.starts), *(quantity(v.value, v.unit) for v in b.values))
        for b in study.basins
    ]
    heads = ("-2 ln evidence above the best", "starts", *names)
    return Table(heads, rows, caption=_BASINS.format(n=study.starts))


def _profiles(study: CalibrationStudy) -> Table:
    rows = [
        (p.name, *(f"{number(v, 3)} ({number(q, 3)}) at {quantity(at, p.unit)}" for at, v, q in
                   zip(p.values, p.neg2_log_likelihood, p.quadratic, strict=True)))
        for p in study.profiles
    ]  # fmt: skip
    heads = ("parameter", "-2 sd", "-1 sd", "+1 sd", "+2 sd")
    return Table(heads, rows, ("parameter",), _PROFILE)


def _articles(study: CalibrationStudy) -> Table:
    """Common mean, spread and values of several articles."""
    rows = [
        (p.name, interval(p.mean, p.low, p.high, p.unit), _spread(p),
         *(f"{quantity(a.value, p.unit)} ({100 * a.away:+.2g} ± {100 * a.reach:.2g} %)"
           for a in p.articles))
        for p in study.articles
    ]  # fmt: skip
    names = [a.article for p in study.articles[:1] for a in p.articles]
    heads = ("parameter", "mean of all units", "spread of units", *names)
    return Table(heads, rows, heads, _TOGETHER)


def _regions(study: CalibrationStudy) -> list[Block]:
    """Parts by their strain energy in the worst modes, and words for the next case."""
    if (found := study.guidance) is None:
        return []
    rows = [
        (r.part, share(r.worst), share(r.good), percent(r.factor, 1.0), share(r.removed),
         r.state or _NONE)
        for r in found.regions[:MOST_REGIONS]
    ]  # fmt: skip
    heads = ("part", "energy, worst modes", "energy, others", "change of its stiffness",
             "deviation removed", "in this calibration")  # fmt: skip
    worst = ", ".join(f"{number(m.test_hz, 4)} Hz" for m in found.worst)
    left = f"The frequencies deviate by {share(found.rms)} rms. Worst modes: {worst}."
    table = Table(heads, rows, ("part", "in this calibration"), f"{left} {_REGIONS}")
    if not found.words:
        return [table, Text([_NO_REGION])]
    return [table, Text([_NEXT]), Code(found.words)]


def _damping(study: CalibrationStudy) -> Table:
    """Loss factors of the parts."""
    rows = [(d.part, number(d.loss_factor, 2), f"{number(d.low, 2)} to {number(d.high, 2)}")
            for d in study.damping]  # fmt: skip
    return Table(("part", "loss factor", "95 %"), rows, ("part",), _LOSSES)


def _spread(p: ArticleParameter) -> str:
    high = "not bounded" if p.spread_high is None else _percent(p.spread_high)
    return f"{_percent(p.spread)} ({_percent(p.spread_low)} to {high})"


def _sample(study: CalibrationStudy) -> list[Block]:
    """Draws of the posterior against the Gaussian of the Hessian."""
    if (found := study.sample) is None:
        return []
    rows = [
        (p.name, interval(p.median, p.low, p.high, p.unit),
         interval(p.mode, p.gaussian_low, p.gaussian_high, p.unit),
         number(p.sd_ratio, 3), number(p.autocorrelation_time, 3), number(p.effective, 3))
        for p in found.parameters
    ]  # fmt: skip
    heads = ("parameter", "draws", "Gaussian", "sd, draws / Gaussian", "autocorrelation [steps]",
             "effective draws")  # fmt: skip
    return [Table(heads, rows, ("parameter",), f"{_DRAWN} {found.sentence}.")]


def calibration_json(result: DiagnosisResult) -> dict[str, Any]:
    """The contents of ``calibration.json``: values of the parameters, and the study."""
    values = [
        {"where": c.where, **vars(c.estimate), "deck_value": c.deck_value,
         "written_value": c.written_value}
        for c in result.calibrated
    ]  # fmt: skip
    mass, study = as_data(result.mass), as_data(result.study)
    return {"values": values, "mass": mass, **(study or {})}
