"""A study against closed forms: f ∝ t √(E/ρ) of a thin plate, its slopes, its Sobol' indices."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.builders.structures import joined

import chladni
from chladni.errors import ChladniError, FileError, LabelError, ModelError
from chladni.io.nastran import write_assembly
from chladni.workflows.loaded_model import Model
from chladni_specimens.plates import plate
from chladni_studies import StudySettings, sample
from chladni_studies.variation import of_parts
from chladni_studies.vary_text import vary_text

from .conftest import THREE, ratio, thin_plate

THIN = 5e-4  # (t/a)² times a few: what transverse shear and rotary inertia add to Kirchhoff's plate


def test_frequencies_are_those_of_a_thin_plate(three):
    for k in range(1, 5):
        np.testing.assert_allclose(ratio(three, k), thin_plate(three), rtol=THIN)
    assert three.column("mac1").min() > 0.999
    mass = three.column("t") * three.column("rho") * 0.3 * 0.22
    np.testing.assert_allclose(three.column("mass_kg"), mass, rtol=1e-9)


def test_log_slopes_are_one_a_half_and_minus_a_half(three):
    for s in three.sensitivities:
        due = [1, 0, 1] if s.result == "mass_kg" else [1, 0.5, -0.5]
        np.testing.assert_allclose(s.log_slope, due, atol=10 * THIN)
        assert s.r2 > 1 - THIN


def test_sobol_indices_are_those_of_a_product(model):
    """Of y = Π g_i(p_i) the shares of the variance follow from each factor's v_i = var g / mean²:
    S_i = v_i / (Π(1 + v) - 1), T_i = v_i Π_{j≠i}(1 + v_j) / (Π(1 + v) - 1) (Sobol' 2001).
    """
    found = chladni.study(model, THREE, StudySettings(samples=170, sampler="saltelli", modes=1))
    assert len(found.rows) == 32 * 5
    s = found.sensitivities[0]
    u = np.linspace(0, 1, 100001)
    factors = (0.9 + 0.2 * u, np.sqrt(0.8 + 0.4 * u), 1 / np.sqrt(0.85 + 0.3 * u))
    v = np.array([g.var() / g.mean() ** 2 for g in factors])
    whole = np.prod(1 + v) - 1
    # SALib's own 95 % intervals, doubled: three of six may lie a little outside of their own
    assert (np.abs(s.first - v / whole) < 2 * s.first_interval).all()
    assert (np.abs(s.total - v * np.prod(1 + v) / (1 + v) / whole) < 2 * s.total_interval).all()
    assert s.first_interval.max() < 0.4


def test_elementary_effects_of_what_is_nearly_linear(model):
    """Over ±1 % f is linear: mu* of a parameter is its slope times its range, sigma nothing."""
    ranges = ("t=99%:101%", "E=99%:101%", "rho=99%:101%")
    found = chladni.study(model, ranges, StudySettings(samples=20, sampler="morris", modes=1))
    s = found.sensitivities[0]
    np.testing.assert_allclose(
        s.mu_star / found.nominal["f1_hz"], [0.02, 0.01, 0.01], rtol=0.03
    )  # the law's curvature over ±1 % is 1 to 2 %
    assert s.sigma.max() < 0.05 * s.mu_star.max()


@pytest.mark.parametrize(
    ("sampler", "asked", "taken"),
    [("sobol", 24, 24), ("lhs", 7, 7), ("grid", 30, 27), ("oat", 10, 10), ("saltelli", 50, 40),
     ("morris", 22, 20)],
)  # fmt: skip
def test_every_sampler_fills_the_ranges(model, sampler, asked, taken):
    settings = StudySettings(samples=asked, sampler=sampler, modes=1, seed=3)
    found, again = (chladni.study(model, THREE, settings) for _ in range(2))
    assert len(found.rows) == taken
    assert (asked == taken) == (not found.notes)
    np.testing.assert_array_equal(found.X, again.X)
    low, high = (np.array([getattr(v, e) for v in found.varied]) for e in ("low", "high"))
    assert (found.X >= low * (1 - 1e-12)).all()
    assert (found.X <= high * (1 + 1e-12)).all()
    if sampler in ("grid", "oat"):
        np.testing.assert_allclose(found.X.min(axis=0), low)
        np.testing.assert_allclose(found.X.max(axis=0), high)
    if sampler == "oat":
        moved = ~np.isclose(found.X, [v.nominal for v in found.varied])
        assert moved.sum(axis=1).max() == 1


def test_a_mode_is_followed_past_another():
    """Two plates that share nothing: thinning one lowers its modes past the other's, alone."""
    one, other = plate(0.3, 0.22, 4, 4, 1e-3), plate(0.3, 0.22, 4, 4, 0.9e-3)
    both = joined(one, replace(other, points=other.points + np.eye(3)[2]))
    made = Model(Path("two plates"), both)
    settings = StudySettings(samples=9, sampler="oat", modes=4)
    found = chladni.study(made, [f"t of {made.assembly.parts[0].name}=60%:140%"], settings)
    ratios = np.stack([ratio(found, k) for k in range(1, 5)])
    own = np.abs(ratios - 1).max(axis=1) > 0.1
    assert own.sum() == 2  # two of the four lowest belong to either plate
    np.testing.assert_allclose(ratios[own], np.tile(found.X[:, 0] / 1e-3, (2, 1)), rtol=1e-3)
    np.testing.assert_allclose(ratios[~own], 1, rtol=1e-6)


def test_modes_that_may_mix_are_not_lost(tmp_path):
    """A square plate has pairs of equal frequency, whose shapes turn freely from run to run."""
    write_assembly(plate(0.3, 0.3, 6, 6, 1e-3), tmp_path / "square.bdf")
    made = chladni.load(tmp_path / "square.bdf", "SI")
    found = chladni.study(made, ["E=50%:150%"], StudySettings(samples=5, modes=9))
    for k in range(1, 10):
        assert found.column(f"mac{k}").min() > 0.99
        np.testing.assert_allclose(ratio(found, k), np.sqrt(found.column("E") / 2.1e11), rtol=1e-6)


def test_a_sample_that_fails_stops_nothing(model, monkeypatch):
    solved = sample.solved

    def fails(model, *given):
        if model.assembly.shells.thickness.max() > 1.05e-3:
            raise ModelError("too thick,\n by decree")
        return solved(model, *given)

    monkeypatch.setattr(sample, "solved", fails)
    found = chladni.study(model, THREE, StudySettings(samples=40, sampler="saltelli", modes=2))
    thick = found.column("t") > 1.05e-3
    assert [k for k, _ in found.failed] == np.flatnonzero(thick).tolist()
    assert {why for _, why in found.failed} == {"too thick, by decree"}
    assert np.isfinite(found.column("f1_hz")[~thick]).all()
    assert found.sensitivities[0].used == (~thick).sum()


def test_a_nominal_that_fails_is_said_before_anything_starts(model, monkeypatch, tmp_path):
    monkeypatch.setattr(sample, "solved", lambda *given: 1 / 0)
    with pytest.raises(FileError, match="own values cannot be solved"):
        chladni.study(model, THREE, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_responses_and_their_summary(model):
    settings = StudySettings(
        samples=3, sampler="oat", modes=2, outputs=("3:+Z", "8:+Z"), inputs=("1:+Z",),
        band=(20.0, 80.0), lines=301, damping=0.01, keep_frf=True,
    )  # fmt: skip
    found = chladni.study(model, ["E=90%:110%"], settings)
    f = np.linspace(20.0, 80.0, 301)
    due = chladni.frf(model, ["3:+Z", "8:+Z"], ["1:+Z"], f, 0.01).frfs[0].to("accelerance").values
    size = np.abs(due)
    row = found.rows[0]  # the deck's own values
    assert row["rms 3:+Z from 1:+Z"] == pytest.approx(np.sqrt((size[:, 0, 0] ** 2).mean()))
    assert row["peak 8:+Z from 1:+Z"] == pytest.approx(size[:, 1, 0].max())
    assert row["peak_hz 8:+Z from 1:+Z"] == pytest.approx(f[size[:, 1, 0].argmax()])


MM = """BEGIN BULK
MAT1,1,2.1+5,,0.3,7.85-9
$ANSA_NAME;1;PSHELL;inner
PSHELL,1,1,0.7,1,,1
PSHELL,2,1,1.2,1,,1
GRID,1,,0.,0.,0.
GRID,2,,100.,0.,0.
GRID,3,,100.,80.,0.
GRID,4,,0.,80.,0.
GRID,5,,200.,0.,0.
GRID,6,,200.,80.,0.
CQUAD4,1,1,1,2,3,4
CQUAD4,2,2,2,5,6,3
PBUSH,7,K,100.
CBUSH,7,7,1,4,,,,0
PELAS,8,12.5
CELAS1,9,8,4,3
ENDDATA
"""


@pytest.fixture(scope="module")
def mm(tmp_path_factory):
    path = tmp_path_factory.mktemp("mm") / "mm.bdf"
    path.write_text(MM)
    return chladni.load(path, "mm-t-s")


@pytest.mark.parametrize(
    ("text", "nominal", "low", "high", "unit"),
    [
        ("t of 1=0.6:0.8", 7e-4, 6e-4, 8e-4, "m"),
        ("t of 1 = 90% : 0.8", 7e-4, 6.3e-4, 8e-4, "m"),
        ("E=2.0e5:2.2e5", 2.1e11, 2e11, 2.2e11, "Pa"),
        ("rho of 1, 2=7.8e-9:8e-9", 7850, 7800, 8000, "kg/m3"),
        ("K of PELAS 8=10:20", 12500, 1e4, 2e4, "N/m"),
        ("nu=0.25:0.35", 0.3, 0.25, 0.35, "-"),
        ("t=90%:110%", 1, 0.9, 1.1, "of the deck's"),
        ("K of PELAS 8=1:1e3:log", 12500, 1e3, 1e6, "N/m"),
    ],
)
def test_ranges_are_in_the_decks_units(mm, text, nominal, low, high, unit):
    v = of_parts(vary_text(text), mm.assembly, mm.deck, mm.units)
    np.testing.assert_allclose([v.nominal, v.low, v.high], [nominal, low, high])
    assert v.unit == unit
    assert v.log == text.endswith("log")


def test_a_number_is_written_everywhere_it_stands(mm):
    v = of_parts(vary_text("t=50%:200%"), mm.assembly, mm.deck, mm.units)
    made = v.applied(mm.assembly, 2.0)
    np.testing.assert_allclose(made.shells.thickness, 2 * mm.assembly.shells.thickness)
    assert [p.section.thickness for p in made.parts] == pytest.approx([1.4e-3, 2.4e-3])
    k = of_parts(vary_text("K of PELAS 8=10:20"), mm.assembly, mm.deck, mm.units)
    assert k.applied(mm.assembly, 2e4).springs.value == pytest.approx([2e4])


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("t of 1=600:800", "857 times"),
        ("E=1:2", "4.76e-06 times the deck's own 210000; "),
        ("E=1:2e5", "decades 1e2:1e6:log"),
        ("t=0.6:0.8", "2 different values"),
        ("t of 3=0.6:0.8", "no part '3'"),
        ("t of 1", "is not of the form"),
        ("q=1:2", "there are E, rho"),
        ("E=3e5:1e5", "must increase"),
        ("E=0%:100%", "above zero"),
        ("E=1:2:3", "is not a range"),
        ("E=nan:2", "must increase"),
        ("K of PBUSH 9=1:2", "no element of PBUSH 9"),
        ("suspension=1:2", "is an effect"),
        ("E at 12=1:2", 'write "E of PART=LOW:HIGH"'),
        ("E=1", "is not a range"),
        ("E=90%:", "is not a range"),
        ("E=%:2", "is not a range"),
        ("E of 1=90%:110%:lin", "is not a range"),
    ],
)
def test_a_bad_range_names_itself(mm, text, named):
    with pytest.raises(ChladniError, match="--vary") as caught:
        of_parts(vary_text(text), mm.assembly, mm.deck, mm.units)
    assert named in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("vary", "named"),
    [
        ((), "no parameter is varied"),
        (("t=90%:110%", "t=80%:110%"), "vary the same number"),
        (("E=90%:110%", "E of plate=80%:110%"), "vary the same number"),
        ("nu=90%:190%", "materials have less than"),
    ],
)
def test_a_study_of_nothing_or_twice_the_same_is_refused(model, vary, named):
    with pytest.raises(ChladniError, match=named):
        chladni.study(model, vary)


@pytest.mark.parametrize(
    ("given", "named"),
    [({"sampler": "dice"}, "morris"), ({"samples": 0}, "samples"), ({"seed": -1}, "seed"),
     ({"modes": 0}, "modes"), ({"inputs": ("1:+Z",)}, "both ends"),
     ({"quantity": "x"}, "mobility")],
)  # fmt: skip
def test_bad_settings_name_themselves(given, named):
    with pytest.raises(LabelError, match=named):
        StudySettings(**given)


def test_too_few_samples_are_refused(model):
    for sampler in ("grid", "oat", "saltelli", "morris"):
        with pytest.raises(FileError, match="at least"):
            chladni.study(model, THREE, StudySettings(samples=3, sampler=sampler))
