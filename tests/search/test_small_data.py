"""Small and odd data end in an answer or in a sentence, and never in a name they cannot bear."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests.builders.decks import flat_sheet
from tests.builders.quick_runs import quick_runs
from tests.builders.recordings import accelerances, across, noisy

from chladni.case import load_case
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import FRF
from chladni.errors import AccuracyError, ChladniError, FileError
from chladni.fem.assemble import structure
from chladni.fem.modelled import modelled
from chladni.inference.least_data import too_little
from chladni.io.nastran import assembly, read_deck
from chladni.io.tables.write_tables import write_npz
from chladni.progress import silent
from chladni.reduced.real_modes import real_modes
from chladni.search.measured_frequencies import widened
from chladni.search.preparation import _own_modes, equalised_lines
from chladni.units import UNITS
from chladni.workflows.calibrate import calibrate
from chladni.workflows.correlate import correlate
from chladni.workflows.diagnose import diagnose
from chladni.workflows.identify import identify
from chladni.workflows.ready_case import ready


@pytest.fixture(scope="module", autouse=True)
def _quick() -> Iterator[None]:
    with quick_runs():
        yield


TRIED = ["point-mass", "extra-support"]


def plate_deck(held: bool = False) -> str:
    """A flat steel plate of 24 quads, 0.6 x 0.3 m, in SI."""
    cards = ["SOL 103", "CEND", *["SPC = 1"] * held, "BEGIN BULK", "MAT1,1,210.+9,,.3,7850."]
    cards += ["PSHELL,1,1,.001,1,,1"]
    cards += flat_sheet(6, 4, 0.6, 0.3)
    return "\n".join([*cards, *["SPC1,1,123456,1,2,3,4,5"] * held, "ENDDATA"]) + "\n"


def bar_deck(held: bool = True) -> str:
    """A steel cantilever of ten bars, 0.3 m, or the free bar, which spins without inertia."""
    cards = ["SOL 103", "CEND", *["SPC = 1"] * held, "BEGIN BULK", "PARAM,COUPMASS,1"]
    cards += ["MAT1,1,210.+9,,.3,7850."]
    cards += ["PBARL,1,1,,BAR", "+,.02,.003"]
    cards += [f"GRID,{k + 1},,{0.03 * k},0.,0." for k in range(11)]
    cards += [f"CBAR,{k + 1},1,{k + 1},{k + 2},0.,1.,0." for k in range(10)]
    return "\n".join([*cards, *["SPC1,1,123456,1"] * held, "ENDDATA"]) + "\n"


def case_of(folder: Path, text: str, deck: str, test: str = "") -> Path:
    (folder / "deck.bdf").write_text(deck)
    (folder / "case.toml").write_text(
        f'[model]\ndeck = "deck.bdf"\nunits = "SI"\n[test]\n{test}recordings = ["{text}"]\n'
        f"[search]\neffects = {TRIED}\n"
    )
    return folder


def with_poles(folder: Path, deck: str, *frequency: float) -> Path:
    rows = [f"{k + 1},{f}" for k, f in enumerate(frequency)]
    (folder / "p.csv").write_text("\n".join(["mode,frequency_hz", *rows]) + "\n")
    return case_of(folder, "p.csv", deck)


def with_responses(folder: Path, outputs: int, modes: int) -> Path:
    """The plate's first flexible modes at so many outputs, 2 % higher, in a band around them."""
    (folder / "deck.bdf").write_text(plate_deck())
    made = modelled(assembly(read_deck(folder / "deck.bdf"), UNITS["SI"]), 300.0)
    flexible = made.modes.frequency[6:]
    f = np.arange(0.5 * flexible[0], 0.51 * flexible[modes - 1 : modes + 1].sum(), 0.02)
    ends = across(made.assembly, [3, 12, 16, 22, 30][:outputs]), across(made.assembly, [8])
    H = accelerances(made, *ends, f, 0.005, stretch=1.02)
    write_npz(folder / "a.npz", replace(H, values=noisy(H.values, 0.014, 0)))
    return case_of(folder, "a.npz", plate_deck())


