"""The page in a real Chromium, over the WebDriver protocol (W3C): the standard library will do."""

import json
import re
import shutil
import socket
import subprocess
import time
from base64 import b64decode
from contextlib import contextmanager
from dataclasses import replace
from urllib.error import URLError
from urllib.request import Request, urlopen

import numpy as np
import pytest
from tests.builders.cases import changed_case
from tests.builders.commands import ran
from tests.builders.quick_runs import coarse_pictures

import chladni
from chladni.dynamics.frf import FRF
from chladni.geometry.formed_mesh import FormedMesh
from chladni.io.dyna import write_keyword
from chladni.output import write_npz
from chladni.report.blocks import Drawing, Section
from chladni.report.diagnosis_drawings import drawings
from chladni.report.diagnosis_folder import shown, write_diagnosis
from chladni.report.frf_charts import responses
from chladni.report.page import write_page, write_sections
from chladni.view import charts
from chladni.view.chart import ChartAxis, Column, Series
from chladni_studies import study_charts

CHROMIUM = shutil.which("chromium") or shutil.which("google-chrome")
DRIVER = shutil.which("chromedriver")
ARGUMENTS = (
    "--headless=new --no-sandbox --disable-gpu --enable-unsafe-swiftshader --disable-quic "
    "--no-first-run --disable-background-networking --disable-component-update --disable-sync "
    "--disable-dev-shm-usage --host-resolver-rules=MAP,*,~NOTFOUND"
).split()
_START, _WAIT = 120.0, 60.0  # [s] a busy machine is allowed


class Browser:
    """One page in one window."""

    def __init__(self, base):
        self.base = base

    def call(self, method, path, body=None):
        data = None if method == "GET" else json.dumps(body or {}).encode()
        request = Request(self.base + path, data, {"Content-Type": "application/json"})
        request.method = method
        with urlopen(request, timeout=_WAIT) as answer:
            return json.load(answer)["value"]

    def open(self, page):
        self.call("POST", "/url", {"url": page.resolve().as_uri()})

    def run(self, script, *arguments):
        """Value of a script's ``return``; a promise is waited for."""
        return self.call("POST", "/execute/sync", {"script": script, "args": list(arguments)})

    def until(self, script, *arguments):
        """The script's value as soon as it is true."""
        end = time.monotonic() + _WAIT
        while not (value := self.run(script, *arguments)):
            assert time.monotonic() < end, f"never true: {script}"
            time.sleep(0.2)
        return value

    def pointer(self, *steps):
        """Move, press and release: ("pointerMove", x, y), ("pointerDown",), ("pointerUp",)."""
        done = [
            {"type": kind, "button": 0, "duration": 100}
            | (dict(zip("xy", map(round, place), strict=True)) if place else {})
            for kind, *place in steps
        ]
        mouse = {"type": "pointer", "id": "mouse", "actions": done}
        self.call("POST", "/actions", {"actions": [mouse]})

    def devtools(self, command, **parameters):
        self.call("POST", "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def size(self, width, height):
        self.devtools(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=height, deviceScaleFactor=1, mobile=False,
        )  # fmt: skip

    def dark(self, on=True):
        feature = {"name": "prefers-color-scheme", "value": "dark" if on else "light"}
        self.devtools("Emulation.setEmulatedMedia", features=[feature])

    def complaints(self):
        """Console messages of level SEVERE and WARNING since the last call, but for the GPU's."""
        said = [m["message"] for m in self.call("POST", "/se/log", {"type": "browser"})]
        return [m for m in said if "readback" not in m and "GPU stall" not in m]

    def pdf(self):
        return b64decode(self.call("POST", "/print", {"background": True}))


@contextmanager
def browser(profile):
    """A browser with a profile of its own that reaches no network."""
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    quiet = subprocess.DEVNULL
    with subprocess.Popen([DRIVER, f"--port={port}"], stdout=quiet, stderr=quiet) as driver:
        try:
            yield from _session(f"http://127.0.0.1:{port}/session", profile)
        finally:
            driver.terminate()


def _session(base, profile):
    options = {"binary": CHROMIUM, "args": [*ARGUMENTS, f"--user-data-dir={profile}"]}
    wanted = {"goog:chromeOptions": options, "goog:loggingPrefs": {"browser": "WARNING"}}
    asked, end = {"capabilities": {"alwaysMatch": wanted}}, time.monotonic() + _START
    while True:
        try:
            made = Browser(base).call("POST", "", asked)
            break
        except URLError as error:
            if time.monotonic() > end or not isinstance(error.reason, ConnectionRefusedError):
                raise
            time.sleep(0.1)
    window = Browser(f"{base}/{made['sessionId']}")
    try:
        yield window
    finally:
        window.call("DELETE", "")


pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        not (CHROMIUM and DRIVER),
        reason="needs chromium and chromedriver (Debian: chromium-driver)",
    ),
]


