"""Factors on stiffness and mass of shells and beams, from their log fields."""

import numpy as np


def stiffness_log(fields: dict[str, np.ndarray], component: str, power: int) -> np.ndarray:
    """E + p t + Q: logarithm of the factor on stiffness that grows with t^p.

    Bending stiffness, p = 3, has the field ``bending`` in addition.  The sum is linear in the
    fields, so it serves their gradients as well; shape (g, ...) of the fields.
    """
    plain = fields["E"] + power * fields["t"]
    if power == 3:
        plain = plain + fields["bending"]
    return plain + fields[component] if component else plain


def mass_log(fields: dict[str, np.ndarray]) -> np.ndarray:
    """ρ + t: logarithm of the factor on the shells' mass, or its gradient."""
    return fields["rho"] + fields["t"]
