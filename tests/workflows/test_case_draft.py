"""A first case: whatever system a deck is in, wherever its recording has its places."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.commands import ran, refused

import chladni
from chladni.errors import ChladniError, FileError
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_csv, write_npz
from chladni.io.uff.write_uff import write_uff
from chladni.model.properties import Isotropic
from chladni.units import UNITS
from chladni.workflows.case_draft import draft
from chladni_specimens.plates import plate

ENDS = ("3:+Z", "8:+Z", "17:-Z", "30:+Z")


@pytest.fixture(scope="module")
def structure():
    return plate(0.3, 0.22, 5, 5, 1e-3)


@pytest.fixture(scope="module")
def deck(structure, tmp_path_factory):
    path = tmp_path_factory.mktemp("deck") / "plate.bdf"
    write_assembly(structure, path)
    return path


@pytest.fixture(scope="module")
def frf(deck):
    model = chladni.load(deck, "SI")
    found = chladni.frf(model, ENDS, ["1:+Z"], np.linspace(15, 100, 120)).frfs[0]
    return found.to("accelerance")


@pytest.fixture(scope="module")
def places(structure):
    return dict(zip(structure.ids.tolist(), structure.points, strict=True))


MATERIALS = {"steel": (2.1e11, 7850.0), "aluminium": (7e10, 2700.0), "plastic": (2e9, 1100.0)}


@pytest.mark.parametrize("units", UNITS)
@pytest.mark.parametrize("material", MATERIALS)
def test_the_unit_system_is_told_by_the_material(structure, tmp_path, units, material):
    E, rho = MATERIALS[material]
    parts = tuple(
        p.with_section(**dict.fromkeys(("membrane", "bending", "shear"), Isotropic(E, 0.3, rho)))
        for p in structure.parts
    )
    write_assembly(structure.with_parts(parts), tmp_path / "deck.bdf", UNITS[units])
    made = draft(tmp_path / "deck.bdf")
    assert made.units.name == units
    assert made.mass == pytest.approx(0.3 * 0.22 * 1e-3 * rho, rel=1e-4)


def test_a_material_of_no_system_is_refused(deck, tmp_path):
    text = deck.read_text()
    odd = tmp_path / "odd.bdf"
    odd.write_text(text.replace("7850.", ".0785"))
    assert odd.read_text() != text
    with pytest.raises(FileError, match="usual in no unit system"):
        draft(odd)
    assert draft(odd, units="SI").units.name == "SI"


def test_units_that_no_material_bears_out_are_told(deck):
    assert draft(deck, units="SI").units_why == "as given"
    assert "but check: in SI the deck" in draft(deck, units="mm-t-s").units_why


def ways(made):
    return {d.label: d.matched_by for d in made.dofs}


def test_by_number_where_the_file_has_no_places(deck, frf, tmp_path):
    write_npz(tmp_path / "a.npz", frf)
    made = draft(deck, [tmp_path / "a.npz"])
    assert set(ways(made).values()) == {"grid"}
    assert made.dofs[2].axis.tolist() == [0, 0, -1]


def renumbered(frf, places, shift):
    """The recording with the lab's own numbers for the places of the deck's grids."""
    label = lambda text: f"{int(text.split(':')[0]) + shift}:{text.split(':')[1]}"  # noqa: E731
    one = replace(frf, outputs=tuple(map(label, frf.outputs)), inputs=tuple(map(label, frf.inputs)))
    used = {int(t.split(":")[0]) for t in (*one.outputs, *one.inputs)}
    return one, {n: places[n - shift] for n in used}


CHANNELS = {  # outputs and input of a recording whose labels count channels
    "two": (("1:+Z", "2:+Z"), "1:+Z"),
    "the force first": (("2:+Z", "3:+Z"), "1:+Z"),
    "three": (("1:+Z", "2:+Z", "3:+Z"), "3:+Z"),
}


@pytest.mark.parametrize("placed", [False, True])
@pytest.mark.parametrize("channels", CHANNELS)
def test_channel_numbers_are_missing_until_coordinates_confirm_grids(
    deck, frf, places, tmp_path, placed, channels
):
    """They are numbers of grids as well; neither the draft nor its case uses these."""
    outputs, drive = CHANNELS[channels]
    few = replace(frf, values=frf.values[:, : len(outputs)], outputs=outputs, inputs=(drive,))
    uff, out = tmp_path / "few.uff", tmp_path / "case"
    write_uff(uff, few, {n: places[n] for n in (1, 2, 3)} if placed else {})
    done = ran("init", deck, uff, "--out", out)
    kinds = {d.matched_by for d in draft(deck, [uff]).dofs}
    assert kinds == ({"grid"} if placed else {"missing"})
    assert (f"MISSING places of {outputs[0]}" in (out / "case.toml").read_text()) is not placed
    assert ("channel numbers" in done.output) is not placed
    if placed:
        assert chladni.load_case(out).outputs.labels == outputs
    else:
        with pytest.raises(ChladniError, match=r"sensors\.csv has a header but no rows"):
            chladni.load_case(out)
        table = out / "sensors.csv"
        table.write_text(f"{table.read_text()}{drive},30,,,,+Z,,,,input,,\n")
        with pytest.raises(ChladniError, match="are taken as channel numbers"):
            chladni.load_case(out)


GRIDS = {  # outputs and inputs whose labels are grids, though one end alone may count
    "a sensor at grid 1, a roving hammer": (("1:+Z",), ("1:+Z", "3:+Z", "8:+Z", "30:+Z")),
    "a sensor at grid 3, a roving hammer": (("3:+Z",), ("1:+Z", "3:+Z", "8:+Z", "30:+Z")),
    "a shaker at grid 1": (("3:+Z", "8:+Z", "30:+Z"), ("1:+Z",)),
    "two sensors, a roving hammer": (("1:+Z", "2:+Z"), ("5:+Z", "9:+Z", "17:+Z", "30:+Z")),
    "every grid of the deck": (tuple(f"{k}:+Z" for k in range(1, 37)), ("2:+Z",)),
}  # fmt: skip


@pytest.mark.parametrize("ends", GRIDS)
def test_labels_are_grids_unless_both_ends_together_count(deck, tmp_path, ends):
    outputs, inputs = GRIDS[ends]
    model, f = chladni.load(deck, "SI"), np.linspace(15, 100, 8)
    few = chladni.frf(model, outputs, inputs, f).frfs[0].to("accelerance")
    write_uff(tmp_path / "a.uff", few, {})
    made = draft(deck, [tmp_path / "a.uff"])
    assert {d.matched_by for d in made.dofs} == {"grid"}
    assert any("no coordinates that confirm" in n for n in made.notes)
    ran("init", deck, tmp_path / "a.uff", "--out", tmp_path / "case")
    assert chladni.load_case(tmp_path / "case").outputs.labels == outputs


def test_the_place_of_a_force_at_node_0_is_asked_for(deck, frf, tmp_path):
    """Responses per force drive no base; a row of the table then says where the force acts."""
    unplaced = replace(frf, inputs=("0:+Z",))
    write_uff(tmp_path / "a.uff", unplaced, {})
    said = ran("init", deck, tmp_path / "a.uff", "--out", tmp_path / "case").output
    assert "does not say where the force acts" in said
    assert "missing: places of 0:+Z (input)" in said
    assert "transmissibility" not in said
    with pytest.raises(ChladniError, match=r"'0:\+Z' has node 0, .* place in sensors\.csv"):
        chladni.load_case(tmp_path / "case")
    table = tmp_path / "case" / "sensors.csv"
    table.write_text(f"{table.read_text()}0:+Z,1,,,,,,,,input,,\n")
    assert chladni.load_case(tmp_path / "case").inputs.grids.tolist() == [1]


def test_a_number_is_not_used_where_the_places_say_otherwise(deck, frf, places, tmp_path):
    """One node of another place than its grid; a node without place among other numbers."""
    moved = {**places, 3: places[30]}
    used = {int(text.split(":")[0]) for text in (*frf.outputs, *frf.inputs)}
    write_uff(tmp_path / "a.uff", frf, {n: moved[n] for n in used})
    found = {d.label: (d.matched_by, d.grid) for d in draft(deck, [tmp_path / "a.uff"]).dofs}
    assert found["3:+Z"] == ("place", 30)
    assert found["8:+Z"] == ("grid", 8)
    one, nodes = renumbered(frf, places, 2)
    write_uff(tmp_path / "b.uff", one, {n: x for n, x in nodes.items() if n != 10})
    found = {d.label: (d.matched_by, d.grid) for d in draft(deck, [tmp_path / "b.uff"]).dofs}
    assert found["10:+Z"] == ("missing", None)
    assert found["5:+Z"] == ("place", 3)


@pytest.mark.parametrize("shift", [1000, 2])
def test_by_place_where_the_lab_has_numbers_of_its_own(deck, frf, places, tmp_path, shift):
    """Numbers that are other grids' (2) must not count where the places say otherwise."""
    one, nodes = renumbered(frf, places, shift)
    write_uff(tmp_path / "a.uff", one, nodes)
    made = draft(deck, [tmp_path / "a.uff"])
    assert set(ways(made).values()) == {"place"}
    assert [d.grid for d in made.dofs] == [3, 8, 17, 30, 1]
    assert any("numbers are not" in n for n in made.notes) == (shift == 2)


