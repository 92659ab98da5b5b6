"""Bending stiffness of shells at folds, which differs between meshes, codes and tools.

A radius of 5 mm is a sharp edge between shells of 20 mm. One solver makes solids of shells and ties
their ends at an edge rigidly; another lets them rotate. A bead smaller than a shell is missing from
the deck. Membrane and mass are the same in all of them.
"""

import numpy as np

from ..geometry.facets import cell_areas
from ..geometry.folds import share_at_folds
from .calibration_parameters import LogField
from .effect import Parameter, Traits
from .element_groups import ElementGroups

SPREAD = 0.4  # prior sd of ln of the bending stiffness of a shell with folds at all corners
LEAST_SHARE = 0.02  # share at folds, in groups that have folds, below which a part has no factor


class FoldBending(LogField):
    """A factor e^(x s) on the bending stiffness of one part, s the share of a group at folds."""

    name = "fold-bending"
    claim = "a fold is stiffer or softer in bending than shells joined at an angle"
    kind = "nuisance"
    traits = Traits(writable=False)


def fold_bending(groups: ElementGroups) -> list[FoldBending]:
    """One factor for every part of shells that has a fold."""
    assembly = groups.structure.assembly
    cells, points = assembly.shells.nodes, assembly.points
    if not len(cells):
        return []
    area, of = cell_areas(points, cells), groups.group[: len(cells)]
    folded = np.bincount(of, area * share_at_folds(points, cells), len(groups))
    share = folded / np.maximum(np.bincount(of, area, len(groups)), np.finfo(float).tiny)
    out = []
    for k in np.unique(groups.part[groups.sheet]):
        own = np.where((groups.part == k) & groups.sheet, share, 0.0)
        if own @ groups.area > LEAST_SHARE * groups.area[own > 0].sum():
            name = assembly.parts[k].name
            unknown = Parameter("k", "-", 0.0, SPREAD, step=0.3)
            text = f"bending at folds of {name}"
            out.append(FoldBending((unknown,), text, quantity="bending", functions=own[:, None]))
    return out
