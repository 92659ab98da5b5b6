"""Candidates and target modes of a case folder or deck, for the placement environments."""

from pathlib import Path

from chladni.cli.model import load_model
from chladni.planning import Wishes
from chladni.planning.places import find_places
from chladni.planning.plan import mounts_at, shapes, target_modes

from .specimens import Specimen


def specimen(case: str, modes: int, *, candidates: int = 300, units: str | None = None) -> Specimen:
    """Flat, reachable places found on the mesh and the first flexible modes along their normals.

    Parameters
    ----------
    case : folder with a case.toml, that file, or a bare deck
    modes : int          target modes, fewer if the model has fewer
    candidates : int     places at most
    units : str          unit system of a bare deck
    """
    model = load_model(Path(case), units)
    places = find_places(model.assembly, candidates, unit=model.unit)
    target, _, _ = target_modes(model.structure, Wishes(modes=modes))
    mounts = mounts_at(places)
    normal = mounts.normal
    labels = tuple(name for name, flat in zip(mounts.labels, normal, strict=True) if flat)
    phi = shapes(model.structure, target, mounts)[normal]
    return Specimen(mounts.points[normal], phi, target.frequency, target.damping, labels)
