"""Results of a fitted effect: its size and its place (SI)."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Estimate:
    """A physical value with its 95 % interval."""

    name: str
    value: float
    unit: str = ""
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Location:
    """Place of an effect in words and, if known, in numbers.

    ``radius_m`` is the extent of a distributed effect, or the uncertainty of the place of a local
    one.
    """

    text: str = ""
    parts: tuple[str, ...] = ()
    grids: tuple[int, ...] = ()
    point_m: tuple[float, ...] | None = None
    radius_m: float | None = None
    band_hz: tuple[float, float] | None = None
    channels: tuple[str, ...] = ()
