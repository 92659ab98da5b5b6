"""Modal identification from responses to an unmeasured force: correlations and free decays.

Let the force be white and stationary in the band. At positive lags, the correlations of responses
then decay as the free structure does: r_ij(τ) = Σ_r c_r exp(p_r τ) + conjugate (NExT: James, Carne
and Lauffer 1995, Int. J. Analytical and Experimental Modal Analysis 10, 260-277). Their one-sided
transform Σ_r c_r / (s - p_r) + ... has the poles of an FRF, and residues of unknown scale.

The transform of a free decay, from its largest amplitude on, has this form without correlation.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..dynamics.frf import FRF
from .setup import Function, Recording
from .signals import window
from .time_record import TimeRecord

FORCES = ("N", "kN", "mN", "lbf", "lb", "kgf")
FEWEST = 64  # samples of a record
ROUNDED = 0.2  # of a step: six digits of the time of a long record
SEGMENTS = 8  # of the record: the lags that are used, and the spread of their correlations
DECAY = 0.01  # of the window at the last lag
ALIKE = -np.log(DECAY) / 2  # lines of one noise: the window's equivalent noise bandwidth
REFERENCES = 3  # responses of most energy
RELEASE = "decay"  # label in place of a force: the block of a free decay
LINES = 2500  # of the band: more take minutes to identify
PIECES, DIED = 32, 0.1  # of a free decay: in its last half no piece is as loud as that of the first


def responses(functions: Sequence[Function]) -> tuple[Function, ...]:
    """Select records of responses of one kind; () if a force was measured too.

    Time histories take precedence over cross and auto spectra.
    """
    if any(f.unit.strip() in FORCES for f in functions):
        return ()
    time = tuple(f for f in functions if f.kind == "time" and not f.input)
    spectral = ("auto spectrum", "cross spectrum", "psd")
    found = time or tuple(f for f in functions if f.kind in spectral)
    alike = tuple(f for f in found if len(f.x) == len(found[0].x) and np.allclose(f.x, found[0].x))
    return alike if alike and len(alike[0].x) > FEWEST and _even(alike[0].x) else ()


def _even(x: np.ndarray) -> bool:
    """Return True if samples are evenly spaced, within the rounding of files with few digits."""
    due = np.linspace(x[0], x[-1], len(x))
    return bool(x[-1] > x[0] and np.abs(x - due).max() < ROUNDED * _step(x))


def _step(x: np.ndarray) -> float:
    return float(x[-1] - x[0]) / (len(x) - 1)


def of_responses(record: TimeRecord) -> tuple[Function, ...]:
    """Time histories of a record without inputs: one a channel and block, block by block."""
    t = np.arange(record.response.shape[2]) / record.rate
    unit = {"receptance": "m", "mobility": "m/s"}.get(record.quantity, "m/s^2")
    return tuple(
        Function("time", label, "", t, y, unit)
        for block in record.response
        for label, y in zip(record.outputs, block, strict=True)
    )


def free_decays(functions: Sequence[Function]) -> bool:
    """Return True if the records are time histories and every block is a free decay."""
    return functions[0].kind == "time" and all(_onset(y) is not None for y in _blocks(functions)[1])


def ringing(r: Recording, band: tuple[float, float] = (0.0, np.inf)) -> Recording:
    """Add the transforms to a recording of free decays only; return any other unchanged.

    Poles are those of an FRF. Residues have neither scale nor drive point: they are mode shapes
    times the initial state of each block.
    """
    used = responses(r.functions)
    if r.frf is not None or r.poles is not None or not used or not free_decays(used):
        return r
    frf, sigma = one_sided(used, band)
    note = (
        f"{r.name}: no force was measured; poles and damping come from its free decays, and "
        "shapes have no scale"
    )
    return replace(r, frf=frf, added_damping=sigma, notes=(*r.notes, note))


def _blocks(functions: Sequence[Function]) -> tuple[tuple[str, ...], np.ndarray]:
    """Labels and time histories (blocks, channels, n): records of one label are blocks.

    If the numbers of blocks differ, the smallest number is used.
    """
    of: dict[str, list[np.ndarray]] = {}
    for f in functions:
        of.setdefault(f.output, []).append(np.real(f.values))
    fewest = min(len(records) for records in of.values())
    return tuple(of), np.array([y[:fewest] for y in of.values()]).swapaxes(0, 1)


def _at_rest(y: np.ndarray) -> np.ndarray:
    """Subtract from channels (..., n) their mean over the last tenth, after the decay."""
    return np.asarray(y - y[..., -max(y.shape[-1] // 10, 1) :].mean(axis=-1, keepdims=True))


def _onset(y: np.ndarray) -> int | None:
    """Return the first sample of the decay of channels (k, n), that of largest power, or None.

    It must lie in the first half. The rest is divided into ``PIECES``. No piece of its last half
    may reach ``DIED`` times the mean square of the first; random forces and repeated hits do.
    """
    y = _at_rest(y)
    power = np.maximum((y**2).mean(axis=1, keepdims=True), np.finfo(float).tiny)
    loud = (y**2 / power).sum(axis=0)
    start = int(loud.argmax())
    n = (len(loud) - start) // PIECES
    if start > len(loud) // 2 or not n:
        return None
    piece = loud[start : start + n * PIECES].reshape(PIECES, n).mean(axis=1)
    return start if piece[PIECES // 2 :].max() < DIED * piece[0] else None


def one_sided(
    functions: Sequence[Function], band: tuple[float, float] = (0.0, np.inf)
) -> tuple[FRF, float]:
    """Transforms of the correlations at positive lags, and the damping σ [1/s] the window adds.

    Parameters
    ----------
    functions : from :func:`responses`
    band : of interest [Hz]; free decays are cut so that it has at most ``LINES`` lines

    The result is called a receptance, for it has that form: Σ R_r / (s - p_r) and residual terms.
    """
    if functions[0].kind == "time":
        return _of_time(functions, band)
    f = functions[0].x  # each spectrum becomes a correlation
    step = _step(f)
    n_f = round(float(f[-1]) / step) + 1
    rows = np.zeros((n_f, len(functions)), complex)
    rows[-len(f) :] = np.array([g.values for g in functions]).T
    r = np.fft.irfft(rows, axis=0)
    lags = len(r) // 2
    rate = len(r) * step
    H = _transformed(r[:lags, :, None], rate)
    names = tuple(f"{g.output} {g.input}".strip() for g in functions)
    made = FRF(H, np.fft.rfftfreq(lags, 1 / rate), names, ("responses",), "receptance")
    return made, -np.log(DECAY) * rate / lags


def _of_time(functions: Sequence[Function], band: tuple[float, float]) -> tuple[FRF, float]:
    """Transform free decays directly, else correlations: mean and variance over segments."""
    labels, blocks = _blocks(functions)
    rate = 1 / _step(functions[0].x)
    starts = [k for y in blocks if (k := _onset(y)) is not None]
    if len(starts) == len(blocks):
        width = min(band[1], rate / 2) - band[0]
        return _of_decays(labels, blocks, starts, rate, round(LINES * rate / max(width, 1e-9)))
    y = np.concatenate(blocks, axis=1)
    y = y - y.mean(axis=1, keepdims=True)
    order = np.argsort(-(y**2).sum(axis=1), kind="stable")[:REFERENCES]
    n = y.shape[1] // SEGMENTS
    lags = n // 2
    parts = []
    for k in range(SEGMENTS):
        Y = np.fft.rfft(y[:, k * n : (k + 1) * n], 2 * n)
        S = np.einsum("of,rf->for", Y, Y[order].conj())
        parts.append(np.fft.irfft(S, axis=0)[:lags] / (n - np.arange(lags))[:, None, None])
    H = np.array([_transformed(r, rate) for r in parts])
    frequency = np.fft.rfftfreq(lags, 1 / rate)
    variance = H.var(axis=0, ddof=1) / SEGMENTS
    smooth = np.maximum(variance, np.median(variance, axis=0))
    made = FRF(
        H.mean(axis=0), frequency, labels, tuple(labels[k] for k in order), "receptance",
        variance=smooth,
    )  # fmt: skip
    return made, -np.log(DECAY) * rate / lags


def _of_decays(
    labels: tuple[str, ...], blocks: np.ndarray, starts: Sequence[int], rate: float, most: int
) -> tuple[FRF, float]:
    """Each block (channels, n) from its start on, ``most`` samples: a reference of its own."""
    n = min(blocks.shape[2] - max(starts), most)
    still = _at_rest(blocks)
    free = np.stack([y[:, k : k + n] for y, k in zip(still, starts, strict=True)], axis=2)
    names = tuple(f"{RELEASE} {k + 1}" for k in range(len(blocks)))
    made = FRF(
        _transformed(np.moveaxis(free, 1, 0), rate), np.fft.rfftfreq(n, 1 / rate), labels, names,
        "receptance",
    )  # fmt: skip
    return made, -np.log(DECAY) * rate / n


def _transformed(r: np.ndarray, rate: float) -> np.ndarray:
    """Σ w(τ) r(τ) exp(-sτ) Δτ of lags (n, ...).

    Noise adds a constant at lag zero, which the residual terms of the fit absorb.
    """
    w = window("exponential", len(r), DECAY)
    return np.fft.rfft(r * w[:, None, None], axis=0) / rate
