"""Compare a recording with a state of the reduced model: whitened residuals and their slopes.

:class:`Responses` are the complex log10 deviation of the damping-equalised FRF on s = ω (ζ + i).
This is Abrahamsson and Kammer's equalisation; poles are moved to |p| on both sides. Natural
frequencies alone (:class:`.pole_data.Poles`) have the same interface: residuals of a state, their
slopes, and ``error``, the covariance of errors of form that is still in them.
"""

from dataclasses import dataclass, field, replace
from typing import ClassVar, Literal, Self

import numpy as np

from ..ema.correlation import log10, wrapped
from ..ema.identification import DERIVATIVES
from ..reduced.matrix_slopes import spanned
from ..reduced.matrix_stack import EVERY
from ..reduced.reduced_model import Reduced, State
from .discrepancy import MEDIAN, Discrepancy, Form, discrepancy, form
from .pole_data import Poles
from .sensor_errors import SensorErrors, Whitening, whitening

LN10 = np.log(10.0)
USUAL, BENT = 0.015, 3.0  # δ at which, and how often, terms of second order are counted
WRAPS = 0.4  # relative deviation of H from which its phase may wrap


def rms_over_lines(values: np.ndarray) -> np.ndarray:
    """Root mean square of H over its lines, (n_f, n_out, n_in) -> (n_out, n_in)."""
    return np.asarray(np.sqrt((np.abs(values) ** 2).mean(axis=0)))


