"""What follows from rows of numbers: names, ties, doubts and refusals, each at its limit."""

from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from chladni.search.decide import decide, tied
from chladni.search.decision_in_words import BEYOND, Reason
from chladni.search.decision_rules import RULES, fits, gain_due, odds_of_something_else
from chladni.search.hypotheses import ALONE, Explanation
from chladni.search.search_round import simplest_first
from chladni.search.several import AlternativeRow

from .decision_tables import FOR, SERVES, Row, named, over, row, table, together

TIED = RULES.tied
DUE = gain_due(1, RULES.chance_of_responses)  # of one family
FOUR = gain_due(4, RULES.chance_of_responses)
NAMED, REST, LITTLE = "missing physics", "not in catalogue", "nothing missing"
R = Reason


def one(gain, news=FOR, Q=SERVES, **more):
    return table(row("crack", gain, news=news, Q=Q), **more)


def with_Q(fitted, held_out):
    return (1.0, fitted), (1.0, held_out)


OPEN = (ALONE, "crack", BEYOND)


@pytest.mark.parametrize(
    ("gain", "news", "Q", "why", "one_of"),
    [
        (1000.0, 0.0, (0.1, 1.0), R.NAMED, ()),  # data that cannot feel it, or none
        (1000.0, -DUE - 1, (0.1, 1.0), R.NAMED, ()),  # all data together
        (1000.0, 500.0, (0.1, 2.0), R.WORSE, OPEN),
        (DUE + 2, -1.0, (0.1, 1.0), R.NAMED, ()),
        (DUE + 2, -4.0, (0.1, 1.0), R.AGAINST, OPEN),
        (1.9 * DUE, 0.0, (0.1, 1.1), R.WORSE, OPEN),
        (1000.0, 500.0, (1.1, 0.1), R.WORSE, OPEN),  # of the fitted data
        (1.9 * DUE, -2 * DUE, (0.1, 1.0), R.AGAINST, ()),
    ],
)
def test_data_no_fit_saw_can_refuse_a_name(gain, news, Q, why, one_of):
    """What is refused refutes nothing: calibration fits, and all data together leave it open."""
    found = decide(one(gain, news, with_Q(*Q)))
    assert (found.reason, found.one_of) == (why, one_of)
    assert found.verdict == (NAMED if found.named else LITTLE)
    assert found.named == (why is R.NAMED)
    unfit = decide(one(gain, news, with_Q(*Q), null=row("", 0.0, p=0.005)))
    assert unfit.verdict == (NAMED if found.named else REST)
    assert unfit.one_of == (("crack", BEYOND) if why is R.WORSE else ())


def test_a_leader_that_cannot_be_fitted_again_leaves_the_name_to_the_next():
    """It is one hypothesis lost, and the answer is that of the others."""
    lost = {"crack": {"lost": "it is no structure"}}
    assert named(table(row("crack", 100.0), row("point-mass", 99.0), then=lost)) == "point-mass"
    found = decide(table(row("crack", 100.0), then=lost))
    assert (found.verdict, found.reason, found.named) == (REST, R.NOT_FITTED, False)


def test_a_set_that_cannot_be_fitted_again_is_refused():
    made = together((80.0, 80.0), DUE)
    singles = [row("crack", 100.0), row("point-mass", 90.0)]
    assert decide(table(*singles, sets=[made])).order[0].together
    found = decide(
        table(*singles, sets=[made], then={"crack and point-mass": {"lost": "it is no structure"}})
    )
    assert not found.order[0].together
    assert "they could not be fitted again: it is no structure" in "".join(found.sentences)


def test_a_renewed_fit_that_lost_its_gain_is_not_named():
    made = one(1.2 * DUE, 0.0, then={"crack": {"gain": 0.9 * DUE}})
    assert decide(made).reason is R.TOO_LITTLE


def test_a_fault_of_a_channel_is_asked_of_what_that_recorded_and_no_fit_saw():
    """Of all that was fitted it explains little."""
    fault = {"physics": False}
    for held_out, verdict in ((0.9, "measurement fault"), (1.1, LITTLE)):
        made = table(row("sensor-fault", 1e3, Q=with_Q(1.1, held_out), **fault))
        assert decide(made).verdict == verdict


