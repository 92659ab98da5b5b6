"""Test article on the bench, given by its modes at the points where devices are attached."""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

from chladni.arrays import readonly
from chladni.errors import ShapeError

from .local_forces import LocalForce


@dataclass(frozen=True, eq=False)
class BenchArticle:
    """Modes of an article and their motion at every place of the test [1/√kg].

    Attributes
    ----------
    name : str
    weight : float              as it is weighed, without sensors [kg]
    frequency, damping : (r,)   [Hz], of critical; rigid motions have 0 Hz to the last digit
    outputs : (n_out, r)        along what each sensor feels, at its true place
    mounts : (n_out, 3, r)      translation where each sensor sits
    drive : (6, r)              at the shaker: along the stinger, two ways across, three rotations
                                about these axes
    hangers : (k, 3, r)         where cords hold it: along the cord, two ways across
    sites : (s, r)              opening of every site with a local force
    laws : what acts at these sites
    gyroscopic : (r, r)         φᵀGφ of spinning parts, skew [1/s]
    masses : (n_out,)           of each sensor [kg]; 0: as its type weighs
    channels : (n_out,)         of the sensor that each is a channel of, which weighs once
    gains : (n_out,)            factor on every channel that nobody knows of (miswired, mistyped)
    output_labels, input_label  as 412:+Z
    base : (r,)                 on a shaker table: load of a unit acceleration of the supports on
                                the modes [√kg]; none elsewhere
    with_base, mounts_with_base : (n_out,), (n_out, 3)  rigid motion of outputs and mounts
    """

    name: str
    weight: float
    frequency: np.ndarray
    damping: np.ndarray
    outputs: np.ndarray
    mounts: np.ndarray
    drive: np.ndarray
    hangers: np.ndarray
    output_labels: tuple[str, ...]
    input_label: str
    sites: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    laws: tuple[LocalForce, ...] = ()
    gyroscopic: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    masses: np.ndarray = field(default_factory=lambda: np.zeros(0))
    channels: np.ndarray = field(default_factory=lambda: np.zeros(0))
    gains: np.ndarray = field(default_factory=lambda: np.zeros(0))
    base: np.ndarray = field(default_factory=lambda: np.zeros(0))
    with_base: np.ndarray = field(default_factory=lambda: np.zeros(0))
    mounts_with_base: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))

    def __post_init__(self) -> None:
        r, n = len(self.frequency), len(self.output_labels)
        if not self.laws:
            object.__setattr__(self, "sites", np.zeros((0, r)))
        if not len(self.gyroscopic):
            object.__setattr__(self, "gyroscopic", np.zeros((r, r)))
        one, none = np.ones(n), np.zeros(n)
        for name, usual in (("gains", one), ("channels", one), ("masses", none)):
            if not len(getattr(self, name)):
                object.__setattr__(self, name, usual)
        due = {"damping": (r,), "outputs": (n, r), "mounts": (n, 3, r), "drive": (6, r),
               "hangers": (len(self.hangers), 3, r), "sites": (len(self.laws), r),
               "gyroscopic": (r, r), "gains": (n,), "channels": (n,), "masses": (n,)}  # fmt: skip
        if self.on_table:
            due |= {"base": (r,), "with_base": (n,), "mounts_with_base": (n, 3)}
        for name, shape in due.items():
            if (found := np.shape(getattr(self, name))) != shape:
                raise ShapeError(f"{name} is {found}, modes, labels and laws say {shape}")
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @property
    def on_table(self) -> bool:
        """True if a shaker table moves its supports instead of a force."""
        return len(self.base) > 0

    @property
    def elastic(self) -> np.ndarray:
        """True for modes that are no rigid motion (r,)."""
        return np.asarray(self.frequency > 0)

    def turned(self, frequency: np.ndarray, damping: np.ndarray, Q: np.ndarray, name: str) -> Self:
        """The article whose modes are Φ Q, Q (r, r) orthogonal."""
        parts = ("outputs", "mounts", "drive", "hangers", "sites")
        seen = {part: getattr(self, part) @ Q for part in parts}
        seen["base"] = self.base @ Q if self.on_table else self.base
        seen["gyroscopic"] = Q.T @ self.gyroscopic @ Q
        return replace(self, name=name, frequency=frequency, damping=damping, **seen)
