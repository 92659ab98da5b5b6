"""What may differ between model and article, and how it enters the reduced model.

An effect acts in five ways, and in no other:

- it multiplies *sheet fields* (thickness, stiffness, density, each component of the plane
  stiffness) on groups of shells.  Multiplying calibrated operators, never subtracting nominal
  ones, keeps every stiffness positive whatever the other parameters do;
- it adds *point terms* c(p) bᵀb to K or M, rows b of the structure (a spring, a mass), and of
  degrees of freedom it brings along (a lump on a spring);
  It may let clamps go (fem/released.py): its rows then reach beyond the dofs of the deck;
- it adds *operators* c(p) A, A what a part other than a sheet has in K or M already, c > -1;
- it changes *channels* of the test: gain, sign;
- it changes *shapes* where they are measured, and only there (a mesh about a sensor).

Parameters are unbounded numbers x with a Gaussian prior; :meth:`Parameter.value` gives the
physical one.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Literal, Self

import numpy as np
import scipy.sparse as sp

from ..fem.assemble import Structure
from ..model.assembly import Assembly
from .estimate import Estimate, Location

if TYPE_CHECKING:
    from .surroundings import Surroundings

FIELDS = ("t", "E", "rho", "bending", "Q11", "Q22", "Q12", "Q66")


WIDER = 2.0  # over the learned error: so that 95 % of 160 intervals held the truth on tuning seeds


@dataclass(frozen=True)
class Parameter:
    """One unknown x with prior N(mean, sd²).

    The physical value is ``scale · exp(x)`` ("log") or ``scale · x`` ("linear"), in ``unit``; where
    nothing can go beyond ``reach`` L it is ``scale · exp(L tanh(x/L))``, x as long as x is small.
    ``step`` is the longest step a fit may take at once, ``starts`` where a search begins. With all
    parameters at ``nominal`` an effect does nothing.
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
        """Its derivative by x."""
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

    Where the place itself is unknown, ``moving`` holds ∂b/∂x of the parameters that move it. Of an
    effect with degrees of freedom of its own, ``own`` (k, own_dofs) is b on these; a base that
    moves carries them as it does the rows ``carrier`` of the structure. Where a clamp was let go,
    ``strained`` rows see what deforms alone, not what follows the clamp.
    """

    matrix: Literal["K", "M"]
    rows: sp.csr_array
    coefficient: np.ndarray
    gradient: np.ndarray
    moving: dict[int, sp.csr_array] = field(default_factory=dict)
    own: np.ndarray | None = None
    carrier: sp.csr_array | None = None
    strained: bool = False


@dataclass(frozen=True, eq=False)
class Rise:
    """How stiffness c A rises with frequency and dissipates: c G A G in its place, η of it lost.

    G = Φ diag(g) ΦᵀM on the modes Φ of the model as it is without the rise, g = (f/f_0)^p: a mode
    meets the stiffness of its own frequency, what it mixes with the geometric mean of both. What is
    so multiplied stays positive.

    Attributes
    ----------
    power, gradient : p, (n_parameters,)
    reference : f_0 [Hz]
    band : (low, high) Hz beyond which it rises no more: nothing was measured there
    loss, loss_gradient : η, (n_parameters,)
    """

    power: float
    gradient: np.ndarray
    reference: float
    band: tuple[float, float]
    loss: float
    loss_gradient: np.ndarray

    def log_frequency(self, lam: np.ndarray) -> np.ndarray:
        """ln f/f_0 within the band, of modes with these λ (m,)."""
        f = np.sqrt(np.maximum(lam, 0)) / (2 * np.pi)
        return np.asarray(np.log(np.clip(f, *self.band) / self.reference))


@dataclass(frozen=True, eq=False)
class MatrixTerm:
    """c A added to K or M: A (n, n) symmetric, c, dc/dx (n_parameters,)."""

    matrix: Literal["K", "M"]
    operator: sp.csr_array
    coefficient: float
    gradient: np.ndarray
    rise: Rise | None = None


@dataclass(frozen=True, eq=False)
class Beside:
    """What an effect knows of the test beside what is compared: whitened residuals r (k,).

    Their slopes by its own parameters (k, n_parameters), and by λ and by the damping ratio that
    effects bring of every mode of the state (k, modes).
    """

    r: np.ndarray
    gradient: np.ndarray
    by_lam: np.ndarray
    by_dissipated: np.ndarray


@dataclass(frozen=True, eq=False)
class ChannelChange:
    """log10 of the factor on every output, complex: level and phase (n_out,), (n_out, n_p)."""

    value: np.ndarray
    gradient: np.ndarray


@dataclass(frozen=True, eq=False)
class ShapeChange:
    """c S b added to the motion of the places that were measured: outputs first, then inputs.

    b are coordinates ``rows`` (k, n) of the structure, S ``shapes`` (places, k), c and dc/dx
    (n_parameters,). What is local at a sensor no change of K and M over a basis can bring. What
    follows a clamp that was let go is none of it.
    """

    rows: sp.csr_array
    shapes: np.ndarray
    coefficient: float
    gradient: np.ndarray


@dataclass(frozen=True, eq=False)
class Effect:
    """One kind of physics; subclasses say what it does, this one does nothing.

    Attributes
    ----------
    parameters : the unknowns, in the order of x
    text : where it acts, in words
    parts, grids : names of parts and ids of grids it concerns
    point : (3,) or None  its place in the basic frame [m]
    trials_factor : how many places were tried, this one among them (look-elsewhere)
    replaces : names of ordinary parameters it makes superfluous
    expected : whether what the deck is made of has it as a rule
    """

    name: ClassVar[str] = "nothing"
    claim: ClassVar[str] = "the model is right as it is"
    kind: ClassVar[str] = "physics"  # physics, test, ordinary, nuisance
    writable: ClassVar[bool] = True  # whether a deck could hold it
    remakes_structure: ClassVar[bool] = False  # so strong that mesh error and basis are made anew
    elastic: ClassVar[bool] = False  # gives or holds, no more: what rubs there as well is not it
    lone: ClassVar[bool] = False  # a second one beside it would be no finding
    rounds: ClassVar[int] = 0  # of loads that its responses cause, see ``reloads``
    lets_go: ClassVar[bool] = False  # of clamps: its rows reach beyond the dofs of the deck
    own_dofs: ClassVar[int] = 0  # degrees of freedom it brings: its terms must give them mass

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

    def fields(self, x: np.ndarray) -> tuple[FieldChange, ...]:
        """Fields of shells and beams it multiplies."""
        return ()

    def terms(self, x: np.ndarray) -> tuple[PointTerm, ...]:
        """Point springs and masses it adds."""
        return ()

    def matrices(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """Operators of the structure it adds."""
        return ()

    def outputs(self, x: np.ndarray) -> ChannelChange | None:
        """What it does to the channels of the test."""
        return None

    def seen(self, x: np.ndarray) -> ShapeChange | None:
        """What it does to the motion of the very places that were measured."""
        return None

    def beside(self, x: np.ndarray, lam: np.ndarray, dissipated: np.ndarray) -> Beside | None:
        """What it is held against beside the data, at λ (m,) and damping that effects bring (m,).

        ``neg2_log_without`` is -2 ln p of the same where it does not act.
        """
        return None

    @property
    def neg2_log_without(self) -> float:
        """-2 ln p, without the effect, of what :meth:`beside` holds it against."""
        return 0.0

    def weight(self, x: np.ndarray) -> tuple[float, np.ndarray]:
        """Change of the weighed mass [kg] beside the sheet's own, and its gradient (n_p,)."""
        return 0.0, np.zeros(len(self.parameters))

    def lump(self, x: np.ndarray) -> tuple[np.ndarray, float] | None:
        """Place (3,) [m] and mass [kg], where it is a mass at a place; None: it is none."""
        return None

    @classmethod
    def of_lump(
        cls, where: "Surroundings", point: np.ndarray, mass: float
    ) -> tuple["Effect", np.ndarray] | None:
        """The effect as a mass [kg] at a place (3,) [m] begins it, and its start; None: not so."""
        return None

    def off_the_scales(self, x: np.ndarray) -> float:
        """Mass [kg] it puts on the structure that is taken off before this is weighed."""
        return 0.0

    def basis_rows(self, x: np.ndarray, shapes: np.ndarray) -> sp.csr_array | None:
        """Rows b (k, n) whose static response the reduced basis must hold, or None.

        Its points, and A φ of its operators: to first order that is how they change the modes.

        Parameters
        ----------
        shapes : (n, r)   modes φ up to the highest frequency of interest
        """
        points = [term.rows for term in self.terms(x)]
        operators = [sp.csr_array((m.operator @ shapes).T) for m in self.matrices(x)]
        return sp.csr_array(sp.vstack([*points, *operators])) if points or operators else None

    def released(self, built: Structure) -> Structure:
        """The structure with the dofs its rows speak of beyond those the deck's supports leave."""
        return built

    def reloads(self, static: np.ndarray, M: sp.csr_array) -> np.ndarray:
        """Loads (n, k) that static responses (n, k) of the last round cause in their turn.

        What acts strongly changes modes beyond first order: the basis holds the responses to these
        as well, ``rounds`` times.
        """
        return M @ static

    def recentred(self, x: np.ndarray, where: "Surroundings") -> tuple["Effect", np.ndarray] | None:
        """The effect about the place it moved to, and its start there; None: it is near enough."""
        return None

    def with_reference_state(self, x: np.ndarray) -> Self:
        """The same effect on a structure that has it already as x says (``remakes_structure``)."""
        return self

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """The structure with the effect written into it."""
        return assembly

    def deck_comment(self, x: np.ndarray) -> str:
        """What of it no card that is written holds, for whoever runs the deck; "" where none is."""
        return ""

    def reported(self, x: np.ndarray, sd: np.ndarray) -> tuple[Estimate, ...]:
        """Physical values of the parameters with their 95 % intervals.

        Laplace's intervals are :meth:`widened`: model error makes them too narrow.
        """
        wide = self.widened(sd)
        return tuple(
            Estimate(p.name, p.value(x[k]), p.unit, *p.interval(x[k], wide[k]))
            for k, p in enumerate(self.parameters)
        )

    def widened(self, sd: np.ndarray) -> np.ndarray:
        """Standard deviations (n,) of a fit, what the data say of each ``WIDER`` times as wide.

        Data of the precision 1/sd² - 1/sd_0² beside a prior sd_0: model error makes these less
        certain and leaves the prior what it is, so that nothing is less certain than before.
        """
        prior = np.array([p.sd for p in self.parameters])
        with np.errstate(divide="ignore"):
            told = np.maximum(1 / np.square(sd) - 1 / prior**2, 0.0)
        return np.asarray(1 / np.sqrt(1 / prior**2 + told / WIDER**2))

    def location(self, x: np.ndarray) -> Location:
        """Where it is once it has been fitted."""
        return self.where()

    def located(self, x: np.ndarray, sd: np.ndarray) -> Location:
        """The same, with how well the place is known where the fit says so."""
        return self.location(x)

    def becomes(self, x: np.ndarray) -> str:
        """The simpler effect that it is at x for all the data can tell; "" where it is its own."""
        return ""

    def nearly(self, x: np.ndarray, sd: np.ndarray) -> str:
        """The simpler effect that it is somewhere in its intervals about x, or ""."""
        return ""

    def implausible(self, x: np.ndarray) -> str:
        """Why its value at x is none such a thing can have; "" where it may."""
        return ""

    def starts(self) -> list[np.ndarray]:
        """Points from which a fit begins: every combination of its parameters' starts."""
        options = [p.starts or (p.mean,) for p in self.parameters]
        grid = np.meshgrid(*options, indexing="ij") if options else []
        return [np.array(x) for x in zip(*(g.ravel() for g in grid), strict=True)]

    def where(self) -> Location:
        """The place it was made for."""
        return Location(
            self.text,
            tuple(self.parts),
            tuple(int(g) for g in self.grids),
            None if self.point is None else tuple(float(v) for v in self.point),
            self.radius,
            channels=tuple(self.channels),
        )


def count(effects: Sequence[Effect]) -> int:
    """How many parameters these effects have together."""
    return sum(len(effect.parameters) for effect in effects)
