"""Effects: possible differences between model and test article, and their terms in the model.

An effect acts on the reduced model in seven ways only (:data:`Term`):

- It multiplies *sheet fields* (thickness, stiffness, density, each component of the plane
  stiffness) on groups of shells. It multiplies calibrated operators and never subtracts nominal
  ones. Every stiffness therefore stays positive, whatever the other parameters do.
- It adds *point terms* c(p) bᵀb to K or M. Rows b are of the structure (a spring, a mass) and of
  dofs that it brings along (a mass on a spring). An effect that releases clamps
  (fem/released.py) has rows beyond the dofs of the deck.
- It adds *operators* c(p) A, c > -1, where A is the contribution of a part to K or M. Where A is a
  share of other operators or of sheets (:class:`Within`), their factors multiply it.
- It changes the *modes* of the stiffness, K to GᵀKG (the mesh, the footprints of joints).
- It *spins* at a grid: a skew term in the damping matrix, which couples modes.
- It changes *channels* of the test: gain, sign.
- It changes *shapes* at the measured places only (the mesh around a sensor).

Parameters are unbounded numbers x with a Gaussian prior; :meth:`Parameter.value` gives the
physical value.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Literal, NamedTuple, TypeVar

import numpy as np
import scipy.sparse as sp

from ..fem.released import Release
from ..model.assembly import Assembly
from .estimate import Estimate, Location, Remarks
from .identified_damping import IdentifiedDamping

FIELDS = ("t", "E", "rho", "bending", "Q11", "Q22", "Q12", "Q66")


WIDER = 2.0  # times the deviation of an effect: 32 of 34 then lie within 90 % on tuning seeds


@dataclass(frozen=True)
class Parameter:
    """One unknown x of prior N(mean, sd²); its value is scale eˣ ("log") or scale x ("linear")."""

    name: str
    unit: str  #: of the value
    mean: float
    sd: float
    scale: float = 1.0
    kind: Literal["log", "linear"] = "log"
    step: float = 0.7  #: limit of a step of a fit
    starts: tuple[float, ...] = ()  #: of a search
    nominal: float = 0.0  #: with all parameters there an effect does nothing
    reach: float = np.inf  #: L: x is replaced by L tanh(x/L), which equals x for small x

    def value(self, x: float) -> float:
        """Physical value."""
        if self.kind == "linear":
            return float(self.scale * x)
        y = x if np.isinf(self.reach) else self.reach * float(np.tanh(x / self.reach))
        return float(self.scale * np.exp(y))

    def slope(self, x: float) -> float:
        """Derivative of the physical value with respect to x."""
        if self.kind == "linear":
            return self.scale
        return self.value(x) * (1 - float(np.tanh(x / self.reach)) ** 2)

    def interval(self, x: float, sd: float, width: float = 1.96) -> tuple[float, float]:
        """Values at x -+ width sd, in increasing order."""
        low, high = sorted((self.value(x - width * sd), self.value(x + width * sd)))
        return low, high


@dataclass(frozen=True, eq=False)
class FieldChange:
    """Logarithm of the factor on one sheet field, over the groups of shells."""

    field: str
    value: np.ndarray  #: (n_groups,)
    gradient: np.ndarray  #: (n_groups, n_parameters)
    of: np.ndarray | None = None  #: (n_elements,) group of each, where it needs its own


@dataclass(frozen=True, eq=False)
class PointTerm:
    """Σ_k c_k b_kᵀ b_k added to K or M."""

    matrix: Literal["K", "M"]
    rows: sp.csr_array  #: b (k, n)
    coefficient: np.ndarray  #: c (k,)
    gradient: np.ndarray  #: dc/dx (k, n_parameters)
    moving: dict[int, sp.csr_array] = field(default_factory=dict)  #: ∂b/∂x that move the place
    own: np.ndarray | None = None  #: b (k, own_dofs) on the effect's own dofs
    carrier: sp.csr_array | None = None  #: rows that carry these dofs where the base moves


@dataclass(frozen=True, eq=False)
class Rise:
    """Frequency-dependent stiffness: c G A G replaces c A, with loss factor η.

    G = Φ diag(g) ΦᵀM on the modes Φ of the model without the rise, g = (f/f_0)^p. A mode has the
    stiffness at its own frequency, a coupling of two modes that at their geometric mean. The
    product stays positive.
    """

    power: float  #: p
    gradient: np.ndarray  #: dp/dx (n_parameters,)
    reference: float  #: f_0 [Hz]
    band: tuple[float, float]  #: [Hz] measured; beyond it the stiffness is constant
    loss: float  #: η
    loss_gradient: np.ndarray  #: dη/dx (n_parameters,)

    def log_frequency(self, lam: np.ndarray) -> np.ndarray:
        """ln f/f_0, limited to the band, of modes with these λ (m,)."""
        f = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
        return np.asarray(np.log(np.clip(f, *self.band) / self.reference))


@dataclass(frozen=True, eq=False)
class Within:
    """The whole of which an operator A is a share: its changes multiply a change of A.

    A term c A adds c m A. The factor m is left of A by all changes of the whole. Hence c > -1
    leaves the stiffness positive.
    """

    #: contents of A, each a kind and an id: ("joint", 17); operators with more are the whole
    pieces: frozenset[tuple[str, int]] = frozenset()
    complete: bool = True  #: A is all that the pieces have: 1 + c multiplies their shares
    shells: np.ndarray | None = None  #: rows of shells A is a share of; their softest group sets m
    bending: bool = False  #: A is a share of their bending alone


@dataclass(frozen=True, eq=False)
class MatrixTerm:
    """c A added to K or M, A symmetric."""

    matrix: Literal["K", "M"]
    operator: sp.csr_array  #: A (n, n)
    coefficient: float  #: c
    gradient: np.ndarray  #: dc/dx (n_parameters,)
    rise: Rise | None = None
    within: Within | None = None  #: the whole of which A is a share
    #: A has no sign (a membrane force); all of these take at most 0.99 of any motion's stiffness
    geometric: bool = False


@dataclass(frozen=True, eq=False)
class ModalFactor:
    """Λ e^L in place of the stiffness Λ = diag(ω²) of some modes Φ, L symmetric.

    K becomes GᵀKG with G = I + Φ (Λ^-½ e^{L/2} Λ^½ - I) ΦᵀM. The logarithms L of all effects on the
    same ``rows`` are added. K stays positive. Motion that follows a released clamp is not strained.
    """

    rows: sp.csr_array  #: ΦᵀM (k, n)
    omega: np.ndarray  #: (k,) [rad/s]
    log: np.ndarray  #: L (k, k)
    gradient: np.ndarray  #: ∂L/∂x (n_parameters, k, k)


@dataclass(frozen=True, eq=False)
class ChannelChange:
    """log10 of the factor on every output, complex: level and phase."""

    value: np.ndarray  #: (n_out,)
    gradient: np.ndarray  #: (n_out, n_parameters)


@dataclass(frozen=True, eq=False)
class ShapeChange:
    """c S b added to the motion of the measured places: outputs first, then inputs.

    It represents local changes at a sensor, which no change of K and M over a basis can. Motion
    that follows a released clamp is not included.
    """

    rows: sp.csr_array  #: b (k, n)
    shapes: np.ndarray  #: S (places, k)
    coefficient: float  #: c
    gradient: np.ndarray  #: dc/dx (n_parameters,)


@dataclass(frozen=True, eq=False)
class SpinTerm:
    """-Rᵀ [h]× R, skew, added to the damping matrix: the moments of a spinning part on its grid.

    Its angular momentum h turns with the structure at the rate θ', which takes the moment θ' x h.
    Source: Meirovitch 1980, Computational Methods in Structural Dynamics, 2.10.
    """

    rows: sp.csr_array  #: R (3, n), rotations about the axes of the basic frame
    momentum: np.ndarray  #: h (3,) [kg m²/s]
    gradient: np.ndarray  #: dh/dx (3, n_parameters)
    grid: int  #: id of the nearest, which carries it in a structure with other dofs
    moving: dict[int, sp.csr_array] = field(default_factory=dict)  #: ∂R/∂x that move the place


Term = FieldChange | PointTerm | MatrixTerm | ModalFactor | ChannelChange | ShapeChange | SpinTerm
Kind = TypeVar(
    "Kind", FieldChange, PointTerm, MatrixTerm, ModalFactor, ChannelChange, ShapeChange, SpinTerm
)


class Weight(NamedTuple):
    """Mass of an effect on the scales [kg]."""

    mass: float  #: added to the weighed mass, that of the sheets excluded
    gradient: np.ndarray  #: (n_parameters,)
    removed: float = 0.0  #: on the structure during the test, and removed before it is weighed


@dataclass(frozen=True)
class Traits:
    """Fixed properties of a kind of effect."""

    writable: bool = True  #: a deck can represent it
    remakes_structure: bool = False  #: it is strong: mesh error and basis are computed again
    elastic: bool = False  #: it adds or removes stiffness only, without friction
    lone: bool = False  #: a second one of its kind is not a finding
    lump: bool = False  #: it is a mass at its ``location``; the first parameter is that mass [kg]
    own_dofs: int = 0  #: degrees of freedom that it adds; its terms must give them mass
    rounds: int = 0  #: times that the responses of basis_rows load the basis again
    own_loads: bool = False  #: their loads are A u with its first operator A; else they are M u
    level: int = 0  #: position of the parameter ln of the damping common to all modes (``damping``)


@dataclass(frozen=True, eq=False)
class Effect:
    """One kind of physics; the base class does nothing.

    A subclass defines :meth:`terms` and :meth:`apply`. The other methods have defaults:
    :meth:`weight` for masses, :meth:`basis_rows` where the modes of the deck are too few, and
    :meth:`reported`, :meth:`location` and :meth:`remarks` after a fit.
    """

    name: ClassVar[str] = "nothing"
    claim: ClassVar[str] = "the model is right"
    kind: ClassVar[str] = "physics"  # physics, test, calibration, nuisance
    traits: ClassVar[Traits] = Traits()

    parameters: tuple[Parameter, ...] = ()  #: the unknowns, in the order of x
    text: str = ""  #: where it acts, in words
    parts: tuple[str, ...] = ()  #: names of parts that it concerns
    grids: tuple[int, ...] = ()  #: ids of grids
    point: tuple[float, float, float] | None = None  #: its place in the basic frame [m]
    radius: float | None = None  #: [m]
    trials_factor: int = 1  #: places tried, this one included (look-elsewhere effect)
    two_log_odds: float = 0.0  #: 2 ln of its odds over calibration, from an earlier recording
    replaces: tuple[str, ...] = ()  #: names of calibration parameters that it makes superfluous
    channels: tuple[str, ...] = field(default=())
    expected: bool = False  #: the materials of the deck usually have it
    release: Release | None = None  #: clamps released: rows reach beyond the dofs of the deck
    in_structure: np.ndarray | None = None  #: x that the structure contains (``remakes_structure``)
    #: identified damping with which it is compared as well, because it dissipates
    damping: IdentifiedDamping | None = None

    @property
    def axis_1(self) -> np.ndarray | None:
        """Axis 1 (3,) of the components of the plane stiffness; None: the deck's material axis."""
        return None

    def terms(self, x: np.ndarray) -> tuple[Term, ...]:
        """Everything that the effect adds to the model at x, with exact gradients."""
        return ()

    def weight(self, x: np.ndarray) -> Weight:
        """Its mass on the scales; the base class weighs nothing."""
        return Weight(0.0, np.zeros(len(self.parameters)))

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array | None:
        """Rows b (k, n) whose static response the reduced basis must contain, or None.

        By default these are its points, and A φ of its operators: the first-order loads of a
        change.

        Parameters
        ----------
        shapes : (n, r)   modes φ up to the highest frequency of interest
        """
        every = self.terms(x)
        points = [term.rows for term in of(PointTerm, every)]
        operators = [sp.csr_array((m.operator @ shapes).T) for m in of(MatrixTerm, every)]
        rows = points + operators
        return sp.csr_array(sp.vstack(rows)) if rows else None

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the effect into the structure."""
        return assembly

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Physical values of the parameters with their 95 % intervals.

        Intervals of an effect are :meth:`widened`: errors of the model about it count fully.
        """
        wide = self.widened(sd)
        return tuple(
            Estimate(p.name, p.value(x[k]), p.unit, *p.interval(x[k], wide[k]))
            for k, p in enumerate(self.parameters)
        )

    def estimate(
        self, x: np.ndarray, sd: np.ndarray, value: Callable[[np.ndarray], float], name: str = "",
        unit: str = "", k: int = 0,
    ) -> Estimate:  # fmt: skip
        """A value of x, and its interval as the k-th parameter moves; that names it by default."""
        step = 1.96 * self.widened(sd)[k] * np.eye(len(x))[k]
        here, *ends = (float(value(x + s * step)) for s in (0, -1, 1))
        p = self.parameters[k]
        return Estimate(name or p.name, here, unit or p.unit, min(ends), max(ends))

    def location(self, x: np.ndarray, sd: np.ndarray | None = None) -> Location:
        """The place after a fit, with its uncertainty where ``sd`` (n_p,) is given."""
        return self.where()

    def remarks(self, x: np.ndarray, sd: np.ndarray | None = None) -> Remarks:
        """Names of simpler effects, physical impossibility and a note for the deck, at x."""
        return Remarks()

    def widened(self, sd: np.ndarray) -> np.ndarray:
        """Standard deviations (n,) of a fit, with the part of the data ``WIDER`` times as wide.

        With prior sd_0 the data have the precision 1/sd² - 1/sd_0². Model error reduces this
        precision and leaves the prior unchanged. Hence no result is wider than its prior. Values
        of a calibration are known as well as Laplace says (``chladni_evidence intervals``).
        """
        prior = np.array([p.sd for p in self.parameters])
        if self.kind == "calibration":
            return np.minimum(sd, prior)
        with np.errstate(divide="ignore"):
            information = np.maximum(1 / np.square(sd) - 1 / prior**2, 0.0)
        return np.asarray(1 / np.sqrt(1 / prior**2 + information / WIDER**2))

    def starts(self) -> list[np.ndarray]:
        """Start points of a fit: every combination of the starts of its parameters."""
        options = [p.starts or (p.mean,) for p in self.parameters]
        grid = np.meshgrid(*options, indexing="ij") if options else []
        return [np.array(x) for x in zip(*(g.ravel() for g in grid), strict=True)]

    def where(self) -> Location:
        """The nominal place of the effect."""
        return Location(
            self.text,
            tuple(self.parts),
            tuple(int(g) for g in self.grids),
            None if self.point is None else tuple(float(v) for v in self.point),
            self.radius,
            channels=tuple(self.channels),
        )


def count(effects: Sequence[Effect]) -> int:
    """Total number of parameters of some effects."""
    return sum(len(effect.parameters) for effect in effects)


def of(kind: type[Kind], terms: Sequence[Term]) -> list[Kind]:
    """The terms of one kind, in their order."""
    return [term for term in terms if isinstance(term, kind)]


def of_test(effect: Effect) -> bool:
    """True for an effect of the test: it changes what is measured, and not the structure."""
    every = effect.terms(np.zeros(len(effect.parameters)))
    return bool(every) and all(isinstance(t, (ChannelChange, ShapeChange)) for t in every)