def test_places_in_millimetres_are_seen_to_be(deck, frf, places, tmp_path):
    one, nodes = renumbered(frf, places, 1000)
    write_uff(tmp_path / "a.uff", one, {n: 1e3 * x for n, x in nodes.items()})
    made = draft(deck, [tmp_path / "a.uff"])
    assert [d.grid for d in made.dofs] == [3, 8, 17, 30, 1]
    assert any("read in mm" in n for n in made.notes)


def test_by_the_nearest_with_its_distance(deck, frf, places, tmp_path):
    one, nodes = renumbered(frf, places, 1000)
    off = {n: x + np.array([0.013, 0.011, 0.02]) for n, x in nodes.items()}
    write_uff(tmp_path / "a.uff", one, off)
    made = draft(deck, [tmp_path / "a.uff"])
    assert set(ways(made).values()) == {"nearest"}
    inside = made.dofs[0]  # the others may lie beyond the plate's edge
    assert inside.distance == pytest.approx(0.02, rel=1e-3)
    assert any("places are more than 10 mm from the mesh" in n for n in made.notes)


def test_what_is_missing_is_named_with_its_remedy(deck, frf, places, tmp_path):
    one, nodes = renumbered(frf, places, 1000)
    write_uff(tmp_path / "a.uff", one, {n: x for n, x in nodes.items() if n != 1017})
    out = tmp_path / "case"
    done = ran("init", deck, tmp_path / "a.uff", "--out", out)
    assert "missing: places of 1017:-Z (output)" in done.output
    assert "not complete yet: case.toml" in done.output
    text = (out / "case.toml").read_text()
    assert "MISSING places of 1017:-Z" in text
    assert "MISSING the weighed mass" in text
    rows = (out / "sensors.csv").read_text()
    assert "1017" not in rows
    (out / "sensors.csv").write_text(rows + "1017:-Z,17,,,,-Z,,,,output,,\n")
    case = chladni.load_case(out)
    assert case.outputs.grids.tolist() == [3, 8, 17, 30]


