"""A parameter of a structure that a fit may change: its field, its parts and its bounds."""

from dataclasses import dataclass


@dataclass(frozen=True)
class FreeParameter:
    """One factor on a field of parts, springs, bushes or masses, or an effect by its name.

    Attributes
    ----------
    name : given by the user
    field : E, rho, nu, t, wall, offset, E1, E2, G12, nu12, K, M, or the name of an effect
    parts : names and cards as the user wrote them; empty: all with this field
    sd : standard deviation of the prior of ln(value / deck's value), None: the default
    low, high : bounds of value / deck's value, None: no bound
    positions : of parts in ``Assembly.parts``
    springs, bushes, masses : rows of these families
    """

    name: str
    field: str
    parts: tuple[str, ...] = ()
    sd: float | None = None
    low: float | None = None
    high: float | None = None
    positions: tuple[int, ...] = ()
    springs: tuple[int, ...] = ()
    bushes: tuple[int, ...] = ()
    masses: tuple[int, ...] = ()
