"""Rules for a layout: fixed and forbidden places, minimum distance, regions; all as masks."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from chladni.errors import LabelError, ShapeError, named

from .information import positions_of


def too_near(points: np.ndarray, distance: float) -> np.ndarray:
    """Pairs of places nearer to each other than ``distance`` (n, n) bool.

    Parameters
    ----------
    points : (n, 2) or (n, 3)   places of the candidates [m]
    distance : least distance between two sensors [m]
    """
    from scipy.spatial import cKDTree

    near = np.zeros((len(points), len(points)), bool)
    pairs = cKDTree(points).query_pairs(np.nextafter(distance, 0.0), output_type="ndarray")
    near[pairs[:, 0], pairs[:, 1]] = near[pairs[:, 1], pairs[:, 0]] = True
    return near


@dataclass(frozen=True, eq=False)
class Rules:
    """Rules for a layout.

    Attributes
    ----------
    fixed, forbidden : positions or mask   candidates that must, must not, be in the layout
    near : (n, n) bool                     pairs that exclude each other, see :func:`too_near`
    region : (n,) int                      region of each candidate
    most, least : {region: count}          sensors a region may, must, hold
    """

    fixed: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    forbidden: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    near: np.ndarray | None = None
    region: np.ndarray | None = None
    most: Mapping[int, int] = field(default_factory=dict)
    least: Mapping[int, int] = field(default_factory=dict)

    def masks(self, n: int) -> tuple[np.ndarray, np.ndarray]:
        """Masks (n,) bool of the fixed and the forbidden candidates."""
        fixed, forbidden = np.zeros(n, bool), np.zeros(n, bool)
        fixed[positions_of(self.fixed, n)] = True
        forbidden[positions_of(self.forbidden, n)] = True
        return fixed, forbidden

    def checked(self, n: int, n_sensors: int) -> "Rules":
        """These rules as masks, checked that ``n_sensors`` of ``n`` candidates can obey them.

        Raises
        ------
        ShapeError, LabelError
            One sentence that says which rules contradict each other.
        """
        fixed, forbidden = self.masks(n)
        if np.any(both := fixed & forbidden):
            raise LabelError(f"candidates {named(np.flatnonzero(both), 3)} are fixed, forbidden")
        if not fixed.sum() <= n_sensors <= n - forbidden.sum():
            raise ShapeError(
                f"{n_sensors} sensors were requested; {fixed.sum()} are fixed and "
                f"{n - forbidden.sum()} of the {n} candidates are allowed"
            )
        self._check_near(n, fixed)
        self._check_regions(n, n_sensors, fixed, ~forbidden)
        return replace(self, fixed=fixed, forbidden=forbidden)

    def _check_near(self, n: int, fixed: np.ndarray) -> None:
        if self.near is None:
            return
        if self.near.shape != (n, n):
            raise ShapeError(f"the pairs too near are {self.near.shape}, they should be {(n, n)}")
        for i, j in combinations(np.flatnonzero(fixed), 2):
            if self.near[i, j]:
                raise ShapeError(f"the fixed candidates {i} and {j} are too near to each other")

    def _check_regions(
        self, n: int, n_sensors: int, fixed: np.ndarray, allowed: np.ndarray
    ) -> None:
        if self.region is None:
            if self.most or self.least:
                raise ShapeError("limits for regions were given, but no region of any candidate")
            return
        if self.region.shape != (n,):
            raise ShapeError(f"regions are {self.region.shape}, there are {n} candidates")
        known = np.unique(self.region)
        if unknown := [r for r in (*self.most, *self.least) if r not in known]:
            raise LabelError(f"no candidate is in region {unknown[0]}; there are {named(known)}")
        room = 0
        for r in known.tolist():
            here = self.region == r
            low = max(self.least.get(r, 0), int((here & fixed).sum()))
            high = min(self.most.get(r, n), int((here & allowed).sum()))
            if low > high:
                raise ShapeError(f"region {r} must hold {low} sensors and has room for {high}")
            room += high
        if sum(self.least.values()) > n_sensors or room < n_sensors:
            raise ShapeError(
                f"the regions require {sum(self.least.values())} sensors and have room for "
                f"{room}; {n_sensors} were requested"
            )

    @property
    def free(self) -> bool:
        """True where any set of candidates is as good as another."""
        return bool(
            self.near is None and self.region is None and not np.any(self.fixed | self.forbidden)
        )

    def _count(self, kept: np.ndarray) -> dict[int, int]:
        assert self.region is not None
        return {int(r): int((self.region[kept] == r).sum()) for r in np.unique(self.region)}

    def _excess(self, kept: np.ndarray) -> dict[int, int]:
        """How many sensors each limited region holds above its most."""
        count = self._count(kept)
        return {r: count[r] - high for r, high in self.most.items() if count[r] > high}

    def _lack(self, kept: np.ndarray) -> dict[int, int]:
        """How many sensors each region still needs."""
        count = self._count(kept)
        return {r: low - count[r] for r, low in self.least.items() if count[r] < low}

    def obeyed(self, layout: np.ndarray) -> None:
        """Raise ShapeError, naming the offender, where a layout breaks these rules (masks)."""
        kept = np.zeros(len(self.fixed), bool)
        kept[layout] = True
        if kept.sum() != len(layout):
            raise ShapeError("the layout contains a candidate twice")
        if np.any(wrong := (self.fixed & ~kept) | (self.forbidden & kept)):
            raise ShapeError(
                f"the layout disagrees with the fixed and forbidden candidates at "
                f"{named(np.flatnonzero(wrong), 3)}"
            )
        if self.near is not None and self.near[np.ix_(layout, layout)].any():
            i = layout[self.near[np.ix_(layout, layout)].any(axis=1)]
            raise ShapeError(f"the layout has sensors nearer than allowed: {named(i, 3)}")
        if self.region is not None and (self._excess(kept) or self._lack(kept)):
            raise ShapeError(f"the layout has {self._count(kept)} sensors by region")

    def deletable(self, kept: np.ndarray, n_sensors: int) -> np.ndarray:
        """Mask of the kept that may leave on the way to ``n_sensors`` (n,) bool.

        Fixed candidates and those of a region at its least must stay. Regions above their most must
        lose sensors.  Once the remaining deletions just suffice for that, only these may lose one.
        """
        may = kept & ~self.fixed
        if self.region is None:
            return may
        count = self._count(kept)
        for r, low in self.least.items():
            if count[r] <= low:
                may = may & (self.region != r)
        excess = self._excess(kept)
        if excess and sum(excess.values()) >= kept.sum() - n_sensors:
            may = may & np.isin(self.region, list(excess))
        return may

    def addable(self, kept: np.ndarray, n_sensors: int) -> np.ndarray:
        """Mask of candidates that may join the kept on the way to ``n_sensors`` (n,) bool."""
        may = ~kept & ~self.forbidden
        waiting = np.flatnonzero(self.fixed & ~kept)
        if self.near is not None:
            shadow = np.r_[np.flatnonzero(kept), waiting]
            may &= ~self.near[shadow].any(axis=0)
        if len(waiting) >= n_sensors - kept.sum():
            may &= self.fixed
        if self.region is None:
            return may
        count = self._count(kept)
        for r, high in self.most.items():
            if count[r] >= high:
                may &= self.region != r
        lack = self._lack(kept)
        if lack and sum(lack.values()) >= n_sensors - kept.sum():
            may &= np.isin(self.region, list(lack))
        return may


def keyed(keys: np.ndarray, n_sensors: int, rules: Rules) -> np.ndarray:
    """The layout (increasing) of the highest keys that the rules allow, one after the other."""
    if rules.free:
        return np.sort(np.argpartition(-keys, n_sensors - 1)[:n_sensors])
    kept = np.zeros(len(keys), bool)
    while kept.sum() < n_sensors:
        may = rules.addable(kept, n_sensors)
        if not may.any():
            break
        kept[int(np.argmax(np.where(may, keys, -np.inf)))] = True
    return np.flatnonzero(kept)


def thinned(rules: Rules, worth: np.ndarray, n_sensors: int) -> np.ndarray:
    """A large set (n,) bool without forbidden or too near places; places of higher worth stay."""
    allowed = ~rules.forbidden
    if rules.near is None:
        return allowed
    crowd = rules.near[:, allowed].sum(axis=1)
    for worth_now in (worth, -crowd.astype(float)):
        kept = _packed(rules, worth_now)
        if kept.sum() >= n_sensors and _regions_fit(rules, kept, n_sensors):
            return kept
    raise ShapeError(
        f"{n_sensors} sensors do not fit at the requested minimum distance: there is room for "
        f"about {kept.sum()} under these rules"
    )


def _packed(rules: Rules, worth: np.ndarray) -> np.ndarray:
    """Greedy packing: in order of worth, each place that is not too near to an earlier one."""
    assert rules.near is not None
    kept, free = np.zeros(len(worth), bool), ~rules.forbidden
    for i in np.argsort(-np.where(rules.fixed, np.inf, worth), kind="stable"):
        if free[i]:
            kept[i] = True
            free &= ~rules.near[i]
    return kept


def _regions_fit(rules: Rules, kept: np.ndarray, n_sensors: int) -> bool:
    """True where the limits of regions can still be met by deleting some of the kept."""
    if rules.region is None:
        return True
    excess = sum(rules._excess(kept).values())
    return not rules._lack(kept) and kept.sum() - excess >= n_sensors
