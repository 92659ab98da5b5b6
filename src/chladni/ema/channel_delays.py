"""Delays of single channels: linear phase beyond that of real modes.

A normal mode has a real modal constant, whatever the place of the sensor: H_o = Σ a_r g_r(ω) with
real a_r. A channel that comes τ late has H_o exp(-iωτ). The least squares of real constants to
H_o exp(iωτ') are smallest at τ' = τ. The poles come from channels that are consistent by
themselves, because no real mode fits a late one.
"""

import numpy as np

from ..dynamics.frf import FRF
from ..errors import ChladniError
from ..units import number
from .channel_checks import drive_points
from .finding import Check, Finding
from .identification import DERIVATIVES, Identified, identify
from .screening import noise_of
from .screening_lines import screening_lines

CONSISTENT = 3.0  # times the noise: an identification leaves less of channels that belong together
TRIED = 2  # channels whose modes are identified alone
TURNED = 0.1  # rad at the highest line: a smaller delay bends nothing
SURE = 6.0  # standard deviations
BETTER = 4.0  # times less is left unexplained with the delay taken off
EXPLAINED = 0.8  # of the response, then
MODEL = 0.05  # of |H|: what damping that is not proportional and lines between poles leave
FINER = 8  # trial delays in a turn of the highest line
TOGETHER = 256  # trial delays at once


def channel_delays(frf: FRF, found: Identified | None) -> tuple[list[Finding], Check]:
    """Outputs that lag or lead the others.

    Parameters
    ----------
    found : modes of the recording; where they do not explain it, those of one channel are used
    """
    name = "delay of single channels"
    if len(frf.outputs) < 2 or frf.quantity not in DERIVATIVES or found is None:
        return [], Check(name, "needs two outputs and their modes", None)
    poles = _consistent_poles(frf, found)
    if len(poles) == 0:
        return [], Check(name, "no mode is above the noise", None)
    noise = noise_of(frf)
    rows = [_delay(frf, o, poles, noise) for o in range(len(frf.outputs))]
    delay, sd, gain, share = (np.array(v) for v in zip(*rows, strict=True))
    known = (share > EXPLAINED) | (gain > BETTER)
    if known.sum() < 2:
        return [], Check(name, "real modes do not explain the responses", None)
    usual = float(np.median(delay[known])) if known.sum() > 2 else 0.0
    top = 2 * np.pi * float(frf.frequency[-1])
    out = []
    for o, label in enumerate(frf.outputs):
        late = float(delay[o]) - usual
        sure = share[o] > EXPLAINED and gain[o] > BETTER and abs(late) > SURE * sd[o]
        if sure and abs(late) * top > TURNED:
            out.append(_late(label, late, float(sd[o]), float(gain[o])))
    if len(out) == len(frf.outputs) and np.ptp(delay) * top < TURNED:
        out = []  # a delay of the whole chain
    most = float(np.abs(delay[known] - usual).max())
    return out, Check(name, f"at most {1e3 * most:.3g} ms", not out)


def _late(label: str, late: float, sd: float, gain: float) -> Finding:
    text = (
        f"output {label} {'lags' if late > 0 else 'leads'} the others by {1e3 * abs(late):.4g} ms "
        f"(± {1e3 * sd:.2g}): without that delay real modes leave {number(gain, 3)} times less of "
        "its response."
    )
    mend = "shift its signal by that time, or measure again with one clock for all channels"
    return Finding("channel delay", text, "fault", (label,), mend, late)


def _consistent_poles(frf: FRF, found: Identified) -> np.ndarray:
    """Poles within the band of all channels, else of the channel whose own fit leaves least."""
    best = found
    if found.chi > CONSISTENT:
        at_drive = {i for i, _, _ in drive_points(frf)}
        noise = (noise_of(frf) / np.maximum(np.abs(frf.values) ** 2, 1e-300)).mean(axis=2)
        each = np.median(noise, axis=0)
        likely = sorted(range(len(frf.outputs)), key=lambda o: (o not in at_drive, each[o]))
        for o in likely[:TRIED]:
            one = frf.sel(outputs=[frf.outputs[o]])
            try:
                alone = identify(one, found.band, use=screening_lines(one))
            except ChladniError:
                continue
            if alone.order and alone.chi < best.chi:
                best = alone
            if best.chi < CONSISTENT:
                break
    sure = best.frequency_sd < 0.02 * best.frequency
    return np.asarray(best.poles[best.inside & sure])


