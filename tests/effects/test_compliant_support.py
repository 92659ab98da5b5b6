"""A clamp on springs: beam theory, the full structure, other clamps, a moving base, decks."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq

from chladni.dynamics.eigen import normal_modes
from chladni.effects import compliant_support
from chladni.effects.compliant_support import SupportDirection, on_springs
from chladni.effects.effect_context import EffectContext, Setup
from chladni.effects.masses import sensor_mass
from chladni.effects.model_errors import mesh_errors
from chladni.effects.rigid_ties import rigid_ties, sprung
from chladni.errors import ModelError
from chladni.fem.assemble import structure
from chladni.fem.base_motion import base_motion
from chladni.fem.energy import mass_properties
from chladni.fem.modelled import solved
from chladni.fem.released import clamps
from chladni.geometry.refine import refined
from chladni.io.nastran import assembly, read_deck, write_assembly, write_deck
from chladni.io.nastran.edit.model_changes import changes
from chladni.model.added_points import with_points
from chladni.model.assembly import RigidBody
from chladni.model.properties import Isotropic
from chladni.reduced.accuracy import accuracy
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni_specimens.plates import grid, plate, sheet

L, B, T, E, RHO = 0.2, 0.01, 0.002, 70e9, 2700.0  # a strip so narrow that it is a beam
TOP = 800.0  # Hz; two bending modes of the strip lie below


def strip(*ends, nu=0.0, sideways=True):
    """The strip, all of its motions held at x = 0, L or both; it may bend sideways or not."""
    points, nodes = grid(np.linspace(0, L, 41), np.linspace(0, B, 3))
    bare = sheet(points, nodes, T, Isotropic(E, nu, RHO))
    edge = np.flatnonzero(np.isin(points[:, 0], ends))
    held = {(row, c) for row in edge.tolist() for c in range(1, 7)}
    held |= set() if sideways else {(row, 2) for row in range(len(points))}
    return replace(bare, supports=np.array(sorted(held)))


def where(problem, sensors=()):
    setup = Setup(sensors, (), mass_properties(problem.structure.assembly)[0], TOP)
    shapes = problem.shapes
    f = problem.frequency[: shapes.shape[1]]
    return EffectContext(problem.groups, problem.grids, problem.candidates, setup, f, shapes)


class Context:
    """A search that likes what moves across the strip."""

    scan, bases = object(), (np.zeros(0),)

    def __init__(self, problem):
        self.where, self.tried = where(problem), []

    def scores(self, effect, starts):
        self.tried += [effect] if effect not in self.tried else []
        frame = getattr(effect.direction, "frame", np.eye(3))
        return np.full((1, len(starts)), -frame[0][2])


def proposed(problem):
    """Of each clamp what bends across the strip, from x = 0 on."""
    every = [e for e in tried(problem) if isinstance(e.direction, SupportDirection)]
    return sorted((e for e in every if e.direction.frame[0][2] > 0.9), key=lambda e: e.point)


def tried(problem):
    """Everything that the search has a score of."""
    context = Context(problem)
    compliant_support.candidates(context)
    return context.tried


@pytest.fixture(scope="module")
def problem():
    return reduced_problem(strip(0.0, sideways=False), TOP, base=np.eye(3)[2:])


@pytest.fixture(scope="module")
def clamp(problem):
    (found,) = proposed(problem)
    return found


def hertz(problem, effect, x, count):
    lam = evaluate(problem.model_for(effect, x), [effect], x, False).lam
    return np.sqrt(np.maximum(lam[:count], 0)) / (2 * np.pi)


def full(made, count):
    return normal_modes(structure(made).system, count).frequency


def bending(k_over_EI):
    """First two frequencies [Hz] of a beam hinged on k at one end, free at the other."""

    def determinant(b):
        hinge = b * (np.sin(b) * np.cosh(b) - np.cos(b) * np.sinh(b))
        return k_over_EI * L * (1 + np.cos(b) * np.cosh(b)) - hinge

    roots = [brentq(determinant, *ends) for ends in ((1e-3, 1.876), (3.0, 4.695))]
    return np.square(roots) / (2 * np.pi * L**2) * np.sqrt(E * T**2 / 12 / RHO)


def test_a_root_that_turns_is_a_beam_on_a_torsional_spring(problem, clamp):
    """k from almost rigid to almost a hinge (Gorman 1975, ch. 1)."""
    assert [p.name for p in clamp.parameters] == ["K", "K_rot"]
    assert_allclose(clamp.direction.motions(), np.eye(6)[[2, 4]])
    EI = E * B * T**3 / 12
    for ratio in (1e4, 10.0, 1.0, 1e-2):
        k = ratio * EI / L
        x = np.array([clamp.parameters[0].nominal, np.log(k / clamp.parameters[1].scale)])
        assert_allclose(hertz(problem, clamp, x, 2), bending(ratio / L), rtol=3e-3)


def test_without_its_springs_the_strip_flies(problem, clamp):
    """Two rigid motions, and above them a free beam's first bending, β L = 4.7300."""
    found = hertz(problem, clamp, np.array([-25.0, -25.0]), 3)
    free = 4.7300**2 / (2 * np.pi * L**2) * np.sqrt(E * T**2 / 12 / RHO)
    assert found[:2].max() < 0.01 * free
    assert_allclose(found[2], free, rtol=5e-3)


