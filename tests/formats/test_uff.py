"""Universal files: what is written is read back, units are SI, what is wrong is said."""

import numpy as np
import pytest
import pyuff
from hypothesis import given
from hypothesis import strategies as st
from tests.builders.refusals import says

from chladni.dynamics.frf import FRF
from chladni.ema.channel_checks import drive_points
from chladni.io.uff.read_uff import read_uff, write_uff
from chladni.io.uff.uff_units import ratio
from chladni.io.uff.write_shapes import write_shapes

LINES = (np.arange(2, 403) * 0.5, np.geomspace(10.0, 300.0, 101))


def a_frf(f=LINES[0], outputs=("1:+Z", "2:-X", "5:n"), inputs=("1:+Z", "9:-Y"), **fields):
    rng = np.random.default_rng(len(f))
    shape = (len(f), len(outputs), len(inputs))
    values = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    return FRF(values, f, outputs, inputs, **fields)


def sets(path):
    read = pyuff.UFF(str(path)).read_sets()
    return read if isinstance(read, list) else [read]


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("f", LINES)
@pytest.mark.parametrize("quantity", ["receptance", "mobility", "accelerance"])
def test_what_is_written_is_read_back(tmp_path, f, binary, quantity):
    coherence = np.linspace(0.1, 1.0, 6 * len(f)).reshape(len(f), 3, 2)
    H = a_frf(f, quantity=quantity, coherence=coherence)
    nodes = {1: np.array([0.0, 0.1, 1.0]), 2: np.array([1 / 3, 2.0, 3.0])}
    write_uff(tmp_path / "a.uff", H, nodes, title="an article", binary=binary)
    back = read_uff(tmp_path / "a.uff")
    exact = {"rtol": 0.0, "atol": 0.0} if binary else {"rtol": 1e-12, "atol": 1e-12}
    assert back.frf.coherence is not None
    np.testing.assert_allclose(back.frf.values, H.values, **exact)
    np.testing.assert_allclose(back.frf.coherence, coherence, **exact)
    np.testing.assert_allclose(back.frf.frequency, f, rtol=0 if binary else 1e-7)
    assert (back.frf.outputs, back.frf.inputs, back.frf.quantity) == (H.outputs, H.inputs, quantity)
    np.testing.assert_allclose(back.nodes[2], nodes[2], rtol=1e-15)
    assert not back.notes
    assert [p.name for p in tmp_path.iterdir()] == ["a.uff"]


def test_base_motion_keeps_its_name(tmp_path):
    """A title that is no text, as a file's name may be, is written with question marks."""
    H = a_frf(outputs=("7:+Z",), inputs=("base:+Z",), quantity="transmissibility")
    write_uff(tmp_path / "a.uff", H, title="d\udcff.bdf")
    assert b"d?.bdf" in (tmp_path / "a.uff").read_bytes()
    back = read_uff(tmp_path / "a.uff").frf
    assert (back.inputs, back.quantity) == (("base:+Z",), "transmissibility")
    np.testing.assert_allclose(back.values, H.values, rtol=1e-12)


def record(**fields):
    """One dataset 58 as another program would write it."""
    f = np.arange(1.0, 11.0)
    base: dict = dict(
        type=58, binary=0, func_type=4, rsp_node=1, rsp_dir=3, ref_node=2, ref_dir=3, x=f,
        data=f + 1j, abscissa_spacing=1, abscissa_spec_data_type=18,
        ordinate_spec_data_type=12, orddenom_spec_data_type=13,
    )  # fmt: skip
    return base | fields


def units(code, length=1.0, force=1.0):
    return dict(
        type=164, units_code=code, units_description="x", temp_mode=1,
        length=length, force=force, temp=1.0, temp_offset=0.0,
    )  # fmt: skip


def foreign(path, *datasets):
    for dataset in datasets:
        pyuff.UFF(str(path)).write_sets(dict(dataset), mode="add")
    return path


