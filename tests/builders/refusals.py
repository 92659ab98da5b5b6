"""Refusals: what is wrong with an input, and the one sentence that says so."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from chladni.errors import ChladniError


def says(
    said: str,
    refused: Callable[..., Any],
    *given: Any,
    error: type[BaseException] = ChladniError,
    **named: Any,
) -> str:
    """Assert that a call is refused in one sentence in which a pattern is found.

    Returns the sentence.
    """
    with pytest.raises(error, match=said) as caught:
        refused(*given, **named)
    sentence = str(caught.value)
    assert "\n" not in sentence
    return sentence


def refusals(table: Path) -> pytest.MarkDecorator:
    """Cases (kind, damage, said) of a table of text.

    Its lines are ``damage || sentence``, below the [kind] of input that is damaged. The sentence is
    a pattern. In a damage, \\n ends a line.
    """
    kind, cases = "", []
    for line in table.read_text(encoding="utf-8").splitlines():
        damage, mark, said = (word.strip() for word in f" {line}".partition(" || "))
        if mark:
            cases.append((kind, damage.replace(r"\n", "\n"), said))
        elif line.startswith("["):
            kind = line.strip("[]")
    return pytest.mark.parametrize(("kind", "damage", "said"), cases, ids=[c[2] for c in cases])


def damaged(text: str, damage: str) -> str:
    """The text with each damage: ``old => new`` in its first place, ``+ more`` at its end."""
    for part in damage.split(" & "):
        if part.startswith("+ "):
            text += part[2:] + "\n"
        else:
            old, _, new = part.partition(" =>")
            assert old in text, f"there is no {old!r} to damage"
            text = text.replace(old, new.removeprefix(" "), 1)
    return text
