"""Candidates and target modes of a case folder or deck, for the placement environments."""

from .specimens import Specimen


def specimen(case: str, modes: int) -> Specimen:
    """Candidates found on the mesh of a case and its first flexible modes there."""
    raise NotImplementedError(case, modes)
