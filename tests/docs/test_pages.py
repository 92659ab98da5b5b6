"""The documents hang together, and what is written from the program is whole; without Sphinx."""

import doctest
import importlib.util
import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from chladni.cli import app
from chladni.effects import registry

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
EXAMPLES = DOCS / "examples.md"
GALLERY = DOCS / "guide" / "gallery.md"
TUTORIALS = sorted((DOCS / "tutorials").glob("*.md"))
LINK = re.compile(r"(?<!`)\[[^\]\[]*\]\(([^)\s]+)\)")


def module(name):
    """A script of the folder of documents."""
    spec = importlib.util.spec_from_file_location(f"docs_{name}", DOCS / f"{name}.py")
    made = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = made
    sys.path.insert(0, str(DOCS))  # its neighbours
    try:
        spec.loader.exec_module(made)
    finally:
        sys.path.remove(str(DOCS))
    return made


@pytest.fixture(scope="module")
def reference():
    return module("reference_pages")


@pytest.fixture(scope="module")
def tutorial_blocks():
    return module("tutorial_blocks")


@pytest.fixture(scope="module")
def pages(reference):
    """Every page of the site by its path, with its text; "" for those that the build writes."""
    kept = [p for p in DOCS.rglob("*.md") if "_build" not in p.parts]
    made = {
        DOCS / "reference" / f"{name}.md": page() if name in ("commands", "python") else ""
        for name, page in reference.pages().items()
    }
    return {**{p: p.read_text(encoding="utf-8") for p in kept}, **made}


def plain(text):
    """A page without its blocks and code."""
    return re.sub(r"`[^`\n]*`", "", re.sub(r"```.*?```", "", text, flags=re.DOTALL))


