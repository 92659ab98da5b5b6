"""The shaker, its stinger and the force gauge."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class ForceGauge:
    """A force transducer between stinger and skin (of the kind of a PCB 208C02)."""

    mass: float = 0.023  # [kg]
    # share of it, with its stud, between the crystal and the skin: what the article carries and no
    # force that is read accounts for
    beyond: float = 0.4
    sensitivity: float = 0.01124  # [V/N]
    noise: float = 4.5e-5  # of its crystal and amplifier [N/√Hz]


@dataclass(frozen=True)
class Stinger:
    """A slender rod from the armature to the gauge.

    It pushes along its axis and restrains across it, as a beam clamped at the armature.
    k = EA/L along, 12EI/L³ across, 4EI/L in rotation and 6EI/L² between these two.
    """

    length: float = 0.10  # [m]
    diameter: float = 2.5e-3  # [m]
    E: float = 3e9  # polyamide [Pa]
    rho: float = 1150.0  # [kg/m³]

    @property
    def axial(self) -> float:
        """EA/L [N/m]."""
        return float(self.E * np.pi * self.diameter**2 / 4 / self.length)

    @property
    def mass(self) -> float:
        """[kg]."""
        return float(self.rho * np.pi * self.diameter**2 / 4 * self.length)

    def restraint(self) -> np.ndarray:
        """Stiffness at its end for (transverse motion, slope) (2, 2) [N/m, N, N m]."""
        EI, L = self.E * np.pi * self.diameter**4 / 64, self.length
        return EI / L**3 * np.array([[12, -6 * L], [-6 * L, 4 * L**2]])


@dataclass(frozen=True)
class Shaker:
    """An electrodynamic exciter on a voltage amplifier (of the size of an LDS V406).

    Its input is the force of the blocked coil [N]. The voltage induced by the moving coil brakes
    it, so the force drops at resonances (Varoto and de Oliveira 2002, Journal of Sound and
    Vibration 257, 1-18).
    """

    armature: float = 0.2  # [kg]
    suspension: float = 12.3e3  # [N/m]
    braking: float = 40.0  # (Bl)²/R and its own losses [N s/m]
    stinger: Stinger = field(default_factory=Stinger)
    gauge: ForceGauge = field(default_factory=ForceGauge)
