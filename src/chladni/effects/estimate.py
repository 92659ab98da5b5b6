"""Results of a fitted effect: its size and its place (SI)."""

from collections.abc import Iterable
from dataclasses import dataclass


def in_mm(place: Iterable[float]) -> str:
    """Coordinates [m] as text in millimetres: 120, -35, 0."""
    return ", ".join(str(round(1e3 * float(v))) for v in place)


@dataclass(frozen=True)
class Estimate:
    """A physical value with its 95 % interval.

    Attributes
    ----------
    name : of the parameter
    unit : in which the value is given
    value : the most probable one
    low, high : ends of the interval that holds the value with 95 % if the explanation is right
    """

    name: str
    value: float
    unit: str = ""
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Location:
    """Place of an effect in words and, if known, in numbers.

    Attributes
    ----------
    text : in words
    parts : names of parts
    grids : ids of grids
    point_m : place in the basic frame [m]
    radius_m : the place lies within it with 95 % [m]; of a hem the extent
    band_hz : band that it concerns [Hz]
    channels : labels of the channels that it concerns
    """

    text: str = ""
    parts: tuple[str, ...] = ()
    grids: tuple[int, ...] = ()
    point_m: tuple[float, ...] | None = None
    radius_m: float | None = None
    band_hz: tuple[float, float] | None = None
    channels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Remarks:
    """Text on a fitted effect; "" where there is nothing to say.

    Attributes
    ----------
    becomes : name of the simpler effect that the data cannot distinguish from it
    nearly : name of the simpler effect to which it reduces within its intervals
    implausible : why its value is physically impossible
    comment : note on what the cards of the deck do not represent
    """

    becomes: str = ""
    nearly: str = ""
    implausible: str = ""
    comment: str = ""
