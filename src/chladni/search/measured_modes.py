"""Modes of the test, their partners in every deck, and the damping they lend a model's modes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..dynamics.modes import ModalModel
from ..ema.correlation import mac
from ..ema.mode_pairing import LEAST_CHANNELS, ModePairs, pair
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import Modelled
from ..inference.pole_data import Poles
from ..inference.result import FrequencyError, FrequencyRow
from .measured_frequencies import significant
from .question import Prepared
from .written_scores import seen

BEYOND = 2.0  # times the highest frequency of the test: as far as a partner is looked for
_LEAST = 0.02  # of its lowest: modes below are rigid motions


@dataclass(frozen=True, eq=False)
class MeasuredModes:
    """Frequency, damping and shape of each mode, identified or given as a table."""

    frequency: np.ndarray  # (r,) [Hz]
    damping: np.ndarray | None = None  # (r,) ratios, nan where a table has none
    # (n_out, r) real, of any scale; None where there are too few sensors
    shapes: np.ndarray | None = None

    def near(self, model: Modelled) -> ModalModel:
        """The modes of a model among which partners are looked for."""
        modes = model.up_to(BEYOND * float(self.frequency.max()))
        return modes.sel(modes.frequency > _LEAST * float(self.frequency.min()))

    def mac(self, outputs: MeasuredDofs, model: Modelled, modes: ModalModel) -> np.ndarray | None:
        """MAC (m, r) of a model's modes and these; None without shapes."""
        if self.shapes is None:
            return None
        return mac(outputs.rows(model.structure) @ modes.shapes, self.shapes)

    def pairs(self, outputs: MeasuredDofs, model: Modelled, modes: ModalModel) -> ModePairs:
        """Partners among the modes of a model."""
        return pair(modes.frequency, self.frequency, self.mac(outputs, model, modes))

    def damping_of(self, outputs: MeasuredDofs, model: Modelled, other: float) -> np.ndarray:
        """Modal damping (m,) with which the model's modes are damped as their partners are.

        ζ_r less diag Φᵀ(ωV + K_loss)Φ / 2ω², which the model's own dashpots and loss factors add;
        ``other`` where a mode has no partner.
        """
        damping = np.full(len(model.modes), other)
        if self.damping is None or not len(self.frequency):
            return damping
        s, modes = model.structure, self.near(model)
        if not len(modes):
            return damping
        found = self.pairs(outputs, model, modes)
        phi, omega = modes.shapes[:, found.model], 2 * np.pi * modes.frequency[found.model]
        loss = sp.csr_array(s.hysteretic().K.imag)
        own = np.einsum("ir,ir->r", phi, (s.system.V @ phi) * omega + loss @ phi) / (2 * omega**2)
        first = int(np.searchsorted(model.modes.frequency, modes.frequency[0]))
        seen = self.damping[found.test] - own
        damping[first + found.model] = np.where(np.isnan(seen), other, np.maximum(seen, 0.0))
        return damping


def measured_modes(prepared: Prepared) -> MeasuredModes:
    """Modes that the test shows beyond doubt; of a table all of them."""
    if isinstance(prepared.score, Poles):
        f, shapes = prepared.score.frequency, prepared.score.shapes
        return MeasuredModes(f, prepared.damping, None if shapes is None else shapes.values.T)
    found = prepared.identified
    assert found is not None
    keep = significant(found, *found.band) & (found.damping < 0.05)
    if found.residues.shape[1] < LEAST_CHANNELS:
        return MeasuredModes(found.frequency[keep], found.damping[keep])
    every = found.residues[keep]
    strongest = np.linalg.norm(every, axis=1).argmax(axis=1)
    residues = every[np.arange(len(every)), :, strongest]
    turn = np.exp(-0.5j * np.angle((residues**2).sum(axis=1)))
    shapes = (residues * turn[:, None]).real.T
    return MeasuredModes(found.frequency[keep], found.damping[keep], shapes)


def frequency_rows(
    prepared: Prepared, test: MeasuredModes, stages: Sequence[tuple[str, Modelled]],
    real: np.ndarray | None = None,
) -> tuple[FrequencyRow, ...]:  # fmt: skip
    """Identified frequencies and those of every stage ("before", "calibrated", "after")."""
    known = np.full(len(test.frequency), np.nan) if test.damping is None else test.damping
    rows = [
        FrequencyRow(f, damping=None if np.isnan(zeta) else zeta)
        for f, zeta in zip(test.frequency.tolist(), known.tolist(), strict=True)
    ]
    for name, model in stages if rows else ():
        modes = test.near(model)
        at, value = _paired(prepared, model, modes, test, real)
        for k in np.flatnonzero(at >= 0):
            found: dict[str, Any] = {f"{name}_hz": float(modes.frequency[at[k]])}
            found[f"mac_{name}"] = None if np.isnan(value[k]) else float(value[k])
            rows[k] = replace(rows[k], **found)
    return tuple(rows)


def _paired(
    prepared: Prepared, model: Modelled, modes: ModalModel, test: MeasuredModes,
    real: np.ndarray | None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Model mode of every test mode (-1: none) and their MAC (n,)."""
    n, question = len(test.frequency), prepared.question
    at, value = np.full(n, -1), np.full(n, np.nan)
    if not isinstance(prepared.score, Poles) or test.shapes is not None:
        pairs = test.pairs(question.outputs, model, modes)
        at[pairs.test], value[pairs.test] = pairs.model, pairs.mac
        return at, value
    only = Modelled(model.structure, modes, model.band)
    score, state = seen(question, prepared.score, only, prepared.problem.setup.f_max)
    assert isinstance(score, Poles)
    return score.forced(state, np.ones(n, bool) if real is None else real)[1], value


def frequency_error(rows: Sequence[FrequencyRow]) -> FrequencyError:
    """Root mean square of ln(model/test) over the paired frequencies of every deck, in per cent."""

    def rms(name: str) -> float | None:
        both = [(f, r.test_hz) for r in rows if (f := getattr(r, f"{name}_hz"))]
        d = np.log([model / test for model, test in both])
        return float(100 * np.sqrt(np.mean(d**2))) if both else None

    return FrequencyError(*map(rms, ("before", "calibrated", "after")))
