"""Universal files of other programs: each is read rightly, or refused in a sentence."""

import numpy as np
import pytest
from tests.builders.refusals import says

from chladni.dynamics.frf import FRF
from chladni.io.uff.read_uff import read_uff
from chladni.io.uff.write_uff import write_uff

from . import foreign_uff as uff
from .foreign_uff import F, H, file, function

POUND, INCH = 4.4482216152605, 0.0254
UNEVEN = np.geomspace(10.0, 20.0, 7)
TITLES = ("Heckklappe \xfc, 20 \xb0C", "", "01-Mar-15 12:00:00", "", "")


def read(path, data):
    (path / "x.uff").write_bytes(data)
    return read_uff(path / "x.uff")


# name: (file, quantity, factor to SI)
READ = {
    "inches and pounds by 164": (
        file(uff.units(7, 1 / INCH, 1 / POUND), function()), "accelerance", INCH / POUND),
    "feet and pounds by label": (
        file(function(numerator=(8, "ft"), denominator=(13, "lbf"))), "receptance", 0.3048 / POUND),
    "a user's own units, at the end": (
        file(function(numerator=(11, "NONE")), uff.units(9, 1000.0, 1.0)), "mobility", 1e-3),
    "g over N": (
        file(function(numerator=(12, "g"), denominator=(13, "N"))), "accelerance", 9.80665),
    "double precision": (file(function(double=True)), "accelerance", 1.0),
    "D exponents": (file(function(double=True, letter="D")), "accelerance", 1.0),
    "uneven lines": (file(function(UNEVEN, even=False)), "accelerance", 1.0),
    "uneven lines, double": (file(function(UNEVEN, even=False, double=True)), "accelerance", 1.0),
    "from high to low": (file(function(F[::-1], H[::-1])), "accelerance", 1.0),
    "signs fill the columns": (file(function(y=H * np.exp(2j))), "accelerance", np.exp(2j)),
    "exponents of three digits": (file(function(y=1e-103 * H, double=True)), "accelerance", 1e-103),
    "blank lines between": (b"\r\n \r\n" + file(function(), [""], end="\r\n"), "accelerance", 1.0),
    "words before and after": (
        b"exported by a program\n" + file(function()) + b"end of export\n", "accelerance", 1.0),
    "blank and foreign titles": (file(function(title=TITLES)), "accelerance", 1.0),
    "names of entities": (file(function(names=("LEFT HINGE", "SHAKER"))), "accelerance", 1.0),
    "no labels behind the data types": (
        file(function()).replace(2 * (b" " * 17 + b"NONE"), b""), "accelerance", 1.0),
    "end of file as DOS had it": (file(function()) + b"\x1a", "accelerance", 1.0),
    "carriage returns alone": (file(function(), end="\r", last="\r"), "accelerance", 1.0),
    "transmissibility by its type": (
        file(function(kind=5, numerator=(12, "g"), denominator=(12, "g"))), "transmissibility",
        1.0),
    "datasets nobody needs": (
        file(uff.other(1858, "not", "what is due"), uff.other(2414, "1"), function(),
             uff.other(1830, "x")), "accelerance", 1.0),
}  # fmt: skip


