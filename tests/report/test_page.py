"""The page: everything inside, everything escaped, every verdict a sentence."""

import copy
import json
import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser

import pytest

from chladni.errors import FileError
from chladni.inference.calibration_result import CalibrationStudy
from chladni.inference.result import FrequencyError
from chladni.output import plain
from chladni.report.blocks import Facts, Items, Picture, Section, Table, Text
from chladni.report.diagnosis_json import diagnosis_json, from_json, read_diagnosis
from chladni.report.next_steps import next_steps
from chladni.report.page import write_page, write_sections
from chladni.report.sentence import sentence
from chladni.report.states_table import states_table
from chladni.report.verdict import HEADING, badge, sections
from chladni.view import charts
from chladni.view.chart_png import png
from chladni.workflows.diagnosis_pipeline import beyond_calibration
from chladni.workflows.diagnosis_result import StateResult

LUMP = {"name": "point-mass", "claim": "a lump", "gain": 90.0, "where": {"text": "near grid 9"}}
FAULT = {"name": "sensor-fault", "gain": 40.0, "where": {"text": "channel 7", "channels": ["7:+Z"]}}
SENSORS = {"name": "sensor-mass", "gain": 60.0, "where": {"text": "at the 6 sensors"}}
EVIL = '<script>alert("x")</script>'
DIAGNOSIS = {
    "verdict": "missing physics",
    "effects": [
        {
            "name": "hem-contact",
            "claim": f"the hem holds {EVIL}",
            "log_evidence": -120.3,
            "where": {
                "text": f"edge of {EVIL}",
                "parts": [EVIL],
                "grids": list(range(40)),
                "point_m": [0.1, 0.2, 0.3],
                "radius_m": 0.15,
                "band_hz": [40.0, 160.0],
                "channels": [EVIL],
            },
            "parameters": [
                {"name": EVIL, "value": 3.1e9, "unit": "N/m2", "low": 2.2e9, "high": 4.4e9}
            ],
        }
    ],
    "alternatives": [{"name": EVIL, "log_evidence": -310.0, "why_not": EVIL}],
    "fit": {
        "Q_nominal": 0.2134,
        "Q_calibrated": 0.1121,
        "Q_with_effect": 0.01213,
        "Q_floor": 0.0081,
        "held_out": {
            "Q_nominal": 0.2411,
            "Q_calibrated": 0.131,
            "Q_with_effect": 0.0151,
            "what": EVIL,
        },
    },
    "calibrated": [
        {
            "where": f"E of {EVIL}",
            "name": "E",
            "value": 2.0e11,
            "unit": "Pa",
            "low": 1.9e11,
            "high": 2.1e11,
            "deck_value": 2.1e11,
        }
    ],
    "mass": {"weighed_kg": 10.508, "model_kg": 10.51},
    "frequencies": [
        {
            "test_hz": 28.2,
            "before_hz": 24.9,
            "after_hz": 28.1,
            "mac_before": 0.98,
            "mac_after": None,
        }
    ],
    "files": {"deck": f"{EVIL}.bdf", "report": "report.html"},
}
RESULT = from_json(DIAGNOSIS)


class Tags(HTMLParser):
    """Counts tags and keeps what is loaded from elsewhere."""

    def __init__(self):
        super().__init__()
        self.seen, self.loaded, self.links = [], [], []

    def handle_starttag(self, tag, attrs):
        self.seen.append(tag)
        for name, value in attrs:
            if name in ("src", "srcset", "data", "action"):
                self.loaded.append(value)
            if name == "href":
                self.links.append(value)


def read(path):
    text, tags = path.read_text(encoding="utf-8"), Tags()
    tags.feed(text)
    return text, tags


