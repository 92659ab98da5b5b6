"""Recordings, sensors and the set-up of the test (SI)."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from ..arrays import readonly
from ..dynamics.frf import FRF, MOTION_OVER_FORCE
from ..errors import LabelError, ShapeError, named
from ..results import ShownBriefly
from .time_record import TimeRecord

Role = Literal["output", "input"]
Control = Literal["force", "response"]


@dataclass(frozen=True, eq=False, repr=False)
class PoleTable(ShownBriefly):
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


@dataclass(frozen=True, eq=False, repr=False)
class Function(ShownBriefly):
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


MOST_NODES = 100  # of a modal model: shapes of a model's modes need no more
RIGID = 1e-3  # of the highest frequency: modes below are rigid motions


@dataclass(frozen=True, eq=False, repr=False)
class Shapes(ShownBriefly):
    """Mode shapes as a file holds them: any scale, real or complex.

    Attributes
    ----------
    frequency, damping : (r,)   [Hz], fraction of critical or nan
    values : (n, r)
    dofs : n labels
    sd : (n, r) or None         standard deviation of each entry
    frequency_sd : (r,) or None [Hz]
    """

    frequency: np.ndarray
    damping: np.ndarray
    values: np.ndarray
    dofs: tuple[str, ...]
    sd: np.ndarray | None = None
    frequency_sd: np.ndarray | None = None

    def __post_init__(self) -> None:
        due = (len(self.dofs), len(self.frequency))
        for values in (self.values, self.sd):
            if values is not None and values.shape != due:
                raise ShapeError(f"shapes are {values.shape}, labels and frequencies say {due}")

    def sel(self, modes: np.ndarray, dofs: np.ndarray | slice = slice(None)) -> "Shapes":
        """Some modes at some dofs, by position or mask."""
        kept = np.arange(len(self.dofs))[dofs]
        return replace(
            self, frequency=self.frequency[modes], damping=self.damping[modes],
            values=self.values[kept][:, modes], dofs=tuple(self.dofs[k] for k in kept),
            sd=None if self.sd is None else self.sd[kept][:, modes],
            frequency_sd=None if self.frequency_sd is None else self.frequency_sd[modes],
        )  # fmt: skip

    @property
    def elastic(self) -> "Shapes":
        """The modes that are no rigid motions, in the order of their frequencies."""
        order = np.argsort(self.frequency, kind="stable")
        f = self.frequency[order]
        return self.sel(order[f > RIGID * f.max(initial=0.0)])

    def poles(self) -> PoleTable:
        """Frequencies and damping of the elastic modes as a table."""
        found = self.elastic
        n = len(found.frequency)
        sd = np.full(n, np.nan) if found.frequency_sd is None else found.frequency_sd
        return PoleTable(found.frequency, sd, found.damping, np.arange(1, n + 1), ("",) * n)


@dataclass(frozen=True, eq=False, repr=False)
class Recording(ShownBriefly):
    """One file of a test, or one article or level of it.

    Attributes
    ----------
    name : str                   file (and article, level) it comes from
    frf : FRF or None
    poles : PoleTable or None        where no FRF exists
    shapes : Shapes or None      mode shapes the file holds; with ``poles`` of a modal model
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

    def reciprocal(self, quantity: str) -> "Recording":
        """The recording with force over motion, of one force at a time, as motion over force."""
        if self.frf is None:
            raise LabelError(f"{self.name} holds no FRFs that could be {quantity}")
        frf, kind = self.frf, MOTION_OVER_FORCE[quantity]
        if not frf.values.all():
            raise LabelError(f"{self.name}: {quantity} is zero on a line and has no reciprocal")
        variance = None if frf.variance is None else frf.variance / np.abs(frf.values) ** 4
        frf = replace(frf, values=1 / frf.values, variance=variance, quantity=kind)
        note = f"{self.name}: {quantity} was turned into its reciprocal, {kind}"
        return replace(self, frf=frf, notes=(*self.notes, note))

    @property
    def modal(self) -> Shapes | None:
        """Elastic modes with shapes, one for each of ``poles``; None where shapes are not known.

        Test systems fill in zeros for the directions that they did not measure. An even
        sample of ``MOST_NODES`` nodes stands for more.
        """
        if self.frf is not None or self.poles is None or self.shapes is None:
            return None
        found = self.shapes.elastic
        measured = np.flatnonzero(found.values.any(axis=1))
        of_node = np.array([found.dofs[k].partition(":")[0] for k in measured])
        nodes = list(dict.fromkeys(of_node.tolist()))
        if len(nodes) > MOST_NODES:
            some = np.linspace(0, len(nodes) - 1, MOST_NODES).astype(int)
            measured = measured[np.isin(of_node, [nodes[k] for k in some])]
        if len(found.frequency) != len(self.poles.frequency) or not len(measured):
            return None
        return found.sel(np.arange(len(found.frequency)), measured)


@dataclass(frozen=True, eq=False, repr=False)
class Sensor(ShownBriefly):
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
    source : file and line that say it; "" if no table does
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
    source: str = ""


@dataclass(frozen=True)
class SensorAccuracy:
    """Standard deviations of gain, direction and position of sensors and force gauges."""

    gain: float = 0.01  # relative; calibrators let pass 3 %
    direction: float = float(np.radians(1.0))  # [rad] either way; glued by eye
    # [m] either way, where a sensor's own is not stated; placed by a tape measure
    position: float = 1.5e-3


@dataclass(frozen=True, eq=False, repr=False)
class TestSetup(ShownBriefly):
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
