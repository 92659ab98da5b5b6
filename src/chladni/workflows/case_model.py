"""The model of a case seen through its sensors: rows, responses, places of the test."""

from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp

from ..case import Case
from ..dynamics.coupled import coupled_receptance
from ..dynamics.frf import FRF, residual_flexibility, residual_shift
from ..fem.measured_dofs import MeasuredDofs
from ..fem.modelled import Modelled

if TYPE_CHECKING:
    from ..view.annotations import Marker

DAMPING = 0.01  # where neither case nor test says
REACH = 3.0  # times the band: the two-term residual is then right to (1/3)⁴ of itself


def model_frf(case: Case, model: Modelled, damping: float | np.ndarray, test: FRF) -> FRF:
    """The model's responses on the lines, labels and quantity of a recording.

    Modes up to ``REACH`` times the highest line, the static rest of the others. ``damping`` is one
    ratio, or one of each mode.
    """
    s, f = model.structure, test.frequency
    H = receptances(model, damping, case.outputs.rows(s), case.inputs.loads(s), f)
    if not case.inputs.base.any():
        return FRF(H, f, test.outputs, test.inputs).to(test.quantity)
    with_base = case.outputs.moved_with_base(case.inputs)
    T = with_base - (2 * np.pi * f)[:, None, None] ** 2 * H
    return FRF(T, f, test.outputs, test.inputs, "transmissibility")


def receptances(
    model: Modelled, damping: float | np.ndarray, outputs: sp.csr_array, inputs: sp.csr_array,
    frequency: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Modal superposition and the static rest (n_f, n_out, n_in); rows over the free dofs."""
    s, modal = model.structure, model.modes.with_damping(damping)
    pick, load = outputs.T.toarray(), inputs.T.toarray()
    shift = residual_shift(modal, frequency[-1])
    rest = residual_flexibility(s.system, modal, pick, load, shift=shift)
    phi_o, phi_i = pick.T @ modal.shapes, load.T @ modal.shapes
    loss = sp.csr_array(s.hysteretic().K.imag)
    return coupled_receptance(
        modal, phi_o, phi_i, frequency, V=s.system.V, loss=loss, residual=rest
    )


def cords(case: Case) -> list["Marker"]:
    """Hangers for a picture: places without a direction."""
    from ..view.annotations import Marker

    places = case.assembly.points[case.assembly.rows(list(case.setup.hangers))].tolist()
    return [Marker((x[0], x[1], x[2]), (0.0, 0.0, 0.0)) for x in places]


def markers(dofs: MeasuredDofs) -> list["Marker"]:
    """Sensors and shakers for a picture; the base has no place."""
    from ..view.annotations import Marker

    return [
        Marker((x[0], x[1], x[2]), (n[0], n[1], n[2]), text)
        for x, n, text, base in zip(
            dofs.points.tolist(),
            dofs.directions.tolist(),
            dofs.labels,
            dofs.base,
            strict=True,
        )
        if not base
    ]
