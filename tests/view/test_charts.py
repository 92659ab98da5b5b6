"""Every chart in both renderers: the same points, its words, no name that is a tag or a formula."""

import json
import subprocess
import sys
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.text import Text
from PIL import Image

import chladni
from chladni.ema.level_table import LevelRow, LevelTable, TriedElement
from chladni.errors import ShapeError
from chladni.inference.calibration_result import (
    ArticleParameter,
    ArticleValue,
    CalibrationStudy,
    LikelihoodProfile,
    ResponseBand,
)
from chladni.report import calibration_charts, identification_page, level_blocks
from chladni.view import charts
from chladni.view.chart import ChartAxis, Column, Matrix, Series
from chladni.view.chart_page import extremes, page
from chladni.view.chart_png import figure, png
from chladni_studies import study_charts

STYLE = Path(chladni.__file__).parent / "report/templates/page.css"
EVIL = '<b>$\\frac{</script><a href="javascript:x">'
F = np.linspace(10, 200, 400)
H = sum(1 / ((f0**2 - F**2) + 0.02j * f0 * F) for f0 in (30.0, 80.0, 150.0))
CURVES = {"test": (F, H), "before": (F, 1.1 * H), "after": (F, H), EVIL: (F, 2 * H)}
R = np.array([30.0, 80.0, 150.0])
TABLE = [Column("t [m]", F, log=True), Column(f"Q {EVIL}", 1 / F, nominal=0.01),
         Column("one", np.where(F > 30, 2.0, np.nan))]  # fmt: skip
SAID = study_charts.samples(TABLE)


def level_table():
    rows = tuple(
        LevelRow(k, 1e-4 * k, 50 - k, 0.1, 0.01 * k, 0.001, foretold_hz=48.0, foretold_damping=0.02)
        for k in (1, 2, 3)
    )
    curve = ((1e-4, 49.0, 0.01), (3e-4, 47.0, 0.03))
    return LevelTable("7:+Z", "softening", rows=rows, elements=(TriedElement(EVIL, 1, 3, 2, 0.5),),
                      mean_hz=48.5, mean_damping=0.02, curve=curve)  # fmt: skip


def study(count=2):
    one = ArticleValue("A", 1e-3, 9e-4, 1.1e-3, 0.01, 0.002)
    other, of = replace(one, article=EVIL), [f"E of part {k} {EVIL}" for k in range(count)]
    return CalibrationStudy(
        names=tuple(of),
        profiles=tuple(
            LikelihoodProfile(n, "Pa", (1, 2, 3, 4), (4.0, 1.0, 1.1, np.inf), (4.0, 1.0, 1.0, 4.0))
            for n in of
        ),
        articles=tuple(
            ArticleParameter(n, "m", 1e-3, 9e-4, 1e-3, 0.01, 0.0, None, (one, other)) for n in of
        ),
        bands=(ResponseBand(EVIL, True, tuple(F), tuple(F), tuple(0.5 * F), tuple(2 * F)),) * 2,
    )  # fmt: skip


