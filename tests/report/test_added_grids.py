"""Pictures of an updated deck whose added effect brought grids of its own."""

from types import SimpleNamespace

import numpy as np

from chladni.fem.modelled import modelled
from chladni.model.added_beams import with_beam_line
from chladni.model.added_points import with_points
from chladni.model.properties import BeamSection, Isotropic
from chladni.report import diagnosis_drawings
from chladni.report.mesh_drawings import mesh_of
from chladni.view.surface import surface
from chladni_specimens import plate

STEEL = Isotropic(E=2.1e11, nu=0.3, rho=7850.0)


def test_modes_are_drawn_on_the_grids_of_the_given_deck(tmp_path, monkeypatch):
    deck = plate(0.4, 0.3, 4, 3, 1e-3)
    grown, (added,) = with_points(deck, np.array([[0.0, 0.0, 0.05]]))
    bar = BeamSection(STEEL, area=1e-5, I1=1e-11, I2=1e-11, J=1e-11)
    grown = with_beam_line(grown, [int(deck.ids[0]), int(grown.ids[added])], bar, name="mast")
    final = modelled(grown, 200.0)
    flexible = final.modes.frequency[final.modes.frequency > 1.0][:2]
    rows = [SimpleNamespace(after_hz=float(f)) for f in flexible]
    result = SimpleNamespace(
        frequencies=rows, models=SimpleNamespace(final=SimpleNamespace(model=final))
    )
    drawn = []
    monkeypatch.setattr(
        diagnosis_drawings.scene,
        "montage",
        lambda path, seen, motion, *rest: drawn.append(motion),
    )
    diagnosis_drawings._montage(result, mesh_of(surface(deck), deck), tmp_path)
    assert drawn[0].shape == (len(deck.points), 3, len(flexible))
    whole = (final.structure.T @ final.modes.shapes).reshape(len(grown.points), 6, -1)
    at = int(np.abs(final.modes.frequency - flexible[0]).argmin())
    np.testing.assert_allclose(drawn[0][:, :, 0], whole[: len(deck.points), :3, at])