G, MICRO, TWO = 9.80665, "\xb5", "\xb2"
# unit label of the ordinate, of the denominator: data type, factor to SI
LABELS = {
    ("m/s" + TWO, "N"): (12, 1.0),
    (f"(1/N)*(m/s{TWO})", "NONE"): (12, 1.0),
    ("m/s\xfd", "N"): (12, 1.0),  # squared in the code pages of DOS
    (MICRO + "m", "N"): (8, 1e-6),
    (f"{MICRO}m/s/N", "NONE"): (11, 1e-6),
    ("gravity", "Newton"): (12, G),
    ("G's", "lbs"): (12, G / POUND),
    ("in/lbf-sec", "NONE"): (11, INCH / POUND),
    ("m/N-s", "NONE"): (11, 1.0),
    ("(mm/sec^2) / (kN)", "NONE"): (12, 1e-6),
    ("1/kg", "NONE"): (12, 1.0),
    ("m s^-2 N^-1", "NONE"): (12, 1.0),
    ("Meters", "Newtons"): (8, 1.0),
    ("in/sec/sec", "pounds"): (12, INCH / POUND),
    ("mils", "lbf"): (8, 1e-3 * INCH / POUND),
}  # fmt: skip


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("units", LABELS)
def test_unit_labels_of_test_systems(tmp_path, units, binary):
    """Spellings of labels, in the Latin-1 or CP1252 of Windows programs, in text and in 58b."""
    kind, factor = LABELS[units]
    data = file(function(
        numerator=(kind, units[0]), denominator=(13, units[1]), abscissa=(18, "cycles/s"),
        title=TITLES, double=True))  # fmt: skip
    if binary:
        bits = np.column_stack([H.real, H.imag]).astype("<f8").tobytes()
        mark = f"    58b{1:6d}{2:6d}{11:12d}{len(bits):12d}{0:6d}{0:6d}{0:12d}{0:12d}".encode()
        head = data.split(b"\n")[2:13]
        data = b"\n".join([b"    -1", mark, *head, bits, b"    -1", b""])
    frf = read(tmp_path, data).frf
    np.testing.assert_allclose(frf.values[:, 0, 0], factor * H, rtol=1e-9)
    assert frf.quantity == {8: "receptance", 11: "mobility", 12: "accelerance"}[kind]


@pytest.mark.parametrize("label", ["furlong", "(m/s^2)^2/Hz", "N/(m/s^2)", "dB", "m/s^3"])
def test_a_unit_that_is_no_motion_over_a_force(tmp_path, label):
    said = r"dataset 1 .*the unit .* is not known; known are m, mm"
    says(said, read, tmp_path, file(function(numerator=(12, label))))


@pytest.mark.parametrize("name", READ)
def test_read_rightly(tmp_path, name):
    data, quantity, factor = READ[name]
    frf = read(tmp_path, data).frf
    assert (frf.quantity, frf.outputs, frf.inputs) == (quantity, ("1:+Z",), ("2:+Z",))
    digits = 1e-11 if b"E+00" not in data or "double" in name else 1e-5
    np.testing.assert_allclose(frf.values[:, 0, 0], factor * H, rtol=digits)
    x = UNEVEN if "uneven" in name else F
    np.testing.assert_allclose(frf.frequency, x, rtol=1e-5)


