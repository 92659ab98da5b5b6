"""Effects: possible differences between model and test article, and their terms in the model.

An effect acts on the reduced model in six ways only (:data:`Term`):

- It multiplies *sheet fields* (thickness, stiffness, density, each component of the plane
  stiffness) on groups of shells. It multiplies calibrated operators and never subtracts nominal
  ones. Every stiffness therefore stays positive, whatever the other parameters do.
- It adds *point terms* c(p) bᵀb to K or M. Rows b are of the structure (a spring, a mass) and of
  dofs that it brings along (a mass on a spring). An effect that releases clamps
  (fem/released.py) has rows beyond the dofs of the deck.
- It adds *operators* c(p) A, c > -1, where A is the contribution of a part to K or M. Where A is a
  share of other operators or of sheets (:class:`Within`), their factors multiply it.
- It changes the *modes* of the stiffness, K to GᵀKG (the mesh, the footprints of joints).
- It changes *channels* of the test: gain, sign.
- It changes *shapes* at the measured places only (the mesh around a sensor).

Parameters are unbounded numbers x with a Gaussian prior; :meth:`Parameter.value` gives the
physical value.
"""

from collections.abc import Sequence
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
    """One unknown x with prior N(mean, sd²).

    The physical value is ``scale · exp(x)`` ("log") or ``scale · x`` ("linear"), in ``unit``. With
    a finite ``reach`` L, x is replaced by ``L tanh(x/L)``, which equals x for small x. In a fit,
    ``step`` limits the step; a search begins at ``starts``. With all parameters at ``nominal`` an
    effect does nothing.
    """

    name: str
    unit: str
    mean: float
    sd: float
    scale: float = 1.0
    kind: Literal["log", "linear"] = "log"
    step: float = 0.7
    starts: tuple[float, ...] = ()
    nominal: float = 0.0
    reach: float = np.inf

    def value(self, x: float) -> float:
        """Physical value."""
        return float(self.scale * (np.exp(self._drawn_in(x)[0]) if self.kind == "log" else x))

    def slope(self, x: float) -> float:
        """Derivative of the physical value with respect to x."""
        return self.value(x) * self._drawn_in(x)[1] if self.kind == "log" else self.scale

    def _drawn_in(self, x: float) -> tuple[float, float]:
        """L tanh(x/L) and its derivative."""
        if np.isinf(self.reach):
            return x, 1.0
        t = float(np.tanh(x / self.reach))
        return self.reach * t, 1 - t**2

    def interval(self, x: float, sd: float, width: float = 1.96) -> tuple[float, float]:
        """Values at x -+ width sd, in increasing order."""
        low, high = sorted((self.value(x - width * sd), self.value(x + width * sd)))
        return low, high


@dataclass(frozen=True, eq=False)
class FieldChange:
    """Logarithm of the factor on one sheet field, over the groups of shells.

    ``value`` (n_groups,), ``gradient`` (n_groups, n_parameters).
    """

    field: str
    value: np.ndarray
    gradient: np.ndarray


@dataclass(frozen=True, eq=False)
class PointTerm:
    """Σ_k c_k b_kᵀ b_k added to K or M: rows b (k, n), c (k,), dc/dx (k, n_parameters).

    If the place is unknown, ``moving`` holds ∂b/∂x for the parameters that move it. If the effect
    has its own dofs, ``own`` (k, own_dofs) is b on these. A moving base carries them as it carries
    the rows ``carrier`` of the structure.
    """

    matrix: Literal["K", "M"]
    rows: sp.csr_array
    coefficient: np.ndarray
    gradient: np.ndarray
    moving: dict[int, sp.csr_array] = field(default_factory=dict)
    own: np.ndarray | None = None
    carrier: sp.csr_array | None = None


@dataclass(frozen=True, eq=False)
class Rise:
    """Frequency-dependent stiffness: c G A G replaces c A, with loss factor η.

    G = Φ diag(g) ΦᵀM on the modes Φ of the model without the rise, g = (f/f_0)^p. A mode has the
    stiffness at its own frequency, a coupling of two modes that at their geometric mean. The
    product stays positive.

    Attributes
    ----------
    power, gradient : p, (n_parameters,)
    reference : f_0 [Hz]
    band : (low, high) Hz, the measured band, beyond which the stiffness is constant
    loss, loss_gradient : η, (n_parameters,)
    """

    power: float
    gradient: np.ndarray
    reference: float
    band: tuple[float, float]
    loss: float
    loss_gradient: np.ndarray

    def log_frequency(self, lam: np.ndarray) -> np.ndarray:
        """ln f/f_0, limited to the band, of modes with these λ (m,)."""
        f = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
        return np.asarray(np.log(np.clip(f, *self.band) / self.reference))


@dataclass(frozen=True, eq=False)
class Within:
    """The whole of which an operator A is a share: its changes multiply a change of A.

    A term c A adds c m A. The factor m is left of A by all changes of the whole. Hence c > -1
    leaves the stiffness positive.

    Attributes
    ----------
    pieces : contents of A, each a kind and an id: ("joint", 17). Operators with more are the whole
    complete : whether A is all that the pieces have, so that 1 + c multiplies their shares
    shells : rows of the shells of whose stiffness A is a share; their softest group sets m
    bending : A is a share of their bending alone
    """

    pieces: frozenset[tuple[str, int]] = frozenset()
    complete: bool = True
    shells: np.ndarray | None = None
    bending: bool = False


