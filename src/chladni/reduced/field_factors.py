"""Factors on stiffness and mass of shells and beams, from their log fields."""

from dataclasses import replace

import numpy as np

from ..effects.effect import FieldChange, MatrixTerm, of
from ..effects.shell_components import COMPONENTS
from ..errors import ModelError
from .effect_dofs import Acting

Fields = dict[str, np.ndarray]


def log_fields(acting: Acting, n: int, n_p: int, split: bool) -> tuple[Fields, Fields]:
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


def stiffness_log(fields: Fields, component: str, power: int) -> np.ndarray:
    """E + p t + Q: logarithm of the factor on stiffness that grows with t^p.

    Bending stiffness, p = 3, adds the field ``bending``.  A component of the plane stiffness adds
    its own field Q. The sum is linear in the fields (g, ...), so it serves their gradients as well.
    """
    plain = fields["E"] + power * fields["t"]
    if power == 3:
        plain = plain + fields["bending"]
    return plain + fields[component] if component else plain


def limited(
    term: MatrixTerm, of_part: np.ndarray, logs: Fields, slopes: Fields, split: bool
) -> tuple[MatrixTerm, np.ndarray]:
    """A share of a part, not larger than the fields leave, and the slope of its logarithm (n_p,).

    A share c A with c < 0 is taken from w_g A_g in each group g of the part; c min(w_g) keeps the
    sum positive. The slope is zero where nothing is limited.

    Parameters
    ----------
    of_part : (g,)       position of the part of each group
    split : the model has components of the plane stiffness; shear goes with Q66
    """
    if term.part is None or term.coefficient >= 0:
        return term, np.zeros(slopes["t"].shape[1])
    mine = np.flatnonzero(of_part == term.part)
    component = "Q66" if split else ""
    every = [(stiffness_log(logs, component, p)[mine], p) for p in (1, 3)]
    least, power = min(every, key=lambda pair: float(pair[0].min()))
    softest = mine[int(np.argmin(least))]
    w = float(np.exp(least.min()))
    slope = stiffness_log(slopes, component, power)[softest]
    return replace(term, coefficient=w * term.coefficient, gradient=w * term.gradient), slope


def mass_log(fields: Fields) -> np.ndarray:
    """ρ + t: logarithm of the factor on the shells' mass, or its gradient."""
    return fields["rho"] + fields["t"]
