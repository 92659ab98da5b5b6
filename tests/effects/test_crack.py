"""A crack is a hinge: what beam theory says of it, and what the scan of its lines says."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.sparse.csgraph import connected_components

from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.crack import (
    LEAST_LEFT,
    WORTH,
    LineFinder,
    _at_rest,
    candidates,
    closer,
    crack,
    left,
)
from chladni.effects.element_groups import element_groups
from chladni.fem.assemble import structure
from chladni.inference.likelihood import Responses
from chladni.inference.scan import baseline, bending_slopes, direction_scores
from chladni.model.properties import Isotropic
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import folded_panel, plate

TOP = 300.0


def test_lines_lie_on_one_part_and_are_as_long_as_they_should_be():
    """Of a folded panel: every line within a shell's width of straight, none round the fold."""
    deck = folded_panel(0.6, 0.3, 0.04, 0.01, 0.02, 1e-3)
    lines = LineFinder.of(deck)
    found = lines.drawn(np.arange(0, len(deck.shells), 37), (1.0, 2.0))
    assert len(found) > 20
    for line in found:
        X = lines.middle[line.shells]
        assert set(lines.part[line.shells]) == {line.part}
        extent = np.linalg.svd(X - X.mean(axis=0), compute_uv=False) / np.sqrt(len(X))
        assert extent[1] < lines.width[line.shells].max()
        assert extent[0] > extent[1]
        assert np.ptp(X, axis=0).max() <= 0.5 * lines.size[line.part] + 0.02


def test_an_oblique_line_is_a_hinge_without_bridges():
    """Shells of a line hang together by edges: corners alone would pass bending through it."""
    deck = plate(0.4, 0.3, 16, 12, 1.5e-3)
    lines, nodes = LineFinder.of(deck), deck.shells.nodes
    middle = int(np.argmin(np.linalg.norm(lines.middle - [0.2, 0.15, 0], axis=1)))
    for degrees in range(0, 180, 5):
        way = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees)), 0])
        line = lines.through(middle, way, 1.7)
        by_edge = [[len({*nodes[j]} & {*nodes[k]}) > 1 for j in line.shells] for k in line.shells]
        assert connected_components(np.array(by_edge))[0] == 1, degrees


def test_lines_beside_one_are_moved_turned_and_stretched():
    """About the middle and about either end, where these are as they were to half a shell."""
    lines = LineFinder.of(plate(0.4, 0.4, 40, 40, 1e-3))
    x = np.array([0.205, 0.205, 0])
    line = lines.through(int(np.argmin(np.linalg.norm(lines.middle - x, axis=1))), TOWARDS, 2.0)
    moved = lines.moved(line)

    def ends(some):
        half = 0.5 * 0.25 * 0.4 * some.times * some.direction
        return np.sort([lines.middle[some.through] @ TOWARDS + s * half @ TOWARDS for s in (-1, 1)])

    longer = [m for m in moved if m.times > line.times]
    shift = np.array([ends(m) - ends(line) for m in longer])
    assert len(longer) == 3
    assert (np.abs(shift).min(axis=1) <= 0.005 + 1e-9).sum() == 2  # one end stays
    assert (np.abs(shift).max(axis=1) > 0.01).all()
    assert any(m.times < line.times for m in moved)
    assert any(np.abs(m.direction @ TOWARDS) < 0.99 for m in moved)
    beside = [m for m in moved if m.times == line.times and m.direction @ TOWARDS > 1 - 1e-12]
    away = [np.linalg.norm(lines.middle[m.through] - lines.middle[line.through]) for m in beside]
    assert len(away) >= 4
    assert max(away) < 0.02


TOWARDS = np.array([1.0, 0.0, 0.0])


def missed(lines, true, sets):
    """How far sets of shells are from a line, seen through waves as long as modes have."""
    x = lines.middle
    seen = np.exp(-((x[:, None] - x) ** 2).sum(axis=2) / (2 * 0.04**2))
    wrong = np.reshape([np.bincount(s, minlength=len(x)) for s in sets], (len(sets), len(x)))
    wrong = wrong - np.bincount(true.shells, minlength=len(x))
    return np.einsum("ki,ij,kj->k", wrong, seen, wrong)


def test_lines_are_moved_until_none_beside_explains_more():
    """The search ends far nearer than the nearest of the lines that were drawn."""
    deck = plate(0.4, 0.3, 24, 18, 1.5e-3)
    lines, way = LineFinder.of(deck), np.array([np.cos(0.5), np.sin(0.5), 0.0])
    true, asked = lines.through(7 * 24 + 11, way, 1.9), []

    def bending_scores(about, sets):
        asked.extend(sets)
        return np.full(len(sets), -0.5), missed(lines, true, sets)

    first = lines.drawn(np.arange(0, len(deck.shells), 9), (1.0, 2.5))
    ends, tried = _at_rest(SimpleNamespace(bending_scores=bending_scores), 0, lines, first)
    assert tried == len({s.tobytes() for s in asked})  # each set of shells counts once
    rest = missed(lines, true, [line.shells for line in ends])
    assert rest.min() < 0.2 * missed(lines, true, [line.shells for line in first]).min()
    for line, score in zip(ends, rest, strict=True):
        assert missed(lines, true, [m.shells for m in lines.moved(line)]).min() >= score - WORTH


