"""What a diagnosis is asked: a structure, what was measured on it and where (SI, Hz)."""

from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from ..dynamics.frf import FRF
from ..ema.identification import Identified
from ..fem.assemble import Structure
from ..fem.locate import rows_of
from ..model.assembly import Assembly
from .hypothesis_fit import Search
from .likelihood import Poles, Responses
from .map_fit import Weighing


@dataclass(frozen=True, eq=False)
class Places:
    """Measured or driven dofs on the structure: grids, or free points on the nearest shell.

    Attributes
    ----------
    labels : (k,) text
    grids : (k,) int        id, 0 where the place is no grid
    points : (k, 3)         [m]
    directions : (k, 3)     unit vectors, basic frame
    sd : (k,)               uncertainty of the place [m]
    """

    labels: tuple[str, ...]
    grids: np.ndarray
    points: np.ndarray
    directions: np.ndarray
    sd: np.ndarray

    def rows(self, built: Structure) -> sp.csr_array:
        """Rows over the free dofs of the structure (k, n)."""
        return rows_of(built, self.grids, self.points, self.directions)

    def around(self, built: Structure) -> sp.csr_array:
        """Rows at each place and four more, two standard deviations away in the sheet."""
        rows = [self.rows(built)]
        uncertain = np.flatnonzero(self.sd > 0)
        for k in uncertain:
            n = self.directions[k]
            e1 = np.cross(n, np.eye(3)[int(np.argmin(np.abs(n)))])
            e1 /= np.linalg.norm(e1)
            e2 = np.cross(n, e1)
            step = 1.4 * self.sd[k]
            near = self.points[k] + step * np.array([e1, -e1, e2, -e2])
            rows.append(rows_of(built, np.zeros(4, int), near, np.tile(n, (4, 1))))
        return sp.csr_array(sp.vstack(rows))


@dataclass(frozen=True, eq=False)
class Question:
    """Everything a diagnosis is asked with (SI, Hz).

    ``held_sensors`` and ``held_band`` are never fitted; None: chosen here.
    """

    assembly: Assembly
    outputs: Places
    inputs: Places
    frf: FRF | None = None
    frequency: np.ndarray | None = None  # poles where no FRF exists [Hz]
    frequency_sd: np.ndarray | None = None  # [Hz]
    weighing: Weighing | None = None
    hangers: tuple[int, ...] = ()
    band: tuple[float, float] = (0.0, np.inf)
    exclude: tuple[tuple[float, float], ...] = ()
    held_sensors: tuple[str, ...] | int | None = None
    held_band: tuple[float, float] | None = None
    gain_known: bool = True
    parameters: tuple[tuple[str, tuple[str, ...]], ...] = ()  # (field, parts) the user frees


@dataclass(frozen=True, eq=False)
class Prepared:
    """A search and what scores it.

    Attributes
    ----------
    search : what the diagnosis works with
    score : data on which Q is reported (over the same basis), with ``use`` = fitted samples
    held : samples held out, in the shape of ``score.use``
    what : the held-out data in words
    notes : how the recording was read, and why
    """

    search: Search
    score: Responses | Poles
    held: np.ndarray
    what: str
    notes: tuple[str, ...]
    identified: Identified | None = None
    kept: np.ndarray = field(default_factory=lambda: np.zeros(0, bool))  # poles that are modes
