"""A case goes on the bench and comes back as a case that every other command reads."""

import json
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from tests.builders.commands import ran, refused
from tests.builders.quick_runs import coarse_pictures

import chladni
from chladni.effects import registry
from chladni.ema.frf_estimate import estimate
from chladni.errors import FileError, LabelError, ModelError
from chladni.io.package_files import mesh_path
from chladni_bench.bench_workflow import BenchSettings, virtual_test

QUICK = BenchSettings(band=(15.0, 120.0), resolution=0.5, averages=4, sweeps=2)


@pytest.fixture(scope="module")
def demo():
    return mesh_path("demo/case.toml").parent


@pytest.fixture(scope="module")
def case(demo):
    return chladni.load_case(demo)


def benched(case, **changes):
    return virtual_test(case, replace(QUICK, **changes))


@pytest.fixture(scope="module")
def folder(demo, tmp_path_factory):
    """What ``chladni bench --time`` writes of two articles at two levels."""
    out = tmp_path_factory.mktemp("bench") / "out"
    words = ["bench", str(demo), "--band", "15:120", "--resolution", "0.5", "--averages", "4"]
    words += ["--articles", "2", "--levels", "1,2", "--time", "--hide", "point-mass"]
    words += ["--seed", "540"]
    with coarse_pictures():
        ran(*words, "--pictures", "--out", out)
    return out


def test_the_case_that_is_left_can_be_read(folder, case):
    made = chladni.load_case(folder / "case")
    assert [(r.article, r.level is not None) for r in made.recordings] == [
        ("A", True), ("A", True), ("B", True), ("B", True),
    ]  # fmt: skip
    assert made.frfs[0].outputs == case.outputs.labels
    assert made.setup.hangers == case.setup.hangers
    assert made.band == (15.0, 120.0)  # of the case's, what the test covered
    assert made.held_band is None
    assert sum(kg for _, kg in made.sensor_masses) == pytest.approx(20 * 0.005 + 0.4 * 0.023)
    np.testing.assert_allclose(made.assembly.points, case.assembly.points, atol=1e-9)


def test_truth_is_sealed_and_stands_nowhere_else(folder):
    truth = json.loads((folder / "sealed" / "truth.json").read_text())
    value = truth["effects"]["point-mass"]["value"]
    for path in (folder / "case").rglob("*.toml"):
        assert f"{value:.4g}" not in path.read_text()
    told = (folder / "bench.json").read_text()
    assert "point-mass" not in told
    assert str(value)[:8] not in told


def test_time_data_give_the_frfs_beside_them(folder):
    """Read from the universal file and estimated as ``chladni test`` does it."""
    name = min((folder / "case").glob("article_A_*N_time.uff"))
    (read,) = chladni.load_recordings(name)
    beside = name.with_name(name.name.replace("_time", ""))
    (frf,) = (r.frf for r in chladni.load_recordings(beside))
    found = estimate(read.time).frf.sel(band=(14.9, 120.1))
    assert found.values.shape == frf.values.shape
    size = np.abs(frf.values).max()
    np.testing.assert_allclose(found.values, frf.values, atol=1e-4 * size)


def test_the_page_shows_a_stretch_of_time_and_an_frf(folder):
    page = (folder / "report.html").read_text()
    for words in (
        "Driven at",
        "One block of time data from the front end",
        "deviation from the ideal FRF",
    ):
        assert words in page
    with Image.open(folder / "time.png") as picture:
        assert np.asarray(picture.convert("L")).std() > 5


def test_the_same_seed_is_the_same_test_and_another_is_not(case):
    a, b, c = (benched(case, seed=s).recordings[0].frf.values for s in (540, 540, 541))
    np.testing.assert_array_equal(a, b)
    assert not np.allclose(a, c)


def test_levels_of_one_article_differ_by_noise_alone(case):
    """The sensors keep their sensitivities; a linear article answers alike."""
    found = benched(case, excitation="multisine", levels=(1.0, 2.0), resolution=0.2)
    low, high = (r.frf.values for r in found.recordings)
    assert np.median(np.abs(high / low - 1)) < 2e-3


@pytest.mark.parametrize("band", [(5.0, 60.0), (1.0, 8.0)])
def test_a_local_spring_is_firm_against_the_first_elastic_mode(case, band):
    """k = 0.2 m ω_1²: neither residual vectors far above nor a band below hide rigid motions."""
    found = benched(case, band=band, local=("clearance",), exact=True)
    own = chladni.modes(case, 7)
    due = 0.2 * own.mass * (2 * np.pi * own.modal.frequency[6]) ** 2
    assert own.rigid.tolist() == [True] * 6 + [False]
    assert found.truth["local"][0]["k"] == pytest.approx(due, rel=0.02)
    assert found.truth["frequency_hz"]["A"][:6].tolist() == [0.0] * 6