@pytest.mark.parametrize("units", ["mm-t-s", "SI"])
def test_what_it_writes_is_the_case_that_was_meant(structure, frf, tmp_path, units):
    """From deck and file alone to a case whose model answers as the one recorded."""
    write_assembly(structure, tmp_path / "plate.bdf", UNITS[units])
    nodes = dict(zip(structure.ids.tolist(), structure.points, strict=True))
    write_uff(tmp_path / "a.uff", frf, nodes)
    out = tmp_path / "deep" / "case"
    done = ran("init", tmp_path / "plate.bdf", tmp_path / "a.uff", "--mass", 0.518, "--out", out)
    assert "the case is complete" in done.output
    case = chladni.load_case(out)
    assert case.units.name == units
    assert case.setup.mass == 0.518
    (found,) = chladni.frf(case).frfs
    np.testing.assert_allclose(np.abs(found.values), np.abs(frf.values), rtol=0.02)


def test_a_case_without_a_weighed_mass_can_be_used_and_says_so(deck, frf, places, tmp_path):
    """Missing words that a case can do without do not make it complete."""
    write_uff(tmp_path / "a.uff", frf, places)
    done = ran("init", deck, tmp_path / "a.uff", "--out", tmp_path / "case")
    assert "missing: the weighed mass" in done.output
    assert "can be used" in done.output
    assert "complete" not in done.output


