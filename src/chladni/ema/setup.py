"""Recordings, sensors and the set-up of the test (SI)."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..arrays import OneScreen, readonly
from ..dynamics.frf import FRF
from ..errors import LabelError, ShapeError, named
from .time_record import TimeRecord

Role = Literal["output", "input"]
Control = Literal["force", "response"]


@dataclass(frozen=True, eq=False, repr=False)
class PoleTable(OneScreen):
    """Identified frequencies without an FRF, as in a table of a report.

    Attributes
    ----------
    frequency : (r,)    undamped natural frequency [Hz]
    frequency_sd : (r,) its standard deviation [Hz], nan where unknown
    damping : (r,)      fraction of critical, nan where unknown
    mode : (r,) int     number the user gave it
    state : tuple of str  the state of the object each line belongs to ("" where there is one)
    """

    frequency: np.ndarray
    frequency_sd: np.ndarray
    damping: np.ndarray
    mode: np.ndarray
    state: tuple[str, ...]

    def __post_init__(self) -> None:
        due = (len(self.state),)
        for name in ("frequency", "frequency_sd", "damping", "mode"):
            if getattr(self, name).shape != due:
                raise ShapeError(f"{name} is {getattr(self, name).shape}, the states say {due}")
            object.__setattr__(self, name, readonly(getattr(self, name)))

    @property
    def states(self) -> tuple[str, ...]:
        """The states in the order of the table."""
        return tuple(dict.fromkeys(self.state))

    def of(self, state: str) -> "PoleTable":
        """The lines of one state."""
        if state not in self.state:
            raise LabelError(f"no state {state!r}; there are {', '.join(self.states)}")
        here = np.array([s == state for s in self.state])
        return PoleTable(
            self.frequency[here],
            self.frequency_sd[here],
            self.damping[here],
            self.mode[here],
            tuple(s for s in self.state if s == state),
        )


@dataclass(frozen=True, eq=False)
class Function:
    """A record other than an FRF: time history, spectrum, power spectral density.

    ``kind`` is the term of the universal file (time, auto spectrum, cross spectrum, psd, ...).
    ``input`` is "" if the record has no reference. ``unit`` is the label of the file.
    """

    kind: str
    output: str
    input: str
    x: np.ndarray  # (n,) [s] or [Hz]
    values: np.ndarray  # (n,)
    unit: str = ""


@dataclass(frozen=True, eq=False)
class Shapes:
    """Mode shapes as a file holds them (dataset 55): any scale, real or complex."""

    # frequency, damping: (r,) [Hz], fraction of critical
    frequency: np.ndarray
    damping: np.ndarray
    values: np.ndarray  # (n, r)
    dofs: tuple[str, ...]  # n labels

    def __post_init__(self) -> None:
        due = (len(self.dofs), len(self.frequency))
        if self.values.shape != due:
            raise ShapeError(f"shapes are {self.values.shape}, labels and frequencies say {due}")


@dataclass(frozen=True, eq=False, repr=False)
class Recording(OneScreen):
    """One file of a test, or one article or level of it.

    Attributes
    ----------
    name : str                   file (and article, level) it comes from
    frf : FRF or None
    poles : PoleTable or None        where no FRF exists
    shapes : Shapes or None      mode shapes the file holds
    nodes : {node: (3,)}         places [m]
    axes : {node: (3, 3)}        rows: unit vectors of the node's own measuring axes, where turned
    elements : tuple of tuples   nodes of each trace line or element
    functions : tuple            time histories, spectra
    time : TimeRecord or None    forces and responses against time
    added_damping : float        what an exponential window took from every pole's real part [1/s]
    level : float or None        amplitude of what was held: force [N], base or response [m/s²]
    control : "force" (or the motion of the base), or "response" (of the drive point)
    article : str                which of several nominally equal objects
    state : str                  what was done to the object, where it was measured as it changed
    mass : float or None         weighed in this state [kg]
    notes : tuple of str         what was found odd and how it was read
    """

    name: str
    frf: FRF | None = None
    poles: PoleTable | None = None
    shapes: Shapes | None = None
    nodes: Mapping[int, np.ndarray] = field(default_factory=dict)
    axes: Mapping[int, np.ndarray] = field(default_factory=dict)
    elements: tuple[tuple[int, ...], ...] = ()
    functions: tuple[Function, ...] = ()
    time: TimeRecord | None = None
    added_damping: float = 0.0
    level: float | None = None
    article: str = ""
    notes: tuple[str, ...] = ()
    state: str = ""
    mass: float | None = None
    control: Control = "force"


@dataclass(frozen=True, eq=False)
class Sensor:
    """A sensor or an exciter as the user describes it.

    Attributes
    ----------
    label : the name of the channel in the recording, as 412:+Z
    grid : id of the grid it sits at; or
    place : (3,)              its place in the basic frame [m]
    direction : (3,)          unit vector in the basic frame; None: the normal of the surface
    role : "output" (it measures) or "input" (it drives)
    mass : on the article during the test [kg]
    position_sd : standard deviation of the place [m]
    gain : recorded value over true value [-]
    use : False leaves an output out
    """

    label: str
    grid: int | None = None
    place: np.ndarray | None = None  # (3,) [m]
    direction: np.ndarray | None = None  # (3,) unit vector
    role: Role = "output"
    mass: float = 0.0  # [kg]
    position_sd: float = 0.0  # [m]
    gain: float = 1.0  # what is recorded over what was there
    use: bool = True  # an output that is left out is as if it had not been recorded


@dataclass(frozen=True)
class SensorAccuracy:
    """Standard deviations of gain, direction and position of sensors and force gauges."""

    gain: float = 0.01  # relative; calibrators let pass 3 %
    direction: float = float(np.radians(1.0))  # [rad] either way; glued by eye
    # [m] either way, where a sensor's own is not stated; placed by a tape measure
    position: float = 1.5e-3


@dataclass(frozen=True, eq=False, repr=False)
class TestSetup(OneScreen):
    """The test as it was set up: sensors, exciters, hangers, the weighing."""

    __test__ = False  # not a test class, whatever its name says

    outputs: tuple[Sensor, ...] = ()
    inputs: tuple[Sensor, ...] = ()
    hangers: tuple[int, ...] = ()  # grids
    mass: float | None = None  # weighed [kg]
    mass_sd: float = 0.0  # [kg]
    accuracy: SensorAccuracy = SensorAccuracy()

    def sensor(self, label: str, role: Role = "output") -> Sensor:
        """The sensor (or exciter) of this label."""
        among = self.outputs if role == "output" else self.inputs
        for sensor in among:
            if sensor.label == label:
                return sensor
        raise LabelError(f"no {role} {label!r}; there are {named(s.label for s in among)}")
