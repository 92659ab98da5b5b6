"""Families are found by name, whoever brings them; what cannot be used is one sentence."""

import sys
from dataclasses import replace

import pytest
from typer.testing import CliRunner

from chladni.cli.app import application
from chladni.effects import masses, registry
from chladni.errors import ExtensionError, LabelError, ModelError

from .conftest import installed_examples


class Bolt(masses.PointMass):
    name = "loose-bolt"
    claim = "a bolt is loose"


BOLT = replace(masses.POINT, effect=Bolt)


@pytest.fixture
def bolt():
    registry.register(BOLT)
    yield
    registry.unregister("loose-bolt")


def test_a_program_adds_a_family_and_takes_it_back(bolt):
    assert registry.names()[-1] == "loose-bolt"
    assert registry.family("loose-bolt") is BOLT
    registry.unregister("loose-bolt")
    assert "loose-bolt" not in registry.names()
    registry.register(BOLT)


def test_a_name_belongs_to_one_family(bolt):
    for known in (BOLT, masses.POINT):
        with pytest.raises(ExtensionError, match=f"'{known.name}' is registered already"):
            registry.register(known)


def test_unknown_names_are_told_the_known_ones():
    with pytest.raises(LabelError, match=r"'point-mas'; did you mean 'point-mass'\? there are"):
        registry.family("point-mas")
    with pytest.raises(LabelError, match="no effect 'point-mass' was registered"):
        registry.unregister("point-mass")


def test_an_installed_package_adds_its_family(tmp_path):
    with installed_examples(tmp_path, ["edge_mass"]):
        assert registry.names() == (*(f.name for f in registry.BUILT_IN), "edge-mass")
        assert registry.family("edge-mass").effect.__module__ == "edge_mass"


FAULTS = {
    "raises": ("broken:FAMILY", "raise RuntimeError('no\\nlicence')", "RuntimeError: no licence"),
    "lacks it": ("broken:FAMILY", "", "AttributeError"),
    "is not there": ("nowhere:FAMILY", "", "ModuleNotFoundError"),
    "is something else": ("broken:FAMILY", "FAMILY = 3", "is a int, not a chladni"),
    "takes a name": (
        "broken:POINT", "from chladni.effects.masses import POINT", "another effect has this",
    ),
}  # fmt: skip


@pytest.mark.parametrize("fault", FAULTS)
def test_a_package_that_cannot_be_used_is_one_sentence(installed, monkeypatch, tmp_path, fault):
    """It names the package and what to do, on the command line too, without a traceback."""
    entry, source, said = FAULTS[fault]
    installed("heavy-bolts", {"bolts": entry}, broken=source)
    monkeypatch.delitem(sys.modules, "broken", raising=False)
    with pytest.raises(ExtensionError, match=said) as caught:
        registry.families()
    assert "the package heavy-bolts offers the effect" in str(caught.value)
    assert "uninstall" in str(caught.value)
    assert "\n" not in str(caught.value)
    asked = ["blind", "make", "--set", "panels", "--seeds", "560", "--out", str(tmp_path / "run")]
    done = CliRunner().invoke(application(), asked)
    assert done.exit_code == 2
    assert "heavy-bolts" in done.output
    assert "Traceback" not in done.output


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"effect": type("Loose", (Bolt,), {"name": "Loose Bolt"})}, "lower case with hyphens"),
        ({"effect": type("Nameless", (Bolt,), {"name": "nothing"})}, "needs its own name"),
        ({"candidates": None}, "neither candidates nor known places"),
        ({"cards": ()}, "or a reason why it has none"),
        ({"no_cards": "too heavy"}, "or a reason why it has none"),
    ],
)
def test_a_family_that_is_not_whole_is_refused(changes, said):
    with pytest.raises(ModelError, match=said):
        replace(BOLT, **changes)