@pytest.mark.parametrize("count", [1, pytest.param(5, marks=pytest.mark.slow)])
def test_few_poles_calibrate_and_name_nothing(tmp_path: Path, count: int) -> None:
    case = load_case(with_poles(tmp_path, plate_deck(), *[11.0, 14.0, 29.0, 33.0, 41.0][:count]))
    assert calibrate(case).verdict
    found = diagnose(case)
    assert (found.verdict, found.effects) == ("not in catalogue", ())
    assert len(found.one_of[0]) > 1
    with pytest.raises(
        AccuracyError, match=r"modes? do(es)? not separate the explanations: at least [5-8]"
    ):
        found.trusted()
    assert len(correlate(case).f_test) == count


@pytest.mark.parametrize(("outputs", "modes"), [(1, 1), (2, 2)])
def test_few_modes_at_few_outputs_name_nothing(tmp_path: Path, outputs: int, modes: int) -> None:
    case = load_case(with_responses(tmp_path, outputs, modes))
    assert identify(case).recordings[0].modes.order >= 1
    assert len(correlate(case).pairs) >= 1
    found = diagnose(case)
    assert not found.effects
    assert found.distrust


@pytest.mark.parametrize("held", [True, False])
def test_a_deck_of_bars_is_calibrated(tmp_path: Path, held: bool) -> None:
    """Frequencies tell E / ρ of a bar whose mass is not weighed: one of them is frozen."""
    flexible = first_of(tmp_path, held)
    folder = with_poles(tmp_path, bar_deck(held), *(1.02 * f for f in flexible))
    case = load_case(folder)
    found = calibrate(case)
    assert {c.estimate.name for c in found.calibrated} == {"E"}
    assert found.study is not None
    assert len(found.study.identifiability.frozen) == 1
    assert found.calibrated[0].estimate.value / 210e9 == pytest.approx(1.02**2, rel=5e-3)
    assert not held or not diagnose(case).effects


def test_listed_modes_have_the_same_partners_in_every_command(tmp_path: Path) -> None:
    """Frequencies up to 30 % off, one of them nearer to another mode of the deck."""
    flexible = first_of(tmp_path) * [1.3, 1.02, 0.9, 1.2]
    case = load_case(with_poles(tmp_path, bar_deck(), *np.sort(flexible)))
    found = correlate(case)
    pairs = dict(zip(found.f_test[found.pairs.test], found.f_model[found.pairs.model], strict=True))
    rows = {r.test_hz: r.before_hz for r in calibrate(case).frequencies}
    assert len(pairs) == 4
    for test, model in pairs.items():
        assert rows[test] == pytest.approx(model, rel=1e-9)


def two_parts(soft: float = 1.0) -> str:
    """A steel plate of 120 quads; its middle is a part of its own, ``soft`` times as stiff."""
    cards = ["SOL 103", "CEND", "BEGIN BULK", "MAT1,1,210.+9,,.3,7850.", "PSHELL,1,1,.001,1,,1"]
    cards += [f"MAT1,2,{210e9 * soft:.6e},,.3,7850.", "PSHELL,2,2,.001,2,,2"]
    for card in flat_sheet(15, 8, 0.6, 0.3):
        name, k, *rest = card.split(",")
        if name == "CQUAD4" and 5 <= (int(k) - 1) // 8 < 10:
            rest[0] = "2"
        cards.append(",".join([name, k, *rest]))
    return "\n".join([*cards, "ENDDATA"]) + "\n"


FREE = """
[[parameter]]
parts = ["PSHELL 1"]
field = "E"
sd = 0.1
[[parameter]]
parts = ["PSHELL 2"]
field = "E"
sd = 1.0
"""


