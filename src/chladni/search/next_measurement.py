"""Measurements that would tell tied explanations apart, with the information expected of each.

Candidates are sensors at further grids, drives at further grids, a known mass put on at a grid,
lines above the fitted band, and a weighing (:mod:`..inference.expected_information`).
"""

import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..errors import FileError
from ..fem.measured_dofs import MeasuredDofs
from ..inference.expected_information import (
    Forecast,
    OpenQuantity,
    Predicted,
    Rivals,
    chosen,
    nothing,
)
from ..inference.result import NextMeasurement
from ..results import ShownBriefly
from .decision_rules import RULES

FILE = "outlook.npz"  # of a run
ADVISED = 3  # measurements
ODDS = float(round(np.exp(RULES.tied / 2)))  # that settle: beyond them a diagnosis ties nothing


@dataclass(frozen=True)
class FurtherTest:
    """One measurement that could be made."""

    kind: str  # sensor, drive, mass, band or weighing
    what: str  # in words
    label: str = ""  # dof or grid; "" where it has no place
    point_m: tuple[float, float, float] | None = None  # [m], where it has a place
    cost: float = 1.0  # in units of one more sensor
    amount: float = 0.0  # [kg] of a mass, [Hz] of the top of a band
    fixed: bool = False  # of every further test


@dataclass(frozen=True, eq=False)
class FurtherPlaces:
    """Where further sensors, drives and masses may be."""

    grids: np.ndarray  # (k,) ids
    cost: np.ndarray  # (k,) of a sensor there, in units of one anywhere else
    fixed: MeasuredDofs  # sensors of every further test, wherever they are


@dataclass(frozen=True, eq=False, repr=False)
class Outlook(ShownBriefly):
    """Rival explanations, and what each candidate measurement would show of them."""

    names: tuple[str, ...]  # of the explanations
    rivals: Rivals  # their probabilities
    candidates: tuple[FurtherTest, ...]
    seen: tuple[Predicted, ...]  # data of each candidate, as the rivals predict them
    unknown: OpenQuantity | None = None  # that is measured, where there is one explanation

    @property
    def costs(self) -> np.ndarray:
        """Cost of each candidate (c,)."""
        return np.array([c.cost for c in self.candidates])

    def made(self, measurements: Sequence[int]) -> Predicted:
        """The data of some candidates together."""
        return sum((self.seen[k] for k in measurements), nothing(self.seen[0]))

    def information(self, measurements: Sequence[int]) -> float:
        """Expected information [nat] of some candidates together.

        It is about the name of the true explanation; of one explanation about its unknown
        quantity, ½ ln of the ratio of variances.
        """
        made = self.made(measurements)
        if self.unknown is not None:
            return -float(np.log(self.unknown.narrowed(made)))
        return self.rivals.forecast(made).information

    @property
    def nothing_left(self) -> str:
        """The sentence for no candidate that is worth its measurement."""
        does = f"tells {' and '.join(self.names)} apart"
        if self.unknown is not None:
            does = f"narrows the interval of {self.unknown.name}, the least known quantity"
        return f"Nothing further is worth measuring: none of the candidates {does}."

    def without(self, barred: Sequence[str]) -> "Outlook":
        """The outlook without the candidates of some kinds or labels."""
        return self.of(np.flatnonzero(~self.excluded(barred)).tolist())

    def of(self, kept: Sequence[int]) -> "Outlook":
        """The outlook with some of its candidates."""
        candidates = tuple(self.candidates[k] for k in kept)
        return replace(self, candidates=candidates, seen=tuple(self.seen[k] for k in kept))

    def excluded(self, without: Sequence[str]) -> np.ndarray:
        """Mask over the candidates of some kinds or labels."""
        barred = set(without)
        return np.array([bool(barred & {c.kind, c.label}) for c in self.candidates])


def advised(
    every: Sequence[Outlook], count: int = ADVISED, odds: float = ODDS,
    without: Sequence[str] = (),
) -> tuple[NextMeasurement, ...]:  # fmt: skip
    """Choose the best few measurements, each with the most information for its cost.

    Fixed ones are first.

    Parameters
    ----------
    every : cases that are equally likely, with the same candidates
    odds : that settle an explanation
    without : kinds or labels that cannot be measured
    """
    first, n = every[0], len(every)
    most = np.inf if first.unknown else sum(o.rivals.entropy for o in every) / n

    def information(measurements: Sequence[int]) -> float:
        return sum(o.information(measurements) for o in every) / n

    barred = first.excluded(without)
    fixed = [k for k, c in enumerate(first.candidates) if c.fixed and not barred[k]]
    ks = chosen(information, np.where(barred, np.inf, first.costs), count, most, fixed)
    return outcomes(every, ks, odds)


