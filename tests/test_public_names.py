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


def undocumented(name, value) -> list[str]:
    """Faults of a docstring: no sentence first, or a parameter, shape, unit or error unsaid."""
    said = inspect.getdoc(value) or ""
    first = said.partition("\n")[0]
    faults = []
    if len(first) <= 15 or not (first.endswith((".", ",")) or "\n" in said):
        faults.append(f"{name} opens with {first!r}")
    if inspect.isfunction(value):
        takes = set(inspect.signature(value).parameters)
        unsaid = [p for p in takes - {"progress", "words"} if not re.search(rf"\b{p}\b", said)]
        if len(unsaid) > 1:
            faults.append(f"{name} says nothing of {unsaid}")
        if not UNITS.search(said):
            faults.append(f"{name} names no shape, unit or file")
        fails = takes & {"source", "path", "deck", "recording"} and "exchange.write" not in name
        if fails and "Raises" not in said:
            faults.append(f"{name} names none of the errors it raises")
    elif is_dataclass(value) and not issubclass(value, Result):
        lacking = [f.name for f in fields(value) if not re.search(rf"\b{f.name}\b", said)]
        if len(lacking) > len(fields(value)) // 2:
            faults.append(f"{name} says nothing of {lacking}")
    if inspect.isclass(value):
        methods = [n for n, f in vars(value).items() if callable(f) and not n.startswith("_")]
        faults += [f"{name}.{n}" for n in methods if not inspect.getdoc(getattr(value, n))]
    return faults


def test_every_public_name_is_documented():
    """A sentence first; then each parameter or attribute, its shape or unit, and the errors."""
    assert not [fault for name, value in EVERY.items() for fault in undocumented(name, value)]


def test_poor_documentation_is_found():
    def poor(path, frequency, channels):
        """Read."""

    assert len(undocumented("poor", poor)) == 4


def test_errors_have_one_base():
    with pytest.raises(ChladniError):
        chladni.load("no such deck")
