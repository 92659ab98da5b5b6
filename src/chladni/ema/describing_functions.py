"""Describing functions: the complex stiffness a nonlinear element has at an amplitude.

For x = A cos θ, the force of an element has the first harmonic A (κ' cos θ - κ'' sin θ). Here
κ'(A) = (1/πA) ∮ f cos θ dθ and κ''(A) = -(1/πA) ∮ f sin θ dθ. It dissipates π A² κ'' per cycle.
Gelb and Vander Velde (1968), Multiple-Input Describing Functions; Worden and Tomlinson (2001),
Nonlinearity in Structural Dynamics, chapter 3.
"""

import numpy as np
from scipy.special import gamma


def cubic(A: np.ndarray, k3: float) -> np.ndarray:
    """κ = 3/4 k3 A² of a spring with f = k3 x³."""
    return 0.75 * k3 * A**2 + 0j


def gap_spring(A: np.ndarray, k: float, gap: float) -> np.ndarray:
    """κ = k (1 - 2/π (asin u + u √(1 - u²))), u = gap/A, of a spring with play ±gap, 0 within."""
    u = np.minimum(gap / A, 1.0)
    return k * (1 - 2 / np.pi * (np.arcsin(u) + u * np.sqrt(1 - u**2))) + 0j


def slider(A: np.ndarray, k: float, slip: float) -> np.ndarray:
    """κ of a spring k in series with Coulomb friction that slides from x = slip on (Jenkins).

    κ' = k/π (ψ - sin 2ψ / 2), κ'' = k/π sin² ψ with cos ψ = 1 - 2 slip/A. Before sliding, κ = k.
    With sliding, a cycle dissipates 4 k slip (A - slip) (Jenkins 1962; k slip is μN).
    """
    psi = np.arccos(1 - 2 * np.minimum(slip / A, 1.0))
    return k / np.pi * (psi - np.sin(2 * psi) / 2 + 1j * np.sin(psi) ** 2)


def micro_slip(A: np.ndarray, c: float, n: float) -> np.ndarray:
    """κ = -c Aⁿ (8/π W (n+1)/(n+2) - 4i/π n/(n+2)), the effect of micro-slip on a joint.

    The force of the backbone is that of the stuck joint less c x^(n+1); loops follow Masing's rule.
    W is Wallis' integral of sin^(2n+2) over a quarter turn. Sliders whose slip has a power-law
    density give n = χ + 1, 0 < n <= 1 (Segalman 2005, J. Applied Mechanics 72, four-parameter Iwan
    model below macro-slip). Joints whose contact opens in motion can have a larger n.
    """
    m = 2 * n + 2
    wallis = np.sqrt(np.pi) / 2 * gamma((m + 1) / 2) / gamma(m / 2 + 1)
    lost = 8 / np.pi * wallis * (n + 1) / (n + 2)
    return c * A**n * (-lost + 4j / np.pi * n / (n + 2))


def drag(A: np.ndarray, b: float, n: float) -> np.ndarray:
    """κ = i b Aⁿ: loss that grows with amplitude and no change of stiffness (n = 1: air drag)."""
    return 1j * b * A**n
