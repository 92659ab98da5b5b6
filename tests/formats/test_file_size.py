"""What is too large is refused by its size, before anything of it is read; a variable raises it."""

import zipfile
from pathlib import Path

import numpy as np
import pytest

from chladni.errors import FileError
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
def test_every_reader_looks_at_the_size_first(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sparse file of the limit and a byte takes no place; refusing it takes no memory."""
    path = tmp_path / name
    with path.open("wb") as file:
        file.truncate(int(LARGEST * 1e9) + 1)

    def read(*given: object, **more: object) -> None:
        raise AssertionError("it was read")

    for reader in ("read_bytes", "read_text", "open"):
        monkeypatch.setattr(Path, reader, read)
    with pytest.raises(
        FileError, match=rf"{name} holds 1 GB, more than the limit of 1 GB; {OVERRIDE}=2"
    ):
        READERS[name](path)


def test_an_archive_is_held_to_what_it_unpacks_to(tmp_path: Path) -> None:
    """Zeros of 1.6 GB pack into 2 MB; the head of the archive says so."""
    path = tmp_path / "a.npz"
    zeros = bytes(100_000_000)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        with archive.open("values.npy", "w", force_zip64=True) as member:
            for _ in range(11):
                member.write(zeros)
        for name in ("frequency_hz", "outputs", "inputs"):
            with archive.open(f"{name}.npy", "w") as member:
                np.lib.format.write_array(member, np.zeros(1))
    assert path.stat().st_size < 3e6
    with pytest.raises(FileError, match=rf"a\.npz unpacks to 1\.1 GB.*{OVERRIDE}=2"):
        read_recordings(path)


def test_the_user_may_raise_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refuse_large(tmp_path, int(1e9))
    with pytest.raises(FileError, match="more than the limit of 1 GB"):
        refuse_large(tmp_path, int(3e9))
    monkeypatch.setenv(OVERRIDE, "4")
    refuse_large(tmp_path, int(3e9))
    monkeypatch.setenv(OVERRIDE, "much")
    with pytest.raises(FileError, match="'much' is not a number of gigabytes"):
        refuse_large(tmp_path, 1)
