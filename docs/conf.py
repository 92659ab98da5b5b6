"""The documentation site: MyST pages, and reference pages that the program itself writes.

``sphinx-build -W docs docs/_build/html`` builds all of it and runs the tutorials (minutes, the
first time); ``-t quick`` leaves the tutorials' results out.
"""

import re
import sys
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path.insert(0, str(DOCS))

import command_pages  # noqa: E402
import mathml  # noqa: E402
import name_links  # noqa: E402
import reference_pages  # noqa: E402
import tutorial_blocks  # noqa: E402

from chladni.output import own_version  # noqa: E402

project = "chladni"
copyright = "the authors of chladni"
version = release = own_version()

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.githubpages",  # that host serves folders such as _static with its mark alone
    "numpydoc",
]
myst_enable_extensions = ["dollarmath", "deflist", "colon_fence"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "first_day.ipynb"]
suppress_warnings = ["config.cache"]
highlight_language = "none"
smartquotes_action = "qe"  # --option keeps its dashes

autodoc_typehints = "none"  # the signature of a docstring says shapes and units
autodoc_preserve_defaults = True
autodoc_member_order = "bysource"
autosummary_generate = False
numpydoc_show_class_members = False
numpydoc_xref_param_type = False

html_theme = "pydata_sphinx_theme"
html_title = "chladni"
html_context = {"default_mode": "auto"}  # light or dark as the browser says
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_copy_source = False
html_math_renderer = "mathml"
html_theme_options = {
    "navigation_with_keys": False,
    "show_toc_level": 2,
    "navigation_depth": 2,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
    "navbar_align": "left",
}


def _bars(app: Any, what: str, name: str, value: object, options: object, lines: list[str]) -> None:
    """Escape the bars of formulas, |φ|², which reStructuredText takes for substitutions."""
    lines[:] = [x if x.lstrip().startswith(">>>") else x.replace("|", r"\|") for x in lines]


def _described(
    app: Any, what: str, name: str, value: object, options: object, lines: list[str]
) -> None:
    """Take ``name : meaning`` of parameters and attributes as their meaning, not as a type."""
    section, out = "", []
    for line, below in zip(lines, [*lines[1:], ""], strict=True):
        section = line if re.fullmatch("-{3,}", below) else section
        found = re.fullmatch(r"(\*{0,2}\w+(?:, \w+)*) : (.+)", line)
        listed = found is not None and section in ("Parameters", "Attributes")
        out += [found[1], f"    {found[2]}"] if listed else [line]
    lines[:] = out


def setup(app: Any) -> None:
    """Write the reference, run the tutorials, and show what they printed and drew."""
    mathml.setup(app)
    name_links.setup(app)
    quick = app.tags.has("quick")
    runs = [*sorted((DOCS / "tutorials").glob("*.md")), command_pages.GALLERY]
    outputs: dict[Path, list[str] | None] = dict.fromkeys(runs)

    def run(app: Any) -> None:
        if not quick:
            outputs.update((page, tutorial_blocks.run(page)) for page in runs)

    def show(app: Any, name: str, source: list[str]) -> None:
        page = DOCS / f"{name}.md"
        own = outputs.get(page)
        if page.parent.name == "commands":
            own = command_pages.outputs(page.stem, outputs[command_pages.GALLERY])
        if page in outputs or "_build/tutorials" in source[0]:
            source[0] = tutorial_blocks.shown(page, own)

    reference_pages.write(DOCS / "reference")
    app.connect("builder-inited", run)
    app.connect("source-read", show)
    app.connect("autodoc-process-docstring", _described, priority=400)  # before numpydoc
    app.connect("autodoc-process-docstring", _bars, priority=600)  # after numpydoc
