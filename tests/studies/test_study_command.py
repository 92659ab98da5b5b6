"""``chladni study``: what it writes, that others read it in a line, what it refuses."""

import json
import re

import numpy as np
import pandas
import pytest
import xarray
from tests.builders.cases import changed_case
from tests.builders.commands import ran, refused
from tests.builders.structures import stiffer

import chladni
from chladni.io.tables.write_tables import write_npz
from chladni.output import plain
from chladni.results import to_json
from chladni_studies import StudySettings

CASE = """
[model]
deck = "plate.bdf"
units = "SI"
[test]
recordings = ["frf.npz"]
[band]
fit = [20.0, 90.0]
[[parameter]]
field = "E"
low = 0.9
high = 1.1
[[parameter]]
name = "sheet"
field = "t"
parts = ["plate"]
sd = 0.01
[[parameter]]
field = "suspension"
"""


@pytest.fixture(scope="module")
def folder(deck, tmp_path_factory):
    """The plate recorded with a modulus 5 % above the deck's."""
    folder = tmp_path_factory.mktemp("case")
    (folder / "plate.bdf").write_bytes(deck.read_bytes())
    model = chladni.load(deck, "SI")
    article = type(model)(model.source, stiffer(model.assembly, 1.05))
    made = chladni.frf(article, ["3:+Z", "8:+Z", "17:+Z"], ["1:+Z"], np.linspace(15, 100, 300))
    write_npz(folder / "frf.npz", made.frfs[0].to("accelerance"))
    (folder / "case.toml").write_text(CASE)
    return folder


@pytest.fixture(scope="module")
def out(folder, tmp_path_factory):
    place = tmp_path_factory.mktemp("runs") / "out"
    options = ("--samples", 21, "--sampler", "oat", "--modes", 4, "--workers", 1, "--frf")
    done = ran("study", folder, *options, "--pictures", "--out", place)
    assert "21 of 21 samples" in done.output
    return place


def test_q_is_least_where_the_article_is(out):
    table = pandas.read_csv(out / "samples.csv")
    alone = table[np.isclose(table["sheet"], 1e-3)]
    best = alone.loc[alone["Q"].idxmin()]
    assert best["E"] / 2.1e11 == pytest.approx(1.05, abs=0.012)  # steps of 2.2 %
    assert best["Q"] < 0.1 * alone["Q"].max()


def test_the_json_is_what_the_function_gives_a_notebook(out, folder):
    case = chladni.load_case(folder)
    settings = StudySettings(samples=21, sampler="oat", modes=4, keep_frf=True)
    due = plain(to_json(chladni.study(case, (), settings)))
    found = json.loads((out / "study.json").read_text())
    for held in (found, due):
        held["nominal"].pop("seconds")
    assert found == due
    assert found["parameters"][0]["low"] == pytest.approx(0.9 * 2.1e11)
    assert found["parameters"][1]["high"] == pytest.approx(1e-3 * np.exp(0.02))
    assert any("suspension is an effect" in note for note in found["notes"])
    assert {"plate.bdf", "case.toml"} == {p.rpartition("/")[2] for p in found["files"]}


def test_others_read_it_in_one_line(out):
    rows = pandas.read_json(out / "samples.jsonl", lines=True)
    table = pandas.read_csv(out / "samples.csv")
    assert list(rows["sample"]) == list(table["sample"]) == list(range(21))
    np.testing.assert_allclose(rows["f1_hz"], table["f1_hz"])
    with xarray.open_dataset(out / "study.nc") as data:
        np.testing.assert_allclose(data["frequency"].sel(mode=1), table["f1_hz"])
        np.testing.assert_allclose(data["Q"], table["Q"])
        assert data["E"].attrs["units"] == "Pa"
        whole = data["frf_real"] + 1j * data["frf_imag"]
        assert whole.shape == (21, len(data["frequency_hz"]), 3)
        names = [b"".join(n).decode().strip() if n.ndim else n.item().decode().strip()
                 for n in np.atleast_1d(data["channel_name"].values)]  # fmt: skip
        assert names == ["3:+Z from 1:+Z", "8:+Z from 1:+Z", "17:+Z from 1:+Z"]
        rms = np.sqrt((np.abs(whole) ** 2).mean("line"))
        np.testing.assert_allclose(rms.values, data["rms"].values)