def outcomes(
    every: Sequence[Outlook], measurements: Sequence[int], odds: float = ODDS
) -> tuple[NextMeasurement, ...]:
    """Say of each of some candidates, made one after the other, what it would do."""
    first, n = every[0], len(every)
    out = []
    for end, k in enumerate(measurements, 1):
        c, made = first.candidates[k], measurements[:end]
        bits = sum(o.information(made) for o in every) / n / np.log(2)
        found = NextMeasurement(c.kind, c.what, c.label, c.point_m, c.amount, bits)
        if first.unknown is not None:
            narrows = first.unknown.narrowed(first.made(made))
            out.append(replace(found, about=first.unknown.name, narrows=narrows))
            continue
        after = [o.rivals.forecast(o.made(made)) for o in every]
        settles, misleads = (
            sum(share(f, odds) for f in after) / n for share in (Forecast.settled, Forecast.misled)
        )
        out.append(replace(found, settles=settles, misleads=misleads))
    return tuple(out)


def with_common_candidates(every: Sequence[Outlook]) -> tuple[Outlook, ...]:
    """The outlooks with the candidates that all of them have, in the order of the first."""
    if not every:
        return ()
    places = [{(c.kind, c.label): k for k, c in enumerate(o.candidates)} for o in every]
    keys = [key for key in places[0] if all(key in other for other in places)]
    return tuple(o.of([at[key] for key in keys]) for o, at in zip(every, places, strict=True))


COLUMNS = ("kind", "what", "label", "cost", "amount", "fixed")  # of the candidates, in the file


def arrays_of(known: Outlook) -> dict[str, np.ndarray]:
    """The arrays of an outlook, by name."""
    nowhere = (np.nan,) * 3
    return {
        "names": np.array(known.names), "probability": known.rivals.probability,
        "ends": np.cumsum([s.mean.shape[1] for s in known.seen]),
        "mean": np.hstack([s.mean for s in known.seen]).astype(np.float32),
        **{f"factor_{j}": np.vstack([s.factors[j] for s in known.seen]).astype(np.float32)
           for j in range(len(known.names))},
        **{name: np.array([getattr(c, name) for c in known.candidates]) for name in COLUMNS},
        "point_m": np.array([c.point_m or nowhere for c in known.candidates]),
        **({} if (x := known.unknown) is None else
           {"unknown": np.array(x.name), "along": np.append(x.along, x.rest)}),
    }  # fmt: skip


def read_outlook(folder: Path) -> Outlook:
    """Read the outlook of a run."""
    path = folder / FILE
    if not path.is_file():
        raise FileError(f"{folder}: there is no {FILE}; a diagnosis of responses writes it")
    try:
        with np.load(path, allow_pickle=False) as file:
            held = {name: file[name] for name in file.files}
        for name, kind in (("amount", float), ("fixed", bool)):  # runs before there was one
            held.setdefault(name, np.zeros(len(held["cost"]), kind))
        where = [None if np.isnan(p).any() else tuple(p.tolist()) for p in held["point_m"]]
        rows = zip(*(held[name].tolist() for name in COLUMNS), strict=True)
        each = (dict(zip(COLUMNS, row, strict=True)) for row in rows)
        candidates = tuple(FurtherTest(**c, point_m=p) for c, p in zip(each, where, strict=True))
        names = tuple(held["names"].tolist())
        columns_ = [held["mean"].T, *(held[f"factor_{j}"] for j in range(len(names)))]
        parts = zip(*(np.split(c.astype(float), held["ends"][:-1]) for c in columns_), strict=True)
        seen = tuple(Predicted(mean.T, tuple(factors)) for mean, *factors in parts)
        unknown = None
        if "unknown" in held:
            *along, rest = held["along"].tolist()
            unknown = OpenQuantity(str(held["unknown"]), np.array(along), rest)
        found = Outlook(names, Rivals(held["probability"]), candidates, seen, unknown)
        shapes = {(len(s.mean), *(F.shape[0] - s.mean.shape[1] for F in s.factors)) for s in seen}
    except (OSError, EOFError, ValueError, KeyError, TypeError, zipfile.BadZipFile) as error:
        raise FileError(f"{path} is no outlook of a diagnosis: {error}") from error
    if shapes != {(len(names), *len(names) * (0,))} or len(seen) != len(candidates):
        raise FileError(f"{path} is no outlook of a diagnosis: its matrices have another size")
    return found