@dataclass(frozen=True, eq=False)
class Responses:
    """Damping-equalised FRFs."""

    values: np.ndarray  # (n_f, n_out, n_in) H_X(s), complex
    s: np.ndarray  # (n_f,) [rad/s], complex
    # outputs, inputs: sparse rows (n_out, n), (n_in, n) of the structure
    outputs: object
    inputs: object
    use: np.ndarray  # (n_f, n_out) bool, lines and channels the fit may see
    quantity: str = "accelerance"
    sigma_model: float = 0.003  # sd of log10 H that neither noise nor δ explains
    a: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))  # outputs in the basis
    b: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    # (n_f, n_out, n_in) sd of log10 H of independent samples, spread included
    noise: np.ndarray | None = None
    spread: np.ndarray | None = None  # (n_f, n_out, n_in) sd of log10 H between repeats or articles
    # (n_out, n_in) rms of |H_X| over fitted lines; None: over all lines
    level: np.ndarray | None = None
    bent: np.ndarray | None = None  # sd of log10 H from what errors of form do beyond first order
    error: Discrepancy | None = None  # covariance of the lines and channels in use
    about: State | None = None  # from which the errors of form spread
    direct: np.ndarray | float = 0.0  # (n_out, n_in) rigid motion with a moving base, 0 for forces
    sensors: SensorErrors | None = None  # what sensors and gauges show wrongly by themselves
    known: Whitening | None = None  # of what those errors do to the lines and channels in use

    compared: ClassVar[Literal["responses"]] = "responses"

    @property
    def power(self) -> int:
        """Power of s by which the receptance is multiplied."""
        return DERIVATIVES[self.quantity]

    def rebased(self, model: Reduced) -> Self:
        """Rows of sensors and shakers in the basis of this model."""
        sensors = None if self.sensors is None else self.sensors.rebased(model)
        a, b = model.rows(self.outputs), model.rows(self.inputs)  # type: ignore[arg-type]
        return replace(self, a=a, b=b, sensors=sensors)

    def model(self, state: State) -> np.ndarray:
        """H_A(s) = s^k Σ_r φ_or φ_ir / (λ_r + s²) + what the base carries (n_f, n_out, n_in).

        If effects dissipate, the modes are complex (:mod:`.frequency_dependent_stiffness`), and so
        they are with spinning parts (:mod:`.gyroscopic`).
        """
        return self._measured(self.receptance(state, *self.modal(state)))

    def _measured(self, receptance: np.ndarray) -> np.ndarray:
        """H_A of receptances (..., n_f, n_out, n_in)."""
        return self.s[:, None, None] ** self.power * receptance + self.direct

    def receptance(
        self, state: State, phi_o: np.ndarray, phi_i: np.ndarray, d: np.ndarray,
        s: np.ndarray | None = None,
    ) -> np.ndarray:  # fmt: skip
        """Receptance of the modes of :meth:`modal`, made complex by dissipation; on lines s."""
        s, lost = self.s if s is None else s, state.dissipated
        H = state.between(s, d, phi_o, phi_i)
        return H if lost is None else H + lost.seen(s, d, phi_o, phi_i)

    def modal(self, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """φ_o (n_out, r), φ_i (n_in, r) and D = 1 / (λ + s²) (n_f, r).

        φ_i of a moving base is its load, which depends on the mass of the state.
        """
        d = 1 / (state.lam + self.s[:, None] ** 2)
        phi_o = self.a @ state.phi
        phi_i = self.b @ state.phi if state.drive is None else state.drive
        if state.moved is None:
            return phi_o, phi_i, d
        moved_o, moved_i = self._of_test(state.moved)
        return phi_o + moved_o, phi_i + moved_i if state.drive is None else phi_i, d

    def _of_test(self, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Split an array over all places into outputs and inputs."""
        return places[: len(self.a)], places[len(self.a) :]

    def deviation(self, state: State, receptance: np.ndarray | None = None) -> np.ndarray:
        """δ = log10(H_A / H_X), complex, phase wrapped; of other receptances (..., *H) if given."""
        H = self.model(state) if receptance is None else self._measured(receptance)
        delta = log10(H / self.values)
        return delta if state.offset is None else wrapped(delta + state.offset[:, None])

    def std(self) -> np.ndarray:
        """Standard deviation of δ of each sample, without their dependence."""
        rms = rms_over_lines(self.values) if self.level is None else self.level
        out = self.sigma_model**2 * (1 + (0.6 * rms / np.abs(self.values)) ** 2)
        more = [self.noise, self.bent]
        return np.sqrt(sum((z**2 for z in more if z is not None), out))

    def allowing_errors(self, state: State, delta: float = MEDIAN) -> Self:
        """Return these responses for a model with an error of form of size δ about a state.

        Errors of the sensors are included. Terms of second order have one size in all hypotheses:
        they count as independent, and a smaller δ would gain on every sample.
        """
        plain = self.exactly()
        return replace(plain, bent=plain.curvature(state), about=state)._spread(delta)

    def _spread(self, delta: float) -> Self:
        """Covariance of the lines and channels in use."""
        data = replace(self, known=None, error=None)
        about, errors = self.about, self.sensors
        assert about is not None
        if errors is not None:
            own, common = map(data.stacked, data.sensor_slopes(errors, about, LN10 * data.std()))
            outputs = np.broadcast_to(np.arange(self.use.shape[1]), self.use.shape)[self.use]
            output = np.tile(np.repeat(outputs, self.values.shape[2]), 2)
            data = replace(data, known=whitening(output, own, common))
        W = data.form_slopes(about, form(about, float(self.s.imag.max())))
        return replace(data, error=discrepancy(W).with_delta(delta))

    def form_slopes(self, state: State, about: Form) -> np.ndarray:
        """∂r/∂G and ∂r/∂G' of pairs of modes, times the standard deviation at δ = 1 (n, 2 pairs).

        dH = -s^k a_oᵀ (Λ^½ dG Λ^½ + s² dG') a_i with a = T D φ, T the reference modes' share in
        those of the state.
        """
        i, j = about.pairs.T
        phi_o, phi_i, d = self.modal(state)
        H, sd = self.model(state), self.std()
        T = about.rows @ state.vectors
        a_o = state.between(self.s, d, phi_o, T).transpose(2, 0, 1)
        a_i = state.between(self.s, d, T, phi_i).transpose(1, 0, 2)
        a_o = a_o * (self.s**self.power)[:, None]
        std = np.where(i == j, 0.5, np.sqrt(0.5))  # half, for i = j counts twice below
        root = np.sqrt(about.lam[i] * about.lam[j])
        out = np.empty((2, len(i), *H.shape), complex)
        for p in range(len(phi_i)):
            both = a_o[i] * a_i[j, :, p, None] + a_o[j] * a_i[i, :, p, None]
            both *= -std[:, None, None]
            out[0, ..., p] = root[:, None, None] * both
            out[1, ..., p] = self.s[:, None] ** 2 * both
        out /= H * sd * LN10
        return self.stacked(out.reshape(2 * len(i), *H.shape))

    def curvature(self, state: State) -> np.ndarray:
        """Standard deviation of log10 H beyond what is linear in G (n_f, n_out, n_in).

        For H = H_0 (1 + z) with z of variance σ², ln(1 + z) = z - z²/2. Near a zero of H, where σ
        is large, the logarithm is curved, and beyond σ = 0.4 its phase may wrap. The remaining part
        of the exact response to G is similar along lines and counts ``BENT`` times.
        """
        every = self.only(np.ones(self.use.shape, bool))
        var = (every.form_slopes(state, form(state, float(self.s.imag.max()))) ** 2).sum(axis=1)
        sd = every.std() * LN10 * USUAL
        sigma2 = sd**2 * var.reshape(2, *self.values.shape).sum(axis=0) + self.wrong(state)
        return BENT * sigma2 / (2 * LN10) * (1 + (sigma2 / WRAPS**2) ** 2)

    def sensor_slopes(
        self, errors: SensorErrors, state: State, scale: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Columns d ln H / scale per sd: of each output (5, *H), of the gain of each input."""
        _, phi_i, d = self.modal(state)
        H, out = self.model(state), [errors.gain / scale]
        for modal, with_base in zip(errors.modal, errors.with_base, strict=True):
            G = state.between(self.s, d, modal @ state.phi, phi_i)
            out.append((self.s[:, None, None] ** self.power * G + with_base) / (H * scale))
        return np.stack(out), errors.gain / scale * np.eye(scale.shape[-1])[:, None, None]

    def wrong(self, state: State) -> np.ndarray | float:
        """E|d ln H|² of the independent errors of sensors (n_f, n_out, n_in)."""
        if self.sensors is None:
            return 0.0
        both = self.sensor_slopes(self.sensors, state, np.ones(self.values.shape))
        return np.asarray(sum((np.abs(z) ** 2).sum(axis=0) for z in both))

    def exactly(self) -> Self:
        """Return these responses for a model and a test without errors of form."""
        return replace(self, bent=None, error=None, about=None, known=None)

    def using(self, use: np.ndarray) -> Self:
        """Return other lines and channels, with the same errors of the model's form."""
        data = replace(self, use=use)
        return data if self.error is None else data._spread(self.error.delta)

    def residual(self, state: State, gradient: bool) -> tuple[np.ndarray, np.ndarray]:
        """:meth:`scaled` with the errors of the model's form whitened out."""
        r, J = self.scaled(state, gradient)
        if self.error is None:
            return r, J
        return self.error.whitened(r), self.error.whitened(J) if gradient else J

    def scaled(self, state: State, gradient: bool) -> tuple[np.ndarray, np.ndarray]:
        """δ over its spread on used samples, real and imaginary, sensors' errors whitened out."""
        r = self.stacked(self.deviation(state)[None] / self.std())[:, 0]
        return r, self.scaled_slopes(state) if gradient else np.zeros((len(r), 0))

    def scaled_slopes(self, state: State) -> np.ndarray:
        """The slopes of :meth:`scaled` alone."""
        f, o = np.asarray(self.use.any(axis=1)), np.asarray(self.use.any(axis=0))
        J = self.slopes(state, f, o)
        J /= self.std()[f][:, o]
        return self._stacked(J, self.use[f][:, o])

    def stacked(self, z: np.ndarray) -> np.ndarray:
        """Columns of residuals (n, k) of k complex deviations over their spread (k, n_f, ...)."""
        return self._stacked(z, self.use)

    def _stacked(self, z: np.ndarray, use: np.ndarray) -> np.ndarray:
        """Columns of :meth:`stacked` where z holds some lines and channels; ``use`` is of these."""
        picked = np.moveaxis(z, 0, -1)[use].reshape(use.sum() * z.shape[-1], len(z))
        columns = np.concatenate([picked.real, picked.imag])
        return columns if self.known is None else self.known.whitened(columns)

    def slopes(
        self, state: State, lines: np.ndarray | slice = EVERY, outputs: np.ndarray | slice = EVERY
    ) -> np.ndarray:
        """∂δ/∂x (n_p, n_f, n_out, n_in): dH = -s^k φ_o D ((dK + s² dM) D φ_i - dφ_i), over H ln 10.

        With spinning parts D is A⁻¹ (:mod:`.gyroscopic`).

        Φ D φ_i and s² Φ D φ_i span few vectors; dK and dM multiply these alone. A moving base has
        dφ_i. Shapes that change where they are measured have dφ_o and dφ_i.
        """
        phi_o, phi_i, d = self.modal(state)
        phi_o, d, s = phi_o[outputs], d[lines], self.s[lines]
        direct = np.broadcast_to(self.direct, self.values.shape[1:])[outputs]
        H = self.receptance(state, phi_o, phi_i, d, s) + direct / s[:, None, None] ** self.power
        assert state.dK is not None
        assert state.dM is not None
        out = np.empty((*H.shape, state.dK.count), complex)
        left, right = phi_o * d[:, None], phi_i * d[:, None]  # φ_o D, φ_i D (n_f, ., r)
        if state.spin is not None:
            left = state.spin.passed(s, d, phi_o)
            right = state.spin.reverse.passed(s, d, phi_i)
        q = state.vectors @ right.transpose(1, 2, 0)  # (n_in, m, n_f)
        span, parts = spanned(np.concatenate([*q, *(q * s**2)], axis=1))
        of_K, of_M = np.split(parts.reshape(len(span.T), 2, len(q), -1), 2, axis=1)
        slopes = np.concatenate([state.dK.times(span), state.dM.times(span)], axis=2)
        slopes = slopes.transpose(2, 1, 0).reshape(slopes.shape[2], -1)  # (2k, m n_p)
        real, imag = (part @ state.vectors.T for part in (left.real, left.imag))
        seen = np.block([[real, -imag], [imag, real]])  # products of real numbers are fast
        for j in range(len(phi_i)):
            both = np.concatenate([of_K[:, 0, j], of_M[:, 0, j]]).T
            both = np.stack([both.real, both.imag], axis=1)  # (n_f, 2, 2k)
            W = (both.reshape(-1, len(slopes)) @ slopes).reshape(*seen.shape[::2], -1)
            out[:, :, j].real, out[:, :, j].imag = np.split(-seen @ W, 2, axis=1)
            if state.ddrive is not None:
                out[:, :, j] += np.einsum("for,pr->fop", left, state.ddrive[:, j], optimize=True)
        if state.dissipated is not None:
            for p, lost in state.dissipated.seen_slopes(s, d, phi_o, phi_i):
                out[..., p] += lost
        if state.spin is not None:
            for p, spun in state.spin.seen_slopes(s, left, right):
                out[..., p] += spun
        for p, moved in state.dmoved.items():
            moved_o, moved_i = self._of_test(moved)
            out[..., p] += state.between(s, d, moved_o[outputs], phi_i)
            if state.drive is None:
                out[..., p] += state.between(s, d, phi_o, moved_i)
        out /= H[..., None] * LN10
        if state.doffset is not None:
            out += state.doffset[outputs][:, None]
        return np.moveaxis(out, -1, 0)

    def only(self, use: np.ndarray) -> Self:
        """Return these responses on other lines and channels, without errors of form."""
        return replace(self.exactly(), use=use)

    def Q(self, state: State, use: np.ndarray, real: np.ndarray | None = None) -> float:
        """Mean |δ|² over the lines and channels in use (``real`` is for poles)."""
        if not use.any():
            return float("nan")
        return float(np.mean(np.abs(self.deviation(state)[use]) ** 2))


Data = Responses | Poles
