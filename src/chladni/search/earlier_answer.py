"""An earlier answer as the prior of a new recording of the same object.

p(H | y_1, y_2) ∝ p(y_2 | H, y_1) p(H | y_1): the odds and the posterior that the first recording
left are the prior of the second.

- E, rho, t and the other parameters of the object have the mean and variance of the mixture of all
  explanations.
- An effect at the place where it was found has its odds and its parameters.  The place has no price
  any more.
- An effect anywhere else has no odds: the first recording was not explained by it there.
"""

import hashlib
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.special import softmax

from ..dynamics.frf import FRF
from ..effects.effect import Effect, Parameter
from ..effects.effect_context import EffectContext
from ..effects.family import Family, FromLump
from ..effects.search_context import Candidate, SearchContext
from ..errors import FileError
from ..inference.hypothesis_fit import HypothesisFit, UpdatingProblem
from ..inference.joint_fit import Posterior, of_the_object
from ..results import ShownBriefly

if TYPE_CHECKING:
    from .diagnosis import Diagnosis

FILE = "posterior.json"  # of a run
DIGITS = 4  # of a response, by which a file is known again in another format


@dataclass(frozen=True)
class KnownParameter:
    """A parameter of an effect as its fit left it: x ~ N(mean, sd²), of value scale eˣ or scale x.

    ``sd`` is widened as that of an interval is.
    """

    name: str
    mean: float
    sd: float
    scale: float

    def of(self, p: Parameter) -> Parameter:
        """The parameter with this prior; none becomes wider than it was."""
        size = self.scale / p.scale
        if p.kind == "log":
            return replace(p, mean=self.mean + float(np.log(size)), sd=min(self.sd, p.sd))
        return replace(p, mean=size * self.mean, sd=min(abs(size) * self.sd, p.sd))


@dataclass(frozen=True)
class KnownEffect:
    """An effect as it was found."""

    name: str
    two_log_odds: float  # over calibration
    text: str  # where its parameters begin, in words
    point_m: tuple[float, ...] | None  # its place, known to 95 % within the radius
    radius_m: float
    parameters: tuple[KnownParameter, ...]

    def informed(self, effect: Effect) -> Effect:
        """An effect of this name with the prior that its place gives it."""
        itself = effect.text == self.text
        if not itself and not self._reaches(effect):
            return replace(effect, two_log_odds=min(self.two_log_odds, 0.0))
        known = {k.name: k for k in self.parameters}
        parameters = tuple(
            known[p.name].of(p) if p.name in known and (itself or p.kind == "log") else p
            for p in effect.parameters
        )
        return replace(
            effect, parameters=parameters, trials_factor=1, two_log_odds=self.two_log_odds
        )

    def _reaches(self, effect: Effect) -> bool:
        """True if the place of an effect, as it begins, overlaps the known one."""
        its = effect.location(np.array([p.mean for p in effect.parameters]))
        if self.point_m is None or its.point_m is None:
            return False
        apart = float(np.linalg.norm(np.subtract(self.point_m, its.point_m)))
        return apart <= self.radius_m + (its.radius_m or 0.0)


@dataclass(frozen=True, repr=False)
class EarlierAnswer(ShownBriefly):
    """Odds and posterior of an answer, for a later recording."""

    said: str  # its verdict, and the names
    shared: Posterior  # of the parameters of the object
    effects: tuple[KnownEffect, ...]  # of every family that was tried alone
    mass: float | None  # that was weighed and used [kg]
    data: dict[str, str]  # digests of the responses it used, with their labels
    folder: str = ""  # from which it was read

    def informed(self, problem: UpdatingProblem) -> UpdatingProblem:
        """The problem with the effects of all families informed."""
        known = {e.name: e for e in self.effects}
        families = tuple(
            _informed(f, known[f.name]) if f.name in known else f for f in problem.families
        )
        return replace(problem, families=families)

    def refuse_again(self, data: dict[str, str], path: Path) -> None:
        """Refuse responses that the earlier answer used already."""
        again = [label for digest, label in data.items() if digest in self.data]
        if again:
            more = f" and {len(again) - 1} more" if len(again) > 1 else ""
            raise FileError(
                f"{path}: the answer of {self.folder} used the responses {again[0]}{more} already, "
                "so they would count twice; give what was measured since, or leave out --earlier"
            )

    @property
    def note(self) -> str:
        """The answer that a result builds on, in a sentence."""
        return (
            f"this answer builds on that of {self.folder} ({self.said}): its odds and posterior "
            "are the prior here, so gains are those of both recordings; effects elsewhere than it "
            "found them have no odds from it"
        )


def _informed(family: Family, known: KnownEffect) -> Family:
    """The family whose effects have the odds and the posterior of an earlier answer."""

    def candidates(context: SearchContext) -> list[Candidate]:
        found = family.proposed(context)
        return [replace(c, effect=known.informed(c.effect)) for c in found]

    def closer(context: SearchContext, effect: Effect, x: np.ndarray) -> Candidate | None:
        found = None if family.closer is None else family.closer(context, effect, x)
        return found and replace(found, effect=known.informed(found.effect))

    def of_lump(where: EffectContext, point: np.ndarray, mass: float) -> FromLump:
        found = None if family.of_lump is None else family.of_lump(where, point, mass)
        return found and (known.informed(found[0]), found[1])

    return replace(family, candidates=candidates, closer=closer, of_lump=of_lump, before=family)


