"""FRF of few, long, unwindowed records: local polynomials for the FRF and for the leakage.

Pintelon and Schoukens (2012), System Identification, 2nd ed., section 7.2.2 (arbitrary excitation).
"""

import numpy as np

from ..dynamics.frf import FRF
from ..errors import FileError
from .time_record import TimeRecord

ORDER = 2  # of the polynomials
MORE = 4  # lines beyond the unknowns, for the variance


def local_polynomial(record: TimeRecord) -> tuple[FRF, float]:
    """Y(k+r) = Σ_s (g_s r^s) U(k+r) + Σ_s t_s r^s + V by least squares about every line k.

    Each block has a leakage T of its own, the FRF is common to all. Coherence is 1 less the noise
    over the power of the response; the second result is the degrees of freedom of the variance.
    """
    b, n_in, n = record.force.shape
    U, Y = (np.fft.rfft(x) / n for x in (record.force, record.response))
    n_f, unknowns = U.shape[2], (ORDER + 1) * (n_in + b)
    half = max(ORDER + 1, int(np.ceil(((unknowns + MORE) / b - 1) / 2)))
    if n_f < 2 * half + 2:
        raise FileError(f"{n} samples hold {n_f} lines; local polynomials need {2 * half + 2}")
    lines = np.arange(1, n_f)
    centre = np.clip(lines, half + 1, n_f - 1 - half)  # at the ends the window stops moving
    offset = np.arange(-half, half + 1)
    at = centre[:, None] + offset  # (lines, w)
    r = (at - lines[:, None]) / half
    powers = r[:, :, None] ** np.arange(ORDER + 1)  # (lines, w, order + 1)
    K = np.zeros((len(lines), b, len(offset), unknowns), complex)
    for block in range(b):
        driven = U[block][:, at].transpose(1, 2, 0)  # (lines, w, n_in)
        K[:, block, :, : (ORDER + 1) * n_in] = (
            powers[:, :, :, None] * driven[:, :, None, :]
        ).reshape(len(lines), len(offset), -1)
        own = (ORDER + 1) * (n_in + block)
        K[:, block, :, own : own + ORDER + 1] = powers
    K = K.reshape(len(lines), -1, unknowns)
    y = Y[:, :, at].transpose(2, 0, 3, 1).reshape(len(lines), -1, Y.shape[1])
    scale = np.maximum(np.sqrt((np.abs(K) ** 2).sum(axis=1, keepdims=True)), 1e-300)
    Q, R = np.linalg.qr(K / scale)
    x = np.linalg.pinv(R) @ (Q.conj().transpose(0, 2, 1) @ y) / scale.transpose(0, 2, 1)
    freedom = K.shape[1] - unknowns
    noise = (np.abs(y - K @ x) ** 2).sum(axis=1) / freedom  # (lines, n_out)
    root = np.linalg.pinv(R) / scale.transpose(0, 2, 1)
    spread = (np.abs(root) ** 2).sum(axis=2)[:, :n_in]
    H = x[:, :n_in].transpose(0, 2, 1)
    total = np.maximum((np.abs(y) ** 2).mean(axis=1), 1e-300)
    gamma = np.clip(1 - noise / total, 0.0, 1.0)
    frf = FRF(
        H, lines * record.rate / n, record.outputs, record.inputs, record.quantity,
        variance=noise[:, :, None] * spread[:, None, :],
        coherence=np.repeat(gamma[:, :, None], n_in, axis=2),
    )  # fmt: skip
    return frf, float(freedom)
