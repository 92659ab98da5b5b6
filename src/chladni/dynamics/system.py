"""The second-order system M q'' + V q' + K q = f."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..arrays import OneScreen, readonly
from ..errors import ShapeError


@dataclass(frozen=True, eq=False, repr=False)
class System(OneScreen):
    """Mass, viscous damping and stiffness over labelled degrees of freedom."""

    # M, V, K: (n, n) mass [kg], damping [N s/m], stiffness [N/m]; symmetric. K may be
    # complex where the structure has hysteretic damping.
    M: sp.csr_array
    V: sp.csr_array
    K: sp.csr_array
    dofs: np.ndarray  # (n, 2) int: point id and component 1-6 of each row

    def __post_init__(self) -> None:
        n = len(self.dofs)
        for name in "MVK":
            if getattr(self, name).shape != (n, n):
                raise ShapeError(f"{name} is {getattr(self, name).shape}, {n} dofs need {(n, n)}")
        object.__setattr__(self, "dofs", readonly(np.asarray(self.dofs, dtype=np.int64)))

    @property
    def elastic(self) -> sp.csr_array:
        """The real part of K; a real K is returned itself, because SciPy's ``real`` copies it."""
        return self.K.real if np.iscomplexobj(self.K.data) else self.K