CHARTS = {  # name: the chart, and words that must stand on it
    "responses": (
        lambda: charts.responses({"1:+Z": CURVES, EVIL: CURVES}, "|H| [m/N]", [(20, 100)],
                                 {"1:+Z": (F, F / 200), EVIL: (F, F / 300)}, {"worst": 1}),
        ("|H| [m/N]", "frequency [Hz]", "phase [°]", "coherence", "test", "before", "after"),
    ),
    "mac": (
        lambda: charts.mac(R, {"before": (np.eye(3), R, [(0, 0)]), "after": (np.eye(3), R, [])}),
        ("deck before [Hz]", "test [Hz]", "MAC [%]", "150.0", "100"),
    ),
    "ladder": (
        lambda: charts.ladder(R, {"before": 0.9 * R, "after": R * [1, np.nan, 1.01]}),
        ("30", "model - test [%]", "frequency of the test [Hz]"),
    ),
    "steps": (
        lambda: charts.steps({"fitted": {"nominal": 0.2, "with": 0.01}}, {"fitted": 0.005}),
        ("nominal", "Q", "0.2", "(-95 %)", "noise, fitted"),
    ),
    "odds": (
        lambda: charts.odds([(EVIL, -3.0, "named"), ("b", -300.0, "too bad")]),
        ("b", "2 ln Bayes factor", "594"),
    ),
    "fit_test": (
        lambda: charts.fit_test({"misfit": (0.5, 1.0, 0.4, 2.5), EVIL: (9, 2, 1, 4)}),
        ("misfit", "median", "not explained"),
    ),
    "stacked": (
        lambda: charts.over(charts.FREQUENCY, (ChartAxis("a [m]", log=True), [Series("", F, F)]),
                            (ChartAxis(EVIL),
                            [Series(EVIL, F, np.where(F > 30, F, np.nan), "both")])),
        ("a [m]", "frequency [Hz]"),
    ),
    "over_levels": (
        lambda: level_blocks.over_levels(level_table()),
        ("amplitude [mm]", "natural frequency [Hz]", "damping [% of critical]", "measured",
         "predicted from the others", "one linear model"),
    ),
    "profiles": (lambda: calibration_charts.profiles(study()), ("profile", "interval", "part 1")),
    "corner": (
        lambda: calibration_charts.corner(["E", EVIL], 1e-4 * np.eye(2), np.ones((9, 2)) / 100),
        ("E",),
    ),
    "articles": (
        lambda: calibration_charts.articles(study()), ("A", "± spread of units", "[%]"),
    ),
    "bands": (
        lambda: calibration_charts.bands(study()), ("90 % of the posterior", "test", "held out"),
    ),
    "circles": (
        lambda: identification_page.circles({f"{k} Hz": (H[::9], H) for k in range(3)}),
        ("Re H", "Im H", "test", "identified"),
    ),
    "slopes": (
        lambda: study_charts.slopes(np.eye(2), ["f1", EVIL], ["t", "E"]), ("f1", "E", "1.00"),
    ),
    "indices": (
        lambda: study_charts.indices(
            {name: {"first": (R, R / 9), "total": (R, None)} for name in ("f1", EVIL)},
            ["a", "b", EVIL], "index"), ("index", "first", "total"),
    ),
    "parallel": (lambda: study_charts.parallel(TABLE, SAID, 1), ("t [m]", "one", "200")),
    "spread": (
        lambda: study_charts.spread(F, np.abs(H)[None, :, None] * R[:, None, None], ["1:+Z"],
                                    "|accelerance|"),
        ("|accelerance|", "frequency [Hz]", "samples", "median"),
    ),
    "cloud": (lambda: study_charts.cloud(TABLE, SAID, 0, 1), ("t [m]",)),
    "grid": (lambda: study_charts.results_over_parameters(TABLE[:1], TABLE[1:]), ("t [m]", "one")),
}  # fmt: skip


@pytest.fixture(params=CHARTS)
def drawn(request):
    make, words = CHARTS[request.param]
    return make(), words


def numbers(values, log=False):
    """Values of a trace as a browser has them."""
    if isinstance(values, dict):
        return np.array(
            [np.nan if v is None else 10 ** (v * values["step"]) for v in values["log"]]
        )
    return np.array([np.nan if v is None else v for v in values], dtype=float)


def test_every_picture_says_what_it_shows(drawn, tmp_path):
    """Not blank; labels with units, names of curves and of rows."""
    chart, words = drawn
    with Image.open(png(chart, tmp_path / "a.png")) as image:
        assert min(image.size) > 250
        assert np.asarray(image.convert("L")).std() > 5
    said = [text.get_text() for text in figure(chart).findobj(Text) if text.get_visible()]
    assert not [word for word in words if not any(word in text for text in said)], said


def test_both_renderers_have_the_points_of_the_chart(drawn):
    """Every series in its order: all points of a page to its digits, and on paper the same."""
    chart, words = drawn
    spec = json.loads(json.dumps(page(chart), allow_nan=False, default=lambda a: a.tolist()))
    series = [s for p in chart.panels if p for s in p.series]
    traces = [t for t in spec["data"] if t["type"] != "heatmap"
              and not (t.get("hoverinfo") == "skip" and t["line"]["width"] == 0)]  # fmt: skip
    assert len(traces) == len(series)
    for s, trace in zip(series, traces, strict=True):
        base = 0.0 if s.base is None or s.kind != "bars" else s.base
        for side, due in (("x", s.x), ("y", s.y)):
            along = s.kind == "bars" and (side == "x") == s.lying
            found = numbers(trace[side]) + (base if along else 0.0)
            due = np.where(np.isfinite(due), due, np.nan)
            np.testing.assert_allclose(found, due, rtol=2e-3, atol=1e-12)
    lines = [line for ax in figure(chart).axes for line in ax.lines]
    for s in (s for s in series if s.kind in ("line", "points", "both") and s.values is None):
        same = (np.array_equal(line.get_ydata(), s.y, equal_nan=True) for line in lines)
        assert any(same)
    text = json.dumps(spec) + json.dumps(chart.panels, default=_words)
    assert not [w for w in words if w not in text and w.replace("°", "\\u00b0") not in text
                and w.replace("±", "\\u00b1") not in text]  # fmt: skip


