"""One test as WAV, MAT, CSV, NPZ and universal file; what is wrong is one sentence."""

import numpy as np
import pytest
import pyuff
from scipy.io import savemat, wavfile
from tests.builders.refusals import says

from chladni.io.tables.read_tables import read_recordings

RATE, N = 2048.0, 600
RNG = np.random.default_rng(5)
FORCE, MOTION = RNG.uniform(-1, 1, (1, N)), RNG.uniform(-1, 1, (2, N))
LABELS = ("7:+Z", "7:+Z", "9:-X")
CHANNELS = "channel,label,unit,scale\n1,7:+Z,lbf,2\n2,7:+Z,g,4\n3,9:-X,m/s^2,1\n"
POUND, GRAVITY = 4.4482216152605, 9.80665


def csv(path, unit="m/s^2"):
    head = f"time_s,7:+Z [N],7:+Z [g],9:-X [{unit}]"
    rows = np.column_stack([np.arange(N) / RATE, FORCE.T, MOTION.T])
    np.savetxt(path, rows, delimiter=",", header=head, comments="", fmt="%.17g")
    return path


def universal(path, blocks=1):
    file = pyuff.UFF(str(path))
    names = {f"id{k}": "NONE" for k in range(1, 6)}
    for y, kind, unit, node, way in blocks * [
        (FORCE[0], 13, "N", 7, 3), (MOTION[0], 12, "g", 7, 3), (MOTION[1], 12, "mm/s^2", 9, -1),
    ]:  # fmt: skip
        file.write_sets(
            {
                "type": 58, "func_type": 1, "rsp_node": node, "rsp_dir": way, "ref_node": 0,
                "ref_dir": 0, "data": y, "x": np.arange(N) / RATE, "binary": 0,
                "abscissa_spec_data_type": 17, "abscissa_axis_units_lab": "s",
                "ordinate_spec_data_type": kind, "ordinate_axis_units_lab": unit,
                "orddenom_spec_data_type": 0, "orddenom_axis_units_lab": "NONE", **names,
            },
            mode="add",
        )  # fmt: skip
    return path


def the_record(path):
    (found,) = read_recordings(path)
    assert found.time is not None, found.notes
    return found.time


def test_csv_says_labels_and_units_in_its_head(tmp_path):
    found = the_record(csv(tmp_path / "a.csv"))
    assert (found.inputs, found.outputs) == (LABELS[:1], LABELS[1:])
    assert found.quantity == "accelerance"
    assert found.rate == pytest.approx(RATE)
    np.testing.assert_allclose(found.force[0], FORCE)
    np.testing.assert_allclose(found.response[0], MOTION * [[GRAVITY], [1.0]])


def test_wav_gets_units_from_the_table_beside_it(tmp_path):
    """16 bits: shares of full scale to 2⁻¹⁶, times the scale of each channel."""
    numbers = np.round(np.vstack([FORCE, MOTION]).T * 32767).astype(np.int16)
    wavfile.write(tmp_path / "hit.wav", int(RATE), numbers)
    said = r"hit.wav has 3 channels .* add the file hit.channels.csv"
    says(said, read_recordings, tmp_path / "hit.wav")
    (tmp_path / "hit.channels.csv").write_text(CHANNELS)
    found = the_record(tmp_path / "hit.wav")
    np.testing.assert_allclose(found.force[0], 2 * POUND * FORCE, atol=2 * POUND * 2**-14)
    np.testing.assert_allclose(found.response[0, 0], 4 * GRAVITY * MOTION[0], atol=GRAVITY * 2**-12)
    eight = np.round((np.vstack([FORCE, MOTION]).T + 1) * 127.5).astype(np.uint8)
    wavfile.write(tmp_path / "hit.wav", int(RATE), eight)
    found = the_record(tmp_path / "hit.wav")
    np.testing.assert_allclose(found.force[0], 2 * POUND * FORCE, atol=0.1)


