"""A spinning part on a plate: named and placed; damping in one place is no spinning part."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.plate_recordings import DECK, SENSORS, SHAKERS, a_case, at, labels
from tests.builders.recordings import noisy

import chladni
from chladni.dynamics.coupled import coupled_receptance
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import FRF, residual_flexibility
from chladni.effects.rotating_part import RotatingPart, spinning, with_rotor
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.model.assembly import Scalars
from chladni.reduced.reduced_model import evaluate
from chladni.report.next_steps import next_steps
from chladni_specimens.plates import plate

PLACE, MOMENTUM, DASHPOT = (0.15, 0.1467), 0.02, 6.0  # [m], [kg m²/s], [N s/m]
TRIED = ("rotating-part", "point-mass", "extra-support")


def article(kind):
    """A plate of a finer mesh, with a wheel or with a dashpot to ground."""
    made = plate(0.3, 0.22, 12, 12, 1.015e-3)
    (grid,) = at(made, [PLACE])
    if kind == "wheel":
        return with_rotor(made, grid, np.array([0.0, 0.0, MOMENTUM]))
    ends = np.array([[made.rows([grid])[0], -1]])
    pot = Scalars(np.array([1]), ends, np.array([[3, 3]]), np.array([DASHPOT]), np.zeros(1))
    return replace(made, dampers=pot)


def diagnosed(folder, kind):
    """The diagnosis of accelerances with uneven modal damping and 0.5 % noise."""
    made, up = article(kind), np.array([[0.0, 0.0, 1.0]])
    built = structure(made)
    modes = normal_modes(built.system, 60)
    uneven = 0.008 * np.exp(0.2 * np.random.default_rng(1).normal(size=60))
    modes = replace(modes, damping=uneven)
    felt, driven = (
        built.along(np.array(at(made, p)), np.repeat(up, len(p), axis=0))
        for p in (SENSORS, SHAKERS[:1])
    )
    rest = residual_flexibility(built.system, modes, felt.toarray().T, driven.toarray().T)
    f, V = np.linspace(15, 230, 900), built.system.V
    H = coupled_receptance(modes, felt @ modes.shapes, driven @ modes.shapes, f, V=V, residual=rest)
    ends = labels(DECK, SENSORS), labels(DECK, SHAKERS[:1])
    frf = FRF(H, f, *ends).to("accelerance")
    write_npz(folder / "frf.npz", replace(frf, values=noisy(frf.values, 0.005, 1)))
    weight = round(mass_properties(made)[0], 5)
    return chladni.diagnose(a_case(folder, weight, {"file": "frf.npz"}, tried=TRIED))


def test_a_wheel_is_named_and_placed(tmp_path):
    result = diagnosed(tmp_path, "wheel")
    assert result.verdict == "missing physics"
    (effect,) = result.effects
    assert effect.name == "rotating-part"
    assert np.linalg.norm(np.subtract(effect.where.point_m[:2], PLACE)) < 0.01
    assert "about (" in effect.where.text
    (h,) = effect.parameters
    assert h.low < MOMENTUM < h.high
    assert h.high - h.low < MOMENTUM
    assert effect.written == ()
    steps = " ".join(next_steps(result))
    assert "with the part at rest" in steps
    assert "it contains the change" not in steps


def test_damping_in_one_place_is_no_spinning_part(tmp_path):
    result = diagnosed(tmp_path, "dashpot")
    assert result.effects == ()
    assert result.verdict == "not in catalogue"
    first = next_steps(result)[0]
    assert "damping in one place" in first
    assert " Hz " in first


def test_no_card_is_written_for_it(tmp_path):
    """A rotor is refused: a deck without it would be another structure."""
    with pytest.raises(chladni.ChladniError, match="spinning part"):
        write_assembly(article("wheel"), tmp_path / "wheel.bdf")


@pytest.mark.parametrize("grid", [1190, 1310])
def test_a_scan_finds_place_and_momentum(grounds, grid):
    """Responses of the model itself with a weak wheel: the scan is linear in h."""
    ground = grounds("plate")
    problem, where = ground.by_responses.problem, ground.by_responses.where
    wheel = RotatingPart.near(where, where.grids.position(grid))
    x = np.array([0.0, 0.0, 0.0, 0.0, 0.02])
    state = evaluate(problem.reduced.model, [wheel], x)
    data = replace(problem.data, values=problem.data.model(state), sensors=None)
    context = replace(ground.by_responses, problem=replace(problem, data=data))
    best = min(spinning(context), key=lambda c: abs(c.effect.grids[0] - grid))
    assert best.effect.grids == (grid,)
    assert best.effect.momentum(best.start)[2] == pytest.approx(wheel.momentum(x)[2], rel=0.1)
