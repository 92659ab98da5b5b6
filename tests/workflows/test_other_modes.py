"""Modes of another program beside the model's: frames, double modes, files of three kinds."""

import importlib.util
import json
from pathlib import Path

import numpy as np
import pytest
from tests.builders.commands import ran, refused

import chladni
from chladni.errors import FileError
from chladni.io.uff.write_shapes import write_shapes

N = 5  # grids along a side


def deck(path, turned=0.0):
    """A free square steel plate; its grids move in axes turned about z by so many degrees."""
    c, s = np.cos(np.deg2rad(turned)), np.sin(np.deg2rad(turned))
    lines = ["SOL 103", "CEND", "BEGIN BULK", "MAT1,1,2.1+11,,0.3,7850.", "PSHELL,1,1,.001,1,,1"]
    lines.append(f"CORD2R,5,,0.,0.,0.,0.,0.,1.\n,{c:.9f},{s:.9f},0.")
    for i, j in np.ndindex(N, N):
        lines.append(f"GRID,{1 + j + N * i},,{0.05 * i:.3f},{0.05 * j:.3f},0.,5")
    for i, j in np.ndindex(N - 1, N - 1):
        a = 1 + j + N * i
        lines.append(f"CQUAD4,{a},1,{a},{a + N},{a + N + 1},{a + 1}")
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    return path


def punch(path, frequency, motion, ids):
    """Eigenvectors of a punch file: translations (n, 3, r), rotations zero."""
    lines = []
    for k, f in enumerate(frequency):
        lines += ["$TITLE   = PLATE", "$SUBTITLE=", "$LABEL   =", "$EIGENVECTOR", "$REAL OUTPUT",
                  "$SUBCASE ID =           1",
                  f"$EIGENVALUE = {(2 * np.pi * f) ** 2:14.7E}  MODE = {k + 1:5d}"]  # fmt: skip
        for row, id in enumerate(ids):
            values = "".join(f"{v:18.6E}" for v in motion[row, :, k])
            lines += [f"{id:10d}       G{values}", f"{'-CONT-':<18}{'':>0}" + 3 * f"{0.0:18.6E}"]
    path.write_text("".join(f"{line:<72}{k + 1:8d}\n" for k, line in enumerate(lines)))
    return path


@pytest.fixture(scope="module")
def plain(tmp_path_factory):
    """Model, frequencies and translations of the plate in the basic frame."""
    model = chladni.load(deck(tmp_path_factory.mktemp("plain") / "plate.bdf"), "SI")
    modal = model.modes(14)
    return model, modal.frequency, model.motion(modal.shapes)


def test_shapes_are_turned_from_the_frames_of_their_grids(plain, tmp_path):
    """In axes turned by 30° about z a motion u has the components Rᵀ u."""
    model, f, motion = plain
    other = deck(tmp_path / "turned.bdf", 30.0)
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    local = np.einsum("ji,njr->nir", R, motion + 0.3 * motion[:, [2, 2, 2]])
    plain_file = punch(tmp_path / "modes.pch", f, local, model.assembly.ids)
    found = chladni.other_modes(chladni.load(other, "SI"), plain_file)
    expected = motion + 0.3 * motion[:, [2, 2, 2]]
    elastic = found.f_other.size
    np.testing.assert_allclose(found.shapes, expected[:, :, -elastic:], rtol=1e-4, atol=1e-5)


def test_a_model_is_its_own_partner(plain, tmp_path):
    """Every elastic mode finds itself, under its own number; a double pair only in its span."""
    model, f, motion = plain
    pairs = [k for k in range(6, 13) if f[k + 1] / f[k] - 1 < 1e-6]
    assert pairs, "a square plate has double modes"
    mixed = motion.copy()
    a, b = pairs[0], pairs[0] + 1
    mixed[:, :, a], mixed[:, :, b] = (
        motion[:, :, a] + motion[:, :, b],
        motion[:, :, a] - motion[:, :, b],
    )
    path = punch(tmp_path / "modes.pch", f, mixed, model.assembly.ids)
    found = chladni.other_modes(model, path)
    np.testing.assert_allclose(found.in_span, 1, atol=1e-6)
    double = {k + d for k in pairs for d in (0, 1)}
    alone = [k for k, n in enumerate(found.numbers_other) if n - 1 not in double]
    assert len(alone) > 3
    for i, j, value in zip(found.pairs.model, found.pairs.test, found.pairs.mac, strict=True):
        if j in alone:
            assert found.numbers_model[i] == found.numbers_other[j]
            assert value == pytest.approx(1, abs=1e-6)
    mine = found.mac[[found.numbers_model.index(n + 1) for n in (a, b)]]
    assert mine[:, [found.numbers_other.index(n + 1) for n in (a, b)]].max() < 0.6


