"""A family of joints whose factor exceeds the usual scatter, written as a number of the deck."""

from dataclasses import dataclass, replace

import numpy as np

from ..model.assembly import Assembly
from .joints import with_solids
from .model_families import ModelFamily


@dataclass(frozen=True, eq=False)
class CalibratedFamily(ModelFamily):
    """The factor of a joint family, written into the deck: on E of solids or on K of bushes."""

    claim = "joints of one kind are far stiffer or softer than in the deck"
    kind = "calibration"
    writable = True
    called = "stiffness, times the deck's"

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """Write the factor into the deck."""
        factor = self.parameters[0].value(x[0])
        if self.text != "bushes":
            return with_solids(assembly, factor, soft=self.text == "adhesive")
        bushes = assembly.bushes
        own = np.where(bushes.ids > 0, factor, 1.0)  # not the firm springs in rigid ties
        scaled = replace(bushes, stiffness=bushes.stiffness * own[:, None])
        return replace(assembly, bushes=scaled)


def calibrated_family(family: ModelFamily) -> CalibratedFamily:
    """Make a family of joints writable as a number of the deck."""
    return CalibratedFamily(family.parameters, family.text, family.parts, slope=family.slope)