def test_the_page_tells_what_moves_what(out):
    page = (out / "report.html").read_text(encoding="utf-8")
    for word in ("Sensitivities", "sheet", "open_dataset", "suspension", "first elastic one"):
        assert word in page
    for name in ("slopes.png", "parallel.png", "responses.png", "design.csv", "study_begun.json"):
        assert (out / name).is_file()


def test_it_goes_on_by_the_same_command(out, folder):
    options = ("--samples", 21, "--sampler", "oat", "--modes", 4, "--workers", 1, "--frf")
    ran("study", folder, *options, "--out", out)
    found = json.loads((out / "study.json").read_text())
    assert found["finished_before"] == 21


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (("--samples", "0"), "samples = 0"),
        (("--samples", "-3"), "samples = -3"),
        (("--sampler", "dice"), "saltelli"),
        (("--seed", "-1"), "seed"),
        (("--workers", "0"), "workers"),
        (("--workers", "7777777777777777"), "bring no gain on"),
        (("--band", "9"), "--band"),
        (("--input", "1:+Z"), "both ends"),
        (("--input", "999:+Z", "--output", "1:+Z"), "999"),
        (("--frf",), "--frf"),
        (("--vary", "t of innr=90%:110%"), "innr"),
    ],
)
def test_a_bad_option_names_itself(deck, tmp_path, options, named):
    vary = () if "--vary" in options else ("--vary", "t=90%:110%")
    assert named in refused(
        "study", deck, "--units", "SI", *vary, *options, "--out", tmp_path / "x"
    )


def test_mostly_failed_is_not_to_be_trusted(deck, tmp_path, monkeypatch):
    from chladni_studies import sample

    solved, tries = sample.solved, []

    def fails(*given):
        tries.append(given)
        if len(tries) > 2:
            raise ZeroDivisionError("by decree")
        return solved(*given)

    monkeypatch.setattr(sample, "solved", fails)
    options = ("--vary", "t=90%:110%", "--samples", 5, "--workers", 1, "--out", tmp_path / "x")
    done = ran("study", deck, "--units", "SI", *options, code=3)
    assert "4 of 5 samples failed, the first of them, 1: by decree" in done.stderr
    assert (tmp_path / "x" / "report.html").is_file()


@pytest.mark.parametrize("name", ['Ω \n,"E"', "E/rho <b>", "x" * 300, "$_$"])
def test_any_name_goes_through_every_file(folder, tmp_path, name):
    quoted = json.dumps(name, ensure_ascii=False)
    place = changed_case(folder, tmp_path / "Gehäuse Ω", ('"sheet"', quoted))
    ran("study", place, "--samples", 5, "--sampler", "oat", "--modes", 2, "--out", tmp_path / "x")
    table = pandas.read_csv(tmp_path / "x/samples.csv")
    assert name in table.columns
    assert name in pandas.read_csv(tmp_path / "x/design.csv").columns
    with xarray.open_dataset(tmp_path / "x/study.nc") as data:
        assert any(np.allclose(v, table[name]) for v in data.data_vars.values() if v.shape == (5,))
    page = (tmp_path / "x/report.html").read_text(encoding="utf-8").split("<h1")[1]
    assert "<b>" not in re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)  # ours, fixed
    assert "E/rho <b>" not in page


@pytest.mark.parametrize("name", ["Q", "f1_hz", "sample", "mode"])
def test_a_parameter_is_not_called_as_a_result(folder, tmp_path, name):
    place = changed_case(folder, tmp_path / "case", ('"sheet"', f'"{name}"'))
    assert "cannot be called" in refused("study", place, "--samples", 5, "--out", tmp_path / "x")
