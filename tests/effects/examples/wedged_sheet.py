"""A sheet that is rolled as a wedge: thinner at one end than at the other."""

from dataclasses import dataclass, replace

import numpy as np

from chladni.effects import Article, EffectContext, Family, LogField, Parameter
from chladni.model.assembly import Assembly


@dataclass(frozen=True, eq=False)
class WedgedSheet(LogField):
    """t(s) = t0 e^(x s), s from -1 to 1 along the longest side of a part."""

    name = "wedged-sheet"
    claim = "the sheet is thicker at one end than at the other"
    part: int = 0

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the thickness at the corners of the part's shells."""
        return wedged(assembly, self.part, float(x[0]))


def along(assembly: Assembly, part: int, X: np.ndarray) -> np.ndarray:
    """s of points X (n, 3), from -1 to 1 over the longest side of a part."""
    own = assembly.points[np.unique(assembly.shells.nodes[assembly.shells.part == part])]
    k = int(np.ptp(own, axis=0).argmax())
    low, high = own[:, k].min(), own[:, k].max()
    return np.asarray((2 * X[:, k] - low - high) / (high - low))


def wedged(assembly: Assembly, part: int, x: float) -> Assembly:
    """The assembly with a part as a wedge."""
    shells = assembly.shells
    factor = np.exp(x * along(assembly, part, assembly.points))[shells.nodes]
    t = np.where((shells.part == part)[:, None], shells.thickness * factor, shells.thickness)
    return replace(assembly, shells=replace(shells, thickness=t))


def wedges(where: EffectContext) -> list[WedgedSheet]:
    """One of every part of shells."""
    groups, out = where.groups, []
    assembly = groups.structure.assembly
    parts = np.unique(assembly.shells.part).tolist()
    x = Parameter("wedge", "-", 0.0, 0.15, kind="linear", step=0.1, starts=(-0.1, 0.1))
    for part in parts:
        s = along(assembly, part, groups.centre)
        own = (groups.part == part) & groups.sheet
        name = assembly.parts[part].name
        out.append(
            WedgedSheet(
                (x,), f"along {name}", (name,), trials_factor=len(parts), quantity="t",
                functions=np.where(own, s, 0.0)[:, None], part=part,
            )
        )  # fmt: skip
    return out


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """The first part 10 to 20 % thicker at one end, and thinner at the other."""
    x = float(rng.choice([-1, 1]) * rng.uniform(0.1, 0.2))
    return article.with_hidden(wedged(article.assembly, 0, x), {"wedge": x})


FAMILY = Family(
    WedgedSheet,
    conceal,
    placed=wedges,
    cards=("CQUAD4", "CTRIA3"),
    settled_by="measure the thickness of the sheet at both ends",
    on_sheets=True,
)