def test_both_layouts_of_mat(tmp_path):
    plain = {"fs": RATE, "force": FORCE.T, "acceleration": MOTION, "inputs": ["7:+Z"],
             "outputs": ["7:+Z", "9:-X"]}  # fmt: skip
    savemat(tmp_path / "plain.mat", plain)
    found = the_record(tmp_path / "plain.mat")
    assert (found.inputs, found.outputs) == (LABELS[:1], LABELS[1:])
    np.testing.assert_allclose(found.response[0], MOTION)

    def signal(y, unit, name):
        axis = {"start_value": 0.0, "increment": 1 / RATE, "number_of_values": N}
        values = {"values": y, "quantity": {"label": unit}}
        return {"x_values": axis, "y_values": values, "function_record": {"name": name}}

    signals = {
        "Signal": signal(FORCE[0], "N", "hammer:7:+Z"),
        "Signal_1": signal(MOTION[0], "g", "door:7:+Z"),
        "Signal_2": signal(MOTION[1], "m/s^2", "door:9:-X"),
    }
    savemat(tmp_path / "lab.mat", signals)
    other = the_record(tmp_path / "lab.mat")
    assert (other.inputs, other.outputs) == (LABELS[:1], LABELS[1:])
    assert other.rate == pytest.approx(RATE)
    np.testing.assert_allclose(other.response[0, 0], GRAVITY * MOTION[0])


def test_rows_of_both_arrays_are_blocks(tmp_path):
    np.savez(tmp_path / "a.npz", force=np.ones((5, N)), acceleration=np.ones((5, N)), fs=RATE)
    (found,) = read_recordings(tmp_path / "a.npz")
    assert found.time.force.shape == (5, 1, N)
    said = " ".join(found.notes)
    assert "5 rows in both arrays are 5 blocks" in said
    assert "states no units: force is read in N" in said
    np.savez(tmp_path / "b.npz", data=np.vstack([FORCE, MOTION]), dt=1 / RATE,
             units=["N", "mm/s", "mm/s"], labels=LABELS)  # fmt: skip
    found = the_record(tmp_path / "b.npz")
    assert found.quantity == "mobility"
    np.testing.assert_allclose(found.response[0], 1e-3 * MOTION)


def test_a_universal_file_of_time_histories(tmp_path):
    """Blocks where dofs repeat; direction, data type and unit of each channel."""
    found = the_record(universal(tmp_path / "a.uff", 3))
    assert (found.inputs, found.outputs) == (LABELS[:1], LABELS[1:])
    assert found.force.shape == (3, 1, N)
    np.testing.assert_allclose(found.response[1, 1], 1e-3 * MOTION[1], rtol=1e-4)


def test_a_base_that_moves_makes_a_transmissibility(tmp_path):
    csv(tmp_path / "a.csv")
    table = "channel,label,unit,role\n2,base:+Z,m/s^2,input\n3,9:-X,m/s^2,output\n"
    (tmp_path / "a.channels.csv").write_text(table)
    found = the_record(tmp_path / "a.csv")
    assert (found.inputs, found.quantity) == (("base:+Z",), "transmissibility")


def test_a_quantity_that_is_asked_for_counts(tmp_path):
    (found,) = read_recordings(csv(tmp_path / "a.csv"), "receptance")
    assert found.time.quantity == "receptance"
    assert "read as receptance as requested" in found.notes[-1]


def test_responses_without_a_force_are_time_histories(tmp_path):
    """Of a CSV, a WAV of a microphone, an NPZ of two blocks, a universal file: SI, no FRF."""
    head = "time_s,7:+Z [g],9:-X [m/s^2]"
    rows = np.column_stack([np.arange(N) / RATE, MOTION.T])
    np.savetxt(tmp_path / "a.csv", rows, delimiter=",", header=head, comments="", fmt="%.17g")
    numbers = np.round(MOTION[:1].T * 32767).astype(np.int16)
    wavfile.write(tmp_path / "b.wav", int(RATE), numbers)
    (tmp_path / "b.channels.csv").write_text("channel,label,unit,scale\n1,7:+Z,mPa,500\n")
    np.savez(tmp_path / "c.npz", acceleration=np.stack([MOTION] * 2), fs=RATE, outputs=LABELS[1:])
    for name, labels, first in (
        ("a.csv", ("7:+Z", "9:-X"), GRAVITY), ("b.wav", ("7:+Z",), 0.5),
        ("c.npz", ("7:+Z", "9:-X") * 2, 1.0),
    ):  # fmt: skip
        (found,) = read_recordings(tmp_path / name)
        assert found.time is None
        assert tuple(f.output for f in found.functions) == labels
        assert {(f.kind, f.input) for f in found.functions} == {("time", "")}
        np.testing.assert_allclose(found.functions[0].values, first * MOTION[0], atol=1e-4)
        np.testing.assert_allclose(found.functions[0].x, np.arange(N) / RATE, atol=1e-9)