@pytest.mark.parametrize(
    ("gain", "news", "name"), [(0.7, 0.2, ""), (0.7, 0.4, "crack"), (-1.0, 2.0, "")]
)
def test_all_poles_together_may_bear_a_name(gain, news, name):
    """The Bayes factor of fitted and foretold poles is the product of both."""
    due = gain_due(1, RULES.chance_of_poles)
    made = one(gain * due, news * due, poles=True)
    assert named(made) == name
    assert named(made.but(enough=False)) == name  # odds, not a number of modes, bear a name


@pytest.mark.parametrize(
    ("gain", "news", "name"),
    [
        (0.7, 0.4, "crack"),
        (0.7, 0.2, ""),  # not enough together
        (0.4, 9.0, ""),  # what was fitted hardly points there
        (1.2, -0.3, ""),  # what was fitted alone would bear it
    ],
)
def test_all_responses_together_bear_a_name(gain, news, name):
    """Those held out are data as those fitted are; the bound on false alarms is that of all."""
    assert named(one(gain * DUE, news * DUE)) == name


def test_too_few_data_list_what_explains_them():
    """Few data name one effect if all others are far behind, and list those within the odds."""
    tied = RULES.tied
    for gains, one_of in (
        ((90.0, 90.0 - 0.9 * tied, 10.0), ("point-mass", "crack")),
        ((0.9 * tied, 0.5, -30.0), (ALONE, "point-mass", "crack")),
    ):
        made = table(*map(row, ("point-mass", "crack", "suspension"), gains), enough=False)
        found = decide(made)
        assert (found.verdict, found.reason, found.one_of) == (REST, R.TOO_FEW, one_of)
    apart = table(row("point-mass", 90.0), row("crack", 90.0 - 1.1 * tied), enough=False)
    assert named(apart) == "point-mass"
    assert named(apart.but(contradicted=False)) == ""


def test_what_a_material_has_as_a_rule_needs_less():
    """Wood is stiffer along its grain."""
    for expected, name in ((True, "orthotropic-material"), (False, "")):
        made = table(row("orthotropic-material", TIED + 1, news=0.0, expected=expected))
        assert named(made) == name


def test_something_else_wins_from_its_own_odds():
    """No test leaves the prior; the bound grows as p falls; the prior decides where it is even."""
    prior = RULES.something_else
    odds = [odds_of_something_else(p, prior) for p in (0.3, 0.1, 0.02, 0.009, 1e-6, 0.0)]
    assert odds == sorted(odds)
    assert_allclose(odds_of_something_else(1 / np.e, prior), prior)
    assert odds_of_something_else(np.nan, prior) == prior
    assert odds[2] < 1 < odds[3]
    assert fits(0.02)
    assert not fits(0.009)
    assert row("crack", 0.0, p=0.02).chances.fits
    assert not row("crack", 0.0, p=0.02, p_damping=1e-4).chances.fits


def test_what_leaves_more_than_its_own_draws_is_not_named():
    for p, p_damping, verdict in ((0.02, 1.0, NAMED), (0.005, 1.0, REST), (0.5, 0.005, REST)):
        made = table(row("crack", 1e3, p=p, p_damping=p_damping))
        assert decide(made).verdict == verdict
    assert decide(table(null=row("", 0.0, p=0.005))).verdict == REST


# rivals of a leader that is refused


def behind(gains, sound=("point-mass",), **more):
    """mass-patch leads and is refused: its deck is worse."""
    worse, names = with_Q(0.1, 2.0), ("mass-patch", "point-mass", "crack", "suspension")
    rows = (row(n, g, Q=SERVES if n in sound else worse) for n, g in zip(names, gains, strict=True))
    return table(*rows, **more)


GAIN = 5 * FOUR


