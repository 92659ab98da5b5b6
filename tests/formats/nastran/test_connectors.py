"""CWELD and CFAST: what they join, how stiff they are, and that rigid motions cost nothing."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from tests.builders.decks import alike, rewritten
from tests.builders.refusals import says

from chladni.effects.joints import fasteners, lines, with_factor_on, with_family, without_joint
from chladni.fem.assemble import structure
from chladni.io.nastran import assembly
from chladni.model.assembly import Average

E, NU = 2.1e5, 0.3


def sheets(connector, gap=2.0, more=""):
    """Two sheets of 4 x 4 shells of 10 mm, a gap apart; grid 300 between their middles."""
    out, id = [], 0
    for part, z in ((1, 0.0), (2, gap)):
        first = id + 1
        for j in range(5):
            for i in range(5):
                id += 1
                out.append(f"GRID,{id},,{10.0 * i},{10.0 * j},{z}")
        for j in range(4):
            for i in range(4):
                a = first + 5 * j + i
                out.append(f"CQUAD4,{100 * part + 4 * j + i},{part},{a},{a + 1},{a + 6},{a + 5}")
        out.append(f"PSHELL,{part},5,1.,5,,5")
    out += ["MAT1,5,2.1+5,,.3,7.85-9,,,.02", f"GRID,300,,14.,16.,{gap / 2}", "SPC1,9,123456,300"]
    out += ["PWELD,30,5,5.", "PFAST,31,5.,,,1.+5,2.+4,3.+4,4.+5,5.+5,6.+5,.5-6,.1"]
    return "\n".join([*out, *connector.split("\n"), more]) + "\n"


FORMS = {  # shells 105 and 205 are under the middle
    "PARTPAT": "CWELD,900,30,300,PARTPAT\n,1,2",
    "PARTPAT by place": "CWELD,900,30,,PARTPAT\n,1,2\n,14.,16.,1.",
    "ELPAT": "CWELD,900,30,300,ELPAT\n,105,205",
    "ELEMID": "CWELD,900,30,300,ELEMID\n,105,205",
    "GRIDID": "CWELD,900,30,300,GRIDID\n,7,8,13,12\n,32,33,38,37",
    "CFAST": "CFAST,900,31,PROP,1,2,300",
    "CFAST of shells": "CFAST,900,31,ELEM,105,205,300",
    "ALIGN": "CWELD,900,30,,ALIGN,7,32",
}


@pytest.mark.parametrize("form", FORMS)
def test_two_free_sheets_with_one_connector_are_one_body(bulk, form):
    """Six rigid motions and no more: all six components are held, and none to the ground."""
    made = assembly(bulk(sheets(FORMS[form])), "mm-t-s")
    K = structure(made).system.K.toarray()
    K = K / np.sqrt(np.outer(K.diagonal(), K.diagonal()))
    value = np.linalg.eigvalsh(K)
    assert np.abs(value[:6]).max() < 1e-9
    assert value[6] > 1e-7


@pytest.mark.parametrize(
    "form", [f for f in FORMS if f.startswith(("PART", "ELP", "ELEM", "GRID"))]
)
def test_a_weld_is_a_round_beam(bulk, form):
    """k = EA/L, shear with 12 EI/L³ (1 + φ), GJ/L, EI/L, at the middle between the sheets."""
    bush = assembly(bulk(sheets(FORMS[form])), "mm-t-s").bushes
    D, L, G = 5.0, 2.0, E / (2 * (1 + NU))
    A, I = np.pi * D**2 / 4, np.pi * D**4 / 64
    shear = 12 * E * I / L**3 / (1 + 12 * E * I / (0.9 * G * A * L**2))
    due = [1e3 * E * A / L, 1e3 * shear, 1e3 * shear, 2e-3 * G * I / L, *[1e-3 * E * I / L] * 2]
    np.testing.assert_allclose(bush.stiffness[0], due, rtol=1e-6)
    np.testing.assert_allclose(bush.place[0], [0.014, 0.016, 0.001], atol=1e-9)
    np.testing.assert_allclose(np.abs(bush.frame[0, 0]), [0, 0, 1], atol=1e-9)
    assert bush.loss[0, 0] == 0.02


@pytest.mark.parametrize(("gap", "kind", "length"), [(0.5, "", 1.0), (40.0, "", 25.0),
                                                     (2.0, ",,,,,SPOT", 1.0)])  # fmt: skip
def test_length_of_a_weld_has_limits(bulk, gap, kind, length):
    """0.2 D to 5 D, and the mean thickness of the sheets for a spot."""
    text = sheets(FORMS["ELEMID"], gap).replace("PWELD,30,5,5.", f"PWELD,30,5,5.{kind}")
    k = assembly(bulk(text), "mm-t-s").bushes.stiffness[0, 0]
    assert k == pytest.approx(1e3 * E * np.pi * 25 / 4 / length)


def test_a_fastener_may_lie_in_its_sheet(bulk):
    """An axis in the plane of a patch: the weights of its square add up to four, as across it."""
    deck = bulk(sheets("CFAST,900,31,ELEM,105,105,,300,7", gap=0.0))
    (mean,) = (t for t in assembly(deck, "mm-t-s", loose=True).rigid if isinstance(t, Average))
    assert sum(w for *_, w in mean.terms) == pytest.approx(4)


def test_a_fastener_has_its_own_numbers(bulk):
    """KT1 along the axis; half of its mass lies at each end; GE is its loss."""
    made = assembly(bulk(sheets(FORMS["CFAST"])), "mm-t-s")
    assert made.bushes.stiffness[0] == pytest.approx([1e8, 2e7, 3e7, 400, 500, 600])
    assert made.bushes.loss[0, 0] == 0.1
    assert made.masses.matrix[:, 0, 0] == pytest.approx([0.25e-3, 0.25e-3])


def test_the_end_of_a_patch_is_the_mean_of_the_square_of_its_area(bulk):
    """The weights are those of four points: their mean place is the end, and they count four."""
    made = assembly(bulk(sheets(FORMS["PARTPAT"])), "mm-t-s")
    means = [t for t in made.rigid if isinstance(t, Average)]
    assert len(means) == 2
    for mean in means:
        w = np.array([weight for _, _, weight in mean.terms])
        X = made.points[[row for row, _, _ in mean.terms]]
        np.testing.assert_allclose(w @ X / w.sum(), made.points[mean.reference], atol=1e-9)
        assert w.sum() == pytest.approx(4)


@pytest.mark.parametrize(("card", "said"), [
    ("CWELD,900,30,300,SEAM\n,1,2", "CWELD 900: its type 'SEAM' is not understood; there are PART"),
    ("CWELD,900,32,300,PARTPAT\n,1,2", "there is no PWELD 32; there are 30"),
    ("CWELD,900,30,300,PARTPAT\n,1,7", "there is no property of shells 7"),
    ("CWELD,900,30,,PARTPAT\n,1,2", "neither GS, nor GA and GB, nor a place"),
    ("CWELD,900,30,,ALIGN,7", "ALIGN needs GA and GB"),
    ("CWELD,105,30,300,PARTPAT\n,1,2", "already taken by CQUAD4"),
])  # fmt: skip
def test_a_connector_that_joins_nothing_is_refused(bulk, card, said):
    says(said, assembly, bulk(sheets(card)), "mm-t-s")


def test_a_bush_of_one_direction_acts_along_it(bulk):
    """K and C act along the line of its grids, or along x of CID where they coincide."""
    text = (
        "GRID,1,,0.,0.,0.\nGRID,2,,3.,4.,0.\nGRID,3,,0.,0.,0.\nCBUSH1D,8,5,1,2\nCBUSH1D,9,5,1,3,7\n"
        "PBUSH1D,5,100.,2.\nCORD2R,7,,0.,0.,0.,1.,0.,0.,0.,0.,1.\n"
    )
    bushes = assembly(bulk(text), "mm-t-s", loose=True).bushes
    np.testing.assert_allclose(bushes.frame[:, 0], [[0.6, 0.8, 0], [0, 0, 1]], atol=1e-12)
    np.testing.assert_allclose(bushes.stiffness, [[1e5, 0, 0, 0, 0, 0]] * 2)
    np.testing.assert_allclose(bushes.viscous, [[2e3, 0, 0, 0, 0, 0]] * 2)
    says("PBUSH1D 6", assembly, bulk(text.replace("CBUSH1D,8,5", "CBUSH1D,8,6")), loose=True)
    says("needs a coordinate system", assembly, bulk(text.replace("1,3,7", "1,3")), loose=True)


def two(form):
    """Sheets with two connectors of one property."""
    card = FORMS[form]
    other = card.replace("900", "901").replace("300", "301").replace("14.,16.", "26.,24.")
    other = other.replace("7,8,13,12", "13,14,19,18").replace("32,33,38,37", "38,39,44,43")
    other = other.replace("ALIGN,7,32", "ALIGN,13,38")
    return sheets(f"{card}\n{other}", more="GRID,301,,26.,24.,1.")


CHANGES = {
    "one softer": lambda a, first: with_factor_on(a, first, 0.3),
    "one lossy": lambda a, first: with_factor_on(a, first, 0.3, 0.25),
    "all stiffer": lambda a, first: with_family(a, "bushes", 2.0),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("form", FORMS)
def test_a_connector_is_a_joint_that_may_be_soft(bulk, form, change):
    """Each joins both sheets; its new stiffness and loss are read from the changed deck again."""
    deck = bulk(two(form))
    before = assembly(deck, "mm-t-s")
    found = fasteners(structure(before))
    assert [joint.ids for joint in found] == [(900,), (901,)]
    assert lines(found) == [(0, 1)]
    assert all({*joint.parts} == {"PSHELL 1", "PSHELL 2"} for joint in found)
    after = CHANGES[change](before, found[0])
    with pytest.raises(AssertionError):
        alike(before, after)
    again = rewritten(deck, before, after).found
    assert_allclose(again.bushes.stiffness, after.bushes.stiffness, rtol=1e-6)
    assert_allclose(again.bushes.loss, after.bushes.loss, rtol=1e-6)


@pytest.mark.parametrize("form", FORMS)
def test_a_connector_that_is_missing_is_a_card_less(bulk, form):
    """The other one stays, and what a CFAST weighs goes with it."""
    lighter = "PFAST,33,5.,,,1.+5,2.+4,3.+4,4.+5,5.+5,6.+5,.2-6,.1\nCONM2,900,1,,.4-6"
    deck = bulk(two(form).replace("CFAST,901,31", "CFAST,901,33") + lighter)
    before = assembly(deck, "mm-t-s")
    after = without_joint(before, fasteners(structure(before))[0])
    found, gone, fresh = rewritten(deck, before, after)
    assert found.bushes.ids.tolist() == [901]
    assert set(found.masses.ids.tolist()) <= {900, 901}
    assert gone[0].split(",")[1] == "900"
    assert not fresh


def test_a_sound_weld_keeps_its_property_and_the_other_gets_one(bulk):
    """PWELD 30 stays; 32 has a material with a tenth of E, the sheets keep theirs."""
    deck = bulk(two("PARTPAT"))
    before = assembly(deck, "mm-t-s")
    after = with_factor_on(before, fasteners(structure(before))[1], 0.1)
    _, gone, fresh = rewritten(deck, before, after)
    assert gone == ["CWELD,901,30,301,PARTPAT"]
    assert [line.split()[:3] for line in fresh if line.startswith(("MAT1", "PWELD"))] == [
        ["MAT1", "6", "21000."], ["PWELD", "32", "6"]
    ]  # fmt: skip


def test_a_bush_of_one_direction_and_a_gap_are_written_when_they_soften(bulk):
    """K of PBUSH1D; KA, KB and KT of PGAP by one factor."""
    more = (
        "CBUSH1D,910,41,7,32\nPBUSH1D,41,900.,2.\nCGAP,911,42,13,38,1.,0.,0.\n"
        "PGAP,42,,,5.+5,,2.+4\nCGAP,912,43,19,44,1.,0.,0.\nPGAP,43,.1,,5.+5"
    )
    deck = bulk(sheets(FORMS["CFAST"], more=more))
    before = assembly(deck, "mm-t-s")
    after = with_family(before, "bushes", 0.5)
    assert_allclose(rewritten(deck, before, after).found.bushes.stiffness, after.bushes.stiffness)
