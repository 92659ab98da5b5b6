"""Poles of similar shape within one peak: the peak does not fit a single pole."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from .correlation import mac
from .identification import Identified

SAME_SHAPE = 0.8  # MAC of the residues over three channels or more: less is another mode
TWIN = 1.5  # half-bandwidths: poles of one shape nearer than that are one mode


def alike_shapes(a: Identified, b: Identified) -> np.ndarray:
    """Compare the shapes of modes of two recordings; True if similar or unknown (r_a, r_b)."""
    if (a.outputs, a.inputs) != (b.outputs, b.inputs) or len(a.outputs) * len(a.inputs) < 3:
        return np.ones((a.order, b.order), bool)
    return mac(a.by_channel.T, b.by_channel.T) > SAME_SHAPE


def peaks(found: Identified) -> Iterator[np.ndarray]:
    """Positions of the poles of every peak, its strongest first."""
    half, strength = np.abs(found.poles.real), found.relative_delta_chi2
    near = np.abs(found.poles[:, None] - found.poles)
    close = (near < TWIN * np.maximum(half[:, None], half)) & alike_shapes(found, found)
    free = np.ones(found.order, bool)
    for k in np.argsort(-strength):
        if free[k]:
            twins = np.flatnonzero(close[k] & free & (np.arange(found.order) != k))
            free[[k, *twins]] = False
            yield np.array([k, *twins])


def twins_joined(found: Identified) -> Identified:
    """Merge the poles of each peak into one mode with the sum of their residues.

    Two poles fit a leaning peak better than one, but neither has the residue of the mode.
    """
    residues, kept = found.residues.copy(), np.zeros(found.order, bool)
    for first, *twins in peaks(found):
        kept[first] = True
        residues[first] += residues[twins].sum(axis=0)
    return replace(found, residues=residues).sel(kept)


def peak_notes(found: Identified) -> list[str]:
    """Return one sentence for each peak with several poles."""
    out = []
    for several in peaks(found):
        if len(several) > 1:
            f = " and ".join(f"{f:.5g}" for f in np.sort(found.frequency[several]))
            out.append(
                f"{f} Hz are in one peak with the same shape: one mode with a nonlinear peak "
                "(measure at two levels), or modes that these channels cannot distinguish"
            )
    return out