def test_articles_differ_and_exact_ones_do_not(case):
    def f(result):
        return [np.array(v)[6:12] for v in result.truth["frequency_hz"].values()]

    a, b = f(benched(case, articles=2))
    assert 1e-4 < np.abs(b / a - 1).max() < 0.05
    a, b = f(benched(case, articles=2, exact=True))
    np.testing.assert_allclose(a, b)


OF_JOINTS = (
    "weld-missing", "weld-compliance", "adhesive-stiffness", "hem-contact", "contact-stiffness",
    "over-constraint",
    "compliant-support", "viscoelastic-joint", "open-joint", "solid-patch",
)  # fmt: skip


FEW = {"exact": True, "seed": 540, "band": (15.0, 60.0), "resolution": 1.0, "averages": 2}


@pytest.fixture(scope="module")
def plain(case):
    """The recording of an article that hides nothing."""
    return benched(case, **FEW).recordings[0]


@pytest.mark.parametrize("name", registry.names())
def test_every_effect_of_the_catalogue_can_be_hidden(case, plain, name):
    """What is hidden changes the recording by more than its noise; what it acts on must be."""
    if name in OF_JOINTS:
        with pytest.raises(ModelError, match="the structure has no"):
            benched(case, hide=(name,), **FEW)
        return
    found = benched(case, hide=(name,), **FEW)
    assert found.truth["effects"][name]
    away = np.abs(found.recordings[0].truth / plain.truth - 1)
    gain = np.abs(found.recordings[0].frf.values / plain.frf.values - 1)
    assert max(np.median(away), np.median(gain, axis=0).max()) > 5e-3


def test_weighed_mass_is_the_articles_without_sensors(case):
    from chladni.fem.energy import mass_properties

    found = benched(case, exact=True)
    assert found.mass == pytest.approx(mass_properties(case.assembly)[0], rel=3e-3)


def test_a_sine_follows_the_schedule_of_the_thesis(case):
    found = benched(case, excitation="stepped-sine", band=(20.0, 60.0))
    f = found.recordings[0].frf.frequency
    np.testing.assert_allclose(f[0], 20.0)
    assert f[1] / f[0] == pytest.approx(2 ** (1 / 200), rel=1e-3)
    assert {(x.delay, x.measure) for x in found.schedule} == {(30, 20), (80, 20)}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"hide": ("point-moss",)}, "no effect 'point-moss'"),
        ({"local": ("gap",)}, "no local force 'gap'; there are clearance"),
        ({"excitation": "swept-sine"}, "no excitation 'swept-sine'; there are burst-random"),
        ({"articles": 0}, "1 to 26"),
        ({"levels": (0.0,)}, "above zero"),
    ],
)
def test_what_is_not_there_is_refused(case, changes, words):
    with pytest.raises(LabelError, match=words):
        benched(case, **changes)


def test_a_case_without_sensors_is_refused(case):
    bare = replace(case.outputs, labels=(), grids=np.zeros(0, int), points=np.zeros((0, 3)),
                   directions=np.zeros((0, 3)), sd=np.zeros(0), mass=np.zeros(0))  # fmt: skip
    with pytest.raises(FileError, match="names no sensor"):
        benched(replace(case, outputs=bare))


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--levels", "a"], "is not of the form"),
        (["--level", "-2"], "--level"),
        (["--excitation", "noise"], "no excitation"),
        (["--sensors", "x.csv"], "already defines sensors"),
        (["--band", "100:20"], "must increase"),
        (["--band", "50:90000"], "GB of time data, more than the limit of 1 GB"),
        (["--resolution", "0.001", "--averages", "500"], "use lines of --resolution"),
    ],
)
def test_bad_input_is_one_sentence_and_leaves_nothing(demo, tmp_path, words, said):
    assert said in refused("bench", demo, *words, "--out", tmp_path / "o")


def test_a_folder_that_is_no_case_is_not_called_one(tmp_path):
    (tmp_path / "plan").mkdir()
    words = ("bench", tmp_path / "plan", "--units", "SI", "--out", tmp_path / "o")
    assert "no case.toml in the folder" in refused(*words)