@pytest.mark.parametrize("said", ["mm-t-s", "in-lb-s"])
def test_places_off_a_deck_in_the_wrong_units_point_to_the_units(deck, frf, tmp_path, said):
    """The place lies on the deck as it is meant, not on a deck that is read much smaller."""
    write_npz(tmp_path / "a.npz", frf)
    rows = [f"{label},,0.1,0.1,0,+Z,output" for label in ENDS]
    table = "\n".join(["label,grid,x,y,z,direction,role", *rows, "1:+Z,1,,,,+Z,input", ""])
    (tmp_path / "sensors.csv").write_text(table)
    text = f'[model]\ndeck = "{deck}"\noutside = true\nunits = "{{}}"\n'
    text += '[test]\nrecordings = ["a.npz"]\nsensors = "sensors.csv"\n'
    (tmp_path / "case.toml").write_text(text.format("SI"))
    chladni.load_case(tmp_path)
    (tmp_path / "case.toml").write_text(text.format(said))
    with pytest.raises(ChladniError, match=r"another unit of length, so check .*\[model\] units"):
        chladni.load_case(tmp_path)


@pytest.mark.parametrize("command", ["init", "check"])
def test_a_recording_in_the_place_of_the_deck_is_named(deck, frf, tmp_path, command):
    """Deck and recording are easily given in the wrong order."""
    write_uff(tmp_path / "a.uff", frf)
    sentence = refused(command, tmp_path / "a.uff", deck, "--out", tmp_path / "case")
    assert f"the deck comes first, as in {deck} {tmp_path / 'a.uff'}" in sentence


def test_a_plan_is_read(deck, frf, tmp_path):
    """The table that plan writes takes the place of guesses, masses included."""
    words = ("--units", "SI", "--sensors", 6, "--modes", 4, "--drawn", 0)
    ran("plan", deck, *words, "--out", tmp_path / "plan")
    table = (tmp_path / "plan/sensors.csv").read_text().splitlines()[1:]
    outputs = [row.split(",")[0] for row in table if ",output," in row]
    inputs = [row.split(",")[0] for row in table if ",input," in row]
    n = (len(frf.frequency), len(outputs), len(inputs))
    rng = np.random.default_rng(0)
    recorded = replace(frf, values=rng.normal(size=n) + 0j, outputs=outputs, inputs=inputs)
    write_csv(tmp_path / "lab.csv", recorded)
    words = ("--quantity", "accelerance", "--sensors", tmp_path / "plan/sensors.csv")
    done = ran("init", deck, tmp_path / "lab.csv", *words, "--out", tmp_path / "case")
    case = chladni.load_case(tmp_path / "case")
    assert case.outputs.mass.tolist() == [0.005] * 6
    assert case.frfs[0].quantity == "accelerance"
    assert "from the given table" in done.output


