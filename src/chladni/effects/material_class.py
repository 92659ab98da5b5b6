"""The class of a material by its numbers, and the prior orthotropy of its sheets.

Wood (clear softwood, 12 % moisture): E_L over density 22 to 33 MPa m³/kg, E_R/E_L 0.06 to 0.16,
E_T/E_L 0.04 to 0.09, G_LR/E_L and G_LT/E_L 0.05 to 0.12. Source: Forest Products Laboratory (2010),
Wood Handbook, FPL-GTR-190, tables 5-1 and 5-3. Rolled metal: directions differ by a few per cent,
in strong textures by up to some fifteen. Source: Hosford (1993), The Mechanics of Crystals and
Textured Polycrystals, ch. 2. Any other material has a wide prior.
"""

from dataclasses import dataclass

import numpy as np

from ..model.properties import Isotropic


@dataclass(frozen=True)
class Orthotropy:
    """Medians [Pa] of E1, E2, G12 and the standard deviations of their logarithms.

    ``nu_sd`` is that of the logit of sqrt(nu12 nu21) / 0.6; 0.25 means a deviation of 0.04 at 0.3.
    """

    median: tuple[float, float, float]
    sd: tuple[float, float, float]
    nu_sd: float = 1.0

    @property
    def directed(self) -> bool:
        """True if the prior distinguishes the two directions."""
        return self.median[0] != self.median[1]

    def shift(self, E: float, G: float) -> tuple[float, float, float]:
        """Logarithms of the medians over E, E and G of an isotropic sheet."""
        E1, E2, G12 = self.median
        return float(np.log(E1 / E)), float(np.log(E2 / E)), float(np.log(G12 / G))


def is_wood(material: Isotropic) -> bool:
    """True by density [kg/m³] and a modulus [Pa] between those across and along the grain."""
    return 300 <= material.rho <= 900 and 0.3e9 <= material.E <= 25e9


def is_metal(material: Isotropic) -> bool:
    """True from magnesium to steel, by density [kg/m³] and modulus [Pa]."""
    return material.rho > 1700 and material.E > 35e9


def orthotropy(material: Isotropic) -> Orthotropy:
    """Prior of E1, E2 and G12 of a sheet that is isotropic in the deck."""
    if is_wood(material):
        along = 27e6 * material.rho
        return Orthotropy((along, 0.08 * along, 0.08 * along), (0.25, 0.45, 0.35))
    E, G = material.E, material.shear_modulus
    if is_metal(material):
        return Orthotropy((E, E, G), (0.12, 0.12, 0.12), 0.25)
    return Orthotropy((E, E, G), (1.0, 1.0, 0.7))