@pytest.mark.parametrize(
    ("arrays", "said"),
    [
        ({"force": FORCE, "acceleration": MOTION, "fs": -1.0}, "fs must be one number above zero"),
        ({"force": FORCE, "fs": RATE}, "one array force and one of acceleration"),
        ({"force": FORCE, "acceleration": MOTION, "fs": RATE, "huge": FORCE}, "unknown array huge"),
        ({"data": MOTION, "units": ["N"], "fs": RATE}, "1 units for the 2 channels"),
        ({"force": FORCE, "acceleration": MOTION[:, :-9], "fs": RATE}, "samples differ"),
        ({"force": FORCE, "acceleration": np.full((1, N), np.nan), "fs": RATE}, "not a number"),
    ],
)
def test_what_is_wrong_with_arrays_is_said(tmp_path, arrays, said):
    np.savez(tmp_path / "a.npz", **arrays)
    says(rf"a\.npz: .*{said}", read_recordings, tmp_path / "a.npz")


def test_damaged_and_new_files_are_refused(tmp_path):
    savemat(tmp_path / "a.mat", {"fs": RATE, "force": FORCE, "acceleration": MOTION})
    data = (tmp_path / "a.mat").read_bytes()
    (tmp_path / "b.mat").write_bytes(data[: len(data) // 2])
    (tmp_path / "c.mat").write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64" + bytes(100))
    (tmp_path / "d.wav").write_bytes(b"RIFF" + bytes(30))
    objects = np.array([{"a": 1}], dtype=object)
    np.savez(tmp_path / "e.npz", fs=RATE, force=objects, acceleration=MOTION)
    (tmp_path / "g.npz").write_bytes(bytes(range(256)))
    for name, said in (
        ("b.mat", "cannot be read as MAT"),
        ("c.mat", "MATLAB 7.3 .HDF5., which is not supported; save it with -v7"),
        ("d.wav", "cannot be read as WAV"),
        ("e.npz", "cannot be read as NPZ: Object arrays"),
        ("f.wav", "no file"),
        ("g.npz", "cannot be read as NPZ: it is not an archive"),
    ):
        says(rf"{name}.*{said}|{said}.*{name}", read_recordings, tmp_path / name)


def test_the_table_of_channels_is_held_to_its_words(tmp_path):
    csv(tmp_path / "a.csv")
    for table, said in (
        ("channel,label,unit\n8,7:+Z,N\n", r"a\.channels\.csv, line 2: no channel '8'"),
        ("channel,label,unit,role\n1,7:+Z,N,shaker\n", "line 2: role 'shaker'"),
        ("channel,label,unit\n1,,N\n", "line 2: channel 1 has no label"),
        ("channel,label,unit\n1,7:+Z,N\n2,7:+Z,g\n3,7:+Z,g\n", r"channel 7:\+Z occurs twice"),
    ):
        (tmp_path / "a.channels.csv").write_text(table)
        says(said, read_recordings, tmp_path / "a.csv")


def test_a_wav_that_is_shorter_than_it_says_is_refused(tmp_path):
    """The chunk of samples states its bytes; all ones there: a recorder that never came to it."""
    path = tmp_path / "a.wav"
    wavfile.write(path, int(RATE), np.vstack([FORCE, MOTION]).T.astype(np.float32))
    (tmp_path / "a.channels.csv").write_text(CHANNELS)
    data = path.read_bytes()
    assert the_record(path).force.shape[2] == N
    at = data.index(b"data") + 4
    for changed in (data[: len(data) // 2], data[:at] + b"\0\0\1\0" + data[at + 4 :]):
        path.write_bytes(changed)
        says(r"a.wav states \d+ bytes of samples, but", read_recordings, path)


def test_channels_said_twice_are_refused_and_those_not_said_named(tmp_path):
    path = csv(tmp_path / "a.csv")
    table = tmp_path / "a.channels.csv"
    table.write_text(CHANNELS + "2,12:+Z,g,4\n")
    says(r"line 5: channel 2 occurs twice, first in line 3", read_recordings, path)
    table.write_text(CHANNELS.rpartition("3,")[0])
    (found,) = read_recordings(path)
    assert found.time.outputs == ("7:+Z",)
    assert any("a.channels.csv has no line for channel 9:-X" in note for note in found.notes)
    table.write_text(CHANNELS)
    assert not any("no line for" in note for note in read_recordings(path)[0].notes)
