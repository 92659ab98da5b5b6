"""Names in text lead to their page: commands, Python names, effects, cards, environments.

A writer types a name as code, ``chladni plan``, and no link. Each build finds the page.
"""

import re
from functools import cache
from typing import Any

from docutils import nodes

CARDS = "reference/cards"


def setup(app: Any) -> None:
    """Link the names of every page just before it is written."""
    app.connect("doctree-resolved", _link)


@cache
def places() -> dict[str, tuple[str, str]]:
    """Page and anchor of every name."""
    import command_pages
    import object_pages

    from chladni.effects.registry import BUILT_IN
    from chladni.io.nastran.text.cards import FIELDS
    from chladni_envs import IDS

    out = {card: (CARDS, f"#card-{card.lower()}") for card in FIELDS}
    out |= {family.name: ("reference/effects", f"#{family.name}") for family in BUILT_IN}
    out |= {i: ("reference/environments", f"#{i.replace('/', '').lower()}") for i in IDS}
    out |= {f"chladni {c}": (f"reference/commands/{c}", "") for c in command_pages.groups()}
    for name, page in object_pages.full_names().items():
        out[name] = (f"reference/python/{page}", "")
        package, _, own = name.rpartition(".")
        if package == "chladni" and own[0].isupper():
            out[own] = out[name]
    return out


def place(text: str) -> tuple[str, str] | None:
    """Page and anchor that code is about: a name, a call of it, a command with its words."""
    command = re.match(r"chladni [a-z-]+", text)
    call = re.match(r"[\w.]+(?=\()", text)
    return places().get(command[0] if command else call[0] if call else text)


def _link(app: Any, page: nodes.document, name: str) -> None:
    for code in list(page.findall(nodes.literal)):
        found = place(code.astext())
        if found is None or _is_linked(code):
            continue
        target, anchor = found
        if target != name:
            uri = app.builder.get_relative_uri(name, target) + anchor
            link = nodes.reference("", "", internal=True, refuri=uri)
            code.replace_self(link)
            link += code
        elif name == CARDS and anchor[1:] not in page.ids:
            page.ids[anchor[1:]] = code
            code["ids"].append(anchor[1:])


def _is_linked(node: nodes.Node) -> bool:
    """True within a link or a heading, which the table of contents repeats."""
    above = node.parent
    while above is not None:
        if isinstance(above, nodes.reference | nodes.title):
            return True
        above = above.parent
    return False