def _delay(
    frf: FRF, o: int, poles: np.ndarray, noise: np.ndarray
) -> tuple[float, float, float, float]:
    """Delay [s], its sd, unexplained share without over with it, share explained with it."""
    f, H = frf.frequency, frf.values[:, o]
    s = 2j * np.pi * f
    weight = 1 / np.sqrt(noise[:, o] + (MODEL * np.abs(H)) ** 2 + 1e-300)
    G = s[:, None] ** DERIVATIVES[frf.quantity] / np.column_stack(
        [((s[:, None] - poles) * (s[:, None] - poles.conj())), s**2, np.ones_like(s)]
    )
    d = H * weight
    bases = [_basis(G * weight[:, [i]]).conj() * d[:, [i]] for i in range(H.shape[1])]
    product = np.column_stack(bases)  # (n_f, k): its real sum is what a basis vector explains
    trial, E = _on_trials(f, product)
    k = int(np.clip(E.argmax(), 1, len(E) - 2))
    fine = trial[k] + (trial[1] - trial[0]) * np.linspace(-1, 1, 41)
    F = _explained(f, product, fine)
    j = int(np.clip(F.argmax(), 1, len(F) - 2))
    h = fine[1] - fine[0]
    bend = max(-(F[j - 1] - 2 * F[j] + F[j + 1]) / h**2, 1e-300)
    delay = float(fine[j] + (F[j + 1] - F[j - 1]) / (2 * h * bend))
    total = float((np.abs(d) ** 2).sum())
    left = max(total - float(F[j]), 1e-12 * total)
    freedom = max(2 * H.size - product.shape[1] - 1, 1)
    sd = float(np.sqrt(2 * left / freedom / bend))
    without = total - float(_explained(f, product, np.zeros(1))[0])
    return delay, sd, without / left, float(F[j]) / total


def _explained(f: np.ndarray, product: np.ndarray, tau: np.ndarray) -> np.ndarray:
    """Energy that real modes explain of the response with each delay taken off (n,)."""
    turn = np.exp(2j * np.pi * np.multiply.outer(tau, f))
    return np.asarray((((turn @ product).real) ** 2).sum(axis=1))


def _on_trials(f: np.ndarray, product: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Delays up to a quarter of a block, early and late, and what is explained with each (n,)."""
    gap = float(np.median(np.diff(f)))
    index = np.round(f / gap).astype(int)
    if np.abs(f - index * gap).max() < 1e-3 * gap:  # an even grid: a sum over it is an FFT
        n = 2 ** int(np.ceil(np.log2(FINER * (index[-1] + 1))))
        rows = np.zeros((n, product.shape[1]), complex)
        rows[index] = product
        E = ((n * np.fft.ifft(rows, axis=0)).real ** 2).sum(axis=1)
        half = n // 4
        order = np.arange(-half, half + 1)
        return order / (n * gap), np.asarray(E[order])
    step = 1 / (FINER * float(f[-1]))
    half = max(2, int(0.25 / gap / step))
    trial = step * np.arange(-half, half + 1)
    pieces = np.array_split(trial, max(1, len(trial) // TOGETHER))
    return trial, np.concatenate([_explained(f, product, p) for p in pieces])


def _basis(G: np.ndarray) -> np.ndarray:
    """Orthonormal basis over the reals of columns (n, k) complex, as complex columns."""
    real = np.vstack([G.real, G.imag])
    Q, _ = np.linalg.qr(real / np.maximum(np.linalg.norm(real, axis=0), 1e-300))
    return np.asarray(Q[: len(G)] + 1j * Q[len(G) :])
