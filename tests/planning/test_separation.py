"""Sensors that separate explanations: closed forms, the walk, the environment."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from numpy.testing import assert_allclose

import chladni
import chladni_envs  # noqa: F401
from chladni.errors import ChladniError, ShapeError
from chladni.inference.expected_information import Predicted, Rivals
from chladni.io.nastran import write_assembly
from chladni.output import write_npz
from chladni.search.next_measurement import FurtherTest, Outlook, arrays_of, read_outlook
from chladni_envs import agents
from chladni_envs.small_specimens import tied_plate
from chladni_planning import Walk, greedy, separating, value
from chladni_planning.layouts.information import changed
from chladni_planning.layouts.separation import separating_layout
from chladni_planning.plan_page import in_words
from chladni_planning.separation_page import separation_in_words
from chladni_specimens import plate

RNG = np.random.default_rng(3)


def drawn(n=5, readings=4, unknown=(3, 2), p=(0.5, 0.5)):
    """Candidates of random predictions under two explanations, one of them with fewer readings."""
    seen = tuple(
        Predicted(
            np.stack([np.zeros(m), RNG.normal(size=m)]),
            tuple(RNG.normal(size=(m, k)) for k in unknown),
        )
        for m in [readings - 1, *[readings] * (n - 1)]
    )
    tests = tuple(FurtherTest("sensor", f"a sensor at {k}", f"{k}:n") for k in range(n))
    return Outlook(("a", "b"), Rivals(np.array(p)), tests, seen)


def distance(known, layout):
    """d² = Δᵀ (I + (F_1 F_1ᵀ + F_2 F_2ᵀ)/2)⁻¹ Δ of some sensors together."""
    made = known.made(layout)
    S = np.eye(made.mean.shape[1]) + sum(F @ F.T for F in made.factors) / 2
    off = made.mean[1] - made.mean[0]
    return float(off @ np.linalg.solve(S, off))


def test_the_criterion_is_the_distance_of_the_explanations():
    known = drawn()
    c = separating(known)
    for layout in ([0], [1, 3], [0, 2, 4]):
        assert_allclose(value("S", c.fisher(np.array(layout))), np.log1p(distance(known, layout)))


def test_a_joining_sensor_changes_it_as_it_does():
    known = drawn()
    c, at, others = separating(known), np.array([1]), np.array([0, 2, 3, 4])
    U = c.joining(at, others)
    found = changed("S", c.fisher(at), U, np.ones(U.shape[2]))
    assert_allclose(found, [np.log1p(distance(known, [1, k])) for k in others])


def test_a_walk_ends_where_greedy_does():
    known = drawn(7)
    c = separating(known)
    walk = Walk(c, 3, None, True, "S")
    gains = [walk.move(int(np.argmax(np.where(walk.may(), walk.worth, -1)))) for _ in range(3)]
    best = greedy(c, 3, criterion="S")
    assert set(np.flatnonzero(walk.kept)) == set(best)
    assert_allclose(sum(gains), np.log1p(distance(known, best)))


def test_what_is_not_known_hides_a_difference():
    """Two sensors of one difference; the one whose unknowns look like it tells less."""
    off, none = np.array([[0.0, 0.0], [3.0, 1.0]]), np.zeros((2, 1))
    alike = Predicted(off, (10 * off[1][:, None], none))
    clear = Predicted(off, (none, none))
    tests = tuple(FurtherTest("sensor", n, n) for n in ("alike", "clear"))
    known = Outlook(("a", "b"), Rivals(np.full(2, 0.5)), tests, (alike, clear))
    assert greedy(separating(known), 1, criterion="S").tolist() == [1]


@pytest.mark.parametrize("every", [drawn(p=(0.999, 0.001)), replace(drawn(), names=("a", "b"))])
def test_only_open_pairs_count(every):
    if every.rivals.probability[0] > 0.9:
        with pytest.raises(ShapeError, match="nothing is tied"):
            separating(every)
    else:
        assert len(separating([every, every]).rows) == 2


def test_a_layout_has_the_fewest_sensors_that_tell_all():
    """One clear sensor settles it; its distance is d, and costs and spacing are obeyed."""
    none = np.zeros((1, 1))
    seen = [Predicted(np.array([[0.0], [d]]), (none, none)) for d in (9.0, 8.0, 0.1)]

    def known(costs):
        tests = tuple(FurtherTest("sensor", "", f"{k}:n", (0.1 * k, 0.0, 0.0), cost)
                      for k, cost in enumerate(costs))  # fmt: skip
        return Outlook(("a", "b"), Rivals(np.full(2, 0.5)), tests, tuple(seen))

    kept, apart = separating_layout([known((1, 1, 1))], 3)
    assert kept == [0]
    assert_allclose(apart, 9.0)
    assert separating_layout([known((9, 1, 1))], 3)[0] == [1]
    weak = replace(known((1, 1, 1)), seen=tuple(Predicted(s.mean / 9, s.factors) for s in seen))
    kept, apart = separating_layout([weak], 2)
    assert sorted(kept) == [0, 1]
    assert_allclose(apart, np.hypot(1, 8 / 9))
    assert sorted(separating_layout([weak], 2, spacing=0.15)[0]) == [0, 2]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A deck, and the outlook of a diagnosis that leaves two explanations open."""
    path = tmp_path_factory.mktemp("tied")
    made = plate(0.4, 0.3, 6, 5, 2e-3)
    write_assembly(made, path / "plate.bdf")
    known = drawn(4)
    at = made.points[made.rows([10, 17, 25, 33])]
    tests = tuple(
        replace(c, label=f"{g}:n", point_m=tuple(p), what=f"a sensor at {g}:n")
        for c, g, p in zip(known.candidates, (10, 17, 25, 33), at.tolist(), strict=True)
    )
    (path / "run").mkdir()
    write_npz(path / "run" / "outlook.npz", **arrays_of(replace(known, candidates=tests)))
    return path


