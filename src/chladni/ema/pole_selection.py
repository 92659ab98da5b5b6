"""Which poles a recording supports: order sweep, clusters, adding and deleting by χ².

Sweep of orders and stable clusters: Van der Auweraer and Peeters (2004), J. Mech. Eng. 50(3);
adding and deleting by the fall of χ² against its cost in parameters.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from .pole_fitting import (
    PoleData,
    PoleFit,
    PoleSystem,
    bounded,
    noise_left,
    polish,
    relocated,
    solve,
    stacked,
)

ORDERS = (6, 10, 15, 22, 31, 42, 56)
_VF_STEPS = 6
_CLEAR = 10.0  # times its noise: a channel that is less has little to say
BEYOND = 1.3  # as far outside the band a pole may stand for what rings there


@dataclass(frozen=True, eq=False)
class Sweep:
    """Poles of every order tried."""

    order: np.ndarray  # (k,) int; number of pole pairs of the fit each pole comes from
    poles: np.ndarray  # (k,) complex; scaled as the data
    delta_chi2: np.ndarray  # (k,) rise of χ² without the pole
    orders: np.ndarray  # (n_orders,) int


@dataclass(frozen=True, eq=False)
class Rule:
    """Criterion by which a pole justifies its parameters."""

    channels: int
    lines: int
    noise: float = 1.0  # χ² per degree of freedom that counts as noise
    largest: float = 0.1  # damping ratio of the most damped pole
    factor: float = 2.5
    twin: float = 6.0

    @property
    def price(self) -> float:
        """Fall of χ² a pole must bring: 2.5 for each parameter and 4 ln(lines) for the search."""
        parameters = 2 * self.channels + 2
        return self.noise * (self.factor * parameters + 4 * np.log(self.lines))

    def after(self, data: PoleData, fit: PoleFit) -> Self:
        """Rule with the misfit of this fit as noise: a systematic error justifies no poles."""
        return replace(self, noise=max(self.noise * shared_noise(fit.e), noise_left(data, fit)))


def shared_noise(e: np.ndarray) -> float:
    """Return n Σ λ² / (Σ λ)² of the channels' covariance, λ its eigenvalues; 1 if independent.

    χ² that one pole removes from noise is Σ λ χ²_2.  Noise of the force is in all channels, so that
    a single line may be off in all of them and look like a very sharp mode.  The residual ``e``
    (n_f, n) has ‖C‖² too large by (tr C)² / n_f, which is subtracted.
    """
    n_f, n = e.shape
    C = e.conj().T @ e
    trace = max(float(np.trace(C).real), 1e-300)
    return max(1.0, n * (float(np.vdot(C, C).real) / trace**2 - 1 / n_f))


def compressed(data: PoleData, most: int = 8) -> PoleData:
    """Form at most ``most`` real combinations of the channels, with the same line weights for all.

    Channels are scaled to one and every line to the rms over channels, so that small and large
    responses count equally. A channel with little more than noise is not amplified to that level.
    """
    used = data.w > 0
    noise = np.where(used, 2 / np.where(used, data.w, 1.0) ** 2, 0.0).mean(axis=0)
    scale = np.sqrt(np.maximum((np.abs(data.y) ** 2).mean(axis=0), _CLEAR**2 * noise))
    y = np.where(used, data.y, 0) / np.maximum(scale, 1e-300)
    g = 1 / np.sqrt(np.maximum((np.abs(y) ** 2).mean(axis=1), 1e-12))
    _, _, V = np.linalg.svd(stacked(g[:, None] * y), full_matrices=False)
    k = min(most, len(V))
    g = np.where(used.any(axis=1), g, 0.0)
    return PoleData(data.s, y @ V[:k].T, np.repeat(g[:, None], k, axis=1), data.q)


def swept(data: PoleData, orders: tuple[int, ...] = ORDERS, largest: float = 0.1) -> Sweep:
    """Fit by vector fitting at increasing order, until χ² falls by less than the poles cost."""
    small = compressed(data)
    f = np.abs(data.s)
    order: list[int] = []
    poles: list[complex] = []
    delta_chi2: list[float] = []
    chi: list[float] = []
    done: list[int] = []
    best = np.inf
    for n in orders:
        if n > len(f) // 6 and done:
            break
        n = min(n, max(2, len(f) // 6))
        p = np.quantile(f, (np.arange(n) + 0.5) / n) * (-0.01 + 1j)
        for _ in range(_VF_STEPS):
            p = relocated(small, p)
        fit, _ = solve(data, bounded(p, 10 * largest))
        order += [n] * len(p)
        poles += list(fit.p)
        delta_chi2 += list(fit.delta_chi2)
        done.append(n)
        chi.append(float(np.sqrt(noise_left(data, fit))))
        score = fit.chi2 + 2 * (fit.x.size + 2 * len(p))
        if score > best and len(done) > 2 and chi[-1] < 1.2 * min(chi):
            break
        best = min(best, score)
    return Sweep(np.array(order), np.array(poles), np.array(delta_chi2), np.array(done))


def clusters(sweep: Sweep, among: np.ndarray) -> list[np.ndarray]:
    """Group poles of different orders that agree: one index array per cluster, by falling order.

    Each leading pole takes the nearest of every other order that lies within the sum of the two
    half bandwidths.
    """
    p, order = sweep.poles, sweep.order
    free = among.copy()
    found = []
    for k in np.argsort(-order, kind="stable"):
        if not free[k]:
            continue
        reach = np.maximum(np.abs(p.real) + abs(p[k].real), 1e-4 * np.abs(p))
        near = np.flatnonzero(free & (np.abs(p - p[k]) < reach))
        each = [min(near[order[near] == n], key=lambda i: abs(p[i] - p[k])) for n in {*order[near]}]
        free[each] = False
        found.append(np.array(each))
    return found


def start(data: PoleData, sweep: Sweep, rule: Rule) -> np.ndarray:
    """Select starting poles: significant ones of the highest order, clusters of three orders."""
    p, richest = sweep.poles, sweep.orders.max()
    low, high = 0.9 * float(np.abs(data.s).min()), 1.1 * float(np.abs(data.s).max())
    fits = (low < np.abs(p)) & (np.abs(p) < high) & (sweep.delta_chi2 > rule.price)
    fits &= -p.real / np.abs(p) < rule.largest
    leading = [g for g in clusters(sweep, fits) if sweep.order[g[0]] == richest or len(g) > 2]
    chosen = p[[g[0] for g in leading]]
    small = compressed(data)
    for _ in range(_VF_STEPS if len(chosen) else 0):
        chosen = relocated(small, chosen)
    return chosen


def settled(
    data: PoleData, p: np.ndarray, rule: Rule, rounds: int = 40
) -> tuple[PoleFit, PoleSystem]:
    """Polish a little and remove insignificant poles, in turn, until neither changes the fit.

    A pole is insignificant if its removal raises χ² by less than its price. A pole is not a mode
    if it is more than three tenths outside the band or at the damping limit. The same holds inside
    the band if its frequency is less certain than its bandwidth. A pole nearer to the band may
    represent outer modes: many modes above it are not a constant, and their rest would look like
    inner modes.
    """
    fit, slope = polish(data, p, rule.largest, 0)
    for _ in range(rounds):
        before = fit.chi2
        poor = _poor(data, fit, slope, rule.after(data, fit))
        if len(poor):
            fit, slope = polish(data, np.delete(fit.p, poor), rule.largest, 0)
            continue
        fit, slope = polish(data, fit.p, rule.largest, 2, rule.noise)
        poor = _poor(data, fit, slope, rule.after(data, fit))
        if before - fit.chi2 < max(rule.noise, 1e-4 * before) and len(poor) == 0:
            break
    return fit, slope


def paid(data: PoleData, p: np.ndarray, rule: Rule) -> tuple[PoleFit, PoleSystem]:
    """Polish to convergence and remove poles that are no longer significant, the poorest first.

    :func:`settled` stops earlier. There a pole may be slightly off its optimum, so that a second
    pole next to it seems significant too.
    """
    fit, slope = polish(data, p, rule.largest, tol=0.05)
    while len(fit.p) and fit.delta_chi2.min() < rule.after(data, fit).price:
        fit, slope = polish(data, np.delete(fit.p, fit.delta_chi2.argmin()), rule.largest, tol=0.05)
    return fit, slope


def _poor(data: PoleData, fit: PoleFit, slope: PoleSystem, rule: Rule) -> np.ndarray:
    """Select poles to remove together: all insignificant ones, of close neighbours the poorest."""
    low, high = float(np.abs(data.s).min()), float(np.abs(data.s).max())
    size, half = np.abs(fit.p), np.abs(fit.p.real)
    no_mode = (size < low / BEYOND) | (size > BEYOND * high) | (half > 0.98 * rule.largest * size)
    inside = (low <= size) & (size <= high)
    no_mode |= inside & (uncertainty(fit.p, slope, rule.noise)[0] > half)
    delta_chi2 = np.where(no_mode, 0.0, fit.delta_chi2)
    out: list[int] = []
    for k in np.lexsort((fit.delta_chi2, delta_chi2)):
        if delta_chi2[k] >= rule.price:
            break
        if (np.abs(fit.p[out] - fit.p[k]) > 4 * np.minimum(half[out], half[k])).all():
            out.append(int(k))
    return np.array(out, dtype=int)


def uncertainty(p: np.ndarray, slope: PoleSystem, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations of |p| and of ζ from the Gauss-Newton matrix (r,); noise is χ² by dof."""
    C = np.linalg.pinv(slope.H, hermitian=True) * noise
    k = 2 * np.arange(len(p))
    a, b, d = C[k, k], C[k, k + 1], C[k + 1, k + 1]
    size, x, y = np.abs(p), p.real, p.imag
    of_size = x**2 * a + 2 * x * y * b + y**2 * d
    of_zeta = y**4 * a - 2 * x * y**3 * b + x**2 * y**2 * d
    return np.sqrt(np.maximum(of_size, 0)) / size, np.sqrt(np.maximum(of_zeta, 0)) / size**3