def _words(value):
    if is_dataclass(value):
        return {f.name: getattr(value, f.name) for f in fields(value)}
    return value.tolist()


def test_names_are_words_for_plotly(drawn):
    """No text that Plotly shows holds a tag but line breaks; the lists of a reader are bare."""

    def texts(value, key=""):
        if isinstance(value, dict):
            for k, v in value.items():
                if k != "choices" and k != "brush":
                    yield from texts(v, k)
        elif isinstance(value, list):
            for v in value:
                yield from texts(v, key)
        elif isinstance(value, str):
            yield value.replace("<br>", "").replace("<extra></extra>", "")

    spec = page(drawn[0])
    options = [{k: v for k, v in o.items() if k != "text"}
               for c in spec.get("choices", ()) for o in c["options"]]  # fmt: skip
    shown = [*texts(spec), *texts(options)]
    assert not [t for t in shown if "<" in t]


def test_a_shape_between_grid_and_curves_lies_on_one_subplot(drawn):
    """Plotly looks for its subplot by both axes and fails where one is a share of the domain."""
    spec = page(drawn[0])
    options = [o for c in spec.get("choices", ()) for o in c["options"]]
    every = [*spec["layout"].get("shapes", ()), *(s for o in options for s in o.get("shapes", ()))]
    between = [s for s in every if s.get("layer") == "between"]
    assert not [s for s in between if "domain" in s["xref"] + s["yref"]]


def test_a_drag_over_samples_draws_a_box_and_moves_nothing(drawn):
    layout, brushed = page(drawn[0])["layout"], bool(drawn[0].tints_of)
    assert (layout.get("dragmode") == "select") == brushed
    if brushed:
        assert layout["xaxis"]["fixedrange"]
        assert layout["yaxis"]["fixedrange"]


def test_the_colours_of_a_page_are_known_to_its_style(drawn):
    style = STYLE.read_text(encoding="utf-8")
    text = json.dumps(page(drawn[0]), default=lambda a: a.tolist())
    for part in text.split('"@')[1:]:
        assert f"--{part.split(chr(34))[0]}:" in style


def test_a_choice_changes_what_its_view_changes():
    """The option of a view, put over the first, is the view alone."""
    chart = CHARTS["responses"][0]()
    spec = page(chart)
    for option, panels in zip(spec["choices"][0]["options"], chart.views.values(), strict=True):
        alone = page(replace(chart, views={"": panels}, choice=""))["data"]
        assert [{**t, **o} for t, o in zip(spec["data"], option["data"], strict=True)] == alone


def test_a_grid_has_the_first_panels_of_the_views():
    chart = CHARTS["responses"][0]()
    small = chart.grid(columns=2)
    assert [p.title for p in small.panels] == list(chart.views)
    assert [p.series for p in small.panels] == [p[0].series for p in chart.views.values()]


def test_vector_graphics_by_suffix(tmp_path):
    assert "<svg" in png(CHARTS["ladder"][0](), tmp_path / "plot.svg").read_text()


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: Matrix(np.eye(3), "ab", "abc", (0, 1), "MAC"), "MAC"),
        (lambda: Series("a", F, F[1:]), "'a'"),
    ],
)
def test_shapes_that_do_not_fit_are_refused(make, said):
    with pytest.raises(ShapeError, match=said):
        make()


def test_phase_is_drawn_without_vertical_lines():
    """Nothing drawn jumps by more than 270 degrees, and nothing but the jumps is left out."""
    phase = np.degrees(np.angle(np.exp(1j * np.linspace(0, 20, 200))))
    shown = charts.broken(phase)
    assert np.nanmax(np.abs(np.diff(shown))) < 270
    assert np.isnan(shown).sum() == (np.abs(np.diff(phase)) > 270).sum()