def test_a_table_that_is_no_text_is_told(demo, tmp_path):
    (tmp_path / "x.csv").write_bytes(bytes(range(128, 200)))
    words = ["--units", "mm-t-s", "--sensors", tmp_path / "x.csv", "--out", tmp_path / "o"]
    assert "is not UTF-8 text" in refused("bench", demo / "deck.bdf", *words)


def test_a_bare_deck_is_tested_where_a_table_says(demo, folder, tmp_path):
    """Deck, units and a table of sensors; without units it is refused."""
    words = ["bench", demo / "deck.bdf", "--sensors", folder / "case" / "sensors.csv"]
    words += ["--band", "15:80", "--resolution", 1, "--averages", 2, "--out", tmp_path / "o"]
    assert "--units" in refused(*words)
    done = ran(*words, "--units", "mm-t-s")
    assert chladni.load_case(tmp_path / "o" / "case").frfs[0].values.shape[1] == 20
    assert "rigid motions at 0.7 Hz" in done.output
    assert "mesh of the deck" in done.output


def test_a_deck_on_the_bench_is_named_as_the_user_names_it(demo, folder, tmp_path):
    """Notes and faults name the file that was given; what supports hold does not swing."""
    deck = tmp_path / "mine.bdf"
    free = (demo / "deck.bdf").read_text(encoding="latin-1")
    held = "CEND\nSPC = 88\n", "BEGIN BULK\nPARAM,BAILOUT,-1\nSPC1,88,123456,1,2,3\n"
    assert "BEGIN BULK\n" in free
    before, after = free.split("BEGIN BULK\n")
    deck.write_text(before.replace("CEND\n", held[0]) + held[1] + after, encoding="latin-1")
    words = ["bench", deck, "--units", "mm-t-s", "--out", tmp_path / "o", "--finer"]
    words += ["--sensors", folder / "case" / "sensors.csv", "--resolution", 1]
    words += ["--band", "15:80", "--averages", 2]
    done = ran(*words)
    assert f"{deck}: PARAM BAILOUT" in done.output
    assert "have no cords" not in done.output
    assert "mesh of the deck" not in done.output
    deck.write_text(deck.read_text(encoding="latin-1").replace("\nPSHELL   ", "\nPSHELL  x", 1))
    words[words.index("--out") + 1] = tmp_path / "other"
    assert str(deck) in refused(*words)


def advice(folder, **more):
    plan = {"sensors": [], "masses": [], "drives": [], "band_hz": [], **more}
    (folder / "plan.json").write_text(json.dumps(plan))
    return folder / "plan.json"


def test_what_was_advised_is_measured_on_the_same_article(demo, tmp_path):
    """The same modes, damping, weight and concealed effect; new places after the old ones."""
    words = ["bench", demo, "--band", "15:120", "--resolution", "0.5", "--averages", "4"]
    words += ["--hide", "point-mass", "--seed", "3"]
    free = [g for g in (2, 5, 9, 11) if f"{g}:n" not in chladni.load_case(demo).outputs.labels][:2]
    sensors, masses = [{"label": f"{free[0]}:n"}], [{"label": f"{free[1]}:n", "mass_kg": 0.3}]
    ran(*words, "--out", tmp_path / "one")
    plan = advice(tmp_path, sensors=sensors, masses=masses)
    ran(*words, "--add", plan, "--out", tmp_path / "two")
    one, two = (
        json.loads((tmp_path / n / "sealed/truth.json").read_text()) for n in ("one", "two")
    )
    for key in ("effects", "frequency_hz", "damping", "weight_kg"):
        assert one[key] == two[key]
    first, again = (chladni.load_case(tmp_path / n / "case") for n in ("one", "two"))
    assert again.outputs.labels[: len(first.outputs.labels)] == first.outputs.labels
    assert len(again.outputs.labels) == len(first.outputs.labels) + 2
    heavier = sum(kg for _, kg in again.sensor_masses) - sum(kg for _, kg in first.sensor_masses)
    assert heavier == pytest.approx(0.3 + 0.005)


@pytest.mark.parametrize(
    ("plan", "why"),
    [
        ({"band_hz": [300.0]}, "run chladni next --without band"),
        ({"sensors": [{"label": "999999:n"}]}, "999999"),
        ({"sensors": 3}, "is not a plan.json of chladni next"),
    ],
)
def test_advice_that_the_bench_cannot_follow_is_one_sentence(demo, tmp_path, plan, why):
    path = advice(tmp_path, **plan)
    assert why in refused("bench", demo, "--add", path, "--out", tmp_path / "out")
