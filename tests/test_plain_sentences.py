"""Sentences a user reads: on the page, in ``--help``, in notes and in errors.

Rules: no sentence opens with a word that turns the order of subject and verb round, no word of an
older style, and no clause too long to be read once. A value in braces counts as one word, and a
list of names is no clause.
"""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
import typer

from chladni.cli.app import application

SOURCE = Path(__file__).parents[1] / "src"
OPENINGS = {"What", "Whether", "Of", "Those", "Who", "Whose", "Whoever", "Nor", "Than"}
OLD_WORDS = {
    "asked", "beside", "borne", "foretell", "foretells", "foretold", "heard", "hence", "lest",
    "nought", "therein", "thereof", "thereupon", "told", "upon",
}  # fmt: skip
LONGEST = 26  # words of a clause
SHORTEST = 5  # words of a text that counts as a sentence


def faults(text: str) -> list[str]:
    """The rules that a text breaks."""
    text = re.sub(r"`[^`]*`", "x", " ".join(text.split()))
    found = []
    for sentence in re.split(r"(?<=[.!?])\s+(?=[A-Z])", text):
        if sentence.split()[:1] and sentence.split()[0] in OPENINGS:
            found.append(f"opens with {sentence.split()[0]}: {sentence}")
        for clause in re.split(r"[.;:]\s", sentence):
            words = clause.split()
            if len(words) > LONGEST and sum(w.endswith(",") for w in words) < len(words) / 2:
                found.append(f"{len(words)} words in a clause: {clause}")
    old = OLD_WORDS & set(re.findall(r"[a-z]+", text.lower()))
    return found + [f"{word}: {text}" for word in sorted(old)]


def text_of(node: ast.expr) -> str | None:
    """A text with its values as one letter, or None if the node is no text."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        return node.value
    if isinstance(node, ast.JoinedStr):
        return "".join(v.value if isinstance(v, ast.Constant) else "x" for v in node.values)  # type: ignore[misc]
    return None


def messages(path: Path) -> Iterator[str]:
    """Texts of a module that are sentences, except its docstrings and the parts of an f-string."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    skipped = {
        id(part)
        for node in ast.walk(tree)
        for part in (
            ast.walk(node) if isinstance(node, ast.JoinedStr)
            else [node.value] if isinstance(node, ast.Expr) else ()
        )
        if part is not node
    }  # fmt: skip
    for node in ast.walk(tree):
        if isinstance(node, ast.expr) and id(node) not in skipped:
            text = text_of(node)
            deck_or_case = text is not None and (text.isupper() or text.startswith("["))
            if text and len(text.split()) >= SHORTEST and not deck_or_case:
                yield text


def commands(command: click.Command, name: str = "chladni") -> Iterator[tuple[str, str]]:
    """Name and text of the help of a command, of its options and of its sub-commands."""
    yield name, command.help or ""
    yield from ((f"{name} {p.name}", p.help) for p in command.params if getattr(p, "help", None))
    for key, below in getattr(command, "commands", {}).items():
        yield from commands(below, f"{name} {key}")


def test_messages_are_plain():
    modules = sorted(SOURCE.rglob("*.py"))
    assert not [f"{p.name}: {f}" for p in modules for text in messages(p) for f in faults(text)]


def test_help_is_plain():
    texts = list(commands(typer.main.get_command(application())))
    assert len(texts) > 100
    assert not [f"{name}: {f}" for name, text in texts for f in faults(text)]


def test_the_fixed_words_of_the_page_are_plain():
    page = (SOURCE / "chladni" / "report" / "templates" / "page.html").read_text(encoding="utf-8")
    words = re.sub(r"\{[{%].*?[%}]\}|<style>.*?</style>|<[^>]*>", " ", page, flags=re.DOTALL)
    assert "Next steps" in words
    assert not [f for line in words.splitlines() for f in faults(line)]


@pytest.mark.parametrize(
    "text",
    [
        "What the fit leaves is shown. It is small.",
        "The page is shown. Whether it is right is open.",
        "The model is told apart from the test.",
        "The plate " + "and the plate " * 9,
    ],
)
def test_a_poor_sentence_is_found(text):
    assert faults(text)


def test_a_plain_sentence_is_not():
    assert not faults("The deck has no grid {grid}; there are 1 to 9. What-if studies use `told`.")
