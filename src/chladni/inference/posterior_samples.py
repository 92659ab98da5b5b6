"""Draws from a posterior density by a kept sampler, scaled by the Gaussian of its Hessian.

The walkers move in z, x = x̂ + L z with C = L Lᵀ.  Proposals are z' = √(1-β²) z + β ξ, ξ ~ N(0, I).
They keep N(0, I) as it is.  Where the posterior is this Gaussian, every proposal is accepted in any
dimension (Cotter, Roberts, Stuart and White 2013, Statistical Science 28, 424-446).  The sampler is
emcee (Foreman-Mackey, Hogg, Lang and Goodman 2013, PASP 125, 306-312).
"""

from collections.abc import Callable
from dataclasses import dataclass
from types import ModuleType

import numpy as np

from ..extensions import optional_package
from ..parallel import in_parallel
from ..progress import Progress, silent

WALKERS = 16
BETAS = (0.2, 0.5, 1.0)  # sizes of the proposals, by turns at random
BLOCK, MOST = 100, 3000  # steps between two looks at the autocorrelation, and at most
ENOUGH = 50.0  # autocorrelation times that a chain must be long (emcee's advice)
BURN_IN = 5.0  # autocorrelation times that are left out
SEED = 20250103

Proposal = Callable[[np.ndarray, np.random.RandomState], tuple[np.ndarray, np.ndarray]]


@dataclass(frozen=True, eq=False)
class Chains:
    """Draws of all walkers after the burn-in."""

    x: np.ndarray  # (steps, walkers, n)
    autocorrelation_time: np.ndarray  # (n,) steps between independent draws of each unknown
    # steps, discarded: of each walker, and the first of them that are left out
    steps: int
    discarded: int

    @property
    def draws(self) -> np.ndarray:
        """All draws, step by step (steps * walkers, n)."""
        return self.x.reshape(-1, self.x.shape[-1])

    @property
    def effective(self) -> np.ndarray:
        """Number of independent draws that tell as much (n,)."""
        return len(self.draws) / self.autocorrelation_time

    @property
    def converged(self) -> np.ndarray:
        """True where the chains are long against their autocorrelation time (n,)."""
        return self.steps >= ENOUGH * self.autocorrelation_time


def sampler_package() -> ModuleType:
    """The sampler; a :class:`FileError` says that it is not installed."""
    return optional_package("emcee", "'chladni[posterior]'")


def sampled(
    log_density: Callable[[np.ndarray], float], mean: np.ndarray, covariance: np.ndarray,
    progress: Progress = silent, most: int = MOST,
) -> Chains:  # fmt: skip
    """Sample a density until the chains are long against their autocorrelation time.

    Parameters
    ----------
    log_density : x (n,) -> ln p up to a constant; -inf where there is no structure
    mean, covariance : (n,), (n, n)   of the Gaussian that scales the steps
    most : steps of a walker at most
    """
    emcee = sampler_package()
    root = np.linalg.cholesky((covariance + covariance.T) / 2)

    def each(z: np.ndarray) -> np.ndarray:
        return np.array(list(in_parallel(log_density, mean + z @ root.T)))

    z = np.random.default_rng(SEED).normal(size=(WALKERS, len(mean)))
    z[~np.isfinite(each(z))] = 0.0  # the mean is a structure
    moves = [emcee.moves.MHMove(_proposal(beta)) for beta in BETAS]
    sampler = emcee.EnsembleSampler(*z.shape, each, moves=moves, vectorize=True)
    state = emcee.State(z, random_state=np.random.MT19937(SEED).state)
    for done in range(BLOCK, most + 1, BLOCK):
        state = sampler.run_mcmc(state, BLOCK, skip_initial_state_check=True)
        progress("sampling the posterior", done / most)
        x = mean + sampler.get_chain() @ root.T
        found = _chains(x, emcee.autocorr.integrated_time(x, tol=0))
        if found.converged.all():
            break
    return found


def _proposal(beta: float) -> Proposal:
    def proposed(z: np.ndarray, rng: np.random.RandomState) -> tuple[np.ndarray, np.ndarray]:
        """New places, and ln q(z | z') - ln q(z' | z) = (|z'|² - |z|²) / 2."""
        new = np.sqrt(1 - beta**2) * z + beta * rng.standard_normal(z.shape)
        return new, ((new**2).sum(axis=1) - (z**2).sum(axis=1)) / 2

    return proposed


def _chains(x: np.ndarray, tau: np.ndarray) -> Chains:
    """Leave out the burn-in; chains that never moved have no shorter time than their length."""
    tau = np.where(np.isfinite(tau), np.clip(tau, 1.0, len(x)), len(x))
    first = min(int(np.ceil(BURN_IN * tau.max())), len(x) // 2)
    return Chains(x[first:], tau, len(x), first)
