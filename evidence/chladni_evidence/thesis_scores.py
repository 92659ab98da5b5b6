"""Scores of a model against the recordings: paired modes, MAC, Q, mass, held-out data."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.dynamics.modes import rigid_modes
from chladni.ema.correlation import deviation, mac, quality
from chladni.ema.identification import Identified
from chladni.ema.mode_pairing import pair
from chladni.fem.energy import mass_properties
from chladni.fem.modelled import modelled
from chladni.output import write_npz
from chladni.parallel import one_blas_thread
from chladni.workflows.case_model import DAMPING, model_frf
from chladni.workflows.working_model import WorkingModel

from .thesis_desk import Desk
from .thesis_modes import BAND, CORDS

FIT = (26.0, 195.0)  # [Hz] band of the calibration, section 5.4
BEYOND = (200.0, 300.0)  # [Hz] never fitted
SOLVED = 600.0  # [Hz] modes of a model; its static residual stands for the rest
NEAR = 0.25  # largest relative difference of the frequencies of a pair
MODES_A = "modes_A.npz"


@dataclass(frozen=True, eq=False)
class ModelScore:
    """A model against the test."""

    name: str  # of the model
    mass: float  # without sensors [kg]
    # Q, fit: mean over channels and lines of tailgate A, 10 to 195 and 26 to 195 Hz
    Q: float
    fit: float
    summed: float  # Σ over channels of the mean over lines, 10 to 195 Hz
    # other, beyond: Q of tailgates B and C, 26 to 195 Hz; of A, 200 to 300 Hz (none of them fitted)
    other: float
    beyond: float
    # test, model, mac: (r,) of the modes of A; nan where the model has no partner
    test: np.ndarray
    model: np.ndarray
    mac: np.ndarray
    alone: np.ndarray  # frequencies of the model's modes below 195 Hz without partner [Hz]

    @property
    def error(self) -> float:
        """Mean absolute difference of the paired frequencies, relative to the test."""
        return float(np.nanmean(np.abs(self.model / self.test - 1)))

    @property
    def numbers(self) -> dict[str, Any]:
        """All fields for JSON."""
        return {**vars(self), "mean_frequency_error": self.error}


def read_score(data: Mapping[str, Any]) -> ModelScore:
    """A score from its numbers in JSON."""
    values = {name: data[name] for name in ModelScore.__dataclass_fields__}
    for name in ("test", "model", "mac", "alone"):
        values[name] = np.array(values[name], dtype=float)
    return ModelScore(**values)


def keep_modes(folder: Path, modes: Identified, shapes: np.ndarray) -> None:
    """Store the modes of tailgate A for the chapters that compare models with them."""
    write_npz(folder / MODES_A, frequency=modes.frequency, damping=modes.damping, shapes=shapes)


@one_blas_thread()
def scored_model(desk: Desk, name: str, model: WorkingModel) -> ModelScore:
    """Solve a model, pair its modes with those of tailgate A, and score its responses."""
    case = desk.case(model)
    made = modelled(case.tested(case.assembly), SOLVED)
    with np.load(desk.folder / MODES_A, allow_pickle=False) as held:
        test, psi = held["frequency"], held["shapes"]
    elastic = np.flatnonzero(~rigid_modes(made.modes) & (made.modes.frequency < 1.3 * BAND[1]))
    near = made.modes.sel(elastic)
    phi = case.outputs.rows(made.structure) @ near.shapes
    M = mac(phi, psi)
    pairs = pair(near.frequency, test, M, farthest=NEAR)
    partner, alike = np.full((2, len(test)), np.nan)
    partner[pairs.test], alike[pairs.test] = near.frequency[pairs.model], pairs.mac
    below = near.frequency < BAND[1]
    alone = np.setdiff1d(np.flatnonzero(below), pairs.model)
    first, *others = (desk.recording(article) for article in "ABC")
    seen = case.frfs[0].sel(band=(BAND[0], BEYOND[1]))
    H = model_frf(case, made, case.damping or DAMPING, seen)
    write_npz(desk.folder / f"responses_{name}.npz", frequency=H.frequency, values=H.values,
              mac=M[below], modes=near.frequency[below])  # fmt: skip
    whole, channels = band_Q(H, first, BAND), len(H.outputs)
    return ModelScore(
        name, mass_properties(model.assembly)[0], whole, band_Q(H, first, FIT), channels * whole,
        float(np.mean([band_Q(H, other, FIT) for other in others])),
        band_Q(H, first, BEYOND), test, partner, alike, near.frequency[alone],
    )  # fmt: skip


def floor_Q(desk: Desk) -> float:
    """Q of tailgates B and C as models of A, 26 to 195 Hz: articles of one production line."""
    first, *others = (desk.recording(article) for article in "ABC")
    return float(np.mean([band_Q(other, first, FIT) for other in others]))


def band_Q(model: FRF, test: FRF, band: tuple[float, float]) -> float:
    """Mean |δ|² over the lines of a band that both have, without those of the cords."""
    a, b = (f.sel(model.outputs, model.inputs, band) for f in (model, test))
    free = (b.frequency < CORDS[0]) | (b.frequency > CORDS[1])
    return quality(deviation(a, b), b.frequency, (), free[:, None, None].astype(float)).Q