def test_a_rival_that_nothing_refuses_is_the_answer():
    """What was passed over is tied with nothing; what nobody refused may be."""
    made = behind((GAIN, GAIN - 1, GAIN - 2, 0.0))
    found = decide(made)
    assert (found.verdict, named(made)) == (NAMED, "point-mass")
    assert over(found) == (("mass-patch", R.WORSE),)
    assert found.one_of == ("point-mass", "crack")


def test_the_next_is_asked_where_a_rival_is_refused_too():
    found = decide(behind((GAIN, GAIN - 1, GAIN - 2, 0.0), sound=("crack",)))
    assert over(found) == (("mass-patch", R.WORSE), ("point-mass", R.WORSE))
    lost = {"point-mass": {"lost": "it is no structure"}}
    made = behind((GAIN, GAIN - 1, GAIN - 2, 0.0), sound=("point-mass", "crack"), then=lost)
    assert over(decide(made))[1] == ("point-mass", R.NOT_FITTED)


@pytest.mark.parametrize(
    ("second", "more", "why"),
    [
        (FOUR - 1, {}, ()),  # it would not be named alone
        (GAIN - 1.1 * FOUR, {}, ()),  # the leader explains far more
        (GAIN - 1, {"sound": ()}, ("point-mass", R.WORSE)),
        (GAIN - 1, {"after_lead": 0.001}, ("point-mass", R.DAMPING)),
    ],
)
def test_else_the_refusal_stays(second, more, why):
    """What the leader refutes as it refutes calibration alone is not the answer either."""
    found = decide(behind((GAIN, second, 0.0, 0.0), **more))
    assert (found.verdict, found.named) == (LITTLE, False)
    assert over(found)[1:] == ((why,) if why else ())


def test_a_rival_nearly_refuted_stands():
    assert named(behind((GAIN, GAIN - 0.9 * FOUR, 0.0, 0.0))) == "point-mass"


# several effects


TWO = gain_due(2, RULES.chance_of_responses)
SINGLES = (row("crack", 200.0), row("point-mass", 100.0))
PAID, PART = (2 * TWO, 2 * TWO), (2 * TWO, 0.8 * TWO)


def test_a_set_that_pays_comes_before_one_effect():
    made = table(*SINGLES, sets=[together(PAID, TWO)])
    found = decide(made)
    assert (named(made), found.reason) == ("crack and point-mass", R.TOGETHER)
    assert found.order[0].together.gains == PAID


@pytest.mark.parametrize(
    "more",
    [
        {"news": (FOR, -2 * TWO)},  # of one of them
        {"p": 0.005},  # together they do not fit
        {"Q": with_Q(0.1, 2.0)},  # the deck with both is worse
        {"ahead": 0.9 * TWO},  # hardly ahead of one alone
    ],
)
def test_all_must_be_supported_by_data_that_no_fit_saw(more):
    kept = {k: v for k, v in more.items() if k != "news"}
    news = more.get("news", (FOR, FOR))
    made = table(*SINGLES, sets=[together(PAID, TWO, news, **kept)])
    assert named(made) == "crack"


def test_a_set_whose_renewed_fit_lost_the_gain_is_not_named():
    lost = {"crack and point-mass": {"gain": 1e3 - 1.5 * TWO}}
    none = (0.0, 0.0)
    made = table(*SINGLES, sets=[together(PAID, TWO, none)], then=lost)
    assert named(made) == "crack"


def test_what_may_stand_in_the_place_of_one_is_one_of_several():
    alternatives = (
        (),
        (AlternativeRow("adhesive-stiffness", 4.0, "E of 300 MPa is too high for a sealant"),),
    )
    made = table(*SINGLES, sets=[together(PAID, TWO, alternatives=alternatives)])
    assert decide(made).one_of == ("point-mass", "adhesive-stiffness")


def test_an_effect_that_pays_a_part_is_perhaps_there_as_well():
    other = together(PART, TWO, names="crack and suspension")
    said = decide(table(*SINGLES, sets=[other, together(PAID, TWO)])).sentences
    (perhaps,) = (s for s in said if "may be present too" in s)
    assert "with crack and point-mass in place suspension gains" in perhaps