def test_what_modes_writes_correlate_reads(plain, tmp_path):
    """The universal file of `chladni modes` comes back, its shapes those of the model."""
    path = plain[0].source
    ran("modes", path, "--units", "SI", "--count", 12, "--out", tmp_path / "a")
    words = ["correlate", path, "--modes", tmp_path / "a" / "modes.unv", "--units", "SI"]
    ran(*words, "--pictures", "--out", tmp_path / "b")
    found = json.loads((tmp_path / "b" / "correlation.json").read_text())
    assert len(found["modes"]) == 6
    assert min(m["in_span"] for m in found["modes"]) > 0.9999
    assert {"mac.png", "shapes.png", "report.html"} <= {p.name for p in (tmp_path / "b").iterdir()}


def universal(path, f, motion, ids, places):
    """Complex shapes, of any scale, at numbered places; unmeasured directions are zero."""
    turned = motion * np.exp(1j * np.linspace(0.3, 2.0, motion.shape[2]))
    return write_shapes(path, f, turned, ids, places, 0.01)


@pytest.mark.parametrize("scale", [1.0, 1e3], ids=["m", "mm"])
@pytest.mark.parametrize("shift", [0.0, 0.013], ids=["on grids", "away from grids"])
def test_shapes_of_a_test_are_matched_by_their_places(plain, tmp_path, scale, shift):
    """The lab numbers its points as it likes, measures Z alone, and has complex shapes."""
    model, f, motion = plain
    few = np.array([0, 3, 7, 10, 12, 16, 18, 22, 24])
    places, up = model.assembly.points[few], motion[few] * np.array([0.0, 0.0, 1.0])[:, None]
    if shift:  # linear in between, so that the mean of an edge is its middle
        other = few + N
        few, up = few[other < N * N], up[other < N * N]
        other = other[other < N * N]
        places = (model.assembly.points[few] + model.assembly.points[other]) / 2
        up = (motion[few] + motion[other]) / 2 * np.array([0.0, 0.0, 1.0])[:, None]
    path = universal(tmp_path / "a.unv", f, up, 1001 + np.arange(len(few)), scale * places)
    found = chladni.other_modes(model, path)
    assert found.grids == found.translations == len(few)
    assert min(found.in_span) > 0.98
    assert any("complex" in note for note in found.notes)
    assert any(("away from grids" if shift else "other numbers") in note for note in found.notes)


def test_shapes_without_places_on_the_model_are_refused(plain, tmp_path):
    model, f, motion = plain
    far = model.assembly.points + 7.0
    path = universal(tmp_path / "a.unv", f, motion, 1001 + np.arange(N * N), far)
    with pytest.raises(FileError, match="and no places on it: check that it belongs to this deck"):
        chladni.other_modes(model, path)


def test_axes_of_a_file_that_knows_its_places_are_its_own(plain, tmp_path):
    """What `write_shapes` writes is in the basic frame, whatever frames the deck's grids have."""
    model, f, motion = plain
    other = chladni.load(deck(tmp_path / "turned.bdf", 30.0), "SI")
    path = write_shapes(tmp_path / "a.unv", f, motion + 0.3 * motion[:, [2, 2, 2]],
                        model.assembly.ids, model.assembly.points)  # fmt: skip
    found = chladni.other_modes(other, path)
    expected = (motion + 0.3 * motion[:, [2, 2, 2]])[:, :, -found.f_other.size :]
    np.testing.assert_allclose(found.shapes, expected, rtol=1e-4, atol=1e-5)


@pytest.mark.skipif(not importlib.util.find_spec("pyyeti"), reason="OP2 files are read by pyYeti")
def test_modes_of_nastran_itself():
    """An OP2 file of MSC Nastran: the frequencies of all elastic modes to 1e-6, MAC 1."""
    folder = Path(importlib.util.find_spec("pyyeti").origin).parent / "tests/nastran_op2_data"
    if not (folder / "rdop2gpwg_1.op2").is_file():
        pytest.skip("this pyYeti comes without its examples")
    model = chladni.load(folder / "rdop2gpwg_1.dat")
    found = chladni.other_modes(model, folder / "rdop2gpwg_1.op2")
    assert len(found.pairs) == len(found.f_other) == 12
    off = found.f_model[found.pairs.model] / found.f_other[found.pairs.test] - 1
    assert np.abs(off).max() < 1e-6
    assert found.pairs.mac.min() > 1 - 1e-6


def hinged(path, stiff, n=N, rib=False):
    """Two square plates whose facing edges are joined by springs, and a rib across one of them."""
    lines = ["SOL 103", "CEND", "BEGIN BULK", "MAT1,1,2.1+11,,0.3,7850.", "PSHELL,1,1,.001,1,,1"]
    h, side = 0.2 / (n - 1), n * n
    for p, i, j in np.ndindex(2, n, n):
        lines.append(f"GRID,{1 + j + n * i + p * side},,{h * i + 0.2 * p:.4f},{h * j:.4f},0.")
    for p, i, j in np.ndindex(2, n - 1, n - 1):
        a = 1 + j + n * i + p * side
        lines.append(f"CQUAD4,{a},1,{a},{a + n},{a + n + 1},{a + 1}")
    for j, k in enumerate(stiff):
        a = 1 + j * (n - 1) // (len(stiff) - 1) + n * (n - 1)
        b = a + n
        lines += [f"CELAS2,{2000 + 6 * j + c},{k},{a},{c},{b},{c}" for c in range(1, 7) if k]
    if rib:
        lines += [
            "GRID,900,,0.05,0.05,0.02",
            "GRID,901,,0.1,0.05,0.02",
            "PBAR,2,1,1.-5,1.-10,1.-10",
        ]
        a = 1 + (n - 1) // 4 + n * (n - 1) // 4
        lines += [f"CBAR,900,2,{a},900,0.,1.,0.", "CBAR,901,2,900,901,0.,0.,1."]
    path.write_text("\n".join([*lines, "ENDDATA", ""]))
    return path