def test_a_line_that_was_fitted_goes_on_to_a_better_one_beside_it():
    """Along with its strength; each line that was tried is counted. At rest it stays."""
    groups = element_groups(structure(plate(0.4, 0.3, 24, 18, 1.5e-3)))
    lines = LineFinder.of(groups.structure.assembly)
    begun = lines.through(7 * 24 + 11, TOWARDS, 1.9)
    turned = np.array([np.cos(0.35), np.sin(0.35), 0.0])
    true = lines.through(9 * 24 + 12, turned, 2.4)
    strong = np.array([0.4])

    def scores(effect, starts, extended):
        far = missed(lines, true, [effect.shells])[0]
        return np.array([[far + (start[0] - strong[0]) ** 2 for start in starts]])

    def own(effect, start):
        return missed(lines, true, [effect.shells])[0], strong

    context = SimpleNamespace(
        scan=bending_slopes, where=SimpleNamespace(groups=groups), bases=(None, "of the fit"),
        scores=scores, own=own, idle=np.inf,
    )  # fmt: skip
    effect, x = crack(groups, begun, 100), np.array([-0.3])
    better = closer(context, effect, x)
    before, after = missed(lines, true, [effect.shells, better.effect.shells])
    assert after < 0.3 * before
    assert better.start == pytest.approx(strong)
    assert better.base == "of the fit"
    assert better.effect.trials_factor > 100 + len(lines.moved(begun))
    there = crack(groups, true, 100)
    assert closer(context, there, strong) is None
    context.scan = None  # natural frequencies alone do not tell lines so near each other apart
    assert closer(context, effect, x) is None


def test_first_frequency_of_a_strip_falls_as_beam_theory_says():
    """∂ln λ/∂ln f = ∫_line φ''² dx / ∫ φ''² dx, φ'' of a free beam's first mode, nu = 0."""
    n, length = 25, 0.5
    strip = plate(length, 0.06, n, 3, 1e-3, Isotropic(2.1e11, 0.0, 7850.0))
    reduced = reduced_problem(strip, 60.0)
    lines = LineFinder.of(strip)
    middle = int(np.argmin(np.linalg.norm(lines.middle - [length / 2, 0.03, 0], axis=1)))
    across = [
        line for line in lines.drawn(np.array([middle]), (10.0,))
        if len(line.shells) == 3 and np.ptp(lines.middle[line.shells][:, 0]) < 1e-9
    ]  # fmt: skip
    effect, x = crack(reduced.groups, across[0], 1), np.array([-8.0])
    state = evaluate(reduced.model_for(effect, x), [effect], x)
    seventh = state.vectors[:, 6]
    got = state.dK.along(seventh[:, None])[0, 0] / state.lam[6] / effect.terms(x)[0].gradient[0]
    k, s = 4.730040744862704, np.linspace(0, 1, 5001)  # cos k cosh k = 1
    r = (np.cosh(k) - np.cos(k)) / (np.sinh(k) - np.sin(k))
    bent = np.cosh(k * s) - np.cos(k * s) - r * (np.sinh(k * s) - np.sin(k * s))
    inside = np.abs(s - 0.5) <= 0.5 / n
    due = (bent[inside] ** 2).sum() / (bent**2).sum()
    assert_allclose(got, due, rtol=(k / n) ** 2)  # elements of length 1/n err with its square


