"""``chladni diagnose``: the name of the physics a deck left out, and the deck with it."""

from ..workflows.diagnose import diagnose
from .run import DeckOrCase, Mass, Out, Pictures, Recordings, SensorTable, Units, diagnosed, stated


def run(
    source: DeckOrCase,
    recordings: Recordings = None,
    sensors: SensorTable = None,
    mass: Mass = None,
    units: Units = None,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Name the missing physics, write the updated deck, diagnosis.json and a page."""
    words = stated(sensors=sensors, mass=mass, units=units)
    diagnosed("diagnose", source, out, diagnose, pictures, recordings or (), words)
