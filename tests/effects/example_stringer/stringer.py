"""A stringer across the middle of a sheet that the deck lacks: bending stiffness and mass of beams.

All of it is in this file: physics, candidates, concealment on the bench, change of the deck. Its
package names one entry point, ``stringer = "stringer:FAMILY"`` in the group ``chladni.effects``.
"""

from dataclasses import dataclass, field, replace

import numpy as np
import scipy.sparse as sp

from chladni.effects.effect import Effect, MatrixTerm, Parameter, Traits, Weight
from chladni.effects.effect_context import EffectContext
from chladni.effects.family import Article, Family
from chladni.fem.energy import only
from chladni.model.added_beams import with_beam_line
from chladni.model.assembly import Assembly
from chladni.model.properties import BeamSection, Isotropic

SIDE = 3e-3  # [m] prior median of the side of its square section
STEEL = Isotropic(E=2.1e11, nu=0.3, rho=7850.0)


def section(side: float) -> BeamSection:
    """A square bar: A = a², I1 = I2 = a⁴/12, J = 0.1406 a⁴ (Roark, torsion of a square)."""
    inertia = side**4 / 12
    return BeamSection(STEEL, side**2, inertia, inertia, 0.0, 0.1406 * side**4)


@dataclass(frozen=True, eq=False)
class Stringer(Effect):
    """K_b and M_b of bars along a line of grids, their square section of the side a: a⁴, a²."""

    name = "stringer"
    claim = "a stringer stiffens the sheet that the model does not have"
    traits = Traits(elastic=True, lone=True)

    up: tuple[float, float, float] = (0.0, 0.0, 1.0)
    length: float = 0.0  # [m]
    stretching: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))  # of side SIDE
    bending: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    mass: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """K = r² K_EA + r⁴ K_EI and M = r² M_ρA, r = a / SIDE."""
        r = self.parameters[0].value(x[0]) / SIDE
        powers = (("K", self.stretching, 2), ("K", self.bending, 4), ("M", self.mass, 2))
        return tuple(
            MatrixTerm(matrix, A, r**n, np.array([n * r**n]))  # type: ignore[arg-type]
            for matrix, A, n in powers
        )

    def weight(self, x: np.ndarray) -> Weight:
        """ρ a² L."""
        m = STEEL.rho * self.parameters[0].value(x[0]) ** 2 * self.length
        return Weight(m, np.array([2 * m]))

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Bars between the grids, a part of their own."""
        made = section(self.parameters[0].value(x[0]))
        return with_beam_line(assembly, self.grids, made, self.up, "stringer")


def lines(assembly: Assembly) -> list[np.ndarray]:
    """Ids of the grids along the middle of every sheet, across its longest side, in order."""
    out = []
    for part in np.unique(assembly.shells.part):
        rows = np.unique(assembly.shells.nodes[assembly.shells.part == part])
        X = assembly.points[rows]
        long, cross = np.argsort(-np.ptp(X, axis=0))[:2]
        middle = X[np.abs(X[:, long] - X[:, long].mean()).argmin(), long]
        on = np.flatnonzero(np.isclose(X[:, long], middle, atol=1e-6))
        out.append(assembly.ids[rows[on[np.argsort(X[on, cross])]]])
    return out


def stringers(where: EffectContext) -> list[Stringer]:
    """One across every sheet."""
    built = where.groups.structure
    assembly, out = built.assembly, []
    every = lines(assembly)
    a = Parameter("a", "m", 0.0, 0.5, SIDE, step=0.5, starts=(-0.5, 0.0, 0.5), nominal=-30.0)
    for grids in every:
        line = with_beam_line(assembly, grids, section(SIDE), (0.0, 0.0, 1.0))
        whole = section(SIDE)
        axial = replace(whole, I1=0.0, I2=0.0, J=0.0)

        def of(made: BeamSection, line: Assembly = line) -> tuple[sp.csr_array, sp.csr_array]:
            parts = (*line.parts[:-1], line.parts[-1].with_section(**vars(made)))
            return built.contribution(only(line.with_parts(parts), len(parts) - 1))

        (K, M), (K_axial, _) = of(whole), of(axial)
        X = assembly.points[assembly.rows(grids)]
        out.append(
            Stringer(
                (a,), "across the middle of a sheet", (), tuple(grids.tolist()),
                tuple(X.mean(axis=0).tolist()), trials_factor=len(every),
                length=float(np.linalg.norm(np.diff(X, axis=0), axis=1).sum()),
                stretching=K_axial, bending=sp.csr_array(K - K_axial), mass=M,
            )
        )  # fmt: skip
    return out


def conceal(article: Article, rng: np.random.Generator) -> Article:
    """A bar of 3 to 5 mm across the middle of the first sheet."""
    side = float(rng.uniform(3e-3, 5e-3))
    grids = lines(article.assembly)[0]
    made = with_beam_line(article.assembly, grids, section(side), (0.0, 0.0, 1.0), "stringer")
    return article.with_hidden(made, {"a": side})


FAMILY = Family(
    Stringer,
    conceal,
    placed=stringers,
    cards=("CBAR", "PBAR", "MAT1"),
    settled_by="look at the sheet from both sides",
    on_sheets=True,
)
