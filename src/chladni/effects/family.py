"""A family of effects: all that the rest of the program knows of it."""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..errors import ModelError
from ..fem.energy import mass_properties
from ..geometry.sampling import nearest_points
from ..model.assembly import Assembly
from .effect import Effect
from .search_context import Candidate, SearchContext, best_starts
from .surroundings import Surroundings


@dataclass(frozen=True, eq=False)
class Article:
    """What stands on the virtual bench and how it is tested, with the sealed truth.

    Attributes
    ----------
    assembly : the article, meshed finer than the deck
    deck : what the user will have
    outputs, hangers : (k,) int    grid ids of the deck
    gains : (n_out,)               factor on every channel
    off_scale : mass that is taken off before the article is weighed [kg]
    drive : grid id of the deck and direction of the force, or None where none is known
    truth : what was concealed; ``parameters`` by the names the effect reports, ``value`` the first
        of them, ``point_m`` and ``channel`` where it has a place
    """

    assembly: Assembly
    deck: Assembly
    outputs: np.ndarray
    hangers: np.ndarray
    gains: np.ndarray
    off_scale: float = 0.0
    drive: tuple[int, tuple[float, float, float]] | None = None
    truth: dict[str, Any] = field(default_factory=dict)

    @property
    def weight(self) -> float:
        """Mass of the article [kg]."""
        return mass_properties(self.assembly)[0]

    def grids_at(self, grids: np.ndarray) -> tuple[int, ...]:
        """Ids of the article's grids that lie where these of the deck lie."""
        where = self.deck.points[self.deck.rows(grids)]
        return tuple(self.assembly.ids[nearest_points(self.assembly.points, where)].tolist())

    def shell_grid(self, rng: np.random.Generator) -> int:
        """Id of a grid of the deck's shells, or of its beams where it has none, any of them."""
        nodes = self.deck.shells.nodes if len(self.deck.shells) else self.deck.beams.nodes
        return int(self.deck.ids[rng.choice(np.unique(nodes))])


@dataclass(frozen=True, eq=False)
class Family:
    """One kind of physics as search, bench, deck and page know it.

    Attributes
    ----------
    effect : its class, which holds name, claim and physics
    conceal : puts it into an article, of a size and at a place drawn at random, with the truth
    placed : its effects where deck and test tell their place
    candidates : what is worth a fit, where the place is unknown; of ``placed`` the best starts
    closer : one that was fitted at x, next to its place, if it explains more there; the last of
        the context's ``bases`` is that of the fit
    cards : of the deck that hold it
    no_cards : why none can
    settled_by : the measurement that tells it from what looks like it, in words
    needs : what a structure must have beside its sheets for it to act, in words; "": nothing
    on_sheets : whether it acts on shells alone, so that a structure of beams is not asked for it
    """

    effect: type[Effect]
    conceal: Callable[[Article, np.random.Generator], Article]
    placed: Callable[[Surroundings], Sequence[Effect]] | None = None
    candidates: Callable[[SearchContext], Iterable[Candidate]] | None = None
    closer: Callable[[SearchContext, Effect, np.ndarray], Candidate | None] | None = None
    cards: tuple[str, ...] = ()
    no_cards: str = ""
    settled_by: str = ""
    needs: str = ""
    on_sheets: bool = False

    def __post_init__(self) -> None:
        if not re.fullmatch(r"[a-z]+(-[a-z]+)*", self.name) or self.name == Effect.name:
            raise ModelError(
                f"{self.effect.__name__} has the name {self.name!r}; a family's is its own, in "
                "small letters and hyphens, as point-mass"
            )
        if self.placed is None and self.candidates is None:
            raise ModelError(f"{self.name} has neither candidates nor places it is known to act at")
        if bool(self.cards) == bool(self.no_cards):
            raise ModelError(f"{self.name} needs the cards that hold it, or a reason why none can")

    @property
    def name(self) -> str:
        """The name of the public contract."""
        return self.effect.name

    def proposed(self, context: SearchContext) -> list[Candidate]:
        """What of this family is worth a fit; nothing where it has nothing to act on."""
        if self.on_sheets and not context.where.groups.sheet.any():
            return []
        if self.candidates is not None:
            return list(self.candidates(context))
        assert self.placed is not None
        return best_starts(context, self.placed(context.where))
