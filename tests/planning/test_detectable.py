"""Predicted findings: noise hides, sensors find, and a diagnosis names what was predicted."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.recordings import across, noisy

import chladni
from chladni.inference.map_fit import MassMeasurement
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.model.point_masses import with_masses
from chladni.search.question import Question
from chladni_planning.detectable import detectable
from chladni_specimens.plates import plate

MADE = plate(0.3, 0.22, 6, 6, 1e-3)
SENSORS = (2, 4, 7, 18, 30, 43)
PREDICTED = ["point-mass", "stiffness-patch", "thickness-distribution"]


@pytest.fixture(scope="module")
def question():
    mass = MADE.parts[0].section.membrane.rho * 0.3 * 0.22 * 1e-3
    weighed = MassMeasurement(mass, 0.002 * mass)
    return Question(
        MADE, across(MADE, SENSORS), across(MADE, [2]), band=(20.0, 170.0), mass_measurement=weighed
    )


@pytest.fixture(scope="module")
def found(question):
    return detectable(question)


def filled(values):
    return np.where(np.isfinite(values), values, np.inf)


def test_noise_hides(question, found):
    noisy = detectable(question, 0.3)
    for name in ("mass", "softer", "thinner"):
        assert (filled(getattr(noisy, name)) >= filled(getattr(found, name)) * 0.999).all(), name
    assert np.median(filled(noisy.mass)) > 1.2 * np.median(filled(found.mass))


def test_sensors_find(question, found):
    few = detectable(replace(question, outputs=across(MADE, SENSORS[:2])))
    for name in ("mass", "softer", "thinner"):
        assert np.median(filled(getattr(few, name))) > np.median(filled(getattr(found, name))), name


def test_a_mass_is_found_where_the_plate_moves_most(found):
    """A corner moves in every mode of a free plate, the middle in few of them."""
    corner = np.linalg.norm(found.points - MADE.points[MADE.rows([1])], axis=1).argmin()
    middle = np.linalg.norm(found.points - MADE.points.mean(axis=0), axis=1).argmin()
    assert filled(found.mass)[corner] < filled(found.mass)[middle]


def test_thinning_is_told_better_than_softening(found):
    """Bending goes with E and with t³: the same evidence asks about a third of the change."""
    ratio = np.log1p(-found.softer) / np.log1p(-found.thinner)
    assert 1.5 < np.nanmedian(ratio) < 4


def test_what_is_found_is_named_by_a_diagnosis(found, tmp_path):
    """Four times the smallest mass at a place is named there; a quarter of it is not."""
    k = int(np.argsort(filled(found.mass))[len(found.mass) // 2])
    verdicts = []
    for times in (4.0, 0.25):
        article = with_masses(MADE, (int(found.grids[k]),), times * float(found.mass[k]))
        folder = tmp_path / f"{times}"
        result = chladni.diagnose(chladni.load_case(a_case(folder, article)))
        verdicts.append((result.verdict, [e.name for e in result.effects]))
    assert verdicts[0] == ("missing physics", ["point-mass"])
    assert verdicts[1][0] in ("nothing missing", "calibration only")


def a_case(folder, article):
    """The article's own responses with 1 % of noise, its deck without the mass, three families."""
    folder.mkdir()
    write_assembly(MADE, folder / "plate.bdf")
    model = chladni.load(write_assembly(article, folder / "article.bdf"), "SI")
    H = model.frf([f"{g}:+Z" for g in SENSORS], "2:+Z", np.linspace(15, 180, 250))
    write_npz(folder / "frf.npz", replace(H, values=noisy(H.values, 0.01, 500)))
    mass = chladni.modes(model, 7).mass
    (folder / "case.toml").write_text(
        '[model]\ndeck = "plate.bdf"\nunits = "SI"\n[test]\nrecordings = ["frf.npz"]\n'
        f"mass = {mass:.5f}\n[band]\nfit = [20.0, 170.0]\n[search]\neffects = {PREDICTED}\n"
    )
    return folder