@pytest.fixture(scope="module", autouse=True)
def _rendered(_quick):
    with coarse_pictures():
        yield


EVIL = (
    '<b>e</b></script><img src=x onerror="window.hit=1"><a href="javascript:window.hit=1">evil</a>'
)
READY = "return document.querySelector(`[data-name='${arguments[0]}']`).dataset.ready == 'yes'"
PLOT = "const plot = document.querySelector(`[data-name='${arguments[0]}'] .plot`);"
DRAWN = "return [...document.querySelectorAll('.live')].map(f => f.dataset.name)"
NAMES = {
    "where", "information", "frf", "mac", "shapes", "steps", "odds", "ladder", "left", "fit_test",
    "setup",
}  # fmt: skip


@pytest.fixture(scope="module")
def window(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.fixture(scope="module")
def folder_of_run(case, diagnosed, tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    write_diagnosis(folder, case, diagnosed, pictures=True)
    return folder


@pytest.fixture
def page(window, folder_of_run):
    """The page of a diagnosis, opened anew on a desk."""
    window.size(1280, 900)
    window.dark(False)
    window.open(folder_of_run / "report.html")
    return window


def see(page, name):
    """Scroll to a drawing and wait until it is there."""
    there = PLOT + "plot.closest('.live').scrollIntoView({ block: 'center' })"
    page.run(there, name)
    page.until(READY, name)
    page.run(there, name)  # it may have grown, and others above it


def select(page, name, label, index):
    """Choose from a list as a user does; the text that was chosen."""
    script = """
      const all = [...document.querySelectorAll(`[data-name='${arguments[0]}'] label`)];
      const list = all.find((l) => l.textContent.startsWith(arguments[1])).querySelector("select");
      list.selectedIndex = arguments[2];
      list.dispatchEvent(new Event("change"));
      return list.selectedOptions[0].text;"""
    return page.run(script, name, label, index)


def centre(page, name):
    script = PLOT + "const b = plot.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]"
    x, y, width, height = page.run(script, name)
    return x + width / 2, y + height / 2


def test_all_is_drawn_without_a_word_on_the_console_or_a_look_outside(page):
    assert set(page.run(DRAWN)) == NAMES
    for name in sorted(NAMES):
        see(page, name)
    assert page.run(
        "return document.querySelectorAll('.plot .js-plotly-plot, .plot .main-svg').length"
    )
    loaded = page.run("return performance.getEntriesByType('resource').map((e) => e.name)")
    assert all(name.startswith(("data:", "blob:")) for name in loaded)
    assert not page.complaints()


def test_all_is_drawn_while_the_page_is_never_idle(window, folder_of_run):
    """A shape that moves on a slow machine leaves no idle time; what is far down comes anyway."""
    busy = "requestIdleCallback = (run, o) => o?.timeout && setTimeout(run, o.timeout)"
    window.devtools("Page.addScriptToEvaluateOnNewDocument", source=busy, runImmediately=True)
    window.size(1280, 900)
    window.open(folder_of_run / "report.html")
    left = "document.querySelectorAll('.live[data-word]:not([data-ready])').length"
    assert window.until(f"return document.querySelector('[data-ready]') && !{left}")


def test_the_mesh_turns_where_it_is_dragged(page):
    see(page, "where")
    eye = PLOT + "return Object.values(plot._fullLayout.scene._scene.getCamera().eye)"
    before, (x, y) = page.run(eye, "where"), centre(page, "where")
    page.pointer(
        ("pointerMove", x, y), ("pointerDown",), ("pointerMove", x + 90, y + 20), ("pointerUp",)
    )
    assert page.until(
        eye + ".some((v, k) => Math.abs(v - arguments[1][k]) > 0.05)", "where", before
    )


def test_another_channel_shows_its_own_curve(page):
    see(page, "frf")
    curve = PLOT + "return plot.data[0].y.slice(0, 5)"
    values = page.run(curve, "frf")
    select(page, "frf", "channel", 3)
    page.until(PLOT + "return plot.data[0].y[0] != arguments[1][0]", "frf", values)


def test_another_mode_is_shown_and_moves(page):
    see(page, "shapes")
    frames = PLOT + "return Number(plot.dataset.frames || 0)"
    count = page.run(frames, "shapes")
    page.until(PLOT + "return Number(plot.dataset.frames) > arguments[1] + 2", "shapes", count)
    chosen = select(page, "shapes", "mode", 2).split(": ")[1]
    said = PLOT + "return plot.layout.annotations[0].text.includes(arguments[1])"
    assert page.until(said, "shapes", chosen)


def test_a_matrix_says_its_numbers_where_one_points(page):
    see(page, "mac")
    x, y = centre(page, "mac")
    page.pointer(("pointerMove", x - 300, y - 20), ("pointerMove", x - 290, y - 30))
    tip = PLOT + "return plot.querySelector('.hoverlayer').textContent"
    assert "MAC" in page.until(tip, "mac")


TITLES = PLOT + "return plot.layout.annotations.map((a) => a.text)"


def click(page, name, x, y):
    """Press at values of the axes of a chart."""
    at = (
        PLOT
        + """const b = plot.getBoundingClientRect(), { xaxis, yaxis } = plot._fullLayout;
      return [b.x + xaxis._offset + xaxis.l2p(arguments[1]),
        b.y + yaxis._offset + yaxis.l2p(arguments[2])]"""
    )
    place = page.run(at, name, x, y)
    page.pointer(("pointerMove", *place), ("pointerDown",), ("pointerUp",))


def press(page, name, word):
    """Press the button of a drawing with a word."""
    script = """const all = document.querySelectorAll(`[data-name='${arguments[0]}'] button`);
      [...all].find((b) => b.textContent == arguments[1]).click()"""
    page.run(script, name, word)


def test_a_square_of_the_matrix_opens_its_pair_of_modes(page, diagnosed):
    """The second mode of the test next to the first of the given deck, which is no pair."""
    see(page, "shapes")
    see(page, "mac")
    click(page, "mac", 0, 1)
    f = diagnosed.models.test.frequency[1]
    _, right = page.until(TITLES + f".filter((t, k, a) => a[0].includes('{f:.2f} Hz'))", "shapes")
    value = page.run(PLOT + "return plot.data[0].z[1][0]", "mac")
    assert "deck before" in right
    assert f"MAC {value / 100:.3f}"[:8] in right
    assert (
        page.run(PLOT + "return plot.closest('.live').querySelector('select').value", "shapes")
        == ""
    )


def test_a_row_of_frequencies_opens_its_pair_of_modes(page, diagnosed):
    row = "[...document.querySelectorAll('tr[data-opens=shapes]')][2]"
    page.run(f"{row}.click()")
    f = diagnosed.frequencies[2].test_hz
    page.until(
        TITLES.replace("return ", "return plot.layout && ") + f"[0].includes('{f:.2f} Hz')",
        "shapes",
    )


def test_a_sensor_opens_its_channel_and_faults_that_are_none_are_folded(window, folder, tmp_path):
    """The page of a correlation begins with matrix and shapes; paper shows what is folded."""
    ran("correlate", folder, "--out", tmp_path / "out")
    window.size(1440, 900)
    window.open(tmp_path / "out" / "report.html")
    assert window.run(DRAWN)[:2] == ["mac", "shapes"]
    for name in ("mac", "shapes"):
        window.until(READY, name)
        top = window.run(PLOT + "return plot.getBoundingClientRect().y", name)
        assert top < 500
    label = window.run("""const row = document.querySelectorAll("tr[data-opens=frf]")[1];
      row.click(); return row.cells[0].textContent""")
    chosen = PLOT + "return plot.closest('.live').querySelector('select')?.selectedOptions[0].text"
    window.until(READY, "frf")
    window.until(chosen + ".startsWith(arguments[1])", "frf", f"{label} from ")
    folded = "return [...document.querySelectorAll('details')].map((d) => d.open)"
    assert window.run(folded) == [False]
    window.pdf()
    assert window.run(folded) == [True]
    fit = "getComputedStyle(document.documentElement).getPropertyValue('--fit')"
    wide = "Math.max(...[...document.querySelectorAll('.plot')].map((p) => p.clientWidth))"
    assert 300 < window.run(f"return {fit} * {wide}") < 718  # of a sheet of A4
    assert not window.complaints()


def test_the_page_scrolls_unless_the_drawing_has_focus(page):
    see(page, "where")
    x, y = centre(page, "where")
    where = PLOT + "return [scrollY, plot.view.zoom]"
    before, zoom = page.run(where, "where")
    turn = {"type": "scroll", "x": round(x), "y": round(y), "deltaX": 0, "deltaY": 60}
    wheel = {"actions": [{"type": "wheel", "id": "wheel", "actions": [turn]}]}
    page.call("POST", "/actions", wheel)
    page.until(where + "[0] > arguments[1]", "where", before)
    assert page.run(where, "where")[1] == zoom
    see(page, "where")
    page.pointer(("pointerMove", *centre(page, "where")), ("pointerDown",), ("pointerUp",))
    still = page.run(where, "where")[0]
    page.call("POST", "/actions", wheel)
    page.until(where + "[1] != arguments[1]", "where", zoom)
    assert page.run(where, "where")[0] == still


# half the width and height that the structure takes, over those of the picture without its foot
TAKEN = """
    const { scene, _size } = plot._fullLayout, { eye, up } = scene.camera;
    const axes = ["x", "y", "z"], unit = (v) => v.map((c) => c / Math.hypot(...v));
    const e = unit(axes.map((k) => eye[k])), u = axes.map((k) => up[k]);
    const turn = (a, b, k) => a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
    const cross = (a, b) => [0, 1, 2].map((k) => turn(a, b, k));
    const right = unit(cross(u, e)), above = cross(e, right);
    const mesh = plot.data.find((t) => t.type == "mesh3d");
    const ends = axes.map((k) => scene[k + "axis"].range);
    const size = axes.map((k, n) => scene.aspectratio[k] / (ends[n][1] - ends[n][0]));
    const at = (n) => axes.map((k, a) => size[a] * (mesh[k][n] - (ends[a][0] + ends[a][1]) / 2));
    const along = (d, v) => Math.abs(d[0] * v[0] + d[1] * v[1] + d[2] * v[2]);
    const most = (d) => Math.max(...Array.from(mesh.x, (_, n) => along(d, at(n))));
    return [most(right) / (_size.w / _size.h), most(above)];"""


def test_a_structure_that_turns_stays_within_its_picture(page):
    see(page, "where")
    for views in ("start", "behind", "X", "Y", "Z", "drag"):
        if views == "drag":
            x, y = centre(page, "where")
            page.pointer(
                ("pointerMove", x, y),
                ("pointerDown",),
                ("pointerMove", x + 60, y + 130),
                ("pointerUp",),
            )
            page.until(PLOT + "return plot.view.eye[2] < 0.99", "where")
        else:
            press(page, "where", views)
        taken = page.run(PLOT + TAKEN, "where")
        assert 0.5 < max(taken) < 1
    press(page, "where", "Y")
    assert page.run(PLOT + "return plot.view.eye", "where") == [0, -1, 0]


def test_the_axes_are_in_a_corner_and_the_finding_is_named(page, diagnosed):
    """In the foot of the picture, which the structure leaves free."""
    see(page, "where")
    foot = (
        PLOT
        + """const a = plot.querySelector(".triad").getBoundingClientRect();
      const b = plot.getBoundingClientRect(); return [a.x - b.x, b.bottom - a.bottom, a.height]"""
    )
    left, bottom, high = page.run(foot, "where")
    assert abs(left) < 5
    assert abs(bottom) < 5
    assert high < 75
    names = PLOT + "return plot.data.filter((t) => t.mode == 'markers+text').flatMap((t) => t.text)"
    found = [e.name for e in diagnosed.effects]
    tied = [n for n in (diagnosed.one_of[0] if diagnosed.one_of else ()) if n not in found]
    assert set(found) <= set(page.run(names, "where")) <= {*found, *tied}


def test_a_list_of_runs_leads_to_their_pages_and_two_are_compared(window, folder, tmp_path):
    """Sorted by a click; hostile names of folders are text; charts of both in one."""
    runs = tmp_path / "runs"
    for name in ("a", '<img src=x onerror="window.hit=1">'):
        ran("frf", folder, "--input", "2:+Z", "--output", "30:+Z", "--out", runs / name)
    (runs / "not ours").mkdir()
    (runs / "not ours" / "run.json").write_text('{"command": "modes"}')
    ran("index", runs)
    ran("compare", runs / "a", runs / '<img src=x onerror="window.hit=1">', "--out", tmp_path / "c")
    window.size(390, 800)
    window.open(runs / "index.html")
    links = window.run("return [...document.querySelectorAll('td a')].map((a) => a.href)")
    assert len(links) == 2
    assert window.run("return document.documentElement.scrollWidth") <= 390
    assert window.run("return [window.hit, document.querySelector('img[src=x]')]") == [None, None]
    window.call("POST", "/url", {"url": links[1]})
    assert window.run(DRAWN) == ["frf"]
    window.open(tmp_path / "c" / "report.html")
    see(window, "frf")
    assert window.run(PLOT + "return plot.data.length", "frf") == 4  # level and phase of two runs
    assert window.run("return [window.hit, document.querySelector('img[src=x]')]") == [None, None]
    assert not window.complaints()


def test_a_table_is_sorted_by_its_head(page):
    script = """
      const named = (s) => s.querySelector("h2").textContent == "Frequencies";
      const table = [...document.querySelectorAll("section")].find(named).querySelector("table");
      table.tHead.rows[0].cells[arguments[0]].click();
      const value = (row) => parseFloat(row.cells[arguments[0]].textContent);
      return [...table.tBodies[0].rows].map(value);"""
    up, down = page.run(script, 0), page.run(script, 0)
    assert up == sorted(up)
    assert down == up[::-1]
    assert len(up) > 2


def test_a_narrow_screen_holds_all_of_it(page):
    page.size(390, 800)
    for name in sorted(NAMES):
        see(page, name)
    assert page.run("return document.documentElement.scrollWidth") <= 390


def test_drawings_follow_the_dark_scheme(page):
    see(page, "frf")
    tint = PLOT + "return plot.layout.font.color"
    light = page.run(tint, "frf")
    page.dark()
    assert page.until(PLOT + "return plot.layout.font.color != arguments[1]", "frf", light)


def test_paper_and_readers_without_scripts_get_pictures(page, folder_of_run):
    """Each drawing that has a picture is that picture there."""
    hidden = """
      const display = (f, side) => getComputedStyle(f.querySelector(side)).display;
      const both = (f) => [display(f, ".screen"), display(f, ".still")];
      const drawn = [...document.querySelectorAll(".live")];
      return drawn.filter((f) => f.querySelector("img")).map(both);"""
    see(page, "frf")
    assert ["block", "none"] in page.run(hidden)
    page.devtools("Emulation.setEmulatedMedia", media="print")
    printed = page.run(hidden)
    assert len(printed) > 5
    assert all(pair == ["none", "block"] for pair in printed)
    page.devtools("Emulation.setEmulatedMedia", media="")
    assert page.pdf().startswith(b"%PDF")
    page.devtools("Emulation.setScriptExecutionDisabled", value=True)
    try:
        page.open(folder_of_run / "report.html")
        assert page.run(hidden) == printed
    finally:
        page.devtools("Emulation.setScriptExecutionDisabled", value=False)


def test_names_are_shown_and_not_run(window, case, diagnosed, tmp_path):
    """Whatever a deck or a recording calls its parts and channels."""
    seen = shown(case, diagnosed)
    curves = {
        k: replace(c, outputs=tuple(o + EVIL for o in c.outputs)) for k, c in seen.curves.items()
    }
    marked = [replace(m, label=m.label + EVIL) for m in seen.outputs]
    seen = replace(seen, parts=[EVIL for _ in seen.parts], curves=curves, outputs=marked)
    effects = [
        replace(
            e, name=EVIL, where=replace(e.where, text=EVIL, point_m=None, grids=(), parts=(EVIL,))
        )
        for e in diagnosed.effects
    ]
    others = [replace(a, name=EVIL, why_not=EVIL) for a in diagnosed.alternatives]
    result = replace(diagnosed, effects=tuple(effects), alternatives=tuple(others))
    found = drawings(case, result, seen)
    page = write_page(tmp_path, result, {}, [EVIL], title=EVIL, command=EVIL, drawn=found)
    window.size(1280, 900)
    window.open(page)
    for name in [d.name for d in found]:
        see(window, name)
        x, y = centre(window, name)
        window.pointer(("pointerMove", x, y), ("pointerMove", x + 3, y))
    select(window, "frf", "channel", 1)
    assert EVIL[:20] in window.run(PLOT + "return plot.textContent", "odds")
    assert window.run("return window.hit") is None
    assert (
        window.run("return document.querySelectorAll('img[src=x], a[href^=javascript]').length")
        == 0
    )
    assert not window.complaints()


def curves_and_samples():
    """A page with the charts of tests and studies, its numbers small and known."""
    rng, f = np.random.default_rng(2), np.linspace(1, 99, 99)
    H = (1 / (1 - (f / 50) ** 2 + 0.02j))[:, None, None]
    test = FRF(H, f, (f"7:+Z{EVIL}",), ("2:+Z",), coherence=np.full(H.shape, 0.875))
    x = np.linspace(1, 2, 40)
    table = [
        Column(f"E {EVIL}", x), Column("t [m]", rng.permutation(x), log=True),
        Column("mode 1 [Hz]", 10 * x**2, nominal=20.0),
    ]  # fmt: skip
    said = study_charts.samples(table)
    sobol = {"first": (np.array([0.8, 0.1]), np.array([0.1, 0.1]))}
    flat = [Series(EVIL, f, np.full(99, 0.5)), Series("b", f, np.full(99, 0.4))]
    made = {
        "frf": responses({"test": test})[0],
        "lines": charts.over(charts.FREQUENCY, (ChartAxis(f"share {EVIL}", limits=(0, 1)), flat)),
        "lanes": study_charts.parallel(table, said, 2),
        "cloud": study_charts.cloud(table, said, 0, 2),
        "slopes": study_charts.slopes(np.array([[2.0, -1.0]]), [EVIL], [EVIL, "t"]),
        "sobol": study_charts.indices({EVIL: sobol}, [EVIL, "t"], "index"),
    }
    return [Section("all", [Drawing(name, chart) for name, chart in made.items()])]


@pytest.fixture
def sampled(window, tmp_path):
    """The page of :func:`curves_and_samples`, opened anew on a desk."""
    window.size(1280, 900)
    window.open(write_sections(tmp_path / "p.html", EVIL, curves_and_samples()))
    return window


def test_a_response_says_its_coherence_where_one_points(sampled):
    see(sampled, "frf")
    x, y = centre(sampled, "frf")
    sampled.pointer(("pointerMove", x, y), ("pointerMove", x + 5, y))
    tip = PLOT + "return plot.querySelector('.hoverlayer').textContent"
    assert "coherence 0.875" in sampled.until(tip, "frf")


def test_a_box_over_an_axis_keeps_the_samples_within_it(sampled):
    """The upper half of an axis of evenly spaced values holds half of the samples."""
    see(sampled, "lanes")
    count = PLOT + "return plot.parentNode.querySelector('.controls span').textContent"
    assert sampled.run(count, "lanes") == "40 of 40 samples"
    place = (
        PLOT
        + """
      const box = plot.getBoundingClientRect(), { xaxis, yaxis } = plot._fullLayout;
      return [box.x + xaxis._offset + xaxis.l2p(0), box.y + yaxis._offset + yaxis.l2p(0.5),
        box.y + yaxis._offset + yaxis.l2p(1.05)];"""
    )
    x, middle, top = sampled.run(place, "lanes")
    sampled.pointer(
        ("pointerMove", x - 15, top), ("pointerDown",), ("pointerMove", x + 5, top + 20),
        ("pointerMove", x + 15, middle), ("pointerUp",),
    )  # fmt: skip
    sampled.until(count + " == '20 of 40 samples'", "lanes")
    sampled.run(PLOT + "plot.parentNode.querySelector('button').click()", "lanes")
    sampled.until(count + " == '40 of 40 samples'", "lanes")


def test_samples_and_curves_hold_at_every_width_and_run_no_name(sampled):
    names = sampled.run(DRAWN)
    for width, dark in ((1280, False), (390, False), (1280, True)):
        sampled.size(width, 900)
        sampled.dark(dark)
        for name in names:
            see(sampled, name)
            x, y = centre(sampled, name)
            sampled.pointer(("pointerMove", x, y), ("pointerMove", x + 4, y))
        assert sampled.run("return document.documentElement.scrollWidth") <= width
    select(sampled, "cloud", "colour", 2)
    hover = PLOT + "return plot.data[0].text[0].includes('&lt;b&gt;')"
    assert sampled.run(hover, "cloud")
    assert sampled.run("return window.hit") is None
    assert sampled.run("return document.querySelectorAll('img[src=x], a[href^=java]').length") == 0
    assert not sampled.complaints()


# of the room next to the colour bar that the mesh takes, seen along the camera
SHARE_OF_WIDTH = (
    PLOT
    + """const {scene, _size} = plot._fullLayout, {eye, up} = scene.camera;
    const axes = ['x', 'y', 'z'], e = axes.map(k => eye[k]), u = axes.map(k => up[k]);
    const r = [0, 1, 2].map(k => u[(k + 1) % 3] * e[(k + 2) % 3] - u[(k + 2) % 3] * e[(k + 1) % 3]);
    const long = Math.hypot(...r), ranges = axes.map(k => scene[k + 'axis'].range);
    const size = axes.map((k, n) => scene.aspectratio[k] / (ranges[n][1] - ranges[n][0]));
    const mesh = plot.data.find(trace => trace.type == 'mesh3d' && trace.intensity);
    const seen = Array.from(mesh.x, (_, n) => Math.abs(axes.reduce((sum, k, a) =>
      sum + r[a] / long * size[a] * (mesh[k][n] - (ranges[a][0] + ranges[a][1]) / 2), 0)));
    return Math.max(...seen) / (_size.w / _size.h);"""
)


BENCH = "bench --band 20:60 --excitation"
VARIED = "study --vary t=90%:110%"
PAGES = {  # words of a command after which its case or deck comes: names of its drawings
    "modes": "shapes",
    "check": "where",
    "test": "frf_grid",
    "frf --input 2:+Z --output 30:+Z --output 7:+Z": "frf",
    "identify": "automac circles fit indicators shapes stabilisation",
    "correlate": "frf ladder mac shapes where",
    "map --units SI": "change thickness",
    "plan --sensors 6 --forbidden 16:n": "allowed mac shaker shapes where",
    f"{VARIED} --vary E=80%:120% --samples 6": "parallel responses slopes",
    f"{VARIED} --sampler morris --samples 8 --frf": "frf indices_mu_star parallel responses slopes",
    f"{BENCH} stepped-sine --resolution 2 --sweeps 2": "frf schedule",
    f"{BENCH} hammer --resolution 1 --averages 2": "frf time",
}


@pytest.mark.parametrize("command", PAGES)
def test_every_command_draws_its_page(window, folder, tmp_path, command):
    """With the same layout; at both widths, without a word on the console."""
    (name, *options), names, out = command.split(), PAGES[command].split(), tmp_path / "out"
    given = [folder]
    if name == "map":
        given = [folder / "plate.bdf", tmp_path / "formed.k"]
        form(*given)
    ran(name, *given, *options, "--out", out)
    for width in (1280, 390):
        window.size(width, 900)
        window.open(out / "report.html")
        seen = window.run(DRAWN)
        assert sorted(seen) == names
        for one in seen:
            see(window, one)
            if name == "map":
                assert 0.3 < window.run(SHARE_OF_WIDTH, one) < 1
        assert window.run("return document.documentElement.scrollWidth") <= width
    assert not window.complaints()
    if name == "identify":
        click_a_pole(window, folder)


def form(deck, path):
    """The plate of a deck, drawn thinner along its length."""
    plate = chladni.load(deck, "SI").assembly
    t = 1e-3 * (1 - 0.2 * plate.points[:, 0] / plate.points[:, 0].max())
    nodes, numbers = plate.shells.nodes, np.array([p.id for p in plate.parts])
    names = {p.id: p.name for p in plate.parts}
    part = numbers[plate.shells.part]
    write_keyword(path, FormedMesh(plate.ids, plate.points, nodes, part, t[nodes], names), "SI")


def click_a_pole(window, folder):
    """It is put into the whole line that picks it."""
    see(window, "stabilisation")
    place = (
        PLOT
        + """
      const mark = [...plot.querySelectorAll(".points path")].pop().getBoundingClientRect();
      return [mark.x + mark.width / 2, mark.y + mark.height / 2];"""
    )
    x, y = window.run(place, "stabilisation")
    window.pointer(("pointerMove", x, y), ("pointerDown",), ("pointerUp",))
    line = "return document.querySelector(`[data-name='${arguments[0]}'] code`).textContent"
    assert "--pick" in window.until(
        line + ".includes('--pick')" + " && " + line[7:], "stabilisation"
    )
    assert window.run(line, "stabilisation").startswith("chladni ")


HOSTILE = '<img src=x onerror="window.hit=1">'
EVERY = {  # command that shows results of a type: its words; the case has hostile names everywhere
    "modes": "", "check": "", "test": "", "frf": "--input 2:+Z --output 30:+Z", "identify": "",
    "correlate": "", "plan": "--sensors 4", "study": "--vary t=90%:110% --samples 4",
    "calibrate": "", "bench": "--band 20:60 --excitation hammer --resolution 1 --averages 2",
    "render": "--modes 7", "map": "--units SI",
}  # fmt: skip


@pytest.fixture(scope="module")
def hostile(folder, tmp_path_factory):
    """The case in a folder, with a part, a recording and a sensor, of a hostile name."""
    place = tmp_path_factory.mktemp("h") / HOSTILE
    changed_case(folder, place, ("frf.npz", f"{HOSTILE}.npz".replace('"', '\\"')))
    (place / "frf.npz").rename(place / f"{HOSTILE}.npz")
    deck = (place / "plate.bdf").read_text()
    named = re.sub(r"(?m)^PSHELL", f"$ANSA_NAME;1;PSHELL;{HOSTILE}\nPSHELL", deck, count=1)
    (place / "plate.bdf").write_text(named)
    return place


@pytest.mark.parametrize("command", EVERY)
def test_no_page_runs_a_hostile_name(window, hostile, tmp_path, command):
    """Of a folder, a part, a recording; and paper shows every drawing in full width."""
    given = [hostile]
    if command == "map":
        given = [hostile / "plate.bdf", tmp_path / f"{HOSTILE}.k"]
        form(*given)
    code = 3 if command == "calibrate" else 0  # its values are not to be trusted
    ran(command, *given, *EVERY[command].split(), "--out", tmp_path / HOSTILE, code=code)
    page = tmp_path / HOSTILE / "report.html"
    window.size(1280, 900)
    window.open(page)
    for name in window.run(DRAWN):
        see(window, name)
        window.pointer(("pointerMove", *centre(window, name)))
    assert window.run("return [window.hit, document.querySelector('img[src=x]')]") == [None, None]
    assert window.pdf().startswith(b"%PDF")
    assert not window.complaints()


def test_no_page_about_runs_runs_a_hostile_name(window, hostile, folder_of_run, tmp_path):
    """A list of runs, two runs and the next measurement."""
    runs = tmp_path / HOSTILE
    for name, code in (("correlate", 0), ("calibrate", 3)):
        ran(name, hostile, "--out", runs / name, code=code)
    held = dict(np.load(folder_of_run / "outlook.npz"))
    for name in ("names", "what"):
        held[name] = np.array([f"{one}{EVIL}" for one in held[name]])
    (runs / "tied").mkdir()
    write_npz(runs / "tied" / "outlook.npz", **held)
    ran("index", runs)
    ran("compare", runs / "correlate", runs / "calibrate", "--out", tmp_path / "both")
    ran("next", runs / "tied", "--out", tmp_path / "further")
    window.size(390, 900)
    for page in (runs / "index.html", *(tmp_path / n / "report.html" for n in ("both", "further"))):
        window.open(page)
        for name in window.run(DRAWN):
            see(window, name)
        found = "return [window.hit, document.querySelector('img[src=x], a[href^=javascript]')]"
        assert window.run(found) == [None, None]
        assert window.run("return document.documentElement.scrollWidth") <= 390
    assert not window.complaints()