def test_one_hinge_moves_frequencies_alike_on_any_mesh():
    """A strip 0.6 m long with a hinge across its middle: as much of the sheet, on two meshes."""

    def lowered(n, left_of_it):
        strip = plate(0.6, 0.06, n, n // 10, 1.5e-3)
        reduced, lines = reduced_problem(strip, TOP), LineFinder.of(strip)
        middle = int(np.argmin(np.linalg.norm(lines.middle - [0.3, 0.03, 0], axis=1)))
        (line,) = [
            line for line in lines.drawn(np.array([middle]), (3.0,))
            if len(line.shells) == n // 10 and np.ptp(lines.middle[line.shells][:, 0]) < 1e-9
        ]  # fmt: skip
        logit = np.log((1 - LEAST_LEFT) / (left_of_it - LEAST_LEFT) - 1)
        effect, x = crack(reduced.groups, line, 1), np.array([logit])
        assert left(x[0]) == pytest.approx(left_of_it)
        hinge = effect.reported(x, np.zeros(1))[1].value
        lam = [
            evaluate(reduced.model_for(effect, v), [effect], v, False).lam[6]
            for v in (x, np.array([-40.0]))
        ]
        return hinge, lam[0] / lam[1]

    coarse, loss = lowered(30, 0.5)
    assert coarse == pytest.approx(0.6 / 30, rel=0.01)
    width = 0.6 / 90
    fine, same = lowered(90, width / (width + coarse))
    assert fine == pytest.approx(coarse, rel=0.01)
    assert 1 - same == pytest.approx(1 - loss, rel=0.05)
    assert 1 - lowered(90, 0.5)[1] < 0.5 * (1 - loss)  # the ratio itself is another hinge there


def test_a_sheet_too_coarse_for_a_line_has_none():
    """Two by two shells hold no three in a row, and nothing is proposed."""
    coarse = plate(0.2, 0.2, 2, 2, 1e-3)
    groups = element_groups(structure(coarse))
    context = SimpleNamespace(scan=None, where=SimpleNamespace(groups=groups))
    assert candidates(context) == []


def test_two_lines_are_followed_where_each_is_fitted_jointly():
    """Natural frequencies alone have no own optima of an effect next to a linear base."""
    groups = element_groups(structure(plate(0.4, 0.3, 24, 18, 1.5e-3)))

    def scores(effect, starts, extended=False):
        return np.array([[np.sin(40 * effect.point[0]) + np.cos(50 * effect.point[1])]])

    context = SimpleNamespace(
        scan=None, where=SimpleNamespace(groups=groups), scores=scores, bases=(None,)
    )
    assert len(candidates(context)) == 2


def test_something_is_always_left():
    x = np.linspace(-50, 50, 11)
    assert all(LEAST_LEFT <= left(v) <= 1 for v in x)
    assert left(-40.0) == pytest.approx(1, abs=1e-15)


@pytest.fixture(scope="module")
def scanned():
    """A plate, a recording of it with a weak crack, and its baseline."""
    deck = plate(0.4, 0.3, 8, 6, 1.5e-3)
    reduced = reduced_problem(deck, TOP)
    outputs, inputs = reduced.grids.rows[[0, 6, 20, 45]], reduced.grids.rows[[3]]
    s = 2 * np.pi * np.linspace(25, TOP, 60) * (0.05 + 1j)
    use = np.ones((60, 4), bool)
    lines = LineFinder.of(deck).drawn(np.arange(48), (1.0, 2.0))
    true = lines[7]
    effect = crack(reduced.groups, true, 1)
    x = np.array([-4.0])
    empty = Responses(np.ones((60, 4, 1), complex), s, outputs, inputs, use).rebased(reduced.model)
    with_it = evaluate(reduced.model, [effect], x, False)
    data = Responses(empty.model(with_it), s, outputs, inputs, use).rebased(reduced.model)
    base = baseline(
        reduced.model, [calibration_parameter(reduced.groups, "E", [0])], data, None, np.zeros(1)
    )
    return reduced, data, base, lines, true, 1 - left(x[0])


def test_slopes_of_a_line_are_those_of_its_effect(scanned):
    reduced, data, base, lines, _, _ = scanned
    slopes = bending_slopes(base, reduced.model, data, [line.shells for line in lines[:70]])
    for k in (0, 5, 69):
        effect, x = crack(reduced.groups, lines[k], 1), np.array([0.0, -40.0])
        state = evaluate(reduced.model, [*base.effects, effect], x)
        J = data.scaled(state, True)[1][:, 1]
        a = effect.terms(np.array([0.0]))[0]
        at = np.array([0.0, 0.0])
        bent = data.scaled(evaluate(reduced.model, [*base.effects, effect], at), True)[1][:, 1]
        assert np.abs(J).max() < 1e-12  # idle: the logit is flat there
        h = 1e-5
        r = [
            data.scaled(evaluate(reduced.model, [*base.effects, effect], [0.0, v], False), False)[0]
            for v in (-40.0, np.log((1 - LEAST_LEFT) / (1 - LEAST_LEFT - h) - 1))
        ]
        assert_allclose((r[0] - r[1]) / h, slopes[:, k], atol=1e-3 * np.abs(slopes[:, k]).max())
        assert a.gradient[0] < 0
        assert np.abs(bent).max() > 0


def test_the_best_line_is_the_true_one_and_its_loss(scanned):
    _, _, base, lines, true, lost = scanned
    reduced, data = scanned[:2]
    slopes = bending_slopes(base, reduced.model, data, [line.shells for line in lines])
    amount, score = direction_scores(base, slopes)
    best = int(np.argmin(np.where(amount < 0, score, np.inf)))
    assert lines[best] is true
    assert amount[best] == pytest.approx(-lost, rel=0.1)
