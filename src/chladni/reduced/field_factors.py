"""Factors on stiffness and mass of shells and beams, from their log fields."""

import numpy as np

from ..effects.effect import FieldChange, of
from ..effects.shell_components import COMPONENTS
from ..errors import ModelError
from .effect_dofs import Acting


def log_fields(
    acting: Acting, n: int, n_p: int, split: bool
) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Sum of the log fields (n,) over the groups and their gradients (n, n_p), by name.

    Raises
    ------
    ModelError
        If a component of the plane stiffness changes in a model that is not split into components.
    """
    logs = {name: np.zeros(n) for name in ("t", "E", "rho", "bending", *COMPONENTS)}
    slopes = {name: np.zeros((n, n_p)) for name in logs}
    for effect, at, terms in acting:
        for change in of(FieldChange, terms):
            if change.field in COMPONENTS and not split:
                raise ModelError(
                    f"{effect.name} changes {change.field}; the model needs with_components()"
                )
            logs[change.field] = logs[change.field] + change.value
            slopes[change.field][:, at] += change.gradient
    return logs, slopes


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
