"""A form: ranges of its random dimensions, its mesher, and its direction of rolling."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from chladni.model.assembly import Assembly

from . import sheet_forms
from .tube_frame import tube_frame


@dataclass(frozen=True)
class DrawnForm:
    """A kind of structure.

    Attributes
    ----------
    name : str
    ranges : {name: (low, high)}   each dimension is drawn between them [m, rad, share]
    build : (dimensions, element size) -> Assembly
    size : element size of the deck [m]
    material_axis : direction of rolling of a sheet, normal to no part in ``rolled``
    rolled : names of these parts; empty where there is no sheet
    """

    name: str
    ranges: Mapping[str, tuple[float, float]]
    build: Callable[[Mapping[str, float], float], Assembly]
    size: float
    material_axis: tuple[float, float, float] = (1.0, 0.0, 0.0)
    rolled: tuple[str, ...] = ()

    def dimensions(self, seed: int) -> dict[str, float]:
        """The dimensions of one seed, equal on every mesh."""
        rng = np.random.default_rng([seed, *self.name.encode()])
        return {name: float(rng.uniform(*ends)) for name, ends in self.ranges.items()}

    def made(self, seed: int, finer: float = 1.0) -> Assembly:
        """The structure of this seed; elements ``finer`` times smaller than the deck's.

        >>> deck, article = FORMS["ribbed plate"].made(1), FORMS["ribbed plate"].made(1, 1.7)
        >>> len(article.shells) > 2 * len(deck.shells)
        True
        """
        return self.build(self.dimensions(seed), self.size / finer)


_BRACKET = {
    **{"length": (0.30, 0.42), "width": (0.12, 0.20), "leg": (0.07, 0.10), "rise": (0.18, 0.28)},
    **{"gap": (0.0018, 0.0022), "t plate": (0.0018, 0.0025), "t angle": (0.0014, 0.002)},
}
_BOX = {
    **{"length": (0.34, 0.46), "width": (0.24, 0.32), "height": (0.08, 0.14)},
    **{"rim": (0.018, 0.024), "gap": (0.0014, 0.0018), "t box": (0.9e-3, 1.2e-3)},
    "t lid": (0.9e-3, 1.3e-3),
}
_RIBBED = {
    **{"length": (0.5, 0.65), "width": (0.34, 0.46), "rib": (0.016, 0.028), "along": (0.35, 0.6)},
    **{"first": (0.16, 0.26), "last": (0.72, 0.86), "t plate": (1.4e-3, 2.2e-3)},
    "t rib": (1.4e-3, 2.2e-3),
}
_CURVED = {
    **{"length": (0.5, 0.65), "radius": (0.45, 0.8), "arc": (0.55, 0.8), "lip": (0.018, 0.03)},
    **{"x1": (0.12, 0.2), "w1": (0.16, 0.26), "s1": (0.2, 0.3), "x2": (0.52, 0.6)},
    **{
        "w2": (0.16, 0.26),
        "s2": (0.2, 0.3),
        "t shell": (0.9e-3, 1.2e-3),
        "t lip": (0.9e-3, 1.2e-3),
    },
}
_BONDED = {
    **{"length 1": (0.34, 0.44), "length 2": (0.28, 0.38), "width 1": (0.2, 0.28)},
    **{"width 2": (0.14, 0.19), "lap": (0.06, 0.11), "t 1": (1.6e-3, 2.2e-3)},
    **{"t 2": (1.8e-3, 2.6e-3), "glue": (0.6e-3, 1.4e-3)},
}
_FRAME = {
    **{"length": (0.9, 1.2), "width": (0.45, 0.6), "height": (0.4, 0.6), "bay": (0.4, 0.6)},
    **{"narrow": (0.9, 1.1), "rail": (0.022, 0.028), "brace": (0.014, 0.02)},
    **{"t rail": (1.4e-3, 2.0e-3), "t brace": (1.0e-3, 1.5e-3)},
}
FORMS = {
    form.name: form
    for form in (
        DrawnForm("bolted bracket", _BRACKET, sheet_forms.bolted_bracket, 0.015, (0, 1, 0),
             ("plate", "angle")),
        DrawnForm("lidded box", _BOX, sheet_forms.lidded_box, 0.02, (1, 0, 0), ("lid",)),
        DrawnForm("ribbed plate", _RIBBED, sheet_forms.ribbed_plate, 0.02, (1, 0, 0), ("plate",)),
        DrawnForm("tube frame", _FRAME, tube_frame, 0.06),
        DrawnForm("curved shell", _CURVED, sheet_forms.curved_shell, 0.02, (1, 0, 0),
             ("shell", "lips")),
        DrawnForm("bonded plates", _BONDED, sheet_forms.bonded_plates, 0.014, (1, 0, 0),
             ("lower", "upper")),
    )
}  # fmt: skip
