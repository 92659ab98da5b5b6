"""Parameters with a linear operator: the stiffness of a joint, E of a solid, a mass."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from ..fem.derivative import Slope
from ..model.assembly import Assembly
from .effect import Effect, MatrixTerm, Parameter, Weight, Within


@dataclass(frozen=True, eq=False)
class LinearScale(Effect):
    """K + d ∂K/∂v + d²/2 ∂²K/∂v², d = v (e^x - 1), and M likewise; v is the structure's value.

    ``bent`` is the second slope of an operator that is not linear in v (Poisson's ratio).
    ``within`` is the whole of which the operator in K is a share. ``weight_slope`` is ∂m/∂v [kg].
    ``write`` puts a value into an assembly.
    """

    kind = "calibration"
    claim = "a calibration parameter of the deck is wrong"

    slope: Slope | None = None
    write: Callable[[Assembly, float], Assembly] | None = None
    bent: Slope | None = None
    weight_slope: float = 0.0
    within: Within = field(default_factory=Within)

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The slopes of the operators times the change of the value."""
        assert self.slope is not None
        v = self.parameters[0].scale
        d, slope = v * np.expm1(x[0]), v * np.exp(x[0])
        out = _terms(self.slope, d, slope, self.within)
        if self.bent is None:
            return out
        return out + _terms(self.bent, d**2 / 2, d * slope, replace(self.within, complete=False))

    def weight(self, x: np.ndarray) -> Weight:
        """The change of the value times its mass per unit."""
        v = self.parameters[0].scale * self.weight_slope
        return Weight(float(v * np.expm1(x[0])), np.array([v * np.exp(x[0])]))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the value into the structure."""
        return (
            assembly if self.write is None else self.write(assembly, self.parameters[0].value(x[0]))
        )


def _terms(slope: Slope, change: float, gradient: float, within: Within) -> tuple[MatrixTerm, ...]:
    """The operators of a slope, times a change."""
    g = np.array([gradient])
    out = [MatrixTerm("K", slope.K, change, g, within=within)] if slope.K.nnz else []
    return (*out, *([MatrixTerm("M", slope.M, change, g)] if slope.M.nnz else []))


def linear_scale(
    text: str, name: str, unit: str, value: float, slope: Slope,
    write: Callable[[Assembly, float], Assembly] | None = None, sd: float = 0.3,
    bent: Slope | None = None, weight_slope: float = 0.0, within: Within | None = None,
) -> LinearScale:  # fmt: skip
    """The parameter v e^x of a linear operator, with prior standard deviation ``sd`` of x."""
    return LinearScale(
        (Parameter(name, unit, 0.0, sd, value, step=0.3),), text, slope=slope, write=write,
        bent=bent, weight_slope=weight_slope, within=within or Within(),
    )  # fmt: skip
