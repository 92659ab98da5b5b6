"""A plate whose frequencies are known in closed form but for one factor, as a deck."""

import numpy as np
import pytest
from tests.builders.quick_runs import unrendered_pictures

import chladni
from chladni.io.nastran import write_assembly
from chladni_specimens.plates import plate
from chladni_studies import StudySettings

THREE = ("t=90%:110%", "E=80%:120%", "rho=85%:115%")


@pytest.fixture(scope="module", autouse=True)
def _unrendered_pictures():
    with unrendered_pictures():
        yield


@pytest.fixture(scope="session")
def deck(tmp_path_factory):
    """No two of the first modes of this plate are alike."""
    path = tmp_path_factory.mktemp("study") / "plate.bdf"
    write_assembly(plate(0.3, 0.22, 4, 4, 1e-3), path)
    return path


@pytest.fixture(scope="session")
def model(deck):
    return chladni.load(deck, "SI")


@pytest.fixture(scope="session")
def three(model):
    """t, E and rho of the plate in a small space-filling study."""
    return chladni.study(model, THREE, StudySettings(samples=24, modes=4))


def ratio(found, k=1):
    """Frequency of a mode over the deck's own, every sample."""
    return found.column(f"f{k}_hz") / found.nominal[f"f{k}_hz"]


def thin_plate(found):
    """What theory says of that ratio: t √(E / ρ)."""
    t, E, rho = (
        found.column(n) / v.nominal for n, v in zip(found.names, found.varied, strict=True)
    )
    return t * np.sqrt(E / rho)