def test_text_of_decks_and_recordings_is_escaped(tmp_path):
    """Whatever field a deck or a recording can fill: no tag comes out of it."""
    more = [
        Section(EVIL, [Text([EVIL, f"`{EVIL}`"]), Table((EVIL,), [(EVIL,)]), Facts([(EVIL, EVIL)])])
    ]
    page = write_page(tmp_path, RESULT, {}, [EVIL], more, command=EVIL, title=EVIL)
    text, tags = read(page)
    assert tags.seen.count("script") == 1  # that of the page
    assert text.count("&lt;script&gt;") >= 15
    assert "<code>&lt;" in text
    assert all(link.startswith(("./", "#part-")) for link in tags.links)


def test_a_notebook_shows_the_page_in_a_frame_that_runs_nothing():
    """The names of a deck stay text: escaped for the page, and the page for its attribute."""
    html, tags = RESULT._repr_html_(), Tags()
    tags.feed(html)
    assert tags.seen == ["iframe"]
    assert 'sandbox=""' in html
    page = unescape(html[html.index('srcdoc="') + 8 :].split('"', 1)[0])
    assert sentence(RESULT).split(",")[0].split("<")[0] in page
    assert EVIL not in page


def test_page_is_self_contained(tmp_path):
    figure = png(charts.steps({"fitted": {"a": 1.0, "b": 0.5}}), tmp_path / "w.png")
    page = write_page(tmp_path, RESULT, {"waterfall": figure, "where": figure, "mine": figure})
    text, tags = read(page)
    assert tags.seen.count("img") == 3
    assert all(src.startswith("data:image/png;base64,") for src in tags.loaded)
    assert not re.search(r"https?://|@import|url\(", text)
    assert "link" not in tags.seen


def test_numbers_an_engineer_asks_for_are_there(tmp_path):
    text, _ = read(write_page(tmp_path, RESULT))
    for due in (
        *("0.2411", "0.0151", "-94 %", "3.1 GN/m² (2.2 to 4.4)", "-310", "10.51", "24.9"),
        *("210 GPa", "200 GPa (190 to 210)", "-4.8 %"),
    ):
        assert due in text, due


@pytest.mark.parametrize("verdict", HEADING)
def test_every_verdict_is_one_sentence(verdict):
    for d in ({"verdict": verdict}, {**DIAGNOSIS, "verdict": verdict}):
        said = sentence(from_json(d))
        assert said[0].isupper()
        assert said.endswith(".")
        assert "None" not in said


def test_a_calibration_alone_claims_no_more():
    """No alternative was tried: nothing is said of what is missing."""
    d = {"verdict": "calibration only", "effects": [], "alternatives": [], "fit": None}
    assert "not searched" in sentence(from_json(d))
    tried = {**d, "alternatives": [{"name": "point-mass"}]}
    assert "no physics is missing" in sentence(from_json(tried))


@pytest.mark.parametrize("d", [{}, {"verdict": "nothing missing", "effects": [], "fit": None}])
def test_what_is_missing_is_left_out(tmp_path, d):
    text, tags = read(write_page(tmp_path, from_json(d)))
    assert tags.seen.count("section") == 0
    assert "None" not in text


@pytest.mark.parametrize(("written", "told"), [(0.5, True), (0.0151, False)])
def test_a_mesh_too_coarse_is_told_where_the_updated_deck_is_worse(written, told):
    """Named it may be for all that: the error of the mesh is in both models then."""
    held = {**DIAGNOSIS["fit"]["held_out"], "Q_with_effect": written, "Q_with_nuisances": 0.009}
    d = {**DIAGNOSIS, "fit": {**DIAGNOSIS["fit"], "held_out": held}}
    assert ("; Q is 0.009 with errors of mesh" in sentence(from_json(d))) == told


def test_a_missing_picture_is_a_sentence_and_no_page(tmp_path):
    with pytest.raises(FileError, match=r"nix\.png"):
        write_page(tmp_path, RESULT, {"where": tmp_path / "nix.png"})
    with pytest.raises(FileError, match="no picture"):
        write_sections(tmp_path / "p.html", "x", [Section("a", [Picture(tmp_path / "a.exe")])])
    assert not list(tmp_path.iterdir())


