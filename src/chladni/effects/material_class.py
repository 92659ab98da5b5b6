"""What class of material a deck's numbers speak of, and how its sheets depart from isotropy.

Wood (clear softwood, 12 % moisture): E_L over density 22 to 33 MPa m³/kg, E_R/E_L 0.06 to 0.16 and
E_T/E_L 0.04 to 0.09, G_LR/E_L and G_LT/E_L 0.05 to 0.12 (Forest Products Laboratory 2010, Wood
Handbook, FPL-GTR-190, tables 5-1 and 5-3).  Rolled metal: directions differ by a few per cent, in
strong textures up to some fifteen (Hosford 1993, The Mechanics of Crystals and Textured
Polycrystals, ch. 2).  Of all else nothing is known beforehand.
"""

from dataclasses import dataclass

import numpy as np

from ..model.properties import Isotropic


@dataclass(frozen=True)
class Orthotropy:
    """Medians [Pa] of E1, E2, G12 and the standard deviations of their logarithms.

    ``nu_sd`` is that of the logit of sqrt(nu12 nu21) / 0.6: 0.25 is 0.04 about 0.3.
    """

    median: tuple[float, float, float]
    sd: tuple[float, float, float]
    nu_sd: float = 1.0

    @property
    def directed(self) -> bool:
        """Whether the two directions are told apart beforehand."""
        return self.median[0] != self.median[1]

    def shift(self, E: float, G: float) -> tuple[float, float, float]:
        """Logarithms of the medians over an isotropic sheet's E, E and G."""
        E1, E2, G12 = self.median
        return float(np.log(E1 / E)), float(np.log(E2 / E)), float(np.log(G12 / G))


def is_wood(material: Isotropic) -> bool:
    """By density [kg/m³] and by a modulus between that across and that along the grain."""
    return 300 <= material.rho <= 900 and 0.3e9 <= material.E <= 25e9


def is_metal(material: Isotropic) -> bool:
    """From magnesium to steel, by density [kg/m³] and modulus [Pa]."""
    return material.rho > 1700 and material.E > 35e9


def orthotropy(material: Isotropic) -> Orthotropy:
    """What E1, E2 and G12 of a sheet may be whose deck has it isotropic."""
    if is_wood(material):
        along = 27e6 * material.rho
        return Orthotropy((along, 0.08 * along, 0.08 * along), (0.25, 0.45, 0.35))
    E, G = material.E, material.shear_modulus
    if is_metal(material):
        return Orthotropy((E, E, G), (0.12, 0.12, 0.12), 0.25)
    return Orthotropy((E, E, G), (1.0, 1.0, 0.7))