FIRM = (1e6,) * 5


def test_a_deck_is_compared_with_a_variant_of_its_joint(tmp_path):
    """Without the spring at one end every mode is lower or equal (Rayleigh), and MAC says which.

    The same deck is its own partner; a variant may be a path or a model.
    """
    deck = hinged(tmp_path / "firm.bdf", FIRM)
    loose = hinged(tmp_path / "loose.bdf", (*FIRM[:4], 0))
    same, found = (chladni.other_modes(deck, other, units="SI") for other in (deck, loose))
    np.testing.assert_allclose(np.diag(same.mac)[: len(same.f_other)], 1, atol=1e-9)
    n = min(len(found.f_other), len(found.f_model))
    assert np.all(found.f_other[:n] <= found.f_model[:n] * (1 + 1e-9))
    assert found.pairs.mac.min() < 0.99 < found.pairs.mac.max()
    assert (found.grids, found.expanded, found.whole) == (2 * N * N, 0, True)
    again = chladni.other_modes(chladni.load(deck, "SI"), chladni.load(loose, "SI"))
    np.testing.assert_allclose(again.mac, found.mac, atol=1e-9)


def test_grids_that_a_variant_lacks_move_by_expansion(tmp_path):
    """A rib of the deck is not in the variant: in the picture it follows the plates."""
    deck = hinged(tmp_path / "rib.bdf", FIRM, rib=True)
    found = chladni.other_modes(deck, hinged(tmp_path / "plain.bdf", FIRM), units="SI")
    assert found.expanded == 2
    assert found.whole
    best = int(np.argmax(found.pairs.mac))
    i, j = found.pairs.model[best], found.pairs.test[best]
    rib = found.origin.assembly.rows([900, 901])
    scale = np.vdot(found.motion[:, :, i], found.shapes[:, :, j]) / np.sum(
        found.motion[:, :, i] ** 2
    )
    own = scale * found.motion[rib, :, i]
    np.testing.assert_allclose(found.shapes[rib, :, j], own, atol=0.1 * np.abs(own).max())


def test_a_variant_may_have_another_mesh(tmp_path):
    """Twice as fine, with other numbers at the same places: points, not numbers, are compared."""
    deck = hinged(tmp_path / "firm.bdf", FIRM)
    found = chladni.other_modes(deck, hinged(tmp_path / "fine.bdf", FIRM, n=9), units="SI")
    assert found.pairs.mac[:6].min() > 0.95
    assert found.grids > N * N


def test_the_page_of_two_decks_shows_both(tmp_path):
    """A square of the MAC opens both shapes, partners in phase."""
    deck = hinged(tmp_path / "firm.bdf", FIRM)
    loose = hinged(tmp_path / "loose.bdf", (*FIRM[:4], 0))
    words = ["correlate", deck, "--modes", loose, "--units", "SI", "--pictures"]
    ran(*words, "--out", tmp_path / "out")
    page = (tmp_path / "out" / "report.html").read_text()
    assert "loose.bdf against the model; framed: the pairs. Click one to see it." in page
    assert {"mac.png", "shapes.png"} <= {p.name for p in (tmp_path / "out").iterdir()}


@pytest.mark.parametrize(
    ("words", "text", "told"),
    [
        (["--modes", "none.pch"], None, "no file"),
        (["--modes", "modes.txt"], "", "modes are read from .op2, .pch"),
        (["--modes", "modes.pch"], "$TITLE\n", "has no eigenvectors"),
        (["--modes", "modes.unv"], "    -1\n    -1\n", "modes.unv"),
        (["--modes", "far.pch"], None, "belongs to this deck"),
        ([], None, "--modes"),
    ],
)
def test_what_is_no_comparison_of_modes_is_told(plain, tmp_path, words, text, told):
    """Files without modes, modes of another deck, units alone."""
    model, f, motion = plain
    punch(tmp_path / "far.pch", f, motion, model.assembly.ids + 5000)
    if text is not None:
        (tmp_path / words[1]).write_text(text)
    given = [words[0], tmp_path / words[1]] if words else []
    out = ("--out", tmp_path / "out")
    assert told in refused("correlate", model.source, *given, "--units", "SI", *out)
    if not words:
        assert "--modes with" in refused("correlate", model.source, *out)