def test_sections_without_content_are_left_out(tmp_path):
    body = [Section("empty", []), Section("full", [Items(["one"])])]
    text, _ = read(write_sections(tmp_path / "p.html", "t", body))
    assert "full" in text
    assert "empty" not in text


def test_a_page_can_be_written_again_from_its_json():
    """What is written is read back whole; every key that was given is in it."""
    written = diagnosis_json(RESULT)
    assert diagnosis_json(from_json(written)) == written
    for key, value in DIAGNOSIS.items():
        assert set(value) <= set(written[key]) if isinstance(value, dict) else written[key]


def _places(value, at=()):
    """The path of every value in plain data."""
    yield at
    listed = dict(enumerate(value)) if isinstance(value, list) else value
    for key, one in listed.items() if isinstance(listed, dict) else ():
        yield from _places(one, (*at, key))


@pytest.mark.parametrize("bad", [{}, [1], "x", "", True, 10**400, -1, None, [["x"]]], ids=repr)
def test_a_damaged_diagnosis_is_read_or_refused_in_a_sentence(tmp_path, bad):
    """Any one value of another kind: what is read back has the types that the page counts on."""
    whole, path = plain(diagnosis_json(RESULT)), tmp_path / "diagnosis.json"
    refused = 0
    for *way, last in (at for at in _places(whole) if at):
        damaged = copy.deepcopy(whole)
        holder = damaged
        for key in way:
            holder = holder[key]
        holder[last] = bad
        path.write_text(json.dumps(damaged))
        try:
            found = read_diagnosis(tmp_path)
        except FileError:
            refused += 1
        else:
            assert sections(found, {}, (), (), "")
            assert from_json(diagnosis_json(found)) is not None
    assert refused or bad is None


def test_a_field_of_another_type_is_named():
    effect = DIAGNOSIS["effects"][0]
    wrong = {
        "log_evidence holds 'much'": {"log_evidence": "much"},
        "where.parts[1] holds 7": {"where": {"parts": ["a", 7]}},
        "where.band_hz holds 1 values, 2 are due": {"where": {"band_hz": [1.0]}},
        "where.grids[0] holds True": {"where": {"grids": [True]}},
        "name is missing": {"name": None},
    }
    for said, other in wrong.items():
        held = {k: v for k, v in (effect | other).items() if k != "name" or v}
        with pytest.raises(ValueError, match=re.escape(f"effects[0].{said}")):
            from_json({"effects": [held]})


def test_values_that_the_deck_keeps_are_not_called_calibrated(tmp_path):
    """Nothing missing: the updated deck is the deck, whatever the fit tried."""
    text, _ = read(write_page(tmp_path, replace(RESULT, verdict="nothing missing")))
    assert "Calibrated parameters" not in text


def test_reasons_not_to_trust_stand_first(tmp_path):
    text, _ = read(write_page(tmp_path, replace(RESULT, distrust=("the basis is too small",))))
    assert text.index("the basis is too small") < text.index("<h2>At a glance")


@pytest.mark.parametrize("verdict", ["calibration only", "nothing missing"])
def test_a_quiet_verdict_that_is_not_trusted_says_so(verdict):
    quiet = replace(RESULT, verdict=verdict, one_of=())
    assert "may still be missing" not in sentence(quiet)
    doubted = replace(quiet, distrust=("joints no joint is like",))
    assert "physics may still be missing" in sentence(doubted)
    tied = replace(doubted, one_of=(("calibration alone", "hem-contact"),))
    assert "hem-contact explains the recording better" in sentence(tied)


@pytest.mark.parametrize("verdict", ["missing physics", "calibration only", "nothing missing"])
def test_the_badge_is_no_surer_than_the_sentence(verdict):
    found = replace(RESULT, verdict=verdict, effects=RESULT.effects * (verdict[0] == "m"))
    assert badge(found) == HEADING[verdict]
    assert badge(replace(found, distrust=("the basis",))) == "Physics may be missing"
    tied = replace(found, one_of=(("crack", "doubler"),))
    assert badge(tied) == (HEADING[verdict] if found.effects else "No effect named")