@pytest.mark.parametrize("ends", [(0.0,), (0.0, L)])
def test_each_clamp_gives_as_the_full_structure_does(ends):
    """Other clamps stay where they are; the estimate of the error sees no more than there is."""
    built = reduced_problem(strip(*ends, nu=0.3), TOP)
    effects = proposed(built)
    assert [round(e.point[0], 6) for e in effects] == list(ends)
    for effect in effects:
        x = np.array([-2.0, -3.0])
        found, due = hertz(built, effect, x, 2), full(effect.apply(strip(*ends, nu=0.3), x), 2)
        assert_allclose(found, due, rtol=1e-3)
        known = accuracy(built, built.model_for(effect, x), [effect], x, TOP)
        assert_allclose(known.error[:2], found / due - 1, atol=3e-4)


def test_two_clamps_give_beside_each_other():
    """The second is fitted over a basis that lets the first go already."""
    held = strip(0.0, L)
    built = reduced_problem(held, TOP)
    one, two = proposed(built)
    x, y = np.array([-2.0, -3.0]), np.array([-1.0, -4.0])
    built = replace(built, model=built.model_for(one, x))
    lam = evaluate(built.model_for(two, y), [one, two], np.r_[x, y], False).lam
    due = full(two.apply(one.apply(held, x), y), 2)
    assert_allclose(np.sqrt(lam[:2]) / (2 * np.pi), due, rtol=1e-3)


def test_a_mass_that_rides_on_the_strip_feels_the_clamp(problem, clamp):
    """What a sensor weighs at the tip moves with the root as well."""
    tip = int(problem.structure.assembly.ids[-1])
    mass = sensor_mass(where(problem, (((tip, 1.0),),)))[0]
    x, y = np.array([-2.0, -3.0]), np.array([0.5])
    made = replace(problem, model=problem.model_for(mass, y))
    lam = evaluate(made.model_for(clamp, x), [mass, clamp], np.r_[y, x], False).lam
    due = full(clamp.apply(mass.apply(problem.structure.assembly, y), x), 2)
    assert_allclose(np.sqrt(lam[:2]) / (2 * np.pi), due, rtol=1e-3)