def test_a_plan_is_the_table_of_a_test_that_is_still_to_come(deck, tmp_path):
    """Without a recording the rows of the table are the case's own, and the bench can test it."""
    table = tmp_path / "sensors.csv"
    table.write_text("label,grid,direction,role,mass\n9:+Z,9,+Z,output,0.004\n2:+Z,2,+Z,input,\n")
    done = ran("init", deck, "--sensors", table, "--out", tmp_path / "case")
    assert "2 from the given table" in done.output
    case = chladni.load_case(tmp_path / "case")
    assert (case.outputs.labels, case.inputs.labels) == (("9:+Z",), ("2:+Z",))
    assert case.outputs.mass.tolist() == [0.004]
    assert "no.csv" in refused(
        "init", deck, "--sensors", tmp_path / "no.csv", "--out", tmp_path / "other"
    )


def test_nothing_is_replaced(deck, tmp_path):
    (tmp_path / "case.toml").write_text("mine")
    assert "is not replaced" in refused("init", deck, "--out", tmp_path)
    assert (tmp_path / "case.toml").read_text() == "mine"


@pytest.mark.parametrize("word", ['quo"te', "new\nline", "back\\slash #[model] Ä"])
def test_names_from_files_cannot_break_the_case(deck, frf, tmp_path, word):
    """A recording of any name, a part of any name."""
    name = word.replace("\n", " ")
    odd = tmp_path / f"{name}.npz"
    write_npz(odd, frf)
    named = tmp_path / "plate.bdf"
    named.write_text(f"$ANSA_NAME;1;PSHELL;{name}\n" + deck.read_text())
    ran("init", named, odd, "--out", tmp_path / "case")
    text = (tmp_path / "case" / "case.toml").read_text(encoding="utf-8")
    (tmp_path / "case" / "case.toml").write_text(
        text.replace("# [[parameter]]", "[[parameter]]").replace("# parts", "parts")
        .replace("# field", "field"), encoding="utf-8",
    )  # fmt: skip
    assert chladni.load_case(tmp_path / "case").parameters


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (["nothing.bdf"], "nothing.bdf"),
        (["DECK", "nothing.uff"], "nothing.uff"),
        (["DECK", "DECK"], "recordings end in"),
        (["DECK", "--mass", "-1"], "above zero"),
        (["DECK", "--units", "cubits"], "mm-t-s"),
        (["DECK", "CSV"], "--quantity"),
        (["DECK", "CSV", "--quantity", "weight"], "weight"),
        (["DECK", "--sensors", "none.csv", "CSV", "--quantity", "mobility"], "none.csv"),
    ],
)
def test_bad_input_is_one_sentence(deck, frf, tmp_path, arguments, named):
    write_csv(tmp_path / "a.csv", frf)
    known = {"DECK": deck, "CSV": tmp_path / "a.csv"}
    assert named in refused(
        "init", *(known.get(a, a) for a in arguments), "--out", tmp_path / "out"
    )


def test_a_ring_down_alone_is_a_recording(deck, tmp_path):
    """Nothing but the mass is missing: natural frequencies are taken from it."""
    t = np.arange(2048) / 1024.0
    ring = np.exp(-3 * t) * np.sin(2 * np.pi * 40 * t)
    text = "\n".join(f"{a:.6f},{b:.6g}" for a, b in zip(t, ring, strict=True))
    (tmp_path / "ring.csv").write_text(f"time_s,3:+Z [m/s^2]\n{text}\n")
    done = ran("init", deck, tmp_path / "ring.csv", "--out", tmp_path / "case")
    said = done.output.replace("\n", " ")
    assert "no force: their natural frequencies are compared" in said
    assert "the recordings have neither" not in said
