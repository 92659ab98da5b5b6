"""Modes as data: frequencies, damping ratios and mass-normalised shapes over labelled dofs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from ..arrays import OneScreen, readonly
from ..dofs import parse, rows
from ..errors import LabelError, ShapeError

_RIGID_GAP = 100.0  # ratio of frequencies that does not occur between two flexible modes


@dataclass(frozen=True, eq=False, repr=False)
class ModalModel(OneScreen):
    """Modes with Φᵀ M Φ = I and Φᵀ K Φ = diag(ω_r²).

    Attributes
    ----------
    frequency : (r,)     natural frequencies [Hz], increasing
    damping : (r,)       modal damping ratios [-]
    shapes : (n, r)      Φ [1/√kg]
    dofs : (n, 2) int    point id and component 1-6 of each row of ``shapes``
    """

    frequency: np.ndarray
    damping: np.ndarray
    shapes: np.ndarray
    dofs: np.ndarray

    def __post_init__(self) -> None:
        due = (len(self.dofs), len(self.frequency))
        if self.shapes.shape != due:
            raise ShapeError(f"shapes are {self.shapes.shape}, dofs and frequencies say {due}")
        if np.shape(self.damping) != due[1:]:
            raise ShapeError(f"damping is {np.shape(self.damping)}, there are {due[1]} frequencies")
        for name in ("frequency", "damping", "shapes", "dofs"):
            object.__setattr__(self, name, readonly(getattr(self, name)))

    def __len__(self) -> int:
        return len(self.frequency)

    def with_damping(self, zeta: float | np.ndarray) -> Self:
        """Copy of the modes with damping ratio zeta (one for all, or one each)."""
        return replace(self, damping=np.broadcast_to(np.asarray(zeta, float), self.frequency.shape))

    def sel(self, modes: np.ndarray | slice) -> Self:
        """Some of the modes, by number or mask."""
        return replace(
            self,
            frequency=self.frequency[modes],
            damping=self.damping[modes],
            shapes=self.shapes[:, modes],
        )

    def at(self, labels: Sequence[str]) -> np.ndarray:
        """Rows of Φ at these labels, with the label's sign (n_labels, r).

        Raises
        ------
        LabelError
            If a label has no row; the message names it and some existing ones.
        """
        wanted = np.array([parse(text) for text in labels], dtype=np.int64).reshape(-1, 3)
        found = rows(wanted[:, :2], self.dofs)
        if missing := [text for text, k in zip(labels, found, strict=True) if k < 0]:
            some = [f"{p}:{c}" for p, c in self.dofs[:6]]
            raise LabelError(f"no degree of freedom {missing}; there are (point:component) {some}")
        return wanted[:, 2:] * self.shapes[found]


def rigid_modes(modal: ModalModel) -> np.ndarray:
    """Mask (r,) of the modes below the last frequency jump of 100 or more: modes without stiffness.

    Rounding gives every rigid mode a different frequency near zero, so that the last jump counts.
    Modes of a soft suspension lie within a factor of 100 of the first flexible mode and are not
    counted. A model with all modes at 0 Hz has no jump and no rigid modes in this sense. The
    frequencies of residual vectors jump too: apply the function before they are added.
    """
    f = modal.frequency
    jumps = np.flatnonzero((f[1:] > 0) & (f[1:] >= _RIGID_GAP * f[:-1]))
    return np.arange(len(f)) < (jumps[-1] + 1 if len(jumps) else 0)
