"""Significance of a MAC value: limit by noise, probability by chance, share of near modes.

Removal of channels can raise a MAC to any value. Echaniz Granado (2015), section 5.1.4, has 0.77 on
all, 0.96 on ten. Here channels are removed by a rule that does not use the model. The result is
compared with the value that random shapes reach by the same rule.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import betainc

from .correlation import mac, subspace_mac

SEEN = 3.0  # standard deviations of its noise: a channel that moves less does not see the mode
POOR = 0.9  # below it the best half of the channels is looked at
CLOSE = 0.05  # of a frequency: modes that may have mixed
DRAWS = 400  # random shapes


@dataclass(frozen=True)
class Likeness:
    """One pair of modes, compared at the sensors."""

    mac: float  # on all channels
    # expected MAC of the true shape with the one that was identified; nan where no noise is stated
    noise_leaves: float
    # seen, seen_mac: channels that see the mode, and the MAC on them
    seen: int
    seen_mac: float
    # that the best of as many random shapes as there are model modes reaches ``seen_mac``
    chance: float
    space: float  # share of the test's shape in the span of all model modes nearby
    # half, half_chance: MAC on the best half of the channels, and how often the best half for a
    # random shape reaches it; nan where ``mac`` is not poor
    half: float = float("nan")
    half_chance: float = float("nan")


def likeness(
    phi: np.ndarray, psi: np.ndarray, covariance: np.ndarray, model: int, near: np.ndarray
) -> Likeness:
    """Compare one mode of the test with one of the model.

    Parameters
    ----------
    phi : (n, m)            shapes of all model modes it may be paired with, real
    psi, covariance : (n,), (n, n)   the test's shape, real and of unit norm
    model : column of its partner
    near : columns of model modes that may have mixed with it, the partner among them
    """
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    seen = np.abs(psi) > SEEN * sd
    if seen.sum() < 2:
        seen[:] = True
    whole, there = (_mac(phi[at, model], psi[at]) for at in (slice(None), seen))
    half = half_chance = float("nan")
    if whole < POOR:
        unit = phi / np.maximum(np.linalg.norm(phi, axis=0), 1e-300)
        drawn = unit @ np.random.default_rng(0).normal(size=(phi.shape[1], DRAWS))
        half = float(best_half(phi[:, model], psi[:, None])[0])
        reached = best_half(phi[:, model], drawn) >= half
        half_chance = float((1 + reached.sum()) / (1 + DRAWS))
    channels = effective_channels(phi[seen])
    return Likeness(
        mac=whole,
        noise_leaves=float(max(0.0, 1 - np.trace(covariance))),
        seen=int(seen.sum()),
        seen_mac=there,
        chance=chance_of(there, channels, phi.shape[1]),
        space=float(subspace_mac(psi[:, None], phi[:, near])[0]),
        half=half,
        half_chance=half_chance,
    )


def _mac(a: np.ndarray, b: np.ndarray) -> float:
    return float(mac(a[:, None], b[:, None])[0, 0])


def effective_channels(phi: np.ndarray) -> float:
    """Number of independent channels of shapes like these, (tr Σ)² / tr Σ², Σ = Σ_r φφᵀ/φᵀφ.

    Channels that move together in every mode count as one. The number is at most the smaller one of
    n channels and m modes.

    >>> effective_channels(np.eye(4))
    4.0
    >>> effective_channels(np.array([[1.0, 1.0], [1.0, -1.0], [0.0, 0.0]]))
    2.0
    """
    unit = phi / np.maximum(np.linalg.norm(phi, axis=0), 1e-300)
    sigma = np.linalg.svd(unit, compute_uv=False) ** 2
    return float(round(sigma.sum() ** 2 / max((sigma**2).sum(), 1e-300), 12))


def chance_of(value: float, channels: float, trials: int = 1) -> float:
    """P(the largest of so many MACs of random real shapes >= value).

    The squared cosine of two directions that are uniform in n dimensions is distributed as
    Beta(1/2, (n - 1)/2) (Muirhead 1982, Aspects of Multivariate Statistical Theory, section 1.5).

    >>> round(chance_of(0.5, 2), 12), chance_of(0.0, 30, 5)
    (0.5, 1.0)
    """
    one = float(betainc(max(channels - 1, 1e-9) / 2, 0.5, 1 - min(max(value, 0.0), 1.0)))
    return float(-np.expm1(trials * np.log1p(-min(one, 1 - 1e-16)))) if one < 1 else 1.0


def best_half(phi: np.ndarray, psi: np.ndarray) -> np.ndarray:
    """MAC of φ (n,) with every ψ (n, k) once half of the channels, worst first, are out (k,)."""
    n = len(phi)
    left = np.ones(psi.shape, bool)
    for _ in range(n // 2):
        product, a, b = (np.where(left, x, 0.0) for x in (
            phi[:, None] * psi, np.broadcast_to(phi[:, None] ** 2, psi.shape), psi**2))  # fmt: skip
        total = product.sum(axis=0), a.sum(axis=0), b.sum(axis=0)
        below = np.maximum((total[1] - a) * (total[2] - b), 1e-300)
        without = np.where(left, (total[0] - product) ** 2 / below, -1.0)
        left[without.argmax(axis=0), np.arange(psi.shape[1])] = False
    kept = np.where(left, psi, 0.0)
    above = (phi @ kept) ** 2
    below = ((phi**2) @ left) * (kept**2).sum(axis=0)
    return np.minimum(above / np.maximum(below, 1e-300), 1.0)