@pytest.mark.parametrize(
    ("verdict", "distrust", "said"),
    [
        ("not in catalogue", ("the basis",), "Calibrated: does not fit"),
        ("calibration only", ("the basis",), "Calibrated: in doubt"),
        ("nothing missing", (), "Calibrated: fits"),
        ("measurement fault", (), "Measurement fault"),
    ],
)
def test_the_badge_of_a_calibration_names_no_search(verdict, distrust, said):
    found = replace(RESULT, verdict=verdict, distrust=distrust, one_of=(), effects=())
    assert badge(replace(found, searched=False)) == said


@pytest.mark.parametrize(("value", "told"), [(3.1e9, False), (4.9e9, True)])
def test_a_written_number_that_is_not_the_found_one_has_its_reason(value, told):
    """The reason stands in the caption: in a cell it pushes its column off the page."""
    effect = replace(RESULT.effects[0], written=(value,))
    (found,) = (s.blocks for s in sections(replace(RESULT, effects=(effect,)), {}, (), (), "")
                if s.title == "Findings")  # fmt: skip
    (table,) = (b for b in found if isinstance(b, Table) and b.columns[0] == "parameter")
    assert table.rows[0][2].endswith(" (+58 %)") == told
    assert ("fitted without errors of mesh and scatter" in table.caption) == told


@pytest.mark.parametrize("changed", [True, False])
def test_cells_of_calibrated_values_are_short_and_the_caption_explains_them(changed):
    (moved,) = RESULT.calibrated[:1]
    written = (replace(moved, written_value=1.1 * moved.estimate.value),)
    verdict = "calibration only" if changed else "nothing missing"
    found = replace(RESULT, verdict=verdict, study=CalibrationStudy(), calibrated=written)
    (blocks,) = (s.blocks for s in sections(found, {}, (), (), "")
                 if s.title == "Calibrated parameters")  # fmt: skip
    assert blocks[0].rows[0][4].endswith(" (+10 %)") == changed
    assert len(blocks[0].rows[0][4]) < 20
    assert ("in brackets" in blocks[0].caption) == changed
    assert ("keeps its values" in blocks[0].caption) != changed


@pytest.mark.parametrize("compared", ["responses", "frequencies"])
def test_a_deck_that_is_not_trusted_explains_nothing(compared):
    """The reason says how far it is off; the headline does not say the opposite."""
    doubted = replace(RESULT, verdict="calibration only", one_of=(), distrust=("7.6 % off",))
    assert sentence(replace(doubted, compared=compared)).startswith("No effect is named")


CLAIMS = ("The model lacks point-mass", "explains the recording;", "is missing", "is wrong, not")


@pytest.mark.parametrize("compared", ["responses", "frequencies"])
@pytest.mark.parametrize("one_of", [(), (("point-mass", "hem-contact"),)])
@pytest.mark.parametrize("effects", [[], [LUMP], [FAULT]])
@pytest.mark.parametrize("verdict", HEADING)
def test_no_headline_contradicts_the_scores_of_the_decks(verdict, effects, one_of, compared):
    """A worse deck takes the claim back and is not recommended; a better one changes no word."""

    def said(last):
        every = [3.0, 3.0 if effects else last, last]
        Q = dict(zip(("Q_nominal", "Q_calibrated", "Q_with_effect"), every, strict=True))
        off = dict(zip(("before", "calibrated", "after"), every, strict=True))
        scores = {
            "responses": {"fit": {"held_out": Q}},
            "frequencies": {"frequency_rms_percent": off},
        }
        d = {"verdict": verdict, "effects": effects, "alternatives": [{"name": "crack"}],
             "compared": compared, "files": {"deck": "updated.bdf"}}  # fmt: skip
        found = replace(from_json(d | scores[compared]), one_of=one_of)
        return sentence(found), any(s.startswith("Use updated") for s in next_steps(found))

    (better, _), (worse, used) = said(0.05), said(9.0)
    assert not any(word in better for word in ("worse", "farther"))
    assert not used
    assert not any(claim in worse for claim in CLAIMS)
    if "0.05" in better:  # it tells the scores of the decks
        assert "worse than the" in worse or "farther from the test than" in worse