def earlier_answer(
    found: "Diagnosis", said: str, mass: float | None, data: dict[str, str],
    before: EarlierAnswer | None = None,
) -> EarlierAnswer:  # fmt: skip
    """Odds and posterior of a diagnosis; it used the data of the answer before it as well."""
    alone = [h for h in found.hypotheses if len(h.effects) == 1]
    effects = []
    for h in (h for h in alone if h.effect in h.fit.effects):
        effect, x, sd = h.effect, h.fit.of(h.effect), h.fit.sd(h.effect)
        place, gain = effect.location(x, sd), found.two_log_bayes_factor(h)
        each = zip(effect.parameters, x.tolist(), effect.widened(sd).tolist(), strict=True)
        own = tuple(KnownParameter(p.name, mean, s, p.scale) for p, mean, s in each)
        where = effect.text, place.point_m, place.radius_m or 0.0
        effects.append(KnownEffect(effect.name, gain, *where, own))
    used = data if before is None else before.data | data
    return EarlierAnswer(said, _mixture([found.null, *alone]), tuple(effects), mass, used)


def _mixture(every: Sequence[HypothesisFit]) -> Posterior:
    """Mean and standard deviation of the parameters of the object over all explanations."""
    weights = softmax([-h.neg2_log_evidence / 2 for h in every])
    rows: dict[Any, list[tuple[float, float, float]]] = {}
    for h, w in zip(every, weights.tolist(), strict=True):
        for effect in h.fit.effects:
            if effect in h.effects or not of_the_object(effect):
                continue
            x, sd = h.fit.of(effect), effect.widened(h.fit.sd(effect))
            for k, (m, s) in enumerate(zip(x.tolist(), sd.tolist(), strict=True)):
                rows.setdefault((effect.name, effect.text, k), []).append((w, m, s))
    return {key: _moments(row) for key, row in rows.items()}


def _moments(rows: Sequence[tuple[float, float, float]]) -> tuple[float, float]:
    """Mean and standard deviation of a mixture of normal distributions (w, mean, sd)."""
    w, m, s = np.array(rows).T
    w = w / w.sum() if w.sum() > 0 else np.full(len(w), 1 / len(w))
    mean = w @ m
    return float(mean), float(np.sqrt(w @ (s**2 + (m - mean) ** 2)))


def digests(frfs: Iterable[FRF], frequency: np.ndarray | None = None) -> dict[str, str]:
    """Digests of measured responses, or of a table of natural frequencies, with their labels."""
    out = {} if frequency is None else {_digest(frequency): "of the table of frequencies"}
    for frf in frfs:
        for i, driven in enumerate(frf.inputs):
            for o, seen in enumerate(frf.outputs):
                out[_digest(frf.frequency, frf.values[:, o, i])] = f"{seen} over {driven}"
    return out


def _digest(*columns: np.ndarray) -> str:
    """A digest of numbers to ``DIGITS`` of the largest."""
    rounded = [np.round(c / (np.abs(c).max(initial=0.0) or 1.0), DIGITS) + 0.0 for c in columns]
    return hashlib.sha256(b"".join(c.tobytes() for c in rounded)).hexdigest()[:16]


def posterior_json(known: EarlierAnswer) -> dict[str, Any]:
    """``posterior.json``: what :func:`read_earlier` reads."""
    shared = [[*key, *value] for key, value in known.shared.items()]
    return {"said": known.said, "mass": known.mass, "data": known.data, "shared": shared,
            "effects": [asdict(e) for e in known.effects]}  # fmt: skip


def read_earlier(folder: Path) -> EarlierAnswer:
    """Read what the answer of a run leaves."""
    path = folder / FILE
    if not path.is_file():
        raise FileError(
            f"{folder}: there is no {FILE}, so this is no answer to build on; chladni diagnose "
            "writes it"
        )
    try:
        held = json.loads(path.read_text(encoding="utf-8"))
        shared = {(n, t, int(k)): (_finite(m), _positive(s)) for n, t, k, m, s in held["shared"]}
        effects = tuple(_read(held["effects"]))
        mass = None if held["mass"] is None else _positive(held["mass"])
        return EarlierAnswer(
            str(held["said"]), shared, effects, mass, dict(held["data"]), str(folder)
        )
    except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
        raise FileError(f"{path} does not have the form of a posterior: {error}") from error


def _read(rows: Sequence[dict[str, Any]]) -> Iterator[KnownEffect]:
    for row in rows:
        if (point := row["point_m"]) is not None:
            x, y, z = map(_finite, point)
            point = x, y, z
        yield KnownEffect(
            str(row["name"]), _finite(row["two_log_odds"]), str(row["text"]), point,
            _finite(row["radius_m"]),
            tuple(KnownParameter(str(p["name"]), _finite(p["mean"]), _positive(p["sd"]),
                                 _finite(p["scale"])) for p in row["parameters"]),
        )  # fmt: skip


def _finite(value: Any) -> float:
    if not np.isfinite(number := float(value)):
        raise ValueError(f"{value} is no number")
    return number


def _positive(value: Any) -> float:
    if not (number := _finite(value)) > 0:
        raise ValueError(f"{value} is not above 0")
    return number
