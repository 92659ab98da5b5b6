"""What is too large is refused by its size, before anything of it is read; a variable raises it."""

from pathlib import Path

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.io.file_size import LARGEST, OVERRIDE, refuse_large
from chladni.io.formed_files import read_formed
from chladni.io.nastran import read_deck
from chladni.io.nastran.results.op2 import read_op2_modes, read_op4
from chladni.io.nastran.results.punch import read_punch_modes
from chladni.io.scanned_surface import read_scan
from chladni.io.tables.read_tables import read_recordings
from chladni.io.tables.sensor_table import read_sensors

READERS = {
    "a.bdf": read_deck, "a.uff": read_recordings, "a.npz": read_recordings,
    "a.csv": read_recordings, "a.mat": read_recordings, "a.wav": read_recordings,
    "sensors.csv": read_sensors, "a.stl": read_scan, "a.k": read_formed, "formed.csv": read_formed,
    "a.op2": read_op2_modes, "a.op4": read_op4, "a.pch": read_punch_modes,
}  # fmt: skip


@pytest.mark.parametrize("name", READERS)
def test_every_reader_looks_at_the_size_first(name, tmp_path: Path, monkeypatch) -> None:
    """A sparse file of the limit and a byte takes no place; refusing it takes no memory."""
    path = tmp_path / name
    with path.open("wb") as file:
        file.truncate(int(LARGEST * 1e9) + 1)

    def read(*given: object, **more: object) -> None:
        raise AssertionError("it was read")

    for reader in ("read_bytes", "read_text", "open"):
        monkeypatch.setattr(Path, reader, read)
    said = rf"{name} holds 1 GB, more than the limit of 1 GB; {OVERRIDE}=2"
    says(said, READERS[name], path)


def test_an_archive_is_held_to_what_it_unpacks_to(tmp_path: Path, monkeypatch) -> None:
    """The head of the archive says so, before anything of it is unpacked."""
    path = tmp_path / "a.npz"
    np.savez_compressed(path, values=np.zeros(10**6))
    monkeypatch.setenv(OVERRIDE, "0.007")
    assert path.stat().st_size < 1e5
    says(rf"a\.npz unpacks to 0\.008 GB.*{OVERRIDE}=", read_recordings, path)


def test_the_user_may_raise_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refuse_large(tmp_path, int(1e9))
    says("more than the limit of 1 GB", refuse_large, tmp_path, int(3e9))
    monkeypatch.setenv(OVERRIDE, "4")
    refuse_large(tmp_path, int(3e9))
    monkeypatch.setenv(OVERRIDE, "much")
    says("'much' is not a number of gigabytes", refuse_large, tmp_path, 1)
