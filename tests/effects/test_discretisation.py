"""The mesh error where a mesh is far too coarse for what was measured, and where it is not."""

import numpy as np

from chladni.effects.discretisation import LIMIT, mesh_errors
from chladni.fem.modelled import modelled
from chladni.io.nastran import assembly, read_deck
from chladni.units import UNITS
from chladni_specimens.plates import plate

TOP = 450.0  # [Hz]; eight flexible modes on eight shells


def test_no_mode_loses_all_its_stiffness():
    """Laid out as linear, twice the change to the finer mesh would leave less than none."""
    coarse = modelled(plate(0.4, 0.3, 4, 2, 1.5e-3), 4 * TOP)
    error, modes = mesh_errors(coarse, TOP)[0], coarse.up_to(1.4 * TOP)
    flexible = modes.frequency > 1.0
    b = error.rows @ modes.shapes[:, flexible]
    lam = (2 * np.pi * modes.frequency[flexible]) ** 2
    change = (b.T * error.change) @ b / np.sqrt(np.outer(lam, lam))
    assert np.linalg.eigvalsh(np.eye(len(lam)) + 2 * change).min() > 0
    assert np.linalg.eigvalsh(change).min() < -0.4  # it is as coarse as that


def test_the_softest_mode_of_a_row_of_bars_goes_to_its_limit(tmp_path):
    """f = (1.8751/L)² √(EI/ρA) / 2π, for a third more than what a mesh twice as fine changes.

    Lumped masses put much of soft modes into stiff ones, whose stiffness is 10⁴ times theirs.
    """
    L, h, n = 0.9, 0.008, 20
    cards = ["SOL 103", "CEND", "SPC = 1", "BEGIN BULK", "MAT1,1,210.+9,,.3,7850."]
    cards += ["PBARL,1,1,,BAR", f"+,.03,{h}", "SPC1,1,123456,1"]
    cards += [f"GRID,{k + 1},,{L * k / n:.6g},0.,0." for k in range(n + 1)]
    cards += [f"CBAR,{k + 1},1,{k + 1},{k + 2},0.,1.,0." for k in range(n)]
    (tmp_path / "bar.bdf").write_text("\n".join([*cards, "ENDDATA"]) + "\n")
    bar = modelled(assembly(read_deck(tmp_path / "bar.bdf"), UNITS["SI"]), 3200.0)
    (error,), lam = mesh_errors(bar, 800.0), (2 * np.pi * bar.modes.frequency) ** 2
    b = error.rows @ bar.modes.shapes
    due = (1.8751 / L) ** 2 * np.sqrt(210e9 * h**2 / 12 / 7850) / (2 * np.pi)

    def away(x):
        K = np.diag(lam) + x * (b.T * error.change) @ b
        return abs(np.sqrt(np.linalg.eigvalsh(K)[0]) / (2 * np.pi) / due - 1)

    assert away(LIMIT) < 0.1 * away(0.0)
    assert away(2.0) < away(0.0)