# ties and doubts


def test_near_ones_are_one_of_several():
    made = table(
        row("point-mass", 300.0), row("sensor-mass", 301.0 - TIED), row("crack", 299.0 - TIED)
    )
    assert decide(made).one_of == ("point-mass", "sensor-mass")


def test_another_name_for_the_leader_is_no_rival_of_it():
    lump = row("local-resonator", 299.0, becomes="point-mass")
    assert decide(table(row("point-mass", 300.0), lump)).one_of == ()


@pytest.mark.parametrize(("nearly", "one_of"), [("point-mass", True), ("", False)])
def test_what_the_leader_may_be_is_one_of_both_whatever_the_odds(nearly, one_of):
    lump = row("local-resonator", 300.0, nearly=nearly)
    found = decide(table(lump, row("point-mass", 300 - 5 * TIED)))
    assert found.one_of == (("local-resonator", "point-mass") if one_of else ())


@pytest.mark.parametrize(
    ("gains", "one_of"),
    [
        ((TIED + 2, TIED + 1, 1.0), (ALONE, "point-mass", "sensor-mass")),
        ((TIED + 9, TIED - 1, 1.0), (ALONE, "point-mass")),
        ((TIED - 1, 2.0, 1.0), ()),
    ],
)
def test_what_leads_without_a_name_leaves_calibration_in_doubt(gains, one_of):
    names = ("point-mass", "sensor-mass", "suspension")
    rows = (row(n, g, news=0.0) for n, g in zip(names, gains, strict=True))
    found = decide(table(*rows))
    assert (found.verdict, found.one_of) == (LITTLE, one_of)


@pytest.mark.parametrize(("vote", "one_of"), [(1.0, ("crack", BEYOND)), (-1.0, ())])
def test_where_calibration_does_not_fit_a_leader_that_gains_little_is_one_of(vote, one_of):
    """It, or what the catalogue does not hold; not where other data are against it."""
    lost = {"crack": {"gain": 0.6 * DUE, "news": vote}}
    made = table(row("crack", DUE + 1, news=0.0), null=row("", 0.0, p=0.005), then=lost)
    found = decide(made)
    assert (found.verdict, found.one_of) == (REST, one_of)


def test_where_calibration_does_not_fit_all_that_fits_is_open():
    """No gain is due, and each of these may be the cause; where none fits, nothing explains it."""
    gains = {"point-mass": 12.0, "crack": 8.0, "doubler": 3.0, "suspension": 1.0, "cords": -2.0}
    for p, one_of in ((0.3, ("point-mass", "doubler", BEYOND)), (1e-4, ())):
        each = {"crack": 1e-4}
        rows = [row(n, gain, news=0.0, p=each.get(n, p)) for n, gain in gains.items()]
        found = decide(table(*rows, null=row("", 0.0, p=1e-4)))
        assert (found.verdict, found.reason, found.one_of) == (REST, R.NOTHING_DUE, one_of)
        nothing = any("nothing in the catalogue" in said for said in found.sentences)
        assert nothing == (not one_of)


def test_what_relieves_strained_joints_is_one_of_both():
    """What leaves them strained is no rival."""
    rows = (
        row("point-mass", TIED - 1, news=0.0),
        row("sensor-mass", 5.0, strained=True),
        row("suspension", 2.0),
    )
    for strained, one_of in ((True, (ALONE, "point-mass", "suspension")), (False, ())):
        found = decide(table(*rows, null=row("", 0.0, strained=strained)))
        assert found.one_of == one_of
        assert found.verdict == ("calibration only" if strained else LITTLE)


# the leader of a round


def leads(rows, null):
    """Position of the row that leads."""
    fits = [one.fit for one in rows]
    return fits.index(simplest_first(fits, null)[0])