def test_a_table_moves_the_clamp_by_its_springs(problem, clamp):
    """Transmissibility to the tip of the reduced strip and of the written one."""
    x, tip = np.array([-2.0, -3.0]), problem.structure.assembly.ids[-1:]
    model = problem.model_for(clamp, x)
    state = evaluate(model, [clamp], x)
    made = structure(clamp.apply(problem.structure.assembly, x))
    modes, table = normal_modes(made.system, 12), base_motion(made, np.eye(3)[2:])
    up = np.eye(3)[2:]
    for f in (20.0, 90.0, 400.0):
        s2 = (2 * np.pi * f * (0.02 + 1j)) ** 2
        lam = (2 * np.pi * modes.frequency) ** 2
        a = (made.along(tip, up) @ modes.shapes)[0]
        due = 1 - s2 * np.sum(a * (table.force.T @ modes.shapes)[0] / (lam + s2))
        b = (model.rows(problem.structure.along(tip, up)) @ state.phi)[0]
        assert_allclose(1 + s2 * np.sum(b * state.drive[0] / (state.lam + s2)), due, rtol=5e-3)


def test_slopes_of_the_load_of_a_table_follow_a_mass_beside_the_clamp(problem, clamp):
    tip = int(problem.structure.assembly.ids[-1])
    mass = sensor_mass(where(problem, (((tip, 1.0),),)))[0]
    model = replace(problem, model=problem.model_for(clamp, np.zeros(2))).model_for(mass, [0.0])

    def load(x):
        state = evaluate(model, [clamp, mass], x)
        l = np.linalg.solve(state.phi.T, -state.drive[0])
        return l, np.linalg.solve(state.phi.T, -state.ddrive[:, 0].T).T

    x, h = np.array([-1.0, -2.0, 0.3]), 1e-4
    slope = load(x)[1]
    for k, e in enumerate(h * np.eye(3)):
        by_difference = (load(x + e)[0] - load(x - e)[0]) / (2 * h)
        assert_allclose(slope[k], by_difference, atol=1e-6 * np.abs(load(x)[0]).max())


def test_what_hangs_together_is_one_clamp_and_what_all_points_hold_is_none():
    flat = strip(0.0, L)
    drilling = np.array([(row, 6) for row in range(len(flat.points))])
    supports = np.unique(np.concatenate([flat.supports, drilling]), axis=0)
    two = clamps(replace(flat, supports=supports))
    assert [len(c.grids) for c in two] == [3, 3]
    assert not np.concatenate([c.held[:, 5] for c in two]).any()
    assert clamps(replace(flat, supports=drilling)) == ()


def test_a_clamped_bolt_is_a_clamp_though_its_spider_is_searched_on_springs():
    """The held point leads an RBE2; over-constraint puts this tie on a spring in the search."""
    flat = strip(0.0, L)
    bolted, (head,) = with_points(flat, flat.points[[0]] + [0, 0, 0.01])
    body = RigidBody(900, int(head), (0, 1, 2), ((1, 2, 3, 4, 5, 6),) * 3)
    held = np.array([(int(head), c) for c in range(1, 7)])
    bolted = replace(bolted, rigid=(body,), supports=held)
    (tie,) = rigid_ties(bolted)
    for made in (bolted, sprung(bolted, tie, 1e8)):
        (clamp,) = clamps(made)
        assert clamp.grids.tolist() == [bolted.ids[head]]


def test_a_free_structure_is_asked_nothing():
    """Not even its matrices are looked at."""
    assert proposed(reduced_problem(plate(0.2, 0.1, 4, 2, 1e-3), TOP)) == []


def test_a_spider_that_is_held_in_its_middle_is_a_clamp():
    """RBE2 with its independent grid in SPC: the same as the edge held itself."""
    edge, built = strip(0.0), strip(0.0)
    rows = np.unique(edge.supports[:, 0])
    body = RigidBody(9000, int(rows[1]), tuple(map(int, rows[[0, 2]])), ((1, 2, 3, 4, 5, 6),) * 2)
    held = np.array([(rows[1], c) for c in range(1, 7)])
    spider = replace(edge, rigid=(body,), supports=held)
    x = np.array([-2.0, -3.0])
    found = []
    for made in (built, spider):
        problem = reduced_problem(made, TOP)
        (effect,) = proposed(problem)
        found.append((hertz(problem, effect, x, 2), full(effect.apply(made, x), 2)))
    assert_allclose(found[1], found[0], rtol=1e-6)


