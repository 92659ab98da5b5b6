"""Adjacent fasteners as one joint: the lines they stand in, the scan of a run, what a run costs."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose
from scipy.linalg import block_diag
from scipy.sparse.linalg import spsolve

from chladni.dynamics.eigen import normal_modes
from chladni.effects.calibration_parameters import calibration_parameter
from chladni.effects.joint_stiffness import joint_families
from chladni.effects.joints import (
    MOST_RUN,
    Connection,
    joined,
    lines,
    neighbours,
    with_factor_on,
    without_joint,
)
from chladni.effects.welds import WeldCompliance, WeldMissing, of_one, proposed
from chladni.fem.assemble import structure
from chladni.inference.likelihood import Responses
from chladni.inference.scan import baseline
from chladni.io.nastran import assembly, read_deck, write_assembly
from chladni.reduced.reduced_model import evaluate
from chladni.reduced.reduced_problem import reduced_problem
from chladni.search.candidates import UpdatingContext
from chladni.search.fastener_scan import (
    AT_ONCE,
    batched,
    loosened_receptance,
    loosened_rows,
    singles,
    together,
)
from chladni_specimens.forms.mesh_pieces import of_pieces, rectangle, stops
from chladni_specimens.joints.builders import spot_welds
from chladni_specimens.plates import STEEL

TOP, HIGH, COUNT = 250.0, 1.5e-3, 10
GONE = (3, 4, 5, 6)


def connection(point, parts=("a", "b")):
    return Connection("solids", 0, np.array([0]), (1,), np.asarray(point, float), parts)


@pytest.fixture(scope="module", params=["solids", "CWELD"])
def seam(request, tmp_path_factory):
    """Two plates welded along one edge by ten welds, of solids or as a deck has connectors."""
    sides = stops([0.0, 0.5], 0.025), stops([0.0, 0.1], 0.025)
    pieces = [rectangle("lower", (0, 0, 0), *sides), rectangle("upper", (0, 0.07, HIGH), *sides)]
    made = of_pieces(pieces, {"lower": (1.5e-3, STEEL), "upper": (1e-3, STEEL)})
    places = np.array([(x, 0.085, HIGH / 2) for x in np.linspace(0.025, 0.475, COUNT)])
    if request.param == "solids":
        return spot_welds(made, places, ("lower", "upper"))[0]
    path = write_assembly(made, tmp_path_factory.mktemp("seam") / "seam.bdf", "SI")
    lower, upper = (part.id for part in made.parts)
    cards = ["PWELD,900,901,.006", "MAT1,901,2.1+11,,.3"]
    for id, (x, y, z) in enumerate(places.tolist(), start=9001):
        cards += [f"CWELD,{id},900,,PARTPAT", f",{lower},{upper}", f",{x},{y},{z}"]
    text = path.read_text().replace("ENDDATA", "\n".join([*cards, "ENDDATA"]))
    path.write_text(text)
    return assembly(read_deck(path), "SI")


@pytest.fixture(scope="module")
def ground(seam):
    return reduced_problem(seam, TOP)


@pytest.fixture(scope="module")
def welds(ground):
    return sorted(singles(loosened_rows(ground)), key=lambda one: one.joint.point[0])


def receptances(made, data):
    """Of the structure as a whole, on the lines of the data."""
    system, rows = structure(made).system, data.outputs.toarray()
    solved = [rows @ spsolve(sp.csc_array(system.K + s**2 * system.M), rows[0]) for s in data.s]
    return np.array(solved)[:, :, None]


@pytest.fixture(scope="module")
def data(seam, ground, welds):
    """A recording of the seam without four adjacent welds."""
    rows = ground.grids.rows[[0, 9, 30, 60, 75, 120]]
    s = 2 * np.pi * np.linspace(25, TOP, 25) * (0.05 + 1j)
    use = np.ones((25, 6), bool)
    empty = Responses(np.ones((25, 6, 1), complex), s, rows, rows[[0]], use)
    gone = without_joint(seam, joined([welds[k].joint for k in GONE]))
    values = s[:, None, None] ** 2 * receptances(gone, empty)
    return replace(empty, values=values).rebased(ground.model)


@pytest.fixture(scope="module")
def context(ground, welds, data):
    """What a search offers, on this recording."""
    base = baseline(
        ground.model, [calibration_parameter(ground.groups, "E", [0])], data, None, np.zeros(1)
    )
    where = SimpleNamespace(groups=ground.groups)
    problem = SimpleNamespace(reduced=ground, data=data, where=where)
    made = UpdatingContext(problem, SimpleNamespace())
    vars(made).update(
        baselines=(base, base), bases=(np.zeros(1), np.zeros(1)), loosened=tuple(welds)
    )
    return made


def test_fasteners_stand_in_lines_and_gaps_end_them():
    x = [0.0, 1.0, 2.1, 3.0, 8.0, 9.0]
    found = neighbours([connection((v, 0, 0)) for v in x])
    assert [set(n) for n in found] == [{1}, {0, 2}, {1, 3}, {2}, {5}, {4}]
    assert lines([connection((v, 0, 0)) for v in x]) == [(0, 1, 2, 3), (4, 5)]


def test_other_sheets_are_other_lines():
    joints = [connection((v, 0, 0), ("a", "b" if v % 2 else "c")) for v in range(6)]
    found = neighbours(joints)
    assert [set(n) for n in found] == [{2}, {3}, {0, 4}, {1, 5}, {2}, {3}]


def test_a_line_about_a_frame_closes():
    """Every run of a closed line is there, and no fastener stands in one twice."""
    turn = 2 * np.pi * np.arange(12) / 12
    found = neighbours([connection((np.cos(a), np.sin(a), 0)) for a in turn])
    assert all(len(n) == 2 for n in found)
    (row,) = lines([connection((np.cos(a), np.sin(a), 0)) for a in turn])
    runs = {frozenset(row[k : k + MOST_RUN]) for k in range(len(row) - MOST_RUN + 1)}
    assert len(runs) == 12
    assert {len(run) for run in runs} == {MOST_RUN}
    triangle = neighbours([connection((np.cos(a), np.sin(a), 0)) for a in 4 * turn[:3]])
    assert sorted(len(n) for n in triangle) == [1, 1, 2]


def test_a_line_of_one_is_a_line():
    assert lines([connection((0, 0, 0)), connection((5, 0, 0), ("a", "c"))]) == [(0,), (1,)]


def test_rows_are_solved_for_in_groups():
    rows = [(k,) for k in range(AT_ONCE + 1)] + [tuple(range(AT_ONCE))]
    assert [len(group) for group in batched(rows)] == [AT_ONCE, 1, 1]


def test_every_run_of_a_long_line_lies_in_one_row(seam, monkeypatch):
    """And every fastener alone is what it is in a row of its own."""
    monkeypatch.setattr("chladni.search.fastener_scan.AT_ONCE", MOST_RUN + 1)
    ground = reduced_problem(seam, TOP)
    rows = loosened_rows(ground)
    assert len(rows) > 1
    held = [
        {j.ids[0] for j in row.joints[k : k + MOST_RUN]}
        for row in rows for k in range(len(row) - MOST_RUN + 1)
    ]  # fmt: skip
    assert len({frozenset(run) for run in held if len(run) == MOST_RUN}) == COUNT - MOST_RUN + 1
    for one in singles(rows):
        (alone,) = together(ground, [[one.joint]])
        assert_allclose(one.share, alone.share, rtol=1e-6)


def test_the_scan_of_a_run_becomes_the_full_solve(seam, ground, welds, data):
    """Woodbury with what the sheets give between the welds tends to the structure without them.

    Of modes beyond the basis inertia is left out, as of one weld: a basis that reaches twice as far
    misses half at most. With what each weld alone gives it tends to another structure.
    """
    left = np.array([1e-9])
    (one,) = together(ground, [[welds[k].joint for k in GONE]])
    due = receptances(with_factor_on(seam, one.joint, left[0]), data)
    wider = reduced_problem(seam, TOP, data.outputs, reach=5.0)

    def missed(problem, R=None):
        (run,) = together(problem, [[welds[k].joint for k in GONE]])
        run = run if R is None else replace(run, R=R)
        state = evaluate(problem.model, [], np.zeros(0), False)
        H = loosened_receptance(state, problem, data.rebased(problem.model), run, left)[0]
        return np.linalg.norm(H - due)

    apart = block_diag(*(welds[k].R for k in GONE))
    assert missed(wider) < missed(ground) / 2
    assert missed(wider, apart) > 5 * missed(wider)


def test_a_run_of_one_is_the_fastener(ground, welds):
    (one,) = together(ground, [[welds[2].joint]])
    assert_allclose(one.share, welds[2].share, rtol=1e-6)


def test_the_run_that_is_gone_is_proposed_whole(context, welds):
    """Where it begins, how many: neither more nor fewer explain as much."""
    every = proposed(WeldMissing, context)
    run, *others = [c.effect for c in every if len(c.effect.joint.ids) > 1]
    assert set(run.joint.ids) == {i for k in GONE for i in welds[k].joint.ids}
    assert run.text.startswith(("4 welds in a row", "4 fasteners in a row"))
    assert len({c.effect.joint.ids for c in every}) == len(every)
    assert others


def test_all_that_was_tried_is_paid_for(context):
    """Shares of the odds, 1/N each: one fastener and one run in all at most."""
    every = proposed(WeldCompliance, context)
    single = [c for c in every if len(c.effect.joint.ids) == 1]
    more = [c for c in every if c not in single]
    runs = sum(COUNT - m + 1 for m in range(2, MOST_RUN + 1))
    assert all(COUNT / c.effect.trials_factor <= 0.5 for c in single)
    assert all(runs / c.effect.trials_factor <= 0.5 for c in more)


def test_a_run_that_is_gone_is_the_deck_without_it(seam, ground, welds):
    families = joint_families(ground.structure)
    (one,) = together(ground, [[welds[k].joint for k in GONE]])
    effect = of_one(WeldMissing, one.joint, one.share, families, 140, len(GONE))
    x = np.array([-12.0, 0.0])
    model = ground.model_for(effect, x)
    lam = evaluate(model, [effect], x, False).lam[6:14]
    gone = without_joint(seam, one.joint)
    due = normal_modes(structure(gone).system, 14).frequency[6:]
    assert_allclose(np.sqrt(lam) / (2 * np.pi), due, rtol=2e-3)
    made = effect.apply(seam, x)
    assert sum(len(s.ids) for s in (*made.solids, made.bushes)) == COUNT - len(GONE)