REFUSED = {
    "stars where a number was too wide": (
        file(function()).replace(b"  1.00000E+00", b"*" * 13, 1), r"dataset 1 .*\*{12}"),
    "not a number": (file(function(y=np.where(F == 13, np.nan, H))), "1 values are not numbers"),
    "beyond measure": (file(function(y=np.where(F == 13, 1e280, H))), "1 values are not numbers"),
    "more values than it says": (file(function(count=6)), "7 values are present, but it states 6"),
    "fewer values than it says": (file(function(count=9)), "7 of 9 values .* truncated"),
    "no phase": (file(function(y=H.real)), "needs phase"),
    "against frequency in rpm": (
        file(function(abscissa=(19, "rpm"))), r"abscissa, data type 19 \(rpm\)"),
    "a direction beyond six": (file(function(response=(1, 9))), "direction 9 of node 1"),
    "label against type": (
        file(function(numerator=(8, "g"))), "data type says receptance, .* says accelerance"),
    "tabs in place of columns": (
        file(function()).replace(b"         1", b"\t1"), r"dataset 1 \(type 58\): cannot be read"),
    "other lines in another record": (
        file(function(), function(UNEVEN, response=(3, 3), even=False)), "frequencies from"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_refused_in_a_sentence(tmp_path, name):
    data, said = REFUSED[name]
    assert says(said, read, tmp_path, data).startswith("x.uff")


def test_a_file_of_many_datasets(tmp_path):
    """Nodes of both kinds, units in the middle, lines, coherence, spectra, two inputs."""
    places = {1: (0.0, 0.0, 1.0), 123456789: (100.0, 0.0, -2.5)}
    records = [
        function(response=(node, 3), reference=(ref, -1), y=node * H + ref)
        for ref in (7, 5)
        for node in (1, 123456789)
    ]
    coherence = [
        function(y=np.full(7, 0.9), kind=6, response=(node, 3), reference=(ref, -1), double=True)
        for ref in (5, 7)
        for node in (123456789, 1)
    ]
    pen = [f"{1:10d}{3:10d}{1:10d}", "trace", f"{1:10d}{123456789:10d}{0:10d}"]
    found = read(tmp_path, file(
        uff.other(151, "model", "what", "program", "", "", "", ""), uff.nodes(places),
        records[2], uff.other(82, *pen),
        *coherence, records[0], uff.units(5, 1000.0, 1000.0), records[3],
        function(y=np.ones(7), kind=2, reference=(0, 0)), uff.old_nodes({5: (1e3, 2e3, 3e3)}),
        records[1],
    ))  # fmt: skip
    frf = found.frf
    assert (frf.outputs, frf.inputs) == (("1:+Z", "123456789:+Z"), ("5:-X", "7:-X"))
    for i, node in enumerate((1, 123456789)):
        for j, ref in enumerate((5, 7)):
            np.testing.assert_allclose(
                frf.values[:, i, j], node * H + ref, rtol=1e-4, atol=1e-4 * node
            )
    assert frf.coherence is not None
    np.testing.assert_allclose(frf.coherence, 0.9)
    np.testing.assert_allclose(found.nodes[123456789], (0.1, 0, -2.5e-3))
    np.testing.assert_allclose(found.nodes[5], (1, 2, 3))
    assert found.elements == ((1, 123456789),)
    assert [f.kind for f in found.functions] == ["auto spectrum"]


def test_what_is_not_used_is_named(tmp_path):
    notes = read(tmp_path, file(uff.other(2414, "1"), function(), uff.other(999, "x"))).notes
    assert notes == ("x.uff: datasets 999, 2414 are not used",)


def test_time_data_of_another_program(tmp_path):
    """Force and acceleration, single precision, SI by their labels; the FRF is that of a gain."""
    t = np.arange(400) / 200.0
    force = np.random.default_rng(565).normal(size=400)

    def signal(y, response, kind, unit):
        return function(
            t, y, response=response, reference=(0, 0), kind=1, abscissa=(17, "s"),
            numerator=(kind, unit), denominator=(0, "NONE"),
        )  # fmt: skip

    hit, answer = signal(force, (2, 3), 13, "lbf"), signal(2 * force, (1, 3), 12, "g")
    time = read(tmp_path, file(hit, answer)).time
    np.testing.assert_allclose(time.force.ravel(), POUND * force, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(time.response.ravel(), 9.80665 * 2 * force, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("even", [True, False])
def test_a_strict_reader_of_columns_reads_ours(tmp_path, even):
    """What is written stands in the columns that the text of the format gives."""
    f = 0.5 * np.arange(2, 30) if even else np.geomspace(10, 300, 28)
    rng = np.random.default_rng(566)
    values = rng.normal(size=(28, 2, 2)) + 1j * rng.normal(size=(28, 2, 2))
    gamma = rng.uniform(0.5, 1, size=(28, 2, 2))
    frf = FRF(values, f, ("1:+Z", "77:-X"), ("1:+Z", "9:-Y"), "accelerance", coherence=gamma)
    write_uff(tmp_path / "a.uff", frf, {1: np.zeros(3)})
    back = uff.strict((tmp_path / "a.uff").read_text())
    assert len(back) == 8
    dofs = {(1, 3): 0, (77, -1): 1}, {(1, 3): 0, (9, -2): 1}
    for one in back:
        i, j = dofs[0][one["response"]], dofs[1][one["reference"]]
        np.testing.assert_allclose(one["x"], f, rtol=1e-5)
        if one["function"] == 4:
            assert one["types"] == [18, 12, 13]
            np.testing.assert_allclose(one["y"] @ [1, 1j], values[:, i, j], rtol=1e-11)
        else:
            assert one["function"] == 6
            np.testing.assert_allclose(one["y"][:, 0], gamma[:, i, j], rtol=1e-11)