@pytest.mark.parametrize("how", ["SPC1", "SPC", "PS"])
def test_the_deck_holds_what_it_held_beside(how, tmp_path):
    """One of two clamps on springs, whatever cards held them; what is read has the same modes."""
    made = strip(0.0, L)
    path = write_assembly(made, tmp_path / "deck.bdf")
    lines = path.read_text().splitlines()
    ids = made.ids[np.unique(made.supports[:, 0])].tolist()
    if how == "SPC":
        lines = [line for line in lines if not line.startswith("SPC1")]
        cards = [
            f"SPC,1,{a},123456,0.,{b},123456,0." for a, b in zip(ids[:3], ids[3:], strict=True)
        ]
        lines[-1:] = [*cards, "ENDDATA"]
    elif how == "PS":
        lines = [line for line in lines if not line.startswith(("SPC1", "SPC ="))]
        places = made.points[made.rows(ids)].tolist()
        lines = [line for line in lines if not _of_grid(line, ids)]
        grids = [f"GRID,{i},,{x},{y},{z},,123456" for i, (x, y, z) in zip(ids, places, strict=True)]
        lines[-1:] = [*grids, "ENDDATA"]
    path.write_text("\n".join(lines) + "\n")
    read = read_deck(path)
    before = assembly(read, "SI")
    assert np.array_equal(before.supports, made.supports)
    effect = proposed(reduced_problem(before, TOP))[0]
    after = effect.apply(before, np.array([-2.0, -3.0]))
    write_deck(read, tmp_path / "new.bdf", changes(read, before, after, "SI"))
    again = assembly(read_deck(tmp_path / "new.bdf"), "SI")
    assert_allclose(full(again, 4), full(after, 4), rtol=1e-6)
    assert np.abs(full(after, 4) / full(before, 4) - 1).max() > 0.01


def _of_grid(line, ids):
    return line.startswith("GRID") and line.replace("*", " ").split()[1] in map(str, ids)


def test_what_the_deck_holds_by_default_is_refused_with_the_grid(tmp_path):
    made = strip(0.0)
    path = write_assembly(made, tmp_path / "deck.bdf")
    path.write_text(path.read_text().replace("ENDDATA", "GRDSET,,,,,,,6\nENDDATA"))
    read = read_deck(path)
    before = assembly(read, "SI")
    after = replace(before, supports=before.supports[before.supports[:, 0] > 0])
    with pytest.raises(ModelError, match=r"GRDSET of .* holds grid 1"):
        changes(read, before, after, "SI")


def test_what_follows_a_clamp_has_no_mesh_error():
    """On soft springs the whole plate moves: its mesh errs where it bends, as a finer one shows."""
    free = plate(0.2, 0.1, 10, 5, 1e-3)
    edge = np.flatnonzero(free.points[:, 0] == 0)
    deck = replace(free, supports=np.array([(row, c) for row in edge for c in range(1, 7)]))
    built = reduced_problem(deck, TOP)
    over = mesh_errors(solved(built.structure, TOP), TOP / 2)[0]
    (effect,), fine = proposed(built), refined(deck)
    (clamp,) = clamps(fine)
    for x in (np.array([-6.0, -6.0]), np.array([-2.0, -2.0])):
        model = built.model_for(effect, x)
        lam = evaluate(model, [over, effect], np.r_[1.0, x], False).lam[:3]
        due = full(on_springs(fine, clamp, effect.direction, effect.springs(x)), 3)
        assert_allclose(np.sqrt(lam) / (2 * np.pi), due, rtol=3e-3)
