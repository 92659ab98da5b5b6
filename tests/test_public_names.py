"""Public names are explicit, and say what goes in and what comes out."""

import inspect
import re
from dataclasses import fields, is_dataclass

import pytest

import chladni
from chladni.errors import ChladniError
from chladni.results import Result

PUBLIC = {name: getattr(chladni, name) for name in chladni.__all__ if name != "exchange"}
EXCHANGED = {name: getattr(chladni.exchange, name) for name in chladni.exchange.__all__}
EVERY = PUBLIC | {f"exchange.{name}": value for name, value in EXCHANGED.items()}
UNITS = re.compile(r"\[[^\]]+\]|\bSI\b|\bHz\b|\bratio|\(n|\(r|\bpath|\bfolder|\bname|\bfile")


def test_exports_are_explicit():
    """Each module imports what it exports under its own name, and nothing else without a _."""
    for module in (chladni, chladni.exchange):
        assert len(set(module.__all__)) == len(module.__all__)
        assert all(hasattr(module, name) for name in module.__all__)
    assert chladni.exchange.__all__ == sorted(chladni.exchange.__all__)


@pytest.mark.parametrize("name", EVERY)
def test_every_public_name_is_documented(name):
    """A sentence first; then every parameter, or attribute of data, with its shape or unit."""
    value = EVERY[name]
    said = inspect.getdoc(value) or ""
    first = said.partition("\n")[0]
    assert first.endswith((".", ",")) or "\n" in said, f"{name}: {first!r}"
    assert len(first) > 15, name
    if inspect.isfunction(value):
        unsaid = [
            p
            for p in inspect.signature(value).parameters
            if p not in ("progress", "words") and not re.search(rf"\b{p}\b", said)
        ]
        assert len(unsaid) <= 1, f"{name} says nothing of {unsaid}"
        assert UNITS.search(said), f"{name} names no shape, unit or file"
    elif is_dataclass(value) and not issubclass(value, Result):
        lacking = [f.name for f in fields(value) if not re.search(rf"\b{f.name}\b", said)]
        assert len(lacking) <= len(fields(value)) // 2, f"{name} says nothing of {lacking}"


def methods(kind: type) -> list[str]:
    return [n for n, f in vars(kind).items() if callable(f) and not n.startswith("_")]


@pytest.mark.parametrize("kind", [v for v in PUBLIC.values() if inspect.isclass(v)])
def test_every_public_method_is_documented(kind):
    assert not [n for n in methods(kind) if not inspect.getdoc(getattr(kind, n))]


@pytest.mark.parametrize("name", [n for n, v in PUBLIC.items() if inspect.isfunction(v)])
def test_what_may_go_wrong_is_documented(name):
    """A function that takes a path or a name says which errors of one sentence it raises."""
    takes = set(inspect.signature(PUBLIC[name]).parameters)
    if takes & {"source", "path", "deck", "recording"}:
        assert "Raises" in inspect.getdoc(PUBLIC[name]), name


def test_errors_have_one_base():
    with pytest.raises(ChladniError):
        chladni.load("no such deck")