@pytest.mark.parametrize(
    ("head", "ordinate", "label", "below", "factor", "quantity"),
    [
        (1, 12, "NONE", "NONE", 1.0, "accelerance"),
        (5, 12, "NONE", "NONE", 1.0, "accelerance"),  # mm / mN = m / N
        (5, 12, "(m/s^2)/N", "NONE", 1.0, "accelerance"),
        (1, 12, "g/N", "NONE", 9.80665, "accelerance"),
        (1, 0, "mm/s/N", "NONE", 1e-3, "mobility"),
        (1, 12, "g", "lbf", 9.80665 / 4.4482216152605, "accelerance"),
        (5, 12, "NONE", "base", 1.0, "transmissibility"),
    ],
)
def test_units_become_si(tmp_path, head, ordinate, label, below, factor, quantity):
    fields = dict(ordinate_spec_data_type=ordinate, ordinate_axis_units_lab=label)
    over = {"base": dict(orddenom_spec_data_type=12)}.get(
        below, dict(orddenom_axis_units_lab=below)
    )
    frf = read_uff(foreign(tmp_path / "a.uff", units(head), record(**fields, **over))).frf
    np.testing.assert_allclose(frf.values[:, 0, 0], factor * record()["data"], rtol=1e-10)
    assert frf.quantity == quantity


@pytest.mark.parametrize(
    ("labels", "factor", "quantity"),
    [
        (("N", "m/s^2"), 1.0, "accelerance"),
        (("lbf", "g"), 4.4482216152605 / 9.80665, "accelerance"),
        (("N", "mm/s"), 1e3, "mobility"),
        (("NONE", "NONE"), 1.0, "receptance"),
    ],
)
def test_force_over_motion_is_turned_round(tmp_path, labels, factor, quantity):
    """The motion becomes the output, wherever the file has it, and units go with their ends."""
    kind = {"accelerance": 12, "mobility": 11, "receptance": 8}[quantity]
    fields = dict(ordinate_spec_data_type=13, orddenom_spec_data_type=kind)
    named = dict(zip(("ordinate_axis_units_lab", "orddenom_axis_units_lab"), labels, strict=True))
    path = foreign(tmp_path / "a.uff", units(1), record(**fields, **named))
    for asked in (None, {12: "apparent-mass", 11: "impedance", 8: "dynamic-stiffness"}[kind]):
        frf = read_uff(path, asked).frf
        assert (frf.outputs, frf.inputs, frf.quantity) == (("2:+Z",), ("1:+Z",), quantity)
        np.testing.assert_allclose(frf.values[:, 0, 0], 1 / (factor * record()["data"]))


@given(st.sampled_from(["m", "mm", "in"]), st.sampled_from(["", "/s", "/s2", "/s^2", "/s**2"]))
def test_labels_of_units(length, rate):
    """Brackets, blanks and the way the square is written make no difference."""
    kind, a, b = ratio(f"({length}{rate}) / N")
    assert kind == {"": "receptance", "/s": "mobility"}.get(rate, "accelerance")
    assert (a, b) == ({"m": 1.0, "mm": 1e-3, "in": 0.0254}[length], 1.0)


def test_node_0_is_a_base_only_of_a_transmissibility(tmp_path):
    """Its quantity says so, or the case does; else the file does not know where the force acts."""
    path = foreign(tmp_path / "a.uff", record(ref_node=0))
    assert read_uff(path).frf.inputs == ("0:+Z",)
    assert "node 0, so the file does not say where the force acts" in read_uff(path).notes[0]
    assert read_uff(path, "transmissibility").frf.inputs == ("base:+Z",)
    moved = foreign(tmp_path / "b.uff", record(ref_node=0, orddenom_spec_data_type=12))
    assert read_uff(moved).frf.inputs == ("base:+Z",)
    assert not read_uff(moved).notes
    both = foreign(tmp_path / "c.uff", record(rsp_node=0, ref_node=0))
    assert drive_points(read_uff(both).frf) == []


