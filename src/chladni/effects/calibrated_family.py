"""A family of joints that took more than joints of its kind scatter, as a number of the deck."""

from dataclasses import dataclass, replace

import numpy as np

from ..model.assembly import Assembly
from .joints import with_solids
from .model_families import ModelFamily


@dataclass(frozen=True, eq=False)
class CalibratedFamily(ModelFamily):
    """The same factor, written into the deck: on E of such solids, on K of the bushes."""

    claim = "joints of a kind are far stiffer or softer than the deck has them"
    kind = "ordinary"
    writable = True
    called = "stiffness, times the deck's"

    def apply(self, assembly: Assembly, x: np.ndarray) -> Assembly:
        """The deck with the factor in it."""
        factor = self.parameters[0].value(x[0])
        if self.text != "bushes":
            return with_solids(assembly, factor, soft=self.text == "adhesive")
        bushes = assembly.bushes
        own = np.where(bushes.ids > 0, factor, 1.0)  # none of the firm ones in rigid ties
        scaled = replace(bushes, stiffness=bushes.stiffness * own[:, None])
        return replace(assembly, bushes=scaled)


def calibrated_family(family: ModelFamily) -> CalibratedFamily:
    """A family of joints as a number of the deck."""
    return CalibratedFamily(family.parameters, family.text, family.parts, slope=family.slope)
