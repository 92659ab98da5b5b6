"""A damaged file of text ends in one sentence that names it, whatever library stumbled over it."""

from functools import partial
from pathlib import Path

from tests.builders.refusals import damaged, refusals, says

from chladni.case.case_file import request_of
from chladni.io.formed_files import read_formed
from chladni.io.scanned_surface import read_scan
from chladni.io.tables.read_tables import read_recordings
from chladni.io.tables.sensor_table import read_sensors

from .test_dyna import FIXED

READERS = {
    "recordings": partial(read_recordings, quantity="mobility"),
    "sensors": read_sensors,
    "formed": read_formed,
    "scan": read_scan,
    "case": request_of,
}
TIME = "time_s,7:+Z [N],7:+Z [g],9:-X [m/s^2]\n"
TEXTS = {
    "recordings a.csv of a head": "frequency_hz,output,input,real,imag\n",
    "recordings a.csv of time data": TIME + "".join(f"{k / 64},1,{k % 7},2\n" for k in range(64)),
    "sensors s.csv of a head": "label,grid,x,y,z,direction,role,mass\n",
    "formed t.csv of a head": "node,x,y,z,thickness\n",
    "formed a.k of shells": FIXED,
}


@refusals(Path(__file__).with_suffix(".txt"))
def test_a_damaged_file_is_one_sentence(tmp_path, capsys, kind, damage, said):
    """A library that reads it may print, end the process or let any exception pass."""
    reader, name, *_ = kind.split()
    text = TEXTS.get(kind, "")
    (tmp_path / name).write_text(damaged(text, damage) if damage else text, encoding="utf-8")
    assert name in says(said, READERS[reader], tmp_path / name)
    assert capsys.readouterr() == ("", "")