def test_points_that_have_a_name_in_place_of_a_number_are_no_repeats(tmp_path):
    """Response entities tell points of node 0 apart, and nodes of one number on two parts."""
    named = [record(rsp_node=0, ref_node=0, rsp_ent_name=n) for n in ("P 1", "P2", "P3")]
    frf = read_uff(foreign(tmp_path / "a.uff", *named)).frf
    assert (frf.outputs, frf.inputs) == (("P_1:+Z", "P2:+Z", "P3:+Z"), ("0:+Z",))
    parts = [record(rsp_ent_name="LEFT"), record(rsp_ent_name="RIGHT"), record(rsp_node=7)]
    frf = read_uff(foreign(tmp_path / "b.uff", *parts)).frf
    assert frf.outputs == ("LEFT:1:+Z", "RIGHT:1:+Z", "7:+Z")
    alone = record(rsp_ent_name="WING", ref_ent_name="SHAKER")
    coherent = record(func_type=6, data=np.ones(10))
    frf = read_uff(foreign(tmp_path / "c.uff", alone, coherent)).frf
    assert (frf.outputs, frf.coherence is None) == (("1:+Z",), False)


def test_opposite_signs_of_one_dof_are_one_channel(tmp_path):
    """1:-Z from the second hit is the first one's 1:+Z with the other sign."""
    path = foreign(tmp_path / "a.uff", record(), record(rsp_dir=-3, ref_node=4))
    frf = read_uff(path).frf
    assert (frf.outputs, frf.inputs) == (("1:+Z",), ("2:+Z", "4:+Z"))
    np.testing.assert_allclose(frf.values[:, 0, 1], -frf.values[:, 0, 0])


def test_outputs_not_measured_for_every_input_are_noted(tmp_path):
    more = record(rsp_node=8), record(ref_node=4), record(func_type=9)
    recording = read_uff(foreign(tmp_path / "a.uff", record(), *more))
    assert recording.frf.outputs == ("1:+Z",)
    assert "8:+Z" in recording.notes[0]
    assert [f.kind for f in recording.functions] == ["psd"]


def test_shapes_complex_and_real(tmp_path):
    """Dataset 55: a complex pole gives f = |p| / 2π and ζ = -Re p / |p|."""
    shape = dict(
        type=55, model_type=1, id1="x", id2="x", id3="x", id4="x", id5="x", data_ch=2,
        spec_data_type=8, load_case=1, mode_n=1, node_nums=np.array([1, 2]),
    )  # fmt: skip
    z = np.array([1 + 2j, 3 - 1j])
    pole = -0.3 + 40.0j
    complex_shape = shape | dict(
        analysis_type=3, data_type=5, n_data_per_node=3, r1=z, r2=2 * z, r3=0 * z,
        eig=pole, modal_a=1 + 0j, modal_b=1 + 0j,
    )  # fmt: skip
    shapes = read_uff(foreign(tmp_path / "a.uff", complex_shape)).shapes
    np.testing.assert_allclose(shapes.frequency, abs(pole) / (2 * np.pi), rtol=1e-5)
    np.testing.assert_allclose(shapes.damping, 0.3 / abs(pole), rtol=1e-5)
    assert shapes.dofs[:3] == ("1:+X", "1:+Y", "1:+Z")
    np.testing.assert_allclose(shapes.values[:, 0], [z[0], 2 * z[0], 0, z[1], 2 * z[1], 0])


@pytest.mark.parametrize("complex_", [False, True])
def test_shapes_that_are_written_come_back(tmp_path, complex_):
    """A normal mode is its own, a complex one keeps its imaginary part, its pole gives f and ζ."""
    motion = np.arange(12.0).reshape(2, 3, 2) + (1j * np.arange(12.0, 0, -1).reshape(2, 3, 2)
                                                 if complex_ else 0.0)  # fmt: skip
    ids, places = np.array([4, 9]), np.array([[0.0, 0, 0], [1.0, 0, 0]])
    f = np.array([12.5, 40.0])
    back = read_uff(write_shapes(tmp_path / "a.unv", f, motion, ids, places, 0.01)).shapes
    np.testing.assert_allclose(back.values.reshape(2, 3, 2), motion, rtol=1e-5)
    assert np.iscomplexobj(back.values) is complex_
    np.testing.assert_allclose(back.frequency, f, rtol=1e-5)
    np.testing.assert_allclose(back.damping, 0.01, rtol=1e-3)


