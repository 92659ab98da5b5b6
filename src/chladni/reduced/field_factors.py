"""Factors on stiffness and mass of shells and beams, from their log fields."""

from dataclasses import dataclass, replace

import numpy as np

from ..effects.effect import FieldChange, MatrixTerm, Within, of
from ..effects.element_groups import COMPONENTS, ElementGroups
from ..errors import ModelError
from .effect_dofs import Acting

Fields = dict[str, np.ndarray]


def log_fields(
    acting: Acting, groups: ElementGroups, n_p: int, split: bool
) -> tuple[Fields, Fields]:
    """Sum of the log fields (g,) over the groups and their gradients (g, n_p), by name."""
    logs = {name: np.zeros(len(groups)) for name in ("t", "E", "rho", "bending", *COMPONENTS)}
    slopes = {name: np.zeros((len(groups), n_p)) for name in logs}
    for effect, at, terms in acting:
        for change in of(FieldChange, terms):
            if change.field in COMPONENTS and not split:
                raise ModelError(
                    f"{effect.name} changes {change.field}; the model needs with_components()"
                )
            mine = (groups.undivided.group if change.of is None else change.of)[groups.first]
            logs[change.field] = logs[change.field] + change.value[mine]
            slopes[change.field][:, at] += change.gradient[mine]
    return logs, slopes


def stiffness_log(fields: Fields, component: str, power: int) -> np.ndarray:
    """E + p t + Q: logarithm of the factor on stiffness that grows with t^p.

    Bending stiffness, p = 3, adds the field ``bending``.  A component of the plane stiffness adds
    its own field Q. The sum is linear in the fields (g, ...), so it serves their gradients as well.
    """
    plain = fields["E"] + power * fields["t"]
    if power == 3:
        plain = plain + fields["bending"]
    return plain + fields[component] if component else plain


@dataclass(frozen=True, eq=False)
class TermShare:
    """A term of an effect as the model has it: c A with ∂c/∂x (n_p,); ``at`` are its parameters."""

    term: MatrixTerm
    at: slice
    gradient: np.ndarray

    @property
    def within(self) -> Within:
        """The whole of which A is a share."""
        return self.term.within or Within()


def multiplied(
    acting: Acting, groups: ElementGroups, logs: Fields, slopes: Fields, split: bool
) -> list[TermShare]:
    """The operators of all effects with c m in place of c, m what is left of A by the others.

    Sheets leave the factor of their softest group. A term within others leaves 1 + c of what they
    leave; of two that only overlap, a loss by the larger one counts. So the sum of all stays
    positive where each c > -1.
    """
    every = [(at, term) for _, at, terms in acting for term in of(MatrixTerm, terms)]
    done: list[TermShare] = []
    for at, term in sorted(every, key=_size):
        within = term.within or Within()
        left, slope = _left_by_fields(within, groups, logs, slopes, split)
        for other in done:
            c = other.term.coefficient
            if _counts(within, other.within, c):
                left, slope = left + c, slope + other.gradient
        if left < 0:
            left, slope = 0.0, 0 * slope
        gradient = term.coefficient * slope
        gradient[at] += left * term.gradient
        whole = replace(term, coefficient=left * term.coefficient, gradient=left * term.gradient)
        done.append(TermShare(whole, at, gradient))
    return done


def _size(entry: tuple[slice, MatrixTerm]) -> int:
    """Order of terms: the wholes before their shares."""
    return 0 if entry[1].within is None else -len(entry[1].within.pieces)


def _counts(mine: Within, its: Within, c: float) -> bool:
    """True where a change c of pieces changes all of mine, or is a loss of some of them."""
    if not (mine.pieces and its.complete):
        return False
    return mine.pieces <= its.pieces or (c < 0 and not mine.pieces.isdisjoint(its.pieces))


def _left_by_fields(
    within: Within, groups: ElementGroups, logs: Fields, slopes: Fields, split: bool
) -> tuple[float, np.ndarray]:
    """Factor of the softest group of some shells, and its slope (n_p,); 1 without shells."""
    if within.shells is None:
        return 1.0, np.zeros(slopes["t"].shape[1])
    mine = np.unique(groups.group[within.shells])
    options = [
        (stiffness_log(logs, name, power)[mine], name, power)
        for power in ((3,) if within.bending else (1, 3))
        for name in (COMPONENTS if split else ("",))
    ]
    least, name, power = min(options, key=lambda option: float(option[0].min()))
    w = float(np.exp(least.min()))
    return w, w * stiffness_log(slopes, name, power)[mine[int(np.argmin(least))]]


def mass_log(fields: Fields) -> np.ndarray:
    """ρ + t: logarithm of the factor on the shells' mass, or its gradient."""
    return fields["rho"] + fields["t"]
