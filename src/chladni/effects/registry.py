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
    compliant_support,
    contact_stiffness,
    crack,
    extra_support,
    hem_contact,
    local_resonator,
    mass_patch,
    membrane_prestress,
    orthotropic_material,
    over_constraint,
    point_mass,
    sensor_fault,
    sensor_mass,
    shaker_restraint,
    stiffness_patch,
    suspension,
    thickness_distribution,
    viscoelastic_joint,
    weld_compliance,
)
from .family import Family

GROUP = "chladni.effects"
BUILT_IN = (
    orthotropic_material.FAMILY,
    sensor_mass.FAMILY,
    point_mass.FAMILY,
    extra_support.FAMILY,
    suspension.FAMILY,
    thickness_distribution.FAMILY,
    sensor_fault.FAMILY,
    local_resonator.FAMILY,
    stiffness_patch.FAMILY,
    mass_patch.FAMILY,
    crack.FAMILY,
    membrane_prestress.FAMILY,
    weld_compliance.MISSING,
    weld_compliance.FAMILY,
    viscoelastic_joint.ADHESIVE,
    hem_contact.FAMILY,
    contact_stiffness.FAMILY,
    over_constraint.FAMILY,
    compliant_support.FAMILY,
    shaker_restraint.FAMILY,
    viscoelastic_joint.FAMILY,
)
_added: dict[str, Family] = {}


def families() -> tuple[Family, ...]:
    """All known families, the built-in ones first.

    Raises
    ------
    ExtensionError
        If an installed package offers a family that cannot be used.
    """
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
    """Add a family for this process.

    Raises
    ------
    ExtensionError
        If its name is taken.
    """
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