def test_mode_shapes_alone_give_natural_frequencies(tmp_path):
    """In order, without rigid motions; where the file holds FRFs they are not used."""
    motion, ids, places = np.ones((1, 3, 3)), np.array([4]), np.zeros((1, 3))
    path = write_shapes(tmp_path / "a.unv", np.array([40.0, 1e-4, 12.5]), motion, ids, places)
    poles = read_uff(path).poles
    np.testing.assert_allclose(poles.frequency, [12.5, 40.0], rtol=1e-5)
    assert np.isnan(poles.frequency_sd).all()
    with_frf = foreign(path, record())
    assert read_uff(with_frf).frf is not None
    assert read_uff(with_frf).poles is None


def test_what_is_no_file_or_half_of_one_is_said_in_a_sentence(tmp_path):
    path = foreign(tmp_path / "a.uff", record(), record(rsp_node=5))
    path.write_bytes(path.read_bytes()[:-60])
    says(r"a\.uff.*truncated", read_uff, path)
    path.write_bytes(b"hello")
    says(r"a\.uff is not a universal file", read_uff, path)
    says(r"no file .*b\.uff; the folder has a\.uff", read_uff, tmp_path / "b.uff")
    says("empty", read_uff, foreign(tmp_path / "c.uff", record(data=np.zeros(10, complex))))


@pytest.mark.parametrize(
    ("second", "said"),
    [
        (record(), "dataset 2 .*repeats 1:.Z / 2:.Z of dataset 1"),
        (record(rsp_node=5, x=np.arange(2.0, 12.0)), "dataset 2: its 10 frequencies"),
        (record(rsp_node=5, ordinate_spec_data_type=8), "accelerance .*and receptance"),
        (record(rsp_node=5, ordinate_spec_data_type=0), "dataset 2 .*state quantity"),
        (record(rsp_node=5, ordinate_axis_units_lab="m/s"), "accelerance, .*says mobility"),
        (record(rsp_node=5, data=np.arange(10.0)), "dataset 2 .*needs phase"),
        (record(rsp_node=5, ref_node=6), "no output was measured for all"),
    ],
)
def test_records_that_do_not_fit_together(tmp_path, second, said):
    says(said, read_uff, foreign(tmp_path / "a.uff", record(), second))


@pytest.mark.parametrize(
    ("unit", "kind", "hertz"),
    [("Hz", 18, 1.0), ("NONE", 18, 1.0), ("Hertz", 0, 1.0), ("kHz", 1, 1e3),
     ("rad/s", 18, 1 / (2 * np.pi)), ("rad/sec", 18, 1 / (2 * np.pi)), ("RPM", 18, 1 / 60),
     ("1/min", 0, 1 / 60)],
)  # fmt: skip
def test_frequencies_become_hertz(tmp_path, unit, kind, hertz):
    axis = dict(abscissa_axis_units_lab=unit, abscissa_spec_data_type=kind)
    frf = read_uff(foreign(tmp_path / "a.uff", record(**axis))).frf
    np.testing.assert_allclose(frf.frequency, hertz * record()["x"], rtol=1e-5)


@pytest.mark.parametrize(
    ("unit", "kind", "offender"),
    [
        ("rpm", 19, r"data type 19 \(rpm\), is in 'rpm'"),  # a speed: the order is not said
        ("Hz", 19, r"data type 19 \(rpm\), is in 'Hz'"),
        ("rpm", 0, "data type 0, is in 'rpm'"),
        ("-", 20, r"data type 20 \(order\)"),
        ("s", 17, r"data type 17 \(time\), is in 's'"),
        ("furlong", 18, "data type 18, is in 'furlong'"),
    ],
)
def test_an_abscissa_that_is_no_frequency(tmp_path, unit, kind, offender):
    """An FRF is refused with the alternatives; a spectrum beside one is left out with a note."""
    axis = dict(abscissa_axis_units_lab=unit, abscissa_spec_data_type=kind)
    sentence = rf"a\.uff, dataset 2 \(type 58\): its abscissa, {offender}.*Hz, kHz, rad/s or rpm"
    says(sentence, read_uff, foreign(tmp_path / "a.uff", record(), record(rsp_node=5, **axis)))
    beside = foreign(tmp_path / "b.uff", record(), record(func_type=9, **axis))
    recording = read_uff(beside)
    assert recording.functions == ()
    assert "left out: b.uff, dataset 2" in recording.notes[0]


