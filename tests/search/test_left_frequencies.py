"""A deck whose frequencies are farther off than a careful model's says so, and what they show."""

from dataclasses import replace

import numpy as np
import pytest
from tests.builders.decks import flat_sheet

from chladni.fem.modelled import Modelled, modelled
from chladni.geometry.folds import share_at_folds
from chladni.inference.result import FrequencyRow
from chladni.io.nastran import assembly, read_deck
from chladni.search.left_frequencies import fold_shares, left_frequencies
from chladni.search.measured_modes import frequency_error
from chladni.units import UNITS

RATIO = 0.3


@pytest.fixture(scope="module")
def angle(tmp_path_factory):
    """An angle of two steel sheets that meet at x = 0.2 m, and the same with a softer fold."""
    cards = ["SOL 103", "CEND", "BEGIN BULK", "MAT1,1,210.+9,,.3,7850.", "PSHELL,1,1,.002,1,,1"]
    for card in flat_sheet(16, 5, 0.4, 0.3):
        name, k, *rest = card.split(",")
        if name == "GRID" and (x := float(rest[1])) > 0.2:
            rest[1], rest[3] = "0.2", str(x - 0.2)
        cards.append(",".join([name, k, *rest]))
    path = tmp_path_factory.mktemp("angle") / "deck.bdf"
    path.write_text("\n".join([*cards, "ENDDATA"]) + "\n")
    made = assembly(read_deck(path), UNITS["SI"])
    (part,) = made.parts
    soft = part.with_section(bending_ratio=RATIO * part.section.bending_ratio)
    at = share_at_folds(made.points, made.shells.nodes) > 0
    shells = replace(made.shells, part=np.where(at, 1, made.shells.part))
    return modelled(made, 500.0), modelled(replace(made, parts=(part, soft), shells=shells), 500.0)


def frequencies(model: Modelled) -> np.ndarray:
    f = model.modes.frequency
    return f[f > 1.0][:10]


def rows(test: np.ndarray, deck: np.ndarray) -> list[FrequencyRow]:
    return [FrequencyRow(t, after_hz=f) for t, f in zip(test.tolist(), deck.tolist(), strict=True)]


def test_softer_folds_are_found_by_the_frequencies_they_lower(angle):
    """The factor is known: 0.3 on the bending of the shells along the fold, first order in it."""
    deck, softer = angle
    (far, folds), cause = left_frequencies(rows(frequencies(softer), frequencies(deck)), deck)
    assert "leaves 2 % at most" in far
    assert cause == "softer folds"
    assert cause in folds
    found = float(folds.split("with about ")[1].split()[0])
    assert found == pytest.approx(RATIO, abs=0.12)


def test_a_common_factor_is_no_fold(angle):
    deck, _ = angle
    f = frequencies(deck)
    scattered = f * 0.93 * np.exp(0.004 * np.random.default_rng(1).normal(size=len(f)))
    said, cause = left_frequencies(rows(scattered, f), deck)
    assert len(said) == 1
    assert not cause


@pytest.mark.parametrize(("off", "said"), [(0.015, 0), (0.025, 1)])
def test_careful_models_of_shells_leave_two_per_cent(angle, off, said):
    deck, _ = angle
    f = frequencies(deck)
    assert len(left_frequencies(rows(f * (1 + off), f), deck)[0]) == said


def test_shares_are_the_slopes_of_ln_stiffness(angle):
    """d ln f² = s d ln κ (Rayleigh): a small change of the fold tells the share of its energy."""
    deck, _ = angle
    made = deck.assembly
    at = share_at_folds(made.points, made.shells.nodes) > 0
    (part,) = made.parts
    step = 1e-4
    softer = part.with_section(bending_ratio=(1 - step) * part.section.bending_ratio)
    shells = replace(made.shells, part=np.where(at, 1, made.shells.part))
    near = modelled(replace(made, parts=(part, softer), shells=shells), 500.0)
    f = frequencies(deck)
    slope = -2 * np.log(frequencies(near) / f) / step
    np.testing.assert_allclose(fold_shares(deck, f), slope, atol=0.01)


def test_all_modes_are_counted():
    """Eight modes without an error and five of 10 %: the rms is that of thirteen."""
    f = np.linspace(10.0, 130.0, 13)
    deck = f * np.where(np.arange(13) < 8, 1.0, np.exp(0.1))
    assert frequency_error(rows(f, deck)).after == pytest.approx(10 * np.sqrt(5 / 13))