def test_a_written_deck_reaches_what_least_squares_reaches(tmp_path: Path) -> None:
    """Frequencies of the deck with a part of a fifth of its stiffness: least squares leave none.

    The modes of the deck do not span those of the soft part, and the mesh error of the fit would
    take a part of the frequencies, which no deck contains.
    """
    (tmp_path / "soft.bdf").write_text(two_parts(0.2))
    made = assembly(read_deck(tmp_path / "soft.bdf"), UNITS["SI"])
    every = normal_modes(structure(made).system, 18).frequency
    folder = with_poles(tmp_path, two_parts(), *every[every > 1.0][:10])
    with (folder / "case.toml").open("a") as case:
        case.write(FREE)
    found = calibrate(load_case(folder))
    assert found.frequency_error.before > 10
    assert found.frequency_error.calibrated < 0.5
    written = [c.written_value / 210e9 for c in found.calibrated]
    assert written == pytest.approx([1.0, 0.2], rel=0.02)
    for profile in found.study.profiles:
        assert min(profile.neg2_log_likelihood) > 0


KNOWN = """
[[parameter]]
parts = ["PBARL 1"]
field = "E"
sd = 0.01
"""


@pytest.mark.parametrize(("sd", "taken"), [(0.01, 0.3), (1.0, 1.0)])
def test_a_known_modulus_takes_no_number_from_two_modes(tmp_path: Path, sd, taken) -> None:
    """Two frequencies to 1 % know E to 1.4 %: 0.01² / (0.01² + 0.014²) = 0.33 of a prior of 1 %."""
    flexible = first_of(tmp_path)[:2]
    folder = with_poles(tmp_path, bar_deck(), *flexible)
    with (folder / "case.toml").open("a") as case:
        case.write(KNOWN.replace("0.01", str(sd)))
    prepared = ready(load_case(folder), True, silent)[0]
    assert 2 - prepared.numbers == pytest.approx(taken, abs=0.06)
    assert f"take {2 - prepared.numbers:.2g} in effect" in prepared.too_little


def first_of(folder: Path, held: bool = True) -> np.ndarray:
    (folder / "deck.bdf").write_text(bar_deck(held))
    made = assembly(read_deck(folder / "deck.bdf"), UNITS["SI"])
    every = normal_modes(structure(made).system, 10).frequency
    return every[every > 1.0][:4]


def test_recordings_without_a_mode_are_said_to_have_none(tmp_path: Path) -> None:
    f = np.linspace(5, 60, 300)
    turn = np.exp(1e-3j * np.random.default_rng(0).normal(size=(300, 2, 1)))
    values = np.array([0.7, 0.9])[:, None] * turn
    flat = FRF(values, f, ("3:+Z", "12:+Z"), ("8:+Z",), "accelerance")
    write_npz(tmp_path / "a.npz", flat)
    case = load_case(case_of(tmp_path, "a.npz", plate_deck()))
    assert len(correlate(case).f_test) == 0
    assert identify(case).distrust
    for workflow in (calibrate, diagnose):
        with pytest.raises(ChladniError, match="no mode is above the noise"):
            workflow(case)


def test_a_model_far_stiffer_than_what_was_measured_is_never_said_to_agree(tmp_path: Path) -> None:
    """One mode at 4 Hz, the first flexible one of the model at 14 Hz (a beam with a bolted lap)."""
    f = np.arange(3.0, 5.0, 0.05)
    s, w = 2j * np.pi * f, 2 * np.pi * 4.0
    H = (s**2 / (s**2 + 0.02 * w * s + w**2))[:, None, None]
    write_npz(tmp_path / "a.npz", FRF(noisy(H, 0.014, 0), f, ("8:+Z",), ("8:+Z",), "accelerance"))
    case = load_case(case_of(tmp_path, "a.npz", plate_deck()))
    assert len(correlate(case).pairs) == 0
    assert calibrate(case).verdict != "nothing missing"
    found = diagnose(case)
    assert (found.verdict, found.effects) == ("not in catalogue", ())
    assert found.distrust


def test_poles_outside_of_the_band_are_refused(tmp_path: Path) -> None:
    folder = with_poles(tmp_path, plate_deck(), 11.0, 14.0)
    with (folder / "case.toml").open("a") as file:
        file.write("[band]\nfit = [100.0, 200.0]\n")
    with pytest.raises(ChladniError, match="none of the 2 poles, 11 to 14 Hz, lies in the band"):
        calibrate(load_case(folder))