@pytest.mark.parametrize("quantity", [None, "accelerance"])
@pytest.mark.parametrize(
    ("above", "below"),
    [("V", "NONE"), ("mV", "N"), ("mV/N", "NONE"), ("(V)/(V)", "NONE"), ("m/s^2", "V"),
     ("counts", "NONE")],
)  # fmt: skip
def test_values_nobody_calibrated(tmp_path, above, below, quantity):
    """Volts are no motion, whatever data type or case say of them."""
    second = record(rsp_node=5, ordinate_axis_units_lab=above, orddenom_axis_units_lab=below)
    offender = below if above == "m/s^2" else above
    path = foreign(tmp_path / "a.uff", record(), second)
    said = says(r"a\.uff, dataset 2 .*over N or lbf.*\.npz", read_uff, path, quantity)
    assert f"in {offender!r} and" in said


def test_the_case_may_say_the_quantity(tmp_path):
    silent = record(ordinate_spec_data_type=0)
    frf = read_uff(foreign(tmp_path / "a.uff", silent), quantity="mobility").frf
    assert frf.quantity == "mobility"


VARIANTS = {
    "no last line end": lambda t: t.rstrip(b"\n"),
    "some blanks after the mark": lambda t: t.replace(b"    -1\n", b"    -1" + 20 * b" " + b"\n"),
    "80 columns": lambda t: t.replace(b"    -1\n", b"    -1" + 74 * b" " + b"\n"),
    "mark in column one": lambda t: t.replace(b"    -1\n", b"-1\n"),
    "byte order mark": lambda t: b"\xef\xbb\xbf" + t,
    "trimmed lines": lambda t: b"\n".join(line.rstrip() for line in t.split(b"\n")),
}


@pytest.mark.parametrize("name", VARIANTS)
def test_files_as_other_programs_write_them(tmp_path, name):
    H = a_frf()
    write_uff(tmp_path / "a.uff", H, {1: np.zeros(3)})
    (tmp_path / "b.uff").write_bytes(VARIANTS[name]((tmp_path / "a.uff").read_bytes()))
    back = read_uff(tmp_path / "b.uff").frf
    np.testing.assert_allclose(back.values, H.values, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("double", [False, True])
@pytest.mark.parametrize("even", [False, True])
@pytest.mark.parametrize("end", [b"", b"\n", b"\r\n"])
def test_binary_records_of_every_kind(tmp_path, order, double, even, end):
    """58b by either byte order and precision, end mark behind the data or on a line of its own."""
    H = a_frf(outputs=("1:+Z",), inputs=("1:+Z",), quantity="mobility")
    y, f = H.values[:, 0, 0], H.frequency
    columns = (y.real, y.imag) if even else (f, y.real, y.imag)
    raw = np.column_stack(columns).astype(" <>"[order] + ("f8" if double else "f4")).tobytes()
    head = ["    -1", f"    58b{order:6d}{2:6d}{11:12d}{len(raw):12d}{0:6d}{0:6d}{0:12d}{0:12d}"]
    head += ["NONE"] * 5
    head.append(f"{4:5d}{0:10d}{0:5d}{0:10d} {'NONE':10}{1:10d}{3:4d} {'NONE':10}{1:10d}{3:4d}")
    start, step = (f[0], f[1] - f[0]) if even else (0, 0)
    kind = 6 if double else 5
    head.append(f"{kind:10d}{len(f):10d}{int(even):10d}{start:13.5e}{step:13.5e}{0:13.5e}")
    head += [f"{k:10d}{0:5d}{0:5d}{0:5d} {'NONE':20} {'NONE':20}" for k in (18, 11, 13, 0)]
    text = "\n".join(head) + "\n"
    (tmp_path / "a.uff").write_bytes(text.encode() + raw + end + b"    -1\n")
    back = read_uff(tmp_path / "a.uff").frf
    np.testing.assert_allclose(back.values[:, 0, 0], y, rtol=1e-12 if double else 3e-7)
    np.testing.assert_allclose(back.frequency, f, rtol=1e-7)
