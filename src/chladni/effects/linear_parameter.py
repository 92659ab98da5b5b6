"""A number on which an operator depends linearly: a joint's stiffness, a solid's E, a mass."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..fem.derivative import Slope
from ..model.assembly import Assembly
from .effect import Effect, MatrixTerm, Parameter


@dataclass(frozen=True, eq=False)
class LinearScale(Effect):
    """K + v (e^x - 1) ∂K/∂v and M likewise, v the value the structure has.

    ``write`` puts a value into an assembly.
    """

    kind = "ordinary"
    claim = "an ordinary value of the deck is off"

    slope: Slope | None = None
    write: Callable[[Assembly, float], Assembly] | None = None

    def matrices(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The operators' slopes times the change of the value."""
        assert self.slope is not None
        v = self.parameters[0].scale
        change, gradient = v * np.expm1(x[0]), np.array([v * np.exp(x[0])])
        pairs: tuple[tuple[str, sp.csr_array], ...] = (("K", self.slope.K), ("M", self.slope.M))
        return tuple(
            MatrixTerm("M" if name == "M" else "K", A, change, gradient)
            for name, A in pairs
            if A.nnz
        )

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """The structure with the value in it."""
        return (
            assembly if self.write is None else self.write(assembly, self.parameters[0].value(x[0]))
        )


def linear_scale(
    text: str, name: str, unit: str, value: float, slope: Slope,
    write: Callable[[Assembly, float], Assembly] | None = None, sd: float = 0.3,
) -> LinearScale:  # fmt: skip
    """The parameter v e^x of a linear operator, x of prior deviation ``sd``."""
    return LinearScale(
        (Parameter(name, unit, 0.0, sd, value, step=0.3),), text, slope=slope, write=write
    )