def extended(
    data: PoleData, fit: PoleFit, slope: PoleSystem, rule: Rule, tries: int
) -> tuple[PoleFit, PoleSystem]:
    """Add poles where the residual is large, as long as each reduces χ² by its cost."""
    f = np.abs(data.s)
    closed = np.zeros(len(f), bool)
    misses = 0
    for _ in range(tries):
        local = _local(fit)
        local[closed] = 0
        k = int(local.argmax())
        if closed.all() or misses > 3 or local[k] < 1.8 * np.median(local[~closed]):
            break
        better, its_slope = _with_pole(data, fit, f[k], rule) or (fit, slope)
        now = rule.after(data, better)
        if fit.chi2 - better.chi2 > now.price and len(_poor(data, better, its_slope, now)) == 0:
            fit, slope, misses = better, its_slope, 0
        else:
            closed[max(0, k - 4) : k + 5] = True
            misses += 1
    return fit, slope


def with_neighbours(
    data: PoleData,
    fit: PoleFit,
    slope: PoleSystem,
    rule: Rule,
    below: bool = True,
    far: bool = False,
) -> tuple[PoleFit, PoleSystem]:
    """Add a pole beyond each end of the band if it is significant: outer modes are not constant.

    Their residual is large at no single line, so that :func:`extended` does not find it. ``far``:
    the pole may move beyond the limits for a mode, and the search is made at any misfit.
    """
    f, last = np.abs(data.s), len(fit.p)
    for at in (1.12 * float(f.max()), *([float(f.min()) / 1.12] if below else [])):
        if not far and fit.chi2 < data.samples * rule.noise:
            break
        better, its_slope = _with_pole(data, fit, at, rule) or (fit, slope)
        now = rule.after(data, better)
        if fit.chi2 - better.chi2 <= now.price:
            continue
        outside = not f.min() <= np.abs(better.p[-1]) <= f.max()
        allowed = {last} if far and outside else set()
        if set(_poor(data, better, its_slope, now)) <= allowed:
            fit, slope, last = better, its_slope, last + 1
    return fit, slope