def test_a_deck_far_from_the_frequencies_is_no_explanation_of_them():
    groups = (("calibration alone", "extra-support"), ("calibration alone",))
    left = beyond_calibration(groups)
    beyond = "an effect outside the catalogue"
    assert left == ((beyond, "extra-support"), (beyond,))
    said = sentence(replace(RESULT, verdict="not in catalogue", one_of=left))
    assert said == f"No effect is named; the data cannot distinguish {beyond}, extra-support."
    assert beyond_calibration((("crack", beyond),), "softer folds") == (
        ("crack", f"{beyond} (softer folds)"),
    )
    alone = beyond_calibration((), "softer folds")
    said = sentence(replace(RESULT, verdict="not in catalogue", one_of=alone))
    assert said == f"No effect is named; the recording shows {beyond} (softer folds)."
    assert beyond_calibration(()) == ()


def test_agreement_says_how_near():
    near = replace(RESULT, verdict="nothing missing", one_of=(), distrust=())
    error = FrequencyError(before=4.21)
    said = sentence(replace(near, frequency_error=error))
    assert "4.2 % apart in frequency" in said
    assert "agree" not in said  # 4 % off is no agreement; what is allowed for it is said
    assert "mesh, joints and scatter" in said


@pytest.mark.parametrize("verdict", ["missing physics", "measurement fault"])
def test_what_cannot_be_told_apart_is_the_headline(verdict):
    tied = replace(RESULT, verdict=verdict, one_of=(("hem-contact", "weigh the structure"),))
    said = sentence(tied)
    assert "hem-contact" in said
    assert "weigh the structure" in said
    assert sentence(replace(tied, one_of=())) != said


def named(*effects, **more):
    return from_json({"verdict": "missing physics", "effects": list(effects), **more})


def test_every_effect_is_said_with_its_place_and_its_gain(tmp_path):
    """In the sentence, on the page and in the JSON."""
    found = named(LUMP, SENSORS)
    said = sentence(found)
    for word in ("point-mass", "a lump", "near grid 9", "sensor-mass", "at the 6 sensors"):
        assert word in said
    assert [e["gain"] for e in diagnosis_json(found)["effects"]] == [90.0, 60.0]
    loses = "loss in -2 ln evidence without it"
    assert loses in read(write_page(tmp_path, found, {}, ()))[0]
    assert loses not in read(write_page(tmp_path, named(LUMP), {}, ()))[0]


def test_a_fault_beside_physics_is_no_lack_of_the_model():
    said = sentence(named(LUMP, FAULT))
    assert said.index("The model lacks point-mass") < said.index("the recording is wrong")
    assert "sensor-fault" in said[said.index("the recording is wrong") :]


def test_what_is_sure_is_said_beside_what_cannot_be_told_apart():
    one_of = [["sensor-mass", "mass-patch", "take the sensors off"]]
    alternatives = [{"name": "mass-patch", "log_evidence": -1.0}]
    said = sentence(named(LUMP, SENSORS, one_of=one_of, alternatives=alternatives))
    assert said.startswith("The model lacks point-mass")
    assert said.index("one of these") < said.index("sensor-mass") < said.index("mass-patch")
    assert "take the sensors off" in said


def test_a_state_shows_all_its_effects():
    with_states = replace(RESULT, states=(StateResult("empty", named(LUMP, SENSORS)),))
    (table,) = states_table(with_states)
    row = " ".join(table.rows[0])
    for word in ("point-mass", "sensor-mass", "near grid 9", "at the 6 sensors"):
        assert word in row