def test_no_peak_is_thinned_away():
    """Of every block the highest and the lowest value stay, whatever lies between."""
    y = np.random.default_rng(5).standard_normal(30_000)
    y[17_017], y[23_023] = 50, -50
    at = extremes(y, 400)
    assert len(at) <= 400
    assert {17_017, 23_023} <= set(at.tolist())
    np.testing.assert_array_equal(extremes(y[:300], 400), np.arange(300))


def test_no_global_state():
    code = "import sys, chladni.view.chart_png; print('matplotlib.pyplot' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(("modes", "labels"), [(5, 5), (31, 31), (90, 30)])
def test_a_ladder_of_many_modes_can_be_read_on_a_page(tmp_path, modes, labels):
    """No wider than a page shows it without shrinking, and no number on another."""
    f = np.linspace(20, 300, modes)
    chart = charts.ladder(f, {"before": 1.01 * f, "after": 0.99 * f})
    root = ElementTree.fromstring(png(chart, tmp_path / "ladder.svg").read_text())
    assert float(root.get("width").removesuffix("pt")) <= 72 * 9.3
    ticks = [x for x in root.iter() if (x.get("id") or "").startswith("xtick_")]
    assert len(ticks) == labels


def test_what_is_none_at_all_is_drawn_at_the_edge_of_a_logarithmic_axis():
    """A statistic of zero has a mark in the picture, left of all that are not zero."""
    chart = charts.fit_test({"none": (0.0, 1.0, 0.4, 2.5), "some": (9.0, 2.0, 1.0, 4.0)})
    (panel,) = chart.panels
    value = np.concatenate([s.x for s in panel.series if "explained" in s.name])
    assert panel.x.limits[0] < value.min() < 0.4
    assert 4.5 in value
    assert panel.x.limits[1] > 4.5


@pytest.mark.parametrize("count", [1, 2, 11])
def test_any_number_of_parameters_is_drawn(tmp_path, count):
    """All of them trade off: no ellipse has a width."""
    C = 1e-4 * np.ones((count, count))
    names = [f"E of part {k}" for k in range(count)]
    for chart in (calibration_charts.profiles(study(count)), calibration_charts.corner(names, C)):
        assert png(chart, tmp_path / "a.png").stat().st_size > 1000


def test_levels_show_what_was_measured_fitted_and_predicted():
    frequency, damping = level_blocks.over_levels(level_table()).panels
    of = [{s.name: s for s in p.series} for p in (frequency, damping)]
    assert list(of[0]) == ["measured", f"{EVIL}, fitted to all", "predicted from the others",
                           "one linear model"]  # fmt: skip
    np.testing.assert_allclose(of[0]["measured"].x, [0.1, 0.2, 0.3])  # mm
    np.testing.assert_allclose(of[0]["measured"].y, [49, 48, 47])
    np.testing.assert_allclose(of[1]["measured"].y, [1, 2, 3])  # %
    np.testing.assert_allclose(of[1]["measured"].ends[1] - of[1]["measured"].y, 0.2)
    np.testing.assert_allclose(of[1]["one linear model"].y, 2)


def test_a_large_study_is_cut_and_a_failed_sample_is_a_gap():
    """A sample that has no value on an axis is no line across the axes."""
    y = np.ones(study_charts.MOST + 5)
    y[1] = np.nan
    table = [Column("f", y), Column("g", np.arange(len(y), dtype=float))]
    (panel,) = study_charts.parallel(table, study_charts.samples(table), 0).panels
    lines = {int(n) for s in panel.series if s.sample is not None for n in s.sample if n >= 0}
    assert lines == set(range(study_charts.MOST)) - {1}


def test_scores_are_seen_over_decades_and_a_zero_at_the_edge():
    """A Q of zero and one of 1e-4 have their place; words say the value and the change."""
    both = charts.steps({"fitted": {"a": 1.0, "b": 1e-4}, "held out": {"a": 0.5, "b": 0.0}})
    (panel,) = both.panels
    low, high = panel.y.limits
    assert panel.y.log
    every = np.concatenate([s.y for s in panel.series])
    assert low <= every.min()
    assert every.max() < high
    assert [n.text for n in panel.notes] == ["1", "0.0001 (-100 %)", "0.5", "0 (-100 %)"]
    placed = page(both)["layout"]["annotations"]
    np.testing.assert_allclose([n["y"] for n in placed], np.log10([n.y for n in panel.notes]))