def anchors(text):
    """Anchors of the headings, as GitHub and MyST make them."""
    heads = re.findall(r"^#+ (.*)$", text, re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", h.lower()).strip().replace(" ", "-") for h in heads}


def test_every_page_is_in_a_table_of_contents(pages):
    listed = set()
    for page, text in pages.items():
        for tree in re.findall(r"```\{toctree\}\n(.*?)```", text, re.DOTALL):
            names = [n for n in tree.split() if not n.startswith(":") and not n.isdigit()]
            listed |= {(page.parent / f"{n}.md").resolve() for n in names}
    assert set(pages) - listed == {DOCS / "index.md"}
    assert not listed - set(pages)


def test_every_link_within_leads_to_a_page_and_a_heading(pages):
    lost = []
    for page, text in {**pages, ROOT / "README.md": (ROOT / "README.md").read_text()}.items():
        for target in LINK.findall(plain(text)):
            if re.match(r"[a-z]+:", target) or "_build" in target:
                continue
            name, _, anchor = target.partition("#")
            path = (page.parent / name).resolve() if name else page
            there = path in pages or path.exists()
            if not there or (anchor and pages.get(path) and anchor not in anchors(pages[path])):
                lost.append((page.name, target))
    assert not lost


def test_every_key_of_a_diagnosis_is_explained(reference):
    keys = reference.json_keys()
    assert {
        "verdict", "effects[].where.point_m", "fit.held_out.Q_with_effect",
        "levels[].elements[].numbers[].low", "states[].state",
    } <= {key for key, _, _ in keys}  # fmt: skip
    assert not [key for key, _, meaning in keys if not meaning and key.count(".") == 0]


def test_a_key_that_no_class_documents_is_refused(reference, monkeypatch):
    monkeypatch.setitem(reference._CLASSES, "mass", ("Remainder",))
    with pytest.raises(KeyError, match=r"mass\.weighed_kg"):
        reference.json_keys()


def test_every_command_has_a_page_with_an_example_of_it(reference):
    commands = reference.command_pages
    assert set(commands.groups()) == set(app.commands())
    index = commands.commands()
    for name in app.commands():
        assert f"**[{name}](commands/{name}.md)**" in index
        page = commands.command_page(name)
        assert page.startswith(f"# chladni {name}\n")
        assert re.search(rf"```sh\n(.*\n)*?chladni {name}\b", commands.example(name)), name
    assert "`--detect`" in commands.command_page("plan")


def test_every_word_and_option_has_a_meaning(reference):
    pages = map(reference.command_pages.command_page, reference.command_pages.groups())
    rows = re.findall(r"^\| (`[^|]*) \| ([^|]*) \|", "\n".join(pages), re.MULTILINE)
    assert rows
    assert not [word for word, meaning in rows if not meaning.strip()]


def test_small_pictures_are_those_of_the_pages_and_light(tutorial_blocks):
    """The gallery has all of its pictures, so that a quick build shows them."""
    gallery = {tutorial_blocks.small(p) for p in tutorial_blocks.pictures(GALLERY)}
    used = gallery.union(
        *(map(tutorial_blocks.small, tutorial_blocks.pictures(page)) for page in TUTORIALS)
    )
    kept = set((DOCS / "pictures").iterdir())
    assert not gallery - kept
    assert not kept - used
    assert sum(path.stat().st_size for path in kept) < 400e3


@pytest.mark.parametrize(
    "title",
    [
        pytest.param(title, marks=[pytest.mark.slow] if slow else [])
        for title, slow in re.findall(
            r"^## (.*)\n\n(<!-- slow -->)?", EXAMPLES.read_text(encoding="utf-8"), re.MULTILINE
        )
    ],
)
def test_an_example_prints_what_it_says(reference, title, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (one,) = (e for e in reference.object_pages.examples() if e.title == title)
    for needed in re.findall(r"^<!-- needs: (\w+) -->", one.text):
        pytest.importorskip(needed)
    text = re.sub(r"^```.*$", "", one.text, flags=re.MULTILINE)
    given = doctest.DocTestParser().get_doctest(text, {}, title, str(EXAMPLES), 0)
    said = []
    runner = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE)
    assert runner.run(given, out=said.append).failed == 0, "".join(said)


def test_every_public_object_has_an_example(reference):
    pages = reference.object_pages
    bare = [
        one.full
        for one in pages.public_objects().values()
        if not pages.of_object(one) and ">>>" not in (one.value.__doc__ or "")
    ]
    assert bare == []


def test_links_of_an_example_lead_somewhere_on_the_page_of_an_object(reference):
    pages, folder = reference.object_pages, DOCS / "reference" / "python"
    made = {folder.parent / f"{name}.md" for name in reference.pages()}
    for one in pages.public_objects().values():
        for target in LINK.findall(plain(pages.object_page(one))):
            path = (folder / target.partition("#")[0]).resolve()
            assert path in made or path.is_file(), (one.full, target)


def test_names_of_pages_differ_by_more_than_case(reference):
    names = [name.lower() for name in reference.object_pages.public_objects()]
    assert len(set(names)) == len(names) > 150


@pytest.mark.parametrize(
    ("text", "page"),
    [
        ("chladni.diagnose", "reference/python/chladni.diagnose"),
        ('chladni.diagnose("deck.bdf")', "reference/python/chladni.diagnose"),
        ("chladni.exchange.to_xarray", "reference/python/chladni.to_xarray"),
        ("FRF", "reference/python/chladni.FRF"),
        ("chladni plan deck.bdf --units mm-t-s", "reference/commands/plan"),
        ("CQUAD4", "reference/cards#card-cquad4"),
        ("point-mass", "reference/effects#point-mass"),
        ("chladni/SensorPlacement-v0", "reference/environments#chladnisensorplacement-v0"),
        ("point-mass at 412=1e-5:2e-4", None),
        ("chladni.nothing", None),
        ("frequency", None),
    ],
)
def test_names_in_text_lead_to_their_page(text, page):
    place = module("name_links").place(text)
    assert (place and "".join(place)) == page


def test_literal_blocks_of_docstrings_are_blocks(reference):
    text = reference.plain("Three lines::\n\n    a = 1\n\n    b = ``2``\n\nEnd.")
    assert text.startswith("Three lines:\n\n~~~python\na = 1\n\nb =")
    assert text.endswith("~~~\n\nEnd.")


def test_brackets_about_a_fraction_are_stretched():
    """Those about a symbol are not; a bar has no space; ln has."""
    formula = module("mathml").formula
    high = formula(r"\left(\frac{a}{b}\right)^2 + \left(c\right)")
    assert high.count("stretched") == 2
    assert "<mo>(</mo>" in high
    assert 'lspace="0" rspace="0">|' in formula("|x|")
    assert "mspace" in formula(r"2 \ln p")


def test_a_link_that_leads_nowhere_is_named(tmp_path):
    (tmp_path / "there").mkdir()
    (tmp_path / "a.html").write_text(
        '<p id="x"><a href="#x"></a><a href="#y"></a><a href="there/b.html#z"></a>'
        '<a href="there/b.html#w%20v"></a><img src="c.png"><a href="https://nowhere.invalid/"></a>'
    )
    (tmp_path / "there/b.html").write_text('<p id="w v"><a href="../a.html?q=1"></a>')
    assert list(module("links").broken(tmp_path)) == [
        "a.html: #y",
        "a.html: there/b.html#z",
        "a.html: c.png",
    ]


def test_every_exit_code_has_a_meaning(reference):
    """The constants of the command line, and no other."""
    codes = {n for n, v in vars(app).items() if n.isupper() and type(v) is int}
    assert codes == set(reference._CODES)


def test_cards_and_rules_are_listed(reference):
    from chladni.io.nastran.text.cards import FIELDS
    from chladni.search.decision_rules import DecisionRules

    cards, rules = reference.cards(), reference.decision_rules()
    assert not [n for n in FIELDS if f"| `{n}` |" not in cards]
    assert not [n for n in DecisionRules.__dataclass_fields__ if f"| `{n}` |" not in rules]


def test_an_effect_states_claim_formula_prior_and_what_it_is_mistaken_for(reference, grounds):
    text = reference._effect(registry.family("point-mass"), grounds)
    for part in ("M + m Σ bᵀb", "`CONM2`", "[mass-patch](#mass-patch)", "| M | kg |", "weigh"):
        assert part in text, part


@pytest.fixture(scope="module")
def grounds(reference):
    return reference._Grounds()


def test_a_mass_lowers_every_frequency_that_it_moves(reference, grounds):
    """Rayleigh: added mass raises no frequency; these eight modes keep their order."""
    family = registry.family("point-mass")
    one = reference.effect_signatures.signature(family, grounds.of(family).article)
    assert one.shifts[:8].max() < 1e-3
    assert one.shifts[:8].min() < -1
    assert np.abs(one.after / one.before - 1).max() > 0.5


def test_a_faulty_channel_moves_no_frequency_and_scales_its_response(reference, grounds, tmp_path):
    family = registry.family("sensor-fault")
    one = reference.effect_signatures.signature(family, grounds.of(family).article)
    np.testing.assert_allclose(one.shifts, 0, atol=1e-9)
    np.testing.assert_allclose(one.after / one.before, one.truth["gain"])
    picture = reference.effect_signatures.draw(tmp_path / "a.png", one)
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_effects_show_their_signature_and_how_often_they_were_named(
    reference, grounds, tmp_path, monkeypatch
):
    family = registry.family("point-mass")
    kept = tmp_path / "score.json"
    monkeypatch.setattr(reference, "BLIND_SCORE", kept)
    text = reference._effect(family, grounds)
    assert "](signatures/point-mass.png)" in text
    assert "| not measured: no report is kept |" in text
    rows = [("point-mass", "right"), ("point-mass", "none"), ("crack", "right")]
    kept.write_text(json.dumps([{"effect": e, "outcome": o} for e, o in rows]))
    assert "| 1 of 2 |" in reference._effect(family, grounds)
    assert "not measured" in reference._named_right("suspension")


def test_every_error_sentence_has_a_cure(reference, tmp_path):
    """That of the sentence, else a place to look, which is a page."""
    every = reference.error_sentences.sentences()
    assert len(every) > 500
    assert all(s.cure for s in every)
    text = reference.refusals()
    for kind in ("no case.toml in the folder", "chladni init DECK RECORDING", "| `3` |",
                 "## chladni_planning"):  # fmt: skip
        assert kind in text, kind
    folder = DOCS / "reference"
    made = {folder / f"{name}.md" for name in reference.pages()}
    for link in set(re.findall(r"\]\(([^)#]+)\)", " ".join(s.cure for s in every))):
        path = (folder / link).resolve()
        assert path in made or path.is_file(), link
    source = tmp_path / "chladni/io/uff/a.py"
    source.parent.mkdir(parents=True)
    source.write_text("def f(x):\n    raise FileError(f\"{x}: no '{x}' here; give one\")\n")
    (found,) = reference.error_sentences.sentences(tmp_path)
    assert (found.room, found.text, found.cure) == (
        "io.uff",
        "…: no '…' here; give one",
        "give one",
    )


def test_every_kind_of_error_has_a_cure(reference):
    from chladni import errors

    kinds = {n for n, v in vars(errors).items() if isinstance(v, type)
             and issubclass(v, BaseException)}  # fmt: skip
    assert kinds == set(reference._CURES)


def test_the_picture_of_the_readme_moves_and_is_small():
    (path,) = re.findall(r"!\[[^\]]*\]\(([^)]+)\)", (ROOT / "README.md").read_text())
    with Image.open(ROOT / path) as picture:
        assert picture.n_frames > 8
    assert (ROOT / path).stat().st_size < 1e6


def test_blocks_run_in_order_and_show_what_they_print(tutorial_blocks, tmp_path, monkeypatch):
    monkeypatch.setattr(tutorial_blocks, "RUNS", tmp_path / "runs")
    page = tmp_path / "page.md"
    page.write_text(
        "```python file=a/one.txt\nhello\n```\n\n```sh\ncat a/one.txt\n```\n\n"
        "```sh exit=2\necho no >&2\nexit 2\n```\n\n```sh run=no\nexit 5\n```\n"
    )
    outputs = tutorial_blocks.run(page)
    assert outputs == ["hello\n", "no\n"]
    shown = tutorial_blocks.shown(page, outputs)
    assert shown.index("cat a/one.txt") < shown.index(":class: output") < shown.index("exit=2")
    page.write_text("```sh\nexit 3\n```\n")
    with pytest.raises(tutorial_blocks.BlockError, match="exit code 3, not 0"):
        tutorial_blocks.run(page)


def test_a_page_without_its_data_is_shown_without_pictures(tutorial_blocks, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("<!-- needs: nowhere -->\n![Of it](../_build/tutorials/page/a.png)\n")
    assert tutorial_blocks.run(page) is None
    assert "a.png" not in tutorial_blocks.shown(page, None)


@pytest.mark.parametrize("page", [*TUTORIALS, GALLERY], ids=lambda p: p.stem)
def test_every_picture_of_a_tutorial_comes_from_its_own_run(page):
    for path in re.findall(r"!\[[^\]]*\]\(([^)]*)\)", page.read_text(encoding="utf-8")):
        assert path.startswith(f"../_build/tutorials/{page.stem}/"), path
