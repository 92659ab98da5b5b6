"""Subject and folder of the thesis retold: decks, sensors and recordings that chapters share."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from chladni.case import Case
from chladni.case.schema import CaseWords
from chladni.dynamics.frf import FRF
from chladni.geometry.formed_mesh import FormedMesh
from chladni.geometry.sampling import nearest_points
from chladni.io.tables.read_tables import read_recordings
from chladni.model.assembly import Assembly
from chladni.workflows.given_case import given_case
from chladni.workflows.working_model import WorkingModel, load
from chladni_bench import TABLE_3, Stage
from chladni_specimens import Skin, TailgateDesign, forming_mesh, tailgate

from .mesh_transfer import rows_of_part
from .thesis_modes import BAND, CORDS

UNITS = "mm-t-s"
DECK, FORMED, SENSORS = "tailgate.bdf", "formed_thickness.k", "sensors.csv"
HUNG = (0.485, 0.940)  # |y|, s of the upper bolt holes, from which the thesis hung it (figure 17)


@dataclass(frozen=True, eq=False)
class ThesisSpecimen:
    """The structure of the story: the engineer's deck, the article, the forming simulation."""

    # deck, article: the article has formed thickness and a hem that holds
    deck: Callable[[], Assembly]
    article: Callable[[], Assembly]
    formed: Callable[[], FormedMesh]
    hangers: Callable[[Assembly], list[int]]  # grids of the article that its cords hold
    # seam, control: parts of adhesive: of the hem, and of a string without a hem ("": none)
    seam: str = "hem adhesive"
    control: str = "middle adhesive"
    # welds, screws: parts ("": none)
    welds: str = "spot welds"
    screws: str = "screws"


def tailgate_story(size: float) -> ThesisSpecimen:
    """The open tailgate of one mesh size [m]; deck and article share the mesh."""
    design = TailgateDesign(size=size)
    return ThesisSpecimen(
        lambda: tailgate(design),
        lambda: tailgate(TailgateDesign(size=size, hem="real", formed=True)),
        lambda: forming_mesh(Skin.of(design), max(5.5e-3, size / 3)),
        lambda article: _upper_holes(article, Skin.of(design)),
    )


def _upper_holes(assembly: Assembly, skin: Skin) -> list[int]:
    """Grids of the inner panel at the upper holes, left and right."""
    y, s = HUNG
    plan = np.array([[y, s], [-y, s]])
    holes = skin.at(np.column_stack([plan, skin.inner(plan)]))
    rows = rows_of_part(assembly, assembly.part("inner"))
    near = rows[nearest_points(assembly.points[rows], holes)]
    return [int(k) for k in assembly.ids[near]]


@dataclass(frozen=True, eq=False)
class Desk:
    """Working place of the chapters."""

    folder: Path  # of decks, recordings and pictures
    specimen: ThesisSpecimen
    seed: int = 1  # of scatter and noise
    # stages, resolution: schedule of the stepped sine, lines of burst random [Hz]
    stages: tuple[Stage, ...] = TABLE_3
    resolution: float = 0.05
    sensors: int = 30  # how many are planned
    effects: tuple[str, ...] = ()  # that the last chapter searches; none: all of the catalogue

    def deck(self, name: str = DECK) -> WorkingModel:
        """Load a deck of the folder."""
        return load(self.folder / name, UNITS)

    def recording(self, article: str) -> FRF:
        """Stepped sine of an article."""
        frf = read_recordings(self.folder / f"sine_{article}.uff")[0].frf
        assert frf is not None
        return frf

    def weight(self) -> float:
        """Weighed mass of tailgate A [kg]."""
        text = (self.folder / "test.json").read_text(encoding="utf-8")
        return float(json.loads(text)["numbers"]["table_4"]["ours_kg"][0])

    def case(self, deck: WorkingModel | str, tested: bool = True, **words: Any) -> Case:
        """Compare a deck with tailgate A, 10 to 195 Hz without the cords, unless words differ.

        Parameters
        ----------
        tested : False for a case without a recording
        """
        model = self.deck(deck) if isinstance(deck, str) else deck
        given: dict[str, Any] = {"sensors": self.folder / SENSORS}
        if tested:
            given |= {"band": BAND, "exclude": (CORDS,)}
        recording = (self.folder / "sine_A.uff",) if tested else ()
        return given_case(model, recording, cast(CaseWords, {**given, **words}))
