"""The question to VTK is put to a child, once; a crash there is an answer."""

import subprocess

import pytest

from chladni.errors import FileError
from chladni.view import probe


@pytest.fixture(autouse=True)
def alone(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv("CHLADNI_GRAPHICS", raising=False)
    probe.window.cache_clear()
    yield
    probe.window.cache_clear()


def test_a_child_that_crashes_means_no(monkeypatch):
    monkeypatch.setattr(probe, "_CHILD", "import os; os.abort()")
    assert not probe.opens("vtkEGLRenderWindow")
    assert probe.window() is None
    assert not probe.prepare()
    assert "libosmesa6" in probe.advice()[0]


def test_the_answer_is_asked_for_once(monkeypatch):
    asked = []
    monkeypatch.setattr(probe, "opens", lambda name: asked.append(name) or len(asked) == 2)
    assert probe.window() == probe.WINDOWS["egl"]
    probe.window.cache_clear()
    assert probe.window() == probe.WINDOWS["egl"]
    assert asked == list(probe.WINDOWS.values())


def test_another_machine_or_version_is_asked_again(monkeypatch):
    monkeypatch.setattr(probe, "opens", lambda name: True)
    probe.window()
    monkeypatch.setattr(probe, "_machine", lambda: "another")
    monkeypatch.setattr(probe, "opens", lambda name: False)
    probe.window.cache_clear()
    assert probe.window() is None


def test_a_limit_on_address_space_leaves_vtk_alone(monkeypatch):
    resource = pytest.importorskip("resource")
    monkeypatch.setattr(probe, "opens", lambda name: True)
    monkeypatch.setattr(resource, "getrlimit", lambda what: (int(1e15), int(1e15)))
    assert 1e14 < probe.address_space_left() < 1e15  # what is taken is taken off
    assert probe.window()
    probe.window.cache_clear()
    monkeypatch.setattr(resource, "getrlimit", lambda what: (int(1e9), int(1e9)))
    assert probe.window() is None
    assert "ulimit" in probe.advice()[0]


def test_a_wish_overrides_and_a_wrong_one_is_refused(monkeypatch):
    monkeypatch.setenv("CHLADNI_GRAPHICS", "egl")
    assert probe.window() == probe.WINDOWS["egl"]
    assert probe.advice() == []
    monkeypatch.setenv("CHLADNI_GRAPHICS", "glide")
    probe.window.cache_clear()
    with pytest.raises(FileError, match="osmesa, egl, matplotlib"):
        probe.window()


def test_a_broken_cache_is_no_obstacle(monkeypatch):
    monkeypatch.setattr(probe, "opens", lambda name: True)
    (probe.cache_folder() / "graphics.json").write_text("{half")
    assert probe.window() == probe.WINDOWS["osmesa"]


def test_a_busy_machine_is_asked_again(monkeypatch):
    """A child that does not answer in time says nothing about the library."""

    def late(name):
        raise subprocess.TimeoutExpired("child", 60)

    monkeypatch.setattr(probe, "opens", late)
    assert probe.window() is None
    monkeypatch.setattr(probe, "opens", lambda name: True)
    probe.window.cache_clear()
    assert probe.window() == probe.WINDOWS["osmesa"]
