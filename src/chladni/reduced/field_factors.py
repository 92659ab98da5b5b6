"""Factors on stiffness and mass of shells and beams, from their log fields."""

import numpy as np


def stiffness_log(fields: dict[str, np.ndarray], component: str, power: int) -> np.ndarray:
    """E + p t + Q: logarithm of the factor on stiffness that grows with t^p.

    Bending stiffness, p = 3, adds the field ``bending``.  A component of the plane stiffness adds
    its own field Q. The sum is linear in the fields (g, ...), so it serves their gradients as well.
    """
    plain = fields["E"] + power * fields["t"]
    if power == 3:
        plain = plain + fields["bending"]
    return plain + fields[component] if component else plain


def mass_log(fields: dict[str, np.ndarray]) -> np.ndarray:
    """ρ + t: logarithm of the factor on the shells' mass, or its gradient."""
    return fields["rho"] + fields["t"]
