"""Input of a diagnosis: a structure, its measurements and their places (SI, Hz)."""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from ..dynamics.frf import FRF
from ..effects.rigid_ties import on_firm_springs
from ..ema.identification import Identified
from ..ema.level_study import LevelStudy
from ..ema.setup import Control, SensorAccuracy
from ..fem.assemble import Structure
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import Modelled
from ..inference.hypothesis_fit import UpdatingProblem
from ..inference.least_data import NUMBERS
from ..inference.likelihood import Responses
from ..inference.map_fit import MassMeasurement
from ..inference.pole_data import Poles
from ..model.assembly import Assembly
from ..model.free_parameter import FreeParameter
from ..model.point_masses import with_mass_pairs
from .next_measurement import FurtherPlaces


@dataclass(frozen=True, eq=False)
class OtherRecording:
    """A further recording with the same labels, which is not fitted: repeat, article or level."""

    name: str
    relation: str
    frf: FRF
    level: float | None = None
    control: Control = "force"
    article: str = ""


OtherTest = tuple[OtherRecording, Identified]  # a further recording with its modes


@dataclass(frozen=True, eq=False)
class Question:
    """All input of a diagnosis (SI, Hz).

    ``assembly`` is the article as the deck has it; ``tested`` gives it with the sensors' masses.
    ``held_sensors`` and ``held_band`` are never fitted; where None, ``prepare`` chooses them.
    """

    assembly: Assembly
    outputs: MeasuredDofs
    inputs: MeasuredDofs
    frf: FRF | None = None
    frequency: np.ndarray | None = None  # poles where no FRF exists [Hz]
    frequency_sd: np.ndarray | None = None  # [Hz]
    damping: np.ndarray | None = None  # of these poles, nan where unknown
    shapes: np.ndarray | None = None  # (n_out, r) of these poles, real or complex, any scale
    shape_sd: np.ndarray | None = None  # (n_out, r) of each entry, nan where unknown
    mass_measurement: MassMeasurement | None = None
    hangers: tuple[int, ...] = ()
    band: tuple[float, float] = (0.0, np.inf)
    exclude: tuple[tuple[float, float], ...] = ()
    held_sensors: tuple[str, ...] | int | None = None
    held_band: tuple[float, float] | None = None
    gain_known: bool = True
    parameters: tuple[FreeParameter, ...] = ()  # freed by the user; none: a default set
    sensor_masses: tuple[tuple[int, float], ...] = ()  # (grid, kg) of sensors of known mass
    others: tuple[OtherRecording, ...] = ()
    level: float | None = None  # of the recording that is fitted [N], [m/s²]
    control: Control = "force"  # quantity that was kept at the level
    article: str = ""  # of the recording that is fitted
    accuracy: SensorAccuracy = field(default_factory=SensorAccuracy)
    effects: tuple[str, ...] = ()  # names of the effects that are tried; empty: all
    further: FurtherPlaces | None = None  # of sensors that may be added; None: anywhere

    def tested(self, assembly: Assembly) -> Assembly:
        """The article with the sensors of known mass on it, as it was measured."""
        return with_mass_pairs(assembly, self.sensor_masses)

    def searched(self, assembly: Assembly) -> Assembly:
        """The tested article with springs in its rigid ties, stiff enough to act as rigid."""
        return on_firm_springs(self.tested(assembly))

    def rows(self, built: Structure) -> sp.csr_array:
        """Rows of outputs and inputs on any mesh of the structure."""
        return sp.csr_array(sp.vstack([self.outputs.rows(built), self.inputs.rows(built)]))

    @property
    def base(self) -> np.ndarray | None:
        """Directions (k, 3) in which the supports were moved; None where forces were applied."""
        return self.inputs.directions if self.inputs.base.any() else None

    def driven_around(self, built: Structure) -> sp.csr_array:
        """Rows of the excitation: at the likely places of the shakers, or the base's load."""
        return self.inputs.around(built) if self.base is None else self.inputs.loads(built)

    @property
    def weighed_with_sensors(self) -> MassMeasurement | None:
        """The weighed mass of the article plus the sensors' masses, as the model has them."""
        if self.mass_measurement is None:
            return None
        mass = self.mass_measurement.mass + sum(m for _, m in self.sensor_masses)
        return replace(self.mass_measurement, mass=mass)


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Samples that are not fitted, in the shape of the ``use`` of some data."""

    choosing: np.ndarray  # whose evidence supports or refuses a name
    reporting: np.ndarray  # on which the gain of a name is reported, and nothing is decided


@dataclass(frozen=True, eq=False)
class Prepared:
    """An updating problem and the data that score it."""

    question: Question
    problem: UpdatingProblem
    score: Responses | Poles  # Q is reported on it, over the same basis; ``use``: fitted samples
    # samples held out, of ``score`` and of ``problem.data``
    held: HeldOut
    unseen: HeldOut
    what: str  # the data that report, in words
    notes: tuple[str, ...]  # sentences on how the recording is compared, and why
    nominal: Modelled  # the deck, with all modes that a diagnosis needs
    noise: np.ndarray | None = None  # E|Δ log10 H|² from that of the recording; None for poles
    identified: Identified | None = None
    too_little: str = ""  # reason why data so few rarely separate explanations
    numbers: float = NUMBERS  # of fitted modes and channels, less those that calibration takes
    others: tuple[OtherTest, ...] = ()  # recordings that are not fitted, with their modes
    levels: LevelStudy = field(default_factory=LevelStudy)  # modes over levels, of two and more
    damping: np.ndarray | None = None  # of listed poles that are compared, nan where unknown
    above: float = 0.0  # [Hz]: a free deck is compared above the modes of the suspension