def test_time_records_are_no_responses(tmp_path: Path) -> None:
    np.savez(tmp_path / "t.npz", force=np.zeros(4), fs=np.array(48e3))
    with pytest.raises(ChladniError, match=r"t\.npz: time data need one array force and one of"):
        load_case(case_of(tmp_path, "t.npz", plate_deck(), 'quantity = "accelerance"\n'))


@pytest.mark.parametrize(
    ("modes", "channels", "enough"),
    [(7, 0, False), (8, 0, True), (2, 30, False), (3, 2, True), (3, 1, False), (4, 1, True)],
)
def test_least_data(modes: int, channels: int, enough: bool) -> None:
    assert (too_little(modes, channels) == "") is enough


@pytest.mark.parametrize(("modes", "channels"), [(0, 4), (1, 0), (2, 12), (3, 0), (3, 1), (7, 0)])
def test_too_few_data_name_the_least_number_that_suffices(modes: int, channels: int) -> None:
    """The reason counts numbers only where these ask for more than the least three modes."""
    said = too_little(modes, channels)
    due = int(said.split("at least ")[1].split()[0])
    assert too_little(due, channels) == ""
    assert too_little(due - 1, channels)
    assert (f"they give {modes * (1 + channels)} numbers" in said) is (due > 3)


def test_a_wide_band_says_nothing_of_what_lies_far_below_it() -> None:
    f = np.arange(1.0, 600.0)
    wide = FRF(np.ones((len(f), 1, 1), complex), f, ("1:+Z",), ("1:+Z",))
    assert widened(wide, (20.0, 480.0)) == (16.0, pytest.approx(498.4))
    assert widened(wide, (20.0, 25.0)) == (pytest.approx(19.8), pytest.approx(25.2))


def test_a_rigid_mode_in_the_middle_is_no_negative_stiffness() -> None:
    """Six rigid modes of seven: rounding about zero is not compared with a rigid mode."""
    lam = np.array([-2e-5, -1e-5, 0, 1e-5, 1e-5, 2e-5, 2.5e6])
    assert real_modes(np.diag(lam), np.eye(7))[0][-1] == pytest.approx(2.5e6)
    with pytest.raises(ChladniError, match="negative stiffness"):
        real_modes(np.diag([-100.0, *lam[1:]]), np.eye(7))


def test_what_a_rig_rings_with_bears_no_name():
    """Modes are counted as far as the deck has any there, a little beyond the band included."""
    deck = SimpleNamespace(modes=SimpleNamespace(frequency=np.array([0.0, 100.0, 250.0, 900.0])))
    assert _own_modes(deck, 40.0, 200.0) == 2
    assert _own_modes(deck, 0.0, 100.0) == 1


@pytest.mark.parametrize("low", [79.0, 79.1, 80.0, 33.3, 1e-3, 1234.5])
@pytest.mark.parametrize("width", [1.02, 3.0])
def test_the_lowest_line_compared_is_the_end_of_the_band(low, width):
    """A band narrower than the step between lines keeps one, whatever its end rounds to."""
    f = equalised_lines((low, width * low), (), 0.08)
    assert f[0] == low
    assert f[-1] < width * low


def test_a_band_of_which_no_line_is_left_is_refused(tmp_path):
    """Lines 6 % apart: a band of 4 % holds one of them, and a gap may take that one away."""
    case = case_of(tmp_path, "frf.npz", plate_deck())
    made = modelled(assembly(read_deck(tmp_path / "deck.bdf"), UNITS["SI"]), 100.0)
    f_1 = float(made.modes.frequency[6])
    ends = across(made.assembly, [35, 1]), across(made.assembly, [35])
    lines = np.linspace(0.97 * f_1, 1.03 * f_1, 200)
    write_npz(tmp_path / "frf.npz", accelerances(made, *ends, lines, 0.005))
    with (tmp_path / "case.toml").open("a") as text:
        text.write(f"[band]\nfit = [{0.98 * f_1}, {1.02 * f_1}]\n")
        text.write(f"exclude = [[{0.979 * f_1}, {0.981 * f_1}]]\n")
    with pytest.raises(FileError, match="exclude leaves no line between"):
        calibrate(load_case(case))
