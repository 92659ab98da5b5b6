"""Reasons become sentences at the end: each says what was found, of what, with its numbers."""

import pytest

from chladni.search.decide import _doubts, decide
from chladni.search.decision_in_words import UNEXPLAINED, refusal
from chladni.search.decision_rules import gain_due
from chladni.search.several import AlternativeRow

from .decision_tables import FOR, row, table, together

ONE, DUE = (gain_due(n, 1e-5) for n in (1, 2))
WORSE = (1.0, 0.1), (1.0, 2.0)
PAIR = together((2 * DUE, 0.8 * DUE), DUE)
PAID = together((2 * DUE, 2 * DUE), DUE)
BAD = together((2 * DUE, 2 * DUE), DUE, (FOR, -2 * DUE))
TIES = together(
    (2 * DUE, 2 * DUE),
    DUE,
    alternatives=((), (AlternativeRow("hem-contact", 4.0, "odd"),)),
)


SINGLES = (row("crack", 200.0), row("point-mass", 100.0))


@pytest.mark.parametrize(
    ("made", "said"),
    [
        (table(*SINGLES), ("crack: the held-out data bring +50 in 2 ln predictive density",)),
        (
            table(row("crack", 0.7 * DUE, news=FOR)),
            (f"together more than the required {ONE:.0f}",),
        ),
        (
            table(row("crack", 200.0, Q=WORSE)),
            (
                "held-out Q 1 calibrated, 2 with it",
                "the deck with it fits worse than the calibrated deck",
            ),
        ),
        (
            table(row("crack", 200.0, news=-900.0), null=row("", 0.0)),
            ("the held-out data speak against it", "what calibration leaves"),
        ),
        (
            table(row("crack", 200.0, Q=WORSE), row("point-mass", 199.0)),
            ("crack is refused: the deck with it fits", "; point-mass is next"),
        ),
        (
            table(row("point-mass", 5.0), row("crack", 1.0), enough=False),
            (
                "2 modes do not separate the explanations; these explain",
                "calibration alone, point-mass, crack",
            ),
        ),
        (
            table(row("hem-contact", 200.0), row("adhesive-stiffness", 199.0)),
            (
                "2 ln B = 1.0 against adhesive-stiffness",
                "too high for a sealant",
                "settle",
            ),
        ),
        (
            table(row("crack", 15.0, news=0.0)),
            (f"by 15.0 in -2 ln evidence; {ONE:.0f} are required", "settle it"),
        ),
        (
            table(*SINGLES, sets=[PAIR, PAID]),
            (
                f"crack {2 * DUE:.0f}, point-mass {2 * DUE:.0f} (required: {DUE:.0f})",
                "point-mass added to crack: the held-out data bring",
            ),
        ),
        (table(*SINGLES, sets=[BAD]), ("too little for point-mass added to crack",)),
        (table(*SINGLES, sets=[TIES]), ("behind in -2 ln evidence: hem-contact by 4", "odd")),
        (table(row("crack", 200.0, p=0.005)), (f"near 7 Hz{UNEXPLAINED}",)),
    ],
)
def test_each_step_is_said_with_its_numbers(made, said):
    text = "\n".join(decide(made).sentences)
    for part in said:
        assert part in text


def test_a_name_is_never_followed_by_that_nothing_explains_the_recording():
    """The leader was refused by its fit; what stands in its place was not."""
    made = table(row("crack", 200.0, p=0.005), row("point-mass", 199.0))
    found = decide(made)
    assert found.named
    assert not any(UNEXPLAINED in text for text in found.sentences)


def test_the_absolute_test_is_that_of_the_answer():
    assert decide(table(*SINGLES)).tested.chances.test.what == "what crack leaves"
    for gain in (1.0, 200.0):
        quiet = decide(table(row("crack", gain, Q=WORSE)))
        assert quiet.tested.chances.test.what == "what calibration leaves"


@pytest.mark.parametrize(
    ("made", "doubt"),
    [
        (table(row("crack", 200.0, Q=WORSE)), True),
        (table(row("crack", 200.0)), False),  # it is named
        (table(row("crack", 15.0, news=0.0)), False),  # too weak to be named
        (table(row("crack", 200.0, news=-190.0)), False),  # all data give it little
    ],
)
def test_a_refused_effect_that_gains_enough_is_a_reason_for_doubt(made, doubt):
    said = tuple(_doubts(made, decide(made)))
    assert len(said) == doubt
    assert all("all data together give crack 250" in why for why in said)


def test_why_another_is_not_named_is_said_of_each():
    made = table(
        row("suspension", 200.0, Q=WORSE), row("crack", 199.0), row("point-mass", 198.0),
        then={"crack": {"lost": "it is no structure"}},
    )  # fmt: skip
    over = [refusal(made, h, why) for h, why in decide(made).passed_over]
    assert over == [
        "the deck with it fits worse than the calibrated deck",
        "it could not be fitted again: it is no structure",
    ]
