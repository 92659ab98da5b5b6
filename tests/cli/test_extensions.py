"""Commands of installed packages; one that cannot be used is one sentence."""

import sys

import pytest
from typer.testing import CliRunner

from chladni.cli import app

TUNE = '''
def run(count: int = 2) -> None:
    """Tune a bell."""
    print("x" * count)
'''
FAULTS = {  # entry, source, and what the sentence says
    "raises": ("bells", "raise RuntimeError('no\\nlicence')", "RuntimeError: no licence"),
    "is not there": ("nowhere", "", "ModuleNotFoundError"),
    "has no run": ("bells", "", "not a module with a function run"),
    "takes a name": ("bells", TUNE, "another command has this name"),
}


@pytest.fixture
def bells(tmp_path, monkeypatch):
    """Installs a package with one command, as pip would: source and entry points."""

    def install(name, entry, source):
        info = tmp_path / "bells-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: bells\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[{app.GROUP}]\n{name} = {entry}\n")
        (tmp_path / "bells.py").write_text(source)
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.delitem(sys.modules, "bells", raising=False)

    yield install
    sys.modules.pop("bells", None)


def test_an_installed_package_adds_its_command(bells):
    bells("tune", "bells", TUNE)
    assert "Tune a bell" in CliRunner().invoke(app.application(), ["--help"]).output
    done = CliRunner().invoke(app.application(), ["tune", "--count", "3"])
    assert (done.exit_code, done.output) == (0, "xxx\n")


@pytest.mark.parametrize("fault", FAULTS)
def test_a_command_that_cannot_be_used_is_one_sentence(bells, capsys, fault):
    entry, source, said = FAULTS[fault]
    bells("modes" if fault == "takes a name" else "tune", entry, source)
    with pytest.raises(SystemExit) as ended:
        app.main()
    assert ended.value.code == 2
    text = capsys.readouterr().err
    assert "the package bells offers the command" in text
    assert said in text
    assert text.count("\n") == 1


@pytest.mark.parametrize("words", [["blind", "run", "x"], ["blind"]])
def test_a_wheel_says_where_the_evidence_lives(monkeypatch, capsys, words):
    """`blind` is of a checkout: a wheel does not list it, and refuses it in one sentence."""
    monkeypatch.setattr(app, "_is_there", lambda module: False)
    monkeypatch.setattr(sys, "argv", ["chladni", *words])
    with pytest.raises(SystemExit) as ended:
        app.main()
    assert ended.value.code == 2
    text = capsys.readouterr().err
    assert "blind lives in evidence/ of the source" in text
    assert text.count("\n") == 1
    assert "blind" not in app.commands()
