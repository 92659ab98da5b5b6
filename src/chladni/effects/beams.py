"""Beams along a line of grids that the model lacks, with a section of unknown size."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, Self

import numpy as np
import scipy.sparse as sp

from ..errors import ModelError
from ..fem.energy import only
from ..model.added_beams import with_beam_line
from ..model.assembly import Assembly
from ..model.properties import BeamSection
from .effect import Effect, MatrixTerm, Parameter, Traits, Weight
from .effect_context import EffectContext

Operator = tuple[Literal["K", "M"], int, sp.csr_array]  # of the section itself; grows with r^power


@dataclass(frozen=True, eq=False)
class BeamLine(Effect):
    """K + r² K_A + r⁴ K_I and M likewise, r the size of the section over that of ``section``.

    Areas grow with r² and second moments of area with r⁴. The first parameter is the size.
    """

    traits = Traits(elastic=True)

    section: BeamSection = field(kw_only=True)  # of r = 1
    up: tuple[float, float, float] | None = None  # (3,) or None direction of plane 1
    # (3,) place of the beams from their grids [m]
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    length: float = 0.0  # of the line [m]
    operators: tuple[Operator, ...] = ()  # K_A, K_I, M_A and M_I with their powers of r

    @classmethod
    def along(
        cls, where: EffectContext, grids: Sequence[int], section: BeamSection, size: Parameter,
        text: str, tried: int = 1, up: tuple[float, float, float] | None = None,
        offset: tuple[float, float, float] = (0.0, 0.0, 0.0),
    ) -> Self:  # fmt: skip
        """Beams along a line of grids of the deck; the section has areas and second moments only.

        Parameters
        ----------
        grids : ids of two or more grids, in order
        section : areas and second moments at the size ``size.scale`` (SI)
        size : the unknown size [m], for example the side of a square section
        text : where it is, in words
        tried : number of places tried, this one included
        up, offset : see :func:`..model.added_beams.with_beam_line`
        """
        s, plain = section, _of_area(section)
        if s != replace(plain, I1=s.I1, I2=s.I2, I12=s.I12, J=s.J):
            raise ModelError(
                f"{cls.name}: a section of unknown size has areas and second moments only, no "
                "shear factors, non-structural mass or neutral axis of its own"
            )
        built = where.groups.structure
        assembly = built.assembly

        def of(some: BeamSection) -> tuple[sp.csr_array, sp.csr_array]:
            made = with_beam_line(assembly, grids, some, up, cls.name, offset)
            return built.contribution(only(made, len(assembly.parts)))

        (K, M), (K_A, M_A) = of(section), of(plain)
        every: list[Operator] = [
            ("K", 2, K_A), ("K", 4, sp.csr_array(K - K_A)),
            ("M", 2, M_A), ("M", 4, sp.csr_array(M - M_A)),
        ]  # fmt: skip
        X = assembly.points[assembly.rows(np.asarray(grids))]
        x, y, z = X.mean(axis=0).tolist()
        return cls(
            (size,), text, grids=tuple(int(g) for g in grids), point=(x, y, z),
            trials_factor=tried, section=section, up=up, offset=offset,
            length=float(np.linalg.norm(np.diff(X, axis=0), axis=1).sum()),
            operators=tuple(o for o in every if abs(o[2]).max() > 0),
        )  # fmt: skip

    def size(self, x: np.ndarray) -> tuple[float, float]:
        """r and its slope by the first parameter."""
        p = self.parameters[0]
        return p.value(x[0]) / p.scale, p.slope(x[0]) / p.scale

    def terms(self, x: np.ndarray) -> tuple[MatrixTerm, ...]:
        """The operators times their powers of r."""
        (r, slope), first = self.size(x), np.eye(len(x))[0]
        return tuple(
            MatrixTerm(matrix, A, r**n, n * r ** (n - 1) * slope * first)
            for matrix, n, A in self.operators
        )

    def weight(self, x: np.ndarray) -> Weight:
        """ρ A L."""
        (r, slope), m = self.size(x), self.section.material.rho * self.section.area * self.length
        return Weight(m * r**2, 2 * m * r * slope * np.eye(len(x))[0])

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the beams, with a property of their own."""
        made = sized(self.section, self.size(x)[0])
        return with_beam_line(assembly, self.grids, made, self.up, self.name, self.offset)


def sized(section: BeamSection, r: float) -> BeamSection:
    """The section r times as large: areas r², second moments of area r⁴."""
    s, m = section, r**4
    return replace(s, area=r**2 * s.area, I1=m * s.I1, I2=m * s.I2, I12=m * s.I12, J=m * s.J)


def _of_area(section: BeamSection) -> BeamSection:
    """The section without second moments, and without all that does not grow with its size."""
    return BeamSection(section.material, section.area, kind=section.kind)
