"""A family of effects: its interface to search, bench, deck and page."""

import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Self

import numpy as np

from ..errors import ModelError
from ..fem.energy import mass_properties
from ..geometry.sampling import nearest_points
from ..model.assembly import Assembly
from .effect import Effect
from .effect_context import EffectContext, surface
from .search_context import Candidate, SearchContext, best_starts


@dataclass(frozen=True, eq=False)
class Article:
    """A test article on the virtual bench, its test and the concealed truth."""

    assembly: Assembly  #: the article, meshed finer than the deck
    deck: Assembly  #: given to the user
    outputs: np.ndarray  #: (k,) int, grid ids of the deck
    hangers: np.ndarray  #: (k,) int, grid ids of the deck
    gains: np.ndarray  #: (n_out,) factor on every channel
    off_scale: float = 0.0  #: mass that is removed before the article is weighed [kg]
    #: grid id of the deck and direction of the force, or None if unknown
    drive: tuple[int, tuple[float, float, float]] | None = None
    #: of the concealed effect: ``parameters`` by the names that it reports, ``value`` the first of
    #: them, ``point_m`` and ``channel`` where it has a place
    truth: dict[str, Any] = field(default_factory=dict)

    def with_hidden(
        self, assembly: Assembly, parameters: Mapping[str, float], point: Iterable[float] = (),
        **more: Any,
    ) -> Self:  # fmt: skip
        """The article with an effect in its assembly, and the truth about it.

        Parameters
        ----------
        parameters : by the names that the effect reports, the one to be found first
        point : (3,) its place [m], where it has one
        more : other entries of the truth, for example ``radius_m``
        """
        place = [float(v) for v in point]
        truth: dict[str, Any] = {"point_m": place} if place else {}
        value = next(iter(parameters.values()))
        truth |= {"value": value, **more, "parameters": dict(parameters)}
        return replace(self, assembly=assembly, truth=truth)

    @property
    def weight(self) -> float:
        """Mass of the article [kg]."""
        return mass_properties(self.assembly)[0]

    def grids_at(self, grids: np.ndarray) -> tuple[int, ...]:
        """Ids of the article's grids nearest to some grids of the deck."""
        where = self.deck.points[self.deck.rows(grids)]
        return tuple(self.assembly.ids[nearest_points(self.assembly.points, where)].tolist())

    def place_of(self, grid: int) -> np.ndarray:
        """Place (3,) [m] of a grid of the deck."""
        return np.asarray(self.deck.points[self.deck.rows([grid])[0]])

    def shell_grid(self, rng: np.random.Generator) -> int:
        """Id of a random grid of the deck's surface, or of its beams if it has no shells."""
        nodes = surface(self.deck) if len(surface(self.deck)) else self.deck.beams.nodes
        return int(self.deck.ids[rng.choice(np.unique(nodes))])


FromLump = tuple[Effect, np.ndarray] | None


@dataclass(frozen=True, eq=False)
class Family:
    """One kind of physics, as used by search, bench, deck and page."""

    effect: type[Effect]  #: its class, with name, claim and physics
    #: puts it into an article at random, in size and place, with the truth
    conceal: Callable[[Article, np.random.Generator], Article]
    #: gives its effects where deck and test define the place
    placed: Callable[[EffectContext], Sequence[Effect]] | None = None
    #: proposes fits where the place is unknown; without it, the best starts of ``placed``
    candidates: Callable[[SearchContext], Iterable[Candidate]] | None = None
    #: moves an effect fitted at x if it explains more next to its place; the last of the context's
    #: ``bases`` is that of the fit
    closer: Callable[[SearchContext, Effect, np.ndarray], Candidate | None] | None = None
    #: gives its effect, and its start, from a mass [kg] at a place (3,) [m], or None if impossible;
    #: without it, the effect is no mass at a place
    of_lump: Callable[[EffectContext, np.ndarray, float], FromLump] | None = None
    cards: tuple[str, ...] = ()  #: of the deck that represent it
    no_cards: str = ""  #: why no card can
    settled_by: str = ""  #: the measurement that separates it from similar causes, in words
    needs: str = ""  #: what the structure must have in addition to sheets; "": nothing
    on_sheets: bool = False  #: it acts on shells only: a structure of beams does not try it
    before: "Family | None" = None  #: the family without what an earlier answer says of it

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z]+(-[a-z]+)*", self.name) or self.name == Effect.name:
            raise ModelError(
                f"{self.effect.__name__} has the name {self.name!r}; a family needs its own name "
                "in lower case with hyphens, for example point-mass"
            )
        if self.placed is None and self.candidates is None:
            raise ModelError(f"{self.name} has neither candidates nor known places")
        if bool(self.cards) == bool(self.no_cards):
            raise ModelError(f"{self.name} needs its cards, or a reason why it has none")

    @property
    def name(self) -> str:
        """The public name."""
        return self.effect.name

    def proposed(self, context: SearchContext) -> list[Candidate]:
        """Candidates of this family that are worth a fit; none if there is nothing to act on."""
        if self.on_sheets and not context.where.groups.sheet.any():
            return []
        if self.candidates is not None:
            return list(self.candidates(context))
        assert self.placed is not None
        return best_starts(context, self.placed(context.where))
