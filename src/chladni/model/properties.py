"""Materials, sections and parts: the properties of a part of the structure (SI)."""

from dataclasses import dataclass, field, replace
from typing import Self

import numpy as np

HOLLOW, CLOSED = 1.5, 0.5  # limits from which a section counts as a tube: see BeamSection.tube


@dataclass(frozen=True)
class Isotropic:
    """E [Pa], nu [-], rho [kg/m³], structural damping (loss factor) [-].

    G is E / 2(1+nu) unless given.
    """

    E: float
    nu: float
    rho: float = 0.0
    damping: float = 0.0
    G: float | None = None
    id: int = 0

    @property
    def shear_modulus(self) -> float:
        """G [Pa]."""
        return self.E / (2 * (1 + self.nu)) if self.G is None else self.G

    def plane_stress(self) -> np.ndarray:
        """Q (3, 3) of σ = Q ε with ε = (εx εy γxy) [Pa]."""
        E, nu = self.E, self.nu
        Q = E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, 0.0]])
        Q[2, 2] = self.shear_modulus
        return Q

    def transverse(self) -> np.ndarray:
        """Transverse shear moduli (2, 2) [Pa]."""
        return self.shear_modulus * np.eye(2)


@dataclass(frozen=True)
class Orthotropic:
    """Plane orthotropic sheet (MAT8): axes 1, 2 of the element's material frame (SI)."""

    E1: float
    E2: float
    nu12: float
    G12: float
    G1z: float = 0.0  # 0: infinitely stiff in transverse shear, as in Nastran
    G2z: float = 0.0
    rho: float = 0.0
    damping: float = 0.0
    id: int = 0

    def plane_stress(self) -> np.ndarray:
        """Q (3, 3) in the material frame [Pa] (Jones, Mechanics of Composite Materials, 2.61)."""
        nu21 = self.nu12 * self.E2 / self.E1
        scale = 1 / (1 - self.nu12 * nu21)
        Q12 = self.nu12 * self.E2
        return scale * np.array(
            [[self.E1, Q12, 0], [Q12, self.E2, 0], [0, 0, self.G12 / scale]], dtype=float
        )

    def transverse(self) -> np.ndarray:
        """Transverse shear moduli (2, 2) [Pa]; a zero entry means no shear flexibility."""
        return np.diag([self.G1z, self.G2z])


@dataclass(frozen=True, eq=False)
class Anisotropic:
    """A sheet given directly by its plane stiffness (MAT2 or a smeared laminate)."""

    Q: np.ndarray  # (3, 3) [Pa]
    G: np.ndarray = field(default_factory=lambda: np.zeros((2, 2)))  # (2, 2) [Pa]
    rho: float = 0.0
    damping: float = 0.0
    id: int = 0

    def plane_stress(self) -> np.ndarray:
        """Q (3, 3) [Pa]."""
        return self.Q

    def transverse(self) -> np.ndarray:
        """Transverse shear moduli (2, 2) [Pa]; zero means no shear flexibility."""
        return self.G


@dataclass(frozen=True, eq=False)
class AnisotropicSolid:
    """A solid given by its stiffness (MAT9)."""

    C: np.ndarray  # (6, 6) of σ = C ε, ε = (εx εy εz γxy γyz γzx), basic frame [Pa]
    rho: float = 0.0
    damping: float = 0.0
    id: int = 0


Material = Isotropic | Orthotropic | Anisotropic
AnyMaterial = Material | AnisotropicSolid


@dataclass(frozen=True)
class ShellSection:
    """Shell section (PSHELL): A = t Q_m, D = t³/12 r_b Q_b, B = t² Q_c, S = t k_s G (SI)."""

    thickness: float
    membrane: Material | None
    bending: Material | None
    shear: Material | None = None  # None: the bending material; see rigid_shear
    coupling: Material | None = None
    bending_ratio: float = 1.0  # 12 I / t³
    shear_ratio: float = 5 / 6  # t_s / t
    nonstructural: float = 0.0  # [kg/m²]
    rigid_shear: bool = False  # MID3 blank: no transverse shear flexibility
    damping: float = 0.0  # loss factor of the whole section, if the deck gives one


@dataclass(frozen=True)
class SolidSection:
    """Solid section (PSOLID); ``full`` is plain 2x2x2 integration without internal strains.

    ``modes`` is the number of internal strains of a hexahedron, 21 (enhanced, as NX Nastran) or 9
    (incompatible modes, as OptiStruct).
    """

    material: AnyMaterial
    full: bool = False
    modes: int = 21


@dataclass(frozen=True)
class BeamStation:
    """Section of a tapered beam at x times its length, relative to end A; linear between stations.

    A change of the section at end A so changes the whole beam in proportion.
    """

    x: float
    area: float  # over that of end A, as are I1, I2 and J
    I1: float
    I2: float
    I12: float  # over I1 of end A
    J: float
    nonstructural: float  # as in BeamSection, as are those below
    nonstructural_inertia: float
    neutral: tuple[float, float]
    nonstructural_at: tuple[float, float]


@dataclass(frozen=True)
class BeamSection:
    """Beam or bar section (PBAR, PBEAM, PROD) of end A: areas and moments in the element frame.

    ``shear`` are the shear area factors (K1, K2); 0 means no shear flexibility. The reference line
    is the shear centre. Positions (y, z) relative to it are ``neutral`` of the neutral axis (N1, N2
    of PBEAM) and ``nonstructural_at`` of the non-structural mass (M1, M2). The lumped mass of a
    ``beam`` includes the inertia rho (I1 + I2) L / 2 at each end.
    """

    material: Material
    area: float
    I1: float = 0.0
    I2: float = 0.0
    I12: float = 0.0
    J: float = 0.0
    shear: tuple[float, float] = (0.0, 0.0)
    nonstructural: float = 0.0  # [kg/m]
    kind: str = "bar"  # bar, beam, rod
    neutral: tuple[float, float] = (0.0, 0.0)  # [m]
    nonstructural_at: tuple[float, float] = (0.0, 0.0)  # [m]
    nonstructural_inertia: float = 0.0  # about its own centre [kg m]
    stations: tuple[BeamStation, ...] = ()  # by increasing x, the last at 1; none: uniform

    @property
    def structural(self) -> Self:
        """The section without non-structural mass."""
        bare = tuple(
            replace(station, nonstructural=0.0, nonstructural_inertia=0.0)
            for station in self.stations
        )
        return replace(self, nonstructural=0.0, nonstructural_inertia=0.0, stations=bare)

    @property
    def tube(self) -> bool:
        """True for a closed tube, whose A and moments are proportional to its wall thickness.

        4π √(I1 I2) / A² is 1 for a round bar, π/3 for any rectangular bar, and R/t for a thin tube.
        J is 2 I for a round tube and very small for an open profile.
        """
        hollow = 4 * np.pi * np.sqrt(self.I1 * self.I2) > HOLLOW * self.area**2
        return bool(hollow and self.J > CLOSED * min(self.I1, self.I2))


Section = ShellSection | SolidSection | BeamSection


@dataclass(frozen=True)
class Part:
    """A part in the engineering sense: one property of the deck, with its name."""

    id: int
    name: str
    section: Section

    def with_section(self, **changes: object) -> Self:
        """Change some section values of the part."""
        return replace(self, section=replace(self.section, **changes))  # type: ignore[arg-type]
