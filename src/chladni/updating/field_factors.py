"""What the log fields of shells and beams make of their stiffness and their mass."""

import numpy as np


def stiffness_log(fields: dict[str, np.ndarray], component: str, power: int) -> np.ndarray:
    """E + p t + Q: the logarithm of what multiplies stiffness that grows with t^p; of bending more.

    It is linear in the fields, so it stands for their gradients as well; (g, ...) as they are.
    """
    plain = fields["E"] + power * fields["t"]
    if power == 3:
        plain = plain + fields["bending"]
    return plain + fields[component] if component else plain


def mass_log(fields: dict[str, np.ndarray]) -> np.ndarray:
    """ρ + t: the logarithm of what multiplies the shells' mass, or its gradient."""
    return fields["rho"] + fields["t"]
