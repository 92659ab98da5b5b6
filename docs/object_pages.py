"""One page for each public object of Python, with an example that runs.

The example is that of the docstring, or the first section of ``docs/examples.md`` that uses the
object. ``tests/docs`` runs these sections, pytest the docstrings.
"""

import ast
import inspect
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from doctest import DocTestParser
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any

from page_parts import BY, plain, summary, table

EXAMPLES = Path(__file__).parent / "examples.md"
_EXPORTS = {
    "chladni": "The names a script starts from",
    "chladni.io.other_packages": "`chladni.exchange`, to and from other packages",
    "chladni_planning": "Planning a test",
    "chladni_bench": "The virtual bench",
    "chladni_studies": "Parameter studies",
    "chladni.errors": "Errors",
    "chladni.effects.effect": "To write an effect: the base class",
    "chladni.effects.family": "To write an effect: its family",
    "chladni.effects.registry": "To write an effect: the registry",
    "chladni.io.nastran": "Nastran decks and results",
    "chladni_specimens.plates": "Generated plates",
    "chladni_envs.agents": "Agents that play the known methods",
}


@dataclass(frozen=True)
class PublicObject:
    """A class or function and the package that shows it."""

    package: str
    name: str
    value: Any

    @property
    def full(self) -> str:
        """Name with its package."""
        return f"{self.package}.{self.name}"


@dataclass(frozen=True)
class Example:
    """A section of ``docs/examples.md``: its heading, its Markdown, the objects that it names."""

    title: str
    text: str
    uses: frozenset[int]  # ids of the objects

    @property
    def anchor(self) -> str:
        """Its place in the page."""
        return re.sub(r"[^\w\- ]", "", self.title.lower()).replace(" ", "-")


@cache
def public_objects() -> dict[str, PublicObject]:
    """Public objects by the name of their page, each object once.

    Some file systems take FRF and frf for one name: the second of them says what it is.
    """
    out: dict[str, PublicObject] = {}
    shown, taken = set[int](), set[str]()
    for package in _EXPORTS:
        module = import_module(package)
        for name in _public_names(module):
            value = getattr(module, name)
            if id(value) in shown or not (inspect.isclass(value) or inspect.isroutine(value)):
                continue
            shown.add(id(value))
            page = f"{package}.{name}"
            page += "-function" if page.lower() in taken else ""
            taken.add(page.lower())
            out[page] = PublicObject(package, name, value)
    return out


def full_names() -> dict[str, str]:
    """Page of each name with its package; an object of several packages has several names."""
    pages = {id(one.value): page for page, one in public_objects().items()}
    return {
        f"{package.replace('chladni.io.other_packages', 'chladni.exchange')}.{name}": pages[key]
        for package in _EXPORTS
        for name in _public_names(import_module(package))
        if (key := id(getattr(import_module(package), name))) in pages
    }


def _public_names(module: Any) -> Iterable[str]:
    own = [n for n, v in vars(module).items() if getattr(v, "__module__", "") == module.__name__]
    names = vars(module) if hasattr(module, "__path__") else own
    return getattr(module, "__all__", None) or [n for n in names if not n.startswith("_")]


@cache
def examples() -> tuple[Example, ...]:
    """The sections of ``docs/examples.md``."""
    _, *parts = re.split(r"^## (.*)$", EXAMPLES.read_text(encoding="utf-8"), flags=re.MULTILINE)
    pairs = zip(parts[::2], parts[1::2], strict=True)
    return tuple(Example(title, text.strip(), frozenset(_used(text))) for title, text in pairs)


def _used(text: str) -> Iterator[int]:
    """Ids of the objects that code names, by import or as an attribute of a package."""
    for step in DocTestParser().get_examples(text.replace("```", "")):
        for node in ast.walk(ast.parse(step.source)):
            if isinstance(node, ast.ImportFrom):
                yield from (
                    id(getattr(import_module(str(node.module)), n.name)) for n in node.names
                )
            elif isinstance(node, ast.Attribute):
                whole = ast.unparse(node)
                if re.fullmatch(r"chladni(\.exchange)?\.\w+", whole):
                    yield id(_resolved(whole))


def _resolved(whole: str) -> object:
    """The object of a name that begins with its package."""
    package, *names = whole.split(".")
    found: object = import_module(package)
    for name in names:
        found = getattr(found, name)
    return found


def python_interface() -> str:
    """The packages and their public names with a line each."""
    out = ["# Python interface\n", BY.format("its docstrings")]
    out.append("[Examples that run](../examples.md) show most of these names at work.\n")
    for package, title in _EXPORTS.items():
        rows = [
            (f"[`{one.name}`](python/{page}.md)", summary(inspect.getdoc(one.value)))
            for page, one in public_objects().items()
            if one.package == package
        ]
        about = plain(import_module(package).__doc__)
        out += [f"## {title}: `{package}`\n", about, "", table(("name", "summary"), rows)]
    names = "\n".join(f"python/{page}" for page in public_objects())
    return "\n".join([*out, f"```{{toctree}}\n:hidden:\n\n{names}\n```\n"])


def object_page(one: PublicObject) -> str:
    """Signature, docstring and an example."""
    is_class = inspect.isclass(one.value)
    directive = f".. auto{'class' if is_class else 'function'}:: {one.full}"
    members = "\n   :members:" if is_class else ""
    out = [f"# {one.full}\n", f"```{{eval-rst}}\n{directive}{members}\n```\n"]
    links = [f"[{e.title}](../../examples.md#{e.anchor})" for e in of_object(one)]
    if links and ">>>" not in (inspect.getdoc(one.value) or ""):
        text = re.sub(r"\]\((?![a-z]+:|#)", "](../../", of_object(one)[0].text)
        out.append(f"## Example: {links.pop(0)}\n\n{text}\n")
    if links:
        out.append(f"Also in the examples {', '.join(links)}.\n")
    return "\n".join([*out, "[All names](../python.md)\n"])


def of_object(one: PublicObject) -> list[Example]:
    """The examples that name an object."""
    return [e for e in examples() if id(one.value) in e.uses]
