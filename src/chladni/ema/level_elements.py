"""Nonlinear elements of a mode, relative to its stiffness.

Amplitudes are relative to the largest measured one, so that bounds and starts suit any object.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np

from .describing_functions import cubic, drag, gap_spring, micro_slip, slider

Kind = Literal["linear", "friction", "clearance", "cubic", "loss"]
STIFFNESS = (1e-5, 2.0)  # of the mode's own stiffness, of a spring, or as a loss factor
PLACE = (0.01, 1.0)  # of the largest amplitude: where play ends, where a slider slides
POWER = (0.1, 2.5)  # of amplitude: from Coulomb's own to beyond what any joint was reported with


@dataclass(frozen=True)
class Number:
    """A parameter of an element: positive within ``bounds``, or signed, up to the last of them.

    The reported value, in ``unit``, is the fitted one times (largest amplitude) ** ``metres``.
    """

    name: str
    bounds: tuple[float, float]
    starts: tuple[float, ...]
    unit: str = ""
    metres: int = 0
    signed: bool = False


@dataclass(frozen=True)
class BasicElement:
    """One describing function over relative amplitude, with its numbers."""

    name: str
    kind: Kind
    kappa: Callable[..., np.ndarray]
    numbers: tuple[Number, ...]


@dataclass(frozen=True)
class Element:
    """Basic elements in parallel; none: a linear mode. The first one determines the kind."""

    pieces: tuple[BasicElement, ...]

    @property
    def name(self) -> str:
        """Name in the terms of a test engineer."""
        return " and ".join(p.name for p in self.pieces) or "linear"

    @property
    def kind(self) -> Kind:
        """Kind of nonlinearity that it indicates."""
        return self.pieces[0].kind if self.pieces else "linear"

    @property
    def numbers(self) -> tuple[Number, ...]:
        """Parameters of all pieces."""
        return tuple(n for p in self.pieces for n in p.numbers)

    def kappa(self, amplitude: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Complex stiffness over that of the mode, at relative amplitudes (k,)."""
        out, at = np.zeros(amplitude.shape, complex), 0
        for p in self.pieces:
            out = out + p.kappa(amplitude, *values[at : at + len(p.numbers)])
            at += len(p.numbers)
        return out

    def starts(self) -> list[tuple[float, ...]]:
        """Values to begin a fit from."""
        return list(product(*(n.starts for n in self.numbers)))


def _slip_by_loss(amplitude: np.ndarray, loss: float, n: float) -> np.ndarray:
    """Micro-slip by its loss factor at the largest amplitude, κ''(1)."""
    return micro_slip(amplitude, loss * np.pi * (n + 2) / (4 * n), n)


_SPRING = Number("stiffness relative to the mode", STIFFNESS, (1e-3, 2e-2))
_LOSS = Number("loss factor at the largest amplitude", STIFFNESS, (1e-3, 1e-2))
_POWER = Number("power of amplitude", POWER, (0.6, 1.4))
CUBIC = BasicElement(
    "cubic spring", "cubic", cubic,
    (Number("k3 / the mode's stiffness", (0.0, 2.0), (-0.01, 0.01), "1/m2", -2, signed=True),),
)  # fmt: skip
GAP = BasicElement("spring behind a gap", "clearance", gap_spring,
            (_SPRING, Number("gap", PLACE, (0.1, 0.3, 0.7), "m", 1)))  # fmt: skip
SLIDER = BasicElement("slider", "friction", slider,
               (_SPRING, Number("slip from", PLACE, (0.02, 0.1, 0.3, 0.8), "m", 1)))  # fmt: skip
MICRO_SLIP = BasicElement("micro-slip", "friction", _slip_by_loss, (_LOSS, _POWER))
DRAG = BasicElement("drag", "loss", drag, (_LOSS, _POWER))
ELEMENTS = tuple(
    Element(pieces)
    for pieces in ((), (CUBIC,), (GAP,), (SLIDER,), (MICRO_SLIP,), (DRAG,),
                   (SLIDER, CUBIC), (MICRO_SLIP, CUBIC), (DRAG, CUBIC))
)  # fmt: skip
