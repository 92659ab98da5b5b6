"""Results of a fitted effect: its size and its place (SI)."""

from collections.abc import Iterable
from dataclasses import dataclass


def in_mm(place: Iterable[float]) -> str:
    """Coordinates [m] as text in millimetres: 120, -35, 0."""
    return ", ".join(str(round(1e3 * float(v))) for v in place)


@dataclass(frozen=True)
class Estimate:
    """A physical value with the interval that holds it with 95 % if the explanation is right."""

    name: str  # of the parameter
    value: float  # the most probable one
    unit: str = ""
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Location:
    """Place of an effect in words and, if known, in numbers."""

    text: str = ""  # in words
    parts: tuple[str, ...] = ()  # names of parts
    grids: tuple[int, ...] = ()  # ids of grids
    point_m: tuple[float, ...] | None = None  # in the basic frame [m]
    radius_m: float | None = None  # [m] of a distributed effect, or uncertainty of a local place
    band_hz: tuple[float, float] | None = None  # that it concerns [Hz]
    channels: tuple[str, ...] = ()  # labels of those that it concerns


@dataclass(frozen=True)
class Remarks:
    """Text on a fitted effect; "" where there is nothing to say."""

    becomes: str = ""  # name of the simpler effect that the data cannot distinguish from it
    nearly: str = ""  # name of the simpler effect to which it reduces within its intervals
    implausible: str = ""  # why its value is physically impossible
    comment: str = ""  # what the cards of the deck do not represent
