"""One page for each command: its words and options, and its part of the gallery."""

import re
from functools import cache
from typing import Any

from page_parts import BY, plain, summary, table
from tutorial_blocks import DOCS, PICTURE, blocks

GALLERY = DOCS / "guide" / "gallery.md"


@cache
def groups() -> dict[str, Any]:
    """Every command of the parser by its name."""
    import typer

    from chladni.cli.app import application

    group: Any = typer.main.get_command(application())
    return dict(group.commands)


def commands() -> str:
    """Every command with its picture and one sentence."""
    cards = [_card(name, command) for name, command in groups().items()]
    pages = "\n".join(f"commands/{name}" for name in groups())
    return "\n".join(
        [
            "# Commands\n",
            BY.format("its command line"),
            "`chladni COMMAND --help` says the same on a terminal.\n",
            "::::{container} cards\n" + "\n".join(cards) + "\n::::\n",
            f"```{{toctree}}\n:hidden:\n\n{pages}\n```\n",
        ]
    )


def _card(name: str, command: Any) -> str:
    pictures = PICTURE.findall(example(name))
    shown = "![{}]({}_build/tutorials/{})\n\n".format(*pictures[0]) if pictures else ""
    said = summary(command.help)
    return f":::{{container}} card\n**[{name}](commands/{name}.md)**\n\n{shown}{said}\n:::"


def example(name: str) -> str:
    """The section of the gallery about a command."""
    found = re.search(
        rf"^### chladni {name}\n\n(.*?)(?=^##|\Z)",
        GALLERY.read_text(encoding="utf-8"),
        re.MULTILINE | re.DOTALL,
    )
    return found[1].rstrip() if found else ""


def outputs(name: str, of_gallery: list[str] | None) -> list[str]:
    """Outputs of the example of a command, from those of the whole gallery."""
    texts = [b.text for b in blocks(GALLERY.read_text(encoding="utf-8")) if b.runs]
    printed = dict(zip(texts, of_gallery or [], strict=False))
    return [printed.get(b.text, "") for b in blocks(example(name)) if b.runs]


def command_page(name: str) -> str:
    """Usage, words and options of a command, and its example."""
    command = groups()[name]
    steps = getattr(command, "commands", {})
    own = [] if steps else [_usage(f"chladni {name}", command)]
    for step, inner in steps.items():
        whole = f"chladni {name} {step}"
        own.append(f"## {whole}\n\n{plain(inner.help)}\n\n{_usage(whole, inner)}")
    link = f"[the gallery](../../guide/gallery.md#chladni-{name})"
    return "\n".join(
        [
            f"# chladni {name}\n\n{plain(command.help)}\n",
            *own,
            f"## Example\n\n{example(name).replace('](../_build', '](../../_build')}\n",
            f"This is a part of {link}, where the files come from.\n",
        ]
    )


def _usage(name: str, command: Any) -> str:
    arguments = [p for p in command.params if p.param_type_name == "argument"]
    options = [p for p in command.params if p.param_type_name == "option"]
    words = [
        (p.metavar or p.name.upper()) if p.required else f"[{p.metavar or p.name.upper()}]"
        for p in arguments
    ]
    words = [f"{w}..." if p.nargs == -1 else w for w, p in zip(words, arguments, strict=True)]
    usage = " ".join([name, "[OPTIONS]", *words])
    rows = [(f"`{w}`", p.help or "", "") for w, p in zip(words, arguments, strict=True)]
    rows += [(_option(p), p.help or "", _default(p)) for p in options if not p.hidden]
    return f"```text\n{usage}\n```\n\n{table(('word', 'meaning', 'default'), rows)}"


def _option(p: Any) -> str:
    if p.is_flag:
        return ", ".join(f"`{o}`" for o in [*p.opts, *p.secondary_opts])
    kind = re.sub(r"<class '|'>|pathlib\.|list\[|\]", "", str(p.type_descriptor.annotation))
    named = {"Path": "FILE", "int": "N", "float": "X", "str": "TEXT"}.get(kind, "TEXT")
    return f"`{p.opts[0]} {p.metavar or named}`" + (" (may be repeated)" if p.multiple else "")


def _default(p: Any) -> str:
    none = p.default is None or p.default is False or callable(p.default)
    return "" if none else f"`{p.default}`"