SMALL = {"sensors": 4, "modes": 2, "draws": 0, "units": "SI"}


def test_a_plan_has_sensors_for_what_a_diagnosis_leaves_open(folder):
    """They stand in the layout with their distance, and the others see the modes."""
    found = chladni.plan(folder / "plate.bdf", **SMALL, separate=folder / "run")
    mine, layout = found.separation, [found.mounts.labels[k] for k in found.layout]
    assert 1 <= len(mine.labels) <= 3
    assert set(mine.labels) < set(layout)
    c = separating(read_outlook(folder / "run"))
    at = [m.label for m in mine.steps]
    kept = np.array([[10, 17, 25, 33].index(int(n.partition(":")[0])) for n in at])
    assert_allclose(mine.apart, np.sqrt(np.expm1(value("S", c.fisher(kept)))))
    said = " ".join(separation_in_words(mine))
    assert "to tell a, b apart" in said
    assert "standard deviations" in said
    assert "Fixed by the settings" not in " ".join(in_words(found).notes)


def test_a_diagnosis_of_another_mesh_is_refused(folder, tmp_path):
    """Its grid 10 is elsewhere in this deck; 33 is none of a smaller one."""
    for n in (5, 3):
        write_assembly(plate(0.4, 0.3, n, n, 2e-3), tmp_path / "other.bdf")
        with pytest.raises(ChladniError, match="is a diagnosis of another mesh than"):
            chladni.plan(tmp_path / "other.bdf", **SMALL, separate=folder / "run")


@pytest.mark.parametrize(
    ("words", "why"),
    [
        ({"separate": "crack"}, "--separate crack: .* give one, or two and more effects"),
        ({"separate": "none/there"}, "--separate none/there: this is no folder of a diagnosis"),
        ({"separate": ["crack", "crush"]}, "crush"),
        ({"separate": "run", "forbidden": ["10:n", "17:n", "25:n", "33:n"]}, "allowed place"),
        ({"separate": "run", "fixed": ["9:n", "11:n", "16:n", "18:n"]}, "none is left"),
    ],
)
def test_what_cannot_be_separated_is_one_sentence(folder, monkeypatch, words, why):
    monkeypatch.chdir(folder)
    with pytest.raises(ChladniError, match=why):
        chladni.plan(folder / "plate.bdf", **SMALL, **words)


def test_sensor_placement_separates_what_is_tied():
    """Its sensors settle the tied plate better than those in the order of the grid."""
    known = tied_plate()
    env = gym.make("chladni_envs:chladni/SensorPlacement-v0", outlook=known, n_sensors=2)
    end = agents.play(env, agents.greedy)
    assert len(end["labels"]) == 2
    assert end["log_det"] > 0
    sensors = known.without(("mass",))
    at = [k for k, c in enumerate(sensors.candidates) if c.label in end["labels"]]
    assert sensors.information(at) > sensors.information([0, 1])
    check_env(env.unwrapped, skip_render_check=True)


def test_the_environment_divides_information_by_cost():
    """A dear sensor of an outlook is worth less, and its cost is in the info."""
    known = drawn(3)
    dear = replace(known.candidates[0], cost=4.0)
    env = gym.make("chladni_envs:chladni/SensorPlacement-v0", n_sensors=1,
                   outlook=replace(known, candidates=(dear, *known.candidates[1:])))  # fmt: skip
    plain = gym.make("chladni_envs:chladni/SensorPlacement-v0", outlook=known, n_sensors=1)
    worth, before = env.reset()[0], plain.reset()[0]
    assert worth[0] < before[0]
    assert_allclose(worth[1:], before[1:])
    assert env.step(0)[-1]["cost"] == 4.0


def test_a_walk_by_this_criterion_only_adds():
    with pytest.raises(ShapeError, match="sensors are added"):
        Walk(separating(drawn()), 2, None, False, "S")