def test_a_leader_that_is_a_simpler_effect_lets_it_lead():
    lump, mass = row("local-resonator", 0.0, becomes="point-mass"), row("point-mass", 1 - TIED)
    far, foot = row("point-mass", -TIED - 1), 100 * (TIED + 1)
    assert leads([lump, mass], 500.0) == 1
    assert leads([lump, far], 500.0) == 0
    assert leads([lump, far], foot + 1) == 1  # its foot is a hundredth of what was gained
    assert leads([row("local-resonator", 0.0), mass], 500.0) == 0
    assert leads([row("local-resonator", 0.0, nearly="point-mass"), mass], 200.0) == 1


def test_a_value_a_thing_cannot_have_yields_to_one_it_can():
    string, hem = row("adhesive-stiffness", 0.0), row("hem-contact", 1 - TIED)
    assert leads([string, hem], 500.0) == 1
    assert leads([string, row("hem-contact", -TIED - 1)], 500.0) == 0
    assert leads([row("adhesive-stiffness", 0.0, implausible=""), hem], 500.0) == 0


# the function itself


def test_no_number_is_read_that_the_decision_does_not_need():
    """A leader that is named says nothing of its rivals, nor of calibration alone."""
    unread = {"p", "p_damping", "news", "Q", "then"}

    def quiet(one):
        return Row(**{k: v for k, v in one.given.items() if k not in unread})

    made = table(row("crack", 1e3))
    null, rival = quiet(row("", 0.0)), quiet(row("point-mass", 950.0))
    assert decide(made.but(null=null, singles=(*made.singles, rival))).named
    with pytest.raises(AssertionError, match="p was read"):
        decide(table().but(null=null))


ROWS = st.builds(
    row,
    st.sampled_from(("crack", "point-mass", "suspension", "sensor-fault")),
    st.floats(-20, 200),
    st.sampled_from((0.001, 0.03, 0.5, 0.95)),
    st.floats(-60, 60),
    st.builds(with_Q, st.floats(0, 2), st.floats(0, 2)),
    strained=st.booleans(),
)


@settings(deadline=None, max_examples=200)
@given(st.lists(ROWS, max_size=4, unique_by=lambda h: h.name), st.booleans())
def test_every_table_has_a_verdict_with_its_reason(rows, enough):
    """A name gained what is due of all data, was tested, and is the first in order."""
    made = table(*sorted(rows, key=lambda r: r.fit.neg2_log_evidence), enough=enough)
    found = decide(made)
    again = decide(made)  # nothing is remembered
    assert (again.verdict, again.order, again.one_of) == (found.verdict, found.order, found.one_of)
    assert found.named == (found.verdict in (NAMED, "measurement fault"))
    if found.named:
        lead = found.order[0]
        assert made.gain(lead) + lead.news > found.due
        assert enough or len(found.one_of) < 2
        assert lead.chances.fits
    else:
        assert found.reason is not R.NAMED


def test_ties_hold_the_leader_first():
    best = row("crack", 0.0)
    assert tied(best, [best, row("point-mass", 1.0)]) == ("crack", "point-mass")
    assert decide(table()).verdict == LITTLE


@pytest.mark.parametrize(
    ("given_mesh", "halved", "worse"),
    [
        ((0.9, 0.9), (1.1, 0.9), False),  # it is written on the mesh on which it is better
        ((1.1, 0.9), (0.9, 0.9), False),
        ((1.1, 0.9), (0.9, 1.1), True),
        ((1.1, 0.9), None, True),
    ],
)
def test_a_deck_is_worse_if_it_is_on_every_mesh_on_which_it_may_be_written(
    given_mesh, halved, worse
):
    """An effect may be smaller than the error of the deck's mesh, or of what the other one adds."""
    effect = SimpleNamespace(traits=SimpleNamespace(writable=True))
    fit = SimpleNamespace(physics=True, effects=(effect,))
    case = SimpleNamespace(found=SimpleNamespace(plain="calibrated"))
    one = Explanation(case, fit)
    vars(one).update(written="written", halved=("calibrated, finer", "finer") if halved else ())
    scores = {"written": with_Q(*given_mesh), "finer": with_Q(*(halved or (9.0, 9.0)))}
    one._scores = lambda decks: scores[decks[-1]]
    assert one.worse == worse
