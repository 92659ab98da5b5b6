"""What a fitted effect says of itself: how large it is and where (SI)."""

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
    """Where an effect acts: in words, and as far as it is known in numbers.

    ``radius_m`` is how far what is spread reaches; of what sits at one place, how well that is
    known.
    """

    text: str = ""
    parts: tuple[str, ...] = ()
    grids: tuple[int, ...] = ()
    point_m: tuple[float, ...] | None = None
    radius_m: float | None = None
    band_hz: tuple[float, float] | None = None
    channels: tuple[str, ...] = ()
