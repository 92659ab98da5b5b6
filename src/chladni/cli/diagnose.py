"""``chladni diagnose``: the name of the physics a deck left out, and the deck with it."""

from ..workflows.diagnose import diagnose
from .run import CaseFolder, Out, Pictures, diagnosed


def run(
    source: CaseFolder,
    pictures: Pictures = False,
    out: Out = None,
) -> None:
    """Name the missing physics, write the updated deck, diagnosis.json and a page."""
    diagnosed("diagnose", source, out, diagnose, pictures)
