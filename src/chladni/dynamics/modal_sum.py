"""Sums over modes between many places: the sum over three arrays as one BLAS product."""

import numpy as np

AT_ONCE = 2_000_000  # numbers in memory of the products of left and right


def modal_sum(left: np.ndarray, d: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Σ_r φ_ar D_fr ψ_br (n_f, n_left, n_right).

    Parameters
    ----------
    left, right : φ (n_left, r), ψ (n_right, r)   real, as mass-normalised shapes at places
    d : D (n_f, r)                                complex, as 1 / (λ_r + s²)

    >>> modal_sum(np.eye(1, 2), np.array([[2j, 5.0]]), np.ones((1, 2)))
    array([[[0.+2.j]]])
    """
    (n_left, r), n_f, n_right = left.shape, len(d), len(right)
    of_modes = np.ascontiguousarray(d.T, dtype=complex).view(float)  # real, imaginary by turns
    out = np.empty((n_f, n_left, n_right), complex)
    step = max(1, AT_ONCE // max(1, n_right * r))
    for k in range(0, n_left, step):
        both = left[k : k + step, None] * right
        some = (both.reshape(-1, r) @ of_modes).view(complex)
        out[:, k : k + step] = some.reshape(*both.shape[:2], n_f).transpose(2, 0, 1)
    return out
