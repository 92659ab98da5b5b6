"""Shapes of one object from several set-ups: sensors that rove, some of them in common.

Modes are matched by frequency and, from three channels in common on, by shape. Each set-up takes
the factor that fits its common channels best. The differences there are the scatter of the shapes.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..errors import ShapeError
from .correlation import mac
from .mode_pairing import LEAST_CHANNELS, pair
from .setup import Shapes

MOVED = 0.03  # of ln f: modes of two set-ups that lie farther apart are two


def merged(parts: Sequence[Shapes]) -> Shapes:
    """Shapes over all channels, of the modes that every set-up shows.

    Frequencies are means with their standard error; where channels in common show it, ``sd`` is the
    scatter between set-ups.

    Raises
    ------
    ShapeError
        If set-ups have no channel or no mode in common.
    """
    whole, frequencies, square = parts[0], [parts[0].frequency], list[float]()
    for part in parts[1:]:
        common = [label for label in whole.dofs if label in part.dofs]
        if not common:
            raise ShapeError("the set-ups have no channel in common, so their shapes have no scale")
        i, j = (np.array([x.dofs.index(c) for c in common]) for x in (whole, part))
        likeness = mac(part.values[j], whole.values[i]) if len(i) >= LEAST_CHANNELS else None
        found = pair(part.frequency, whole.frequency, likeness, farthest=MOVED)
        if not len(found):
            raise ShapeError("the set-ups have no mode in common")
        old, new = whole.values[:, found.test], part.values[:, found.model]
        power = np.maximum((np.abs(new[j]) ** 2).sum(axis=0), 1e-300)
        new = new * ((new[j].conj() * old[i]).sum(axis=0) / power)
        if len(i) > 1:
            off = (np.abs(new[j] - old[i]) ** 2).sum(axis=0) / (2 * (len(i) - 1))
            square += (off / np.maximum((np.abs(old[i]) ** 2).mean(axis=0), 1e-300)).tolist()
        fresh = np.array([k for k, d in enumerate(part.dofs) if d not in common], int)
        frequencies = [f[found.test] for f in frequencies] + [part.frequency[found.model]]
        whole = whole.sel(found.test)
        whole = replace(
            whole, values=np.concatenate([old, new[fresh]]), sd=None,
            dofs=(*whole.dofs, *(part.dofs[k] for k in fresh)),
        )  # fmt: skip
    if len(parts) == 1:
        return whole
    f = np.array(frequencies)
    spread = f.std(axis=0, ddof=1) / np.sqrt(len(f))
    size = np.sqrt((np.abs(whole.values) ** 2).mean(axis=0))
    scatter = np.sqrt(np.mean(square)) * size if square else None
    return replace(
        whole, frequency=f.mean(axis=0), frequency_sd=np.maximum(spread, 1e-4 * f.mean(axis=0)),
        sd=None if scatter is None else np.broadcast_to(scatter, whole.values.shape),
    )  # fmt: skip
