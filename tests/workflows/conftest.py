"""A small case: a plate with a mass in one corner, recorded on the model's own responses."""

from dataclasses import replace

import numpy as np
import pytest

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.effects.points import with_masses
from chladni.fem import modelled as fem_modelled
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni_specimens.plates import plate

SENSORS = (2, 4, 7, 18, 30, 43)
CASE = """
[model]
deck = "plate.bdf"
units = "SI"
damping = 0.01
[test]
recordings = ["frf.npz"]
mass = {mass}
[band]
fit = [20.0, {top}]
"""


def write_case(folder, shells, sensors, frequency, top):
    """A plate of so many shells a side with a mass on its last corner, which the deck lacks.

    No two modes of the plate are alike, and none has a node at the shaker.
    """
    deck, corner = plate(0.3, 0.22, shells, shells, 1e-3), (shells + 1) ** 2
    write_assembly(deck, folder / "plate.bdf")
    write_assembly(with_masses(deck, (corner,), 0.02), folder / "article.bdf")
    article = chladni.load(folder / "article.bdf", "SI")
    made = chladni.frf(article, [f"{g}:+Z" for g in sensors], ["2:+Z"], frequency).frfs[0]
    write_npz(folder / "frf.npz", made.to("accelerance"))
    mass = round(chladni.modes(article, 7).mass, 5)
    (folder / "case.toml").write_text(CASE.format(mass=mass, top=top))


@pytest.fixture(scope="session")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("case")
    write_case(folder, 6, SENSORS, np.linspace(15, 200, 900), 170.0)
    return folder


@pytest.fixture(scope="session")
def case(folder):
    return chladni.load_case(folder)


@pytest.fixture(scope="session")
def diagnosis(case):
    """The result, and every system whose modes were solved on the way."""
    solved = []

    def counted(system, *given, **named):
        solved.append(system)
        return normal_modes(system, *given, **named)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(fem_modelled, "normal_modes", counted)
        return chladni.diagnose(case), solved


@pytest.fixture(scope="session")
def diagnosed(diagnosis):
    return diagnosis[0]


@pytest.fixture(scope="session")
def calibrated(case):
    return chladni.calibrate(case)


@pytest.fixture
def without_mass(case):
    """The case, nothing weighed."""
    return replace(case, setup=replace(case.setup, mass=None))
