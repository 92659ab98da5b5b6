"""Families of effects by name: built-in, from installed packages, and registered by a program.

A package adds a family by an entry point, without any change of chladni::

    [project.entry-points."chladni.effects"]
    edge-mass = "my_package.edge_mass:FAMILY"
"""

from collections.abc import Sequence
from functools import cache

from ..errors import ExtensionError, LabelError, did_you_mean
from ..extensions import installed
from . import (
    adhesive,
    channels,
    compliant_support,
    contacts,
    crack,
    hems,
    masses,
    membrane_prestress,
    open_joints,
    orthotropy,
    rotating_part,
    sheets,
    solid_patch,
    springs,
    stiffener,
    welds,
)
from .family import Family

GROUP = "chladni.effects"
BUILT_IN = (
    orthotropy.FAMILY,
    masses.SENSORS,
    masses.POINT,
    springs.SUPPORT,
    springs.SUSPENSION,
    sheets.THICKNESS,
    sheets.DOUBLER,
    channels.FAMILY,
    masses.RESONATOR,
    sheets.STIFFNESS,
    sheets.MASS,
    crack.FAMILY,
    stiffener.FAMILY,
    membrane_prestress.FAMILY,
    welds.MISSING,
    welds.COMPLIANCE,
    adhesive.ADHESIVE,
    hems.FAMILY,
    contacts.FAMILY,
    welds.TIE,
    compliant_support.FAMILY,
    open_joints.FAMILY,
    springs.SHAKER,
    adhesive.FAMILY,
    rotating_part.FAMILY,
    solid_patch.FAMILY,
)
_added: dict[str, Family] = {}


def families() -> tuple[Family, ...]:
    """All known families, the built-in ones first; ExtensionError where a package is at fault."""
    return (*BUILT_IN, *_installed(), *_added.values())


def names() -> tuple[str, ...]:
    """The names of all known families."""
    return tuple(family.name for family in families())


def catalogue(chosen: Sequence[str] = ()) -> tuple[Family, ...]:
    """The families with these names, in the order of :func:`families`; all without a name."""
    return tuple(f for f in families() if not chosen or f.name in chosen)


def family(name: str) -> Family:
    """Return the family with this name; raise ``LabelError`` if there is no such family."""
    for known in families():
        if known.name == name:
            return known
    raise LabelError(
        f"no effect {name!r}; {did_you_mean(name, names())}there are {', '.join(names())}"
    )


def register(family: Family) -> None:
    """Add a family for this process; ExtensionError where its name is taken."""
    if family.name in names():
        raise ExtensionError(f"an effect {family.name!r} is registered already")
    _added[family.name] = family


def unregister(name: str) -> None:
    """Remove a family added by :func:`register`; raise ``LabelError`` if it was not."""
    if name not in _added:
        raise LabelError(f"no effect {name!r} was registered; there are {', '.join(_added)}")
    del _added[name]


@cache
def _installed() -> tuple[Family, ...]:
    """Families of the installed packages, in the order of their names."""
    found = installed(
        GROUP,
        "effect",
        "a chladni.effects.family.Family",
        lambda offered: isinstance(offered, Family),
        {own.name for own in BUILT_IN},
        lambda _, family: family.name,
    )
    return tuple(found.values())