@dataclass(frozen=True, eq=False)
class MatrixTerm:
    """c A added to K or M: A (n, n) symmetric, c, dc/dx (n_parameters,).

    ``within`` is the whole of which A is a share. A ``geometric`` A has no sign (a membrane force).
    All of these together take at most 0.99 of the stiffness of any motion.
    """

    matrix: Literal["K", "M"]
    operator: sp.csr_array
    coefficient: float
    gradient: np.ndarray
    rise: Rise | None = None
    within: Within | None = None
    geometric: bool = False


@dataclass(frozen=True, eq=False)
class ModalFactor:
    """Λ e^L in place of the stiffness Λ = diag(ω²) of some modes Φ, L symmetric.

    K becomes GᵀKG with G = I + Φ (Λ^-½ e^{L/2} Λ^½ - I) ΦᵀM. The logarithms L of all effects on the
    same ``rows`` are added. K stays positive. Motion that follows a released clamp is not strained.

    Attributes
    ----------
    rows : (k, n)      ΦᵀM
    omega : (k,) [rad/s]
    log, gradient : L (k, k), ∂L/∂x (n_parameters, k, k)
    """

    rows: sp.csr_array
    omega: np.ndarray
    log: np.ndarray
    gradient: np.ndarray


@dataclass(frozen=True, eq=False)
class ChannelChange:
    """log10 of the factor on every output, complex: level and phase (n_out,), (n_out, n_p)."""

    value: np.ndarray
    gradient: np.ndarray


@dataclass(frozen=True, eq=False)
class ShapeChange:
    """c S b added to the motion of the measured places: outputs first, then inputs.

    b are coordinates ``rows`` (k, n) of the structure, S ``shapes`` (places, k), c and dc/dx
    (n_parameters,). It represents local changes at a sensor, which no change of K and M over a
    basis can. Motion that follows a released clamp is not included.
    """

    rows: sp.csr_array
    shapes: np.ndarray
    coefficient: float
    gradient: np.ndarray


Term = FieldChange | PointTerm | MatrixTerm | ModalFactor | ChannelChange | ShapeChange
Kind = TypeVar("Kind", FieldChange, PointTerm, MatrixTerm, ModalFactor, ChannelChange, ShapeChange)


class Weight(NamedTuple):
    """Mass of an effect on the scales [kg].

    Attributes
    ----------
    mass, gradient : float, (n_p,)   added to the weighed mass, that of the sheets excluded
    removed : mass that is on the structure during the test and is removed before it is weighed
    """

    mass: float
    gradient: np.ndarray
    removed: float = 0.0


@dataclass(frozen=True)
class Traits:
    """Fixed properties of a kind of effect.

    Attributes
    ----------
    writable : a deck can represent it
    remakes_structure : it is strong, so that mesh error and basis are computed again
    elastic : it adds or removes stiffness only, without friction
    lone : a second one of its kind is not a finding
    lump : it is a mass at its ``location``; the first parameter is that mass [kg]
    own_dofs : degrees of freedom that it adds; its terms must give them mass
    rounds : times that the responses of :meth:`Effect.basis_rows` load the basis again, because
        the effect changes modes beyond first order
    own_loads : the loads of these rounds are A u with its first operator A; else they are M u
    level : position of the parameter that is ln of the damping common to all modes (``damping``)
    """

    writable: bool = True
    remakes_structure: bool = False
    elastic: bool = False
    lone: bool = False
    lump: bool = False
    own_dofs: int = 0
    rounds: int = 0
    own_loads: bool = False
    level: int = 0


@dataclass(frozen=True, eq=False)
class Effect:
    """One kind of physics; the base class does nothing.

    A subclass defines :meth:`terms` and :meth:`apply`. The other methods have defaults:
    :meth:`weight` for masses, :meth:`basis_rows` where the modes of the deck are too few, and
    :meth:`reported`, :meth:`location` and :meth:`remarks` after a fit.

    Attributes
    ----------
    parameters : the unknowns, in the order of x
    text : where it acts, in words
    parts, grids : names of parts and ids of grids it concerns
    point : (3,) or None  its place in the basic frame [m]
    trials_factor : number of places tried, this one included (look-elsewhere effect)
    replaces : names of calibration parameters that it makes superfluous
    expected : whether the materials of the deck usually have it
    release : clamps that it releases, so that its rows reach beyond the dofs of the deck
    in_structure : x that the structure already contains (``remakes_structure``), or None
    damping : identified damping with which it is compared as well, because it dissipates
    """

    name: ClassVar[str] = "nothing"
    claim: ClassVar[str] = "the model is right"
    kind: ClassVar[str] = "physics"  # physics, test, calibration, nuisance
    traits: ClassVar[Traits] = Traits()

    parameters: tuple[Parameter, ...] = ()
    text: str = ""
    parts: tuple[str, ...] = ()
    grids: tuple[int, ...] = ()
    point: tuple[float, float, float] | None = None
    radius: float | None = None
    trials_factor: int = 1
    replaces: tuple[str, ...] = ()
    channels: tuple[str, ...] = field(default=())
    expected: bool = False
    release: Release | None = None
    in_structure: np.ndarray | None = None
    damping: IdentifiedDamping | None = None

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


def changes_channels(effect: Effect) -> bool:
    """True for an effect of the test on its channels."""
    return bool(of(ChannelChange, effect.terms(np.zeros(len(effect.parameters)))))