def _with_pole(
    data: PoleData, fit: PoleFit, at: float, rule: Rule
) -> tuple[PoleFit, PoleSystem] | None:
    """Fit one more pole near this frequency; return None if a quick test shows too little gain."""
    usual = float(np.median(-fit.p.real / np.abs(fit.p))) if len(fit.p) else 0.01
    looks = []
    for zeta in (0.5 * usual, 2 * usual):
        p = bounded(np.append(fit.p, at * (-zeta + 1j)), rule.largest)
        looks.append(solve(data, p)[0])
    best = min(looks, key=lambda look: look.chi2)
    if fit.chi2 - best.chi2 < 0.3 * rule.after(data, best).price:
        return None
    return polish(data, best.p, rule.largest, 8, rule.noise)


def merge_duplicate_poles(
    data: PoleData, fit: PoleFit, slope: PoleSystem, rule: Rule
) -> tuple[PoleFit, PoleSystem]:
    """Merge twins: two poles within one bandwidth and of the same shape represent one mode.

    Two poles fit a slightly nonlinear or leaky resonance better than one. The first is polished
    alone. The second stays only if it then reduces χ² by ``rule.twin`` times its price and the
    residual about the resonance by 40 %. Two real modes remove nearly all of it.
    """
    refused: set[complex] = set()
    while len(weaker := [k for k in _twins(fit) if complex(fit.p[k]) not in refused]):
        left = np.delete(fit.p, weaker[0])
        alone, its_slope = polish(data, left, rule.largest, 6, rule.noise)
        rise = alone.chi2 - fit.chi2
        about = np.abs(np.abs(data.s) - abs(fit.p[weaker[0]])) < 3 * abs(fit.p[weaker[0]].real)
        rest = max(float((np.abs(alone.e[about]) ** 2).sum()), 1e-300)
        left_over = np.sqrt((np.abs(fit.e[about]) ** 2).sum() / rest)
        if rise < rule.twin * rule.after(data, alone).price or left_over > 0.6:
            fit, slope = alone, its_slope
        else:
            refused.add(complex(fit.p[weaker[0]]))
    return fit, slope


def _twins(fit: PoleFit) -> list[int]:
    """Weaker partners of pairs within a bandwidth with similar residues, weakest first."""
    half, R = np.abs(fit.p.real), fit.residues
    close = np.abs(fit.p[:, None] - fit.p) < 1.5 * np.maximum(half[:, None], half)
    power = (np.abs(R) ** 2).sum(axis=1)
    alike = np.abs(R.conj() @ R.T) ** 2 > 0.8 * power[:, None] * power
    weaker = fit.delta_chi2[:, None] < fit.delta_chi2
    pairs = (close & alike & weaker).any(axis=1)
    return [int(k) for k in np.argsort(fit.delta_chi2) if pairs[k]]


def _local(fit: PoleFit) -> np.ndarray:
    """χ² around each line (n_f,): moving mean of five lines, all channels."""
    return np.convolve((np.abs(fit.e) ** 2).mean(axis=1), np.ones(5) / 5, mode="same")
