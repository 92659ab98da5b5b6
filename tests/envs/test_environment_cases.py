"""Every environment on a case folder: the panel, recorded with one modulus off."""

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from numpy.testing import assert_array_equal
from tests.builders.environments import story
from tests.builders.structures import stiffer

import chladni
from chladni.dynamics.eigen import normal_modes
from chladni.dynamics.frf import FRF
from chladni.errors import ChladniError, ShapeError
from chladni.fem.assemble import structure
from chladni.io.nastran import write_assembly
from chladni.io.tables.write_tables import write_npz
from chladni.report import identification_page
from chladni.search import measurement_forecasts
from chladni.workflows.working_model import load
from chladni_envs import IDS, agents
from chladni_envs import environment_cases as cases
from chladni_envs.parameter_selection import ParameterSelectionEnv
from chladni_specimens.plates import folded_panel, plate

OF_A_CASE = tuple(i for i in IDS if i != "chladni/NextMeasurement-v0")  # it needs effects as well
SOFT = 0.98  # of the panel's modulus in the article: its peaks move by half a half-bandwidth
SENSORS = ("34:+Z", "100:+Z", "187:+Z", "239:+Z", "313:+Z", "402:+Z", "470:+Z", "555:+Z")
CASE = """
[model]
deck = "panel.bdf"
units = "SI"
damping = 0.01

[test]
recordings = ["article.npz"]
quantity = "accelerance"

[[parameter]]
name = "E"
field = "E"

[[parameter]]
name = "rho"
field = "rho"
"""


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    folder = tmp_path_factory.mktemp("case")
    panel = folded_panel()
    write_assembly(panel, folder / "panel.bdf")
    (folder / "case.toml").write_text(CASE)
    write_npz(folder / "article.npz", _recorded(panel))
    return str(folder)


def _recorded(panel):
    """Accelerance of an article that is softer than the deck, with a little noise."""
    built = structure(stiffer(panel, SOFT))
    modal = normal_modes(built.system, 60).with_damping(0.01)
    phi = modal.at(SENSORS)
    f = np.arange(10.0, 130.0, 0.4)
    omega, omega_r = 2 * np.pi * f[:, None], 2 * np.pi * modal.frequency
    h = -(omega**2) / (omega_r**2 - omega**2 + 0.02j * omega_r * omega)
    H = np.einsum("ir,kr,jr->kij", phi, h, phi[2:3])
    rng = np.random.default_rng(0)
    H *= 1 + 1e-3 * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape))
    return FRF(H, f, SENSORS, (SENSORS[2],), "accelerance")


@pytest.fixture(scope="module")
def recorded(case):
    """The case made ready for updating, once for both environments."""
    return cases.Recorded(case)


@pytest.fixture
def ready(recorded, monkeypatch):
    monkeypatch.setattr(cases, "Recorded", lambda path: recorded)
    return recorded


@pytest.mark.parametrize("id", OF_A_CASE)
@pytest.mark.filterwarnings("ignore:.*render:UserWarning")
def test_contracts_with_a_case(ready, case, id):
    env = gym.make(f"chladni_envs:{id}", case=case, render_mode="rgb_array")
    check_env(env.unwrapped)
    env.reset(seed=0)
    assert env.render().shape[2] == 3


def test_info_names_what_is_kept(ready, case):
    """Labels of the mesh for places, names for parameters; the mask says the same."""
    known = cases.specimen(case, 8).labels
    env = gym.make("chladni/SensorPlacement-v0", case=case, modes=8, n_sensors=9)
    end = agents.play(env, agents.greedy)
    assert end["labels"] == tuple(known[k] for k in np.flatnonzero(end["kept"]))
    assert all(":" in label for label in end["labels"])
    env = gym.make("chladni/ParameterSelection-v0", case=case)
    end = agents.play(env, agents.at_random(0))
    assert set(end["labels"]) <= set(ready.names)
    env = gym.make("chladni/SensorPlacement-v0", phi=np.eye(5)[:, :2], n_sensors=3)
    assert len(env.reset(seed=0)[1]["labels"]) == 5


def test_identify_moves_the_test_on_the_mesh_of_its_case(case, tmp_path):
    """As its sensors do; a recording alone, and a mesh that takes long, move sensors only."""
    page = identification_page.as_page
    (drawing, *_), *_ = (s.blocks for s in page(tmp_path, chladni.identify(case)).sections)
    sides = drawing.content.data["sides"]
    assert list(sides) == ["expanded", "test"]
    seen = folded_panel()
    used = np.unique(seen.shells.nodes)
    at = [int(np.searchsorted(used, seen.rows([int(n.partition(":")[0])])[0])) for n in SENSORS]
    for whole, test in zip(sides["expanded"], sides["test"], strict=True):
        z, known = np.array(whole["motion"])[2, at], np.array(test["motion"])
        assert z @ known > 0.99 * np.linalg.norm(z) * np.linalg.norm(known)


def test_vectors_with_a_case_are_identical(case):
    id, options = "chladni/SensorPlacement-v0", {"case": case, "modes": 8}
    assert_array_equal(story("sync", 5, id, **options), story("async", 5, id, **options))


def test_shakers_of_a_case_are_vetoed_by_its_mesh(case):
    """Gaps and access come from the mesh; a force beyond the first contact is a veto."""
    specimen = cases.specimen(case, 8)
    assert specimen.access.shape == (len(specimen.points),)
    assert specimen.gap_shapes.shape == (len(specimen.clearance), 8)
    closed = np.full(len(specimen.points), False)
    with pytest.raises(ShapeError, match="access and rattle leave 0"):
        gym.make("chladni_envs:chladni/ActuatorPlacement-v0", case=case, modes=8, access=closed)


def test_actuators_of_a_case(case):
    env = gym.make("chladni_envs:chladni/ActuatorPlacement-v0", case=case, modes=8)
    assert agents.play(env, agents.best_actuators(env))["condition"] < 1e3


PLACES = {"regions": ["panel"], "forbidden": ["box 0 0 -1 0.3 0.3 1"]}


@pytest.mark.parametrize("moves", ["delete", "add"])
def test_places_obey_the_words_of_a_plan(case, moves):
    """Labels of the info, whoever plays: fixed ones stay in, none is where it is not allowed."""
    id, more = "chladni/SensorPlacement-v0", {"fixed": ["402:+X", "513:n"], "cost": {"513:n": 4}}
    env = gym.make(id, case=case, modes=4, n_sensors=7, moves=moves, **PLACES, **more)
    for agent in (agents.at_random(0), agents.exchange(env)):
        end = agents.play(env, agent)
        assert {"402:+X", "513:n"} < set(end["labels"])
        assert end["cost"] == 7 + 3
    inner = env.unwrapped
    outside = np.array([n not in more["fixed"] for n in inner.labels])
    assert inner.points[outside, 0].min() > 0.3
    if moves == "delete":
        env.reset(seed=0)
        masks = dict(zip(inner.labels, inner.action_masks(), strict=True))
        assert not masks["402:+X"]
        assert not masks["513:n"]


def test_costs_divide_information_in_an_environment(case):
    """Four times the cost everywhere is half of every row: log det falls by r ln 4."""
    id, same = "chladni/SensorPlacement-v0", {"case": case, "modes": 4, "regions": ["panel"]}
    one, four = (gym.make(id, **same, cost={"panel": c}).unwrapped for c in (1, 4))
    assert one.walk.log_det - four.walk.log_det == pytest.approx(4 * np.log(4))


def test_shakers_obey_the_words_of_a_plan(case):
    env = gym.make("chladni/ActuatorPlacement-v0", case=case, modes=4, fixed=["402:+X"], **PLACES)
    end = agents.play(env, agents.at_random(0))
    at = [env.unwrapped.specimen.labels.index(n) for n in end["labels"]]
    assert env.unwrapped.specimen.points[at, 0].min() > 0.3
    assert "402:+X" not in end["labels"]
    for id in ("chladni/SensorPlacement-v0", "chladni/ActuatorPlacement-v0"):
        with pytest.raises(ShapeError, match=r"regions, forbidden: .* give case="):
            gym.make(id, **PLACES)


def test_further_measurements_of_a_mesh_obey_the_words_of_a_plan():
    """A model alone is planned with a number of sensors; no candidate is elsewhere."""
    id, made = "chladni/NextMeasurement-v0", plate(0.4, 0.3, 6, 5, 2e-3)
    words = {"effects": ("point-mass", "extra-support"), "top": 200.0, "odds": 1e9}
    with pytest.MonkeyPatch.context() as patch:
        for name, n in (("PLACES", 6), ("MASSES", 2), ("LINES", 8)):
            patch.setattr(measurement_forecasts, name, n)
        env = gym.make(id, case=made, sensors=1, regions=["box 0 0 0 0.2 0.3 0"], **words)
    candidates = [c for o in env.unwrapped.outlooks for c in o.candidates]
    at = {c.label.partition(":")[0] for c in candidates if c.label}
    assert at
    assert made.points[made.rows([int(n) for n in at]), 0].max() <= 0.2
    assert env.reset(seed=0)[1]["labels"] is not None
    with pytest.raises(ChladniError, match=r"sensors is 3.5; give a plan"):
        gym.make(id, case=made, sensors=3.5, **words)


def test_selection_of_a_case(ready, case):
    """Freeing the modulus that is off improves the held-out data and is learned."""
    env = gym.make("chladni_envs:chladni/ParameterSelection-v0", case=case)
    problem = env.unwrapped.given
    assert ready.names[0].startswith("E")
    assert len(problem) == 2
    assert problem.improvement([0]) > 0.5
    assert problem.unlearned([0]) < 0.05
    assert agents.play(env, agents.held_back())["score"] > 0.3


def test_calibration_of_a_case(ready, case):
    """The textbook agent finds the modulus of the article, to a quarter of what it is off."""
    env = gym.make("chladni_envs:chladni/Calibration-v0", case=case)
    end = agents.play(env, agents.gauss_newton(env))
    assert env.unwrapped.question.names == ready.names
    found = ready.mean[0] + cases.REACH * ready.sd[0] * end["x"][0]
    assert found == pytest.approx(np.log(SOFT), rel=0.25)
    assert end["score"] > 0.1


def test_a_bare_deck_takes_its_units(case, tmp_path):
    """The panel in millimetres and tonnes is the panel; a wrong name is refused."""
    deck = write_assembly(folded_panel(), tmp_path / "panel.bdf", "mm-t-s")
    of = {str(deck): "mm-t-s", f"{case}/panel.bdf": "SI"}
    first, second = (
        gym.make("chladni_envs:chladni/SensorPlacement-v0", case=path, modes=4, units=units)
        for path, units in of.items()
    )
    np.testing.assert_allclose(first.unwrapped.points, second.unwrapped.points, atol=1e-6)
    for id in (i for i in IDS if "Placement" in i):
        with pytest.raises(ChladniError, match="mm-t-s"):
            gym.make(f"chladni_envs:{id}", case=str(deck), units="mm")


@pytest.mark.parametrize("id", [i for i in IDS if "Placement" in i])
def test_a_bare_deck_shows_its_units(tmp_path, id):
    """Steel in millimetres and tonnes: places are in metres, and a note names the system."""
    deck = write_assembly(folded_panel(), tmp_path / "panel.bdf", "mm-t-s")
    shown, said = (
        gym.make(f"chladni_envs:{id}", case=case, modes=4, **units).unwrapped
        for case, units in ((str(deck), {}), (deck, {"units": "mm-t-s"}))
    )
    assert shown.notes[0].startswith("units = mm-t-s: ")
    assert said.notes == ()
    assert shown.reset(seed=0)[1]["notes"] == shown.notes[0]
    assert "notes" not in said.reset(seed=0)[1]
    np.testing.assert_array_equal(shown.action_masks(), said.action_masks())
    structure = gym.make(f"chladni_envs:{id}", case=folded_panel(), modes=4)
    assert structure.action_space.n > 0


@pytest.mark.parametrize("id", [i for i in OF_A_CASE if "Placement" not in i])
@pytest.mark.parametrize("form", ["deck", "model", "nowhere"])
def test_an_environment_of_recordings_refuses_what_has_none(tmp_path, id, form):
    deck = write_assembly(folded_panel(), tmp_path / "panel.bdf", "mm-t-s")
    given = {"deck": str(deck), "model": load(deck, "mm-t-s"), "nowhere": str(tmp_path / "no")}
    with pytest.raises(ChladniError, match=r"holds no recording|no file or folder"):
        gym.make(f"chladni_envs:{id}", case=given[form])


@pytest.fixture(scope="module")
def choosing(recorded):
    """The same with the effects of the catalogue as choices."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cases, "Recorded", lambda path: recorded)
        env = ParameterSelectionEnv(case="recorded", effects=True)
        env.reset(seed=0)
        return env


def test_effects_of_the_catalogue_are_choices(choosing, recorded):
    """Every candidate of the search has its place and name; the contract stays."""
    own = len(recorded.names)
    assert choosing.names[:own] == recorded.names
    assert {"point-mass", "extra-support", "crack"} <= {n.split()[0] for n in choosing.names[own:]}
    assert choosing.action_space.n == choosing.p + 1 == len(choosing.names) + 1
    check_env(choosing, skip_render_check=True)


def test_an_effect_is_linear_between_nothing_and_where_it_began(choosing, recorded):
    """At θ = 1 held-out residuals are those with the effect at its start, no others."""
    catalogue, problem = recorded.catalogue, choosing.problem
    k = next(k for k, c in enumerate(catalogue.candidates) if c.effect.name == "point-mass")
    effect, start = catalogue.candidates[k].effect, catalogue.candidates[k].start
    base = catalogue.problem.base
    model = catalogue.problem.reduced.model_for(effect, start)
    x = np.concatenate([catalogue.problem.mean(), start])
    heavier = cases.evaluate(model, [*base, effect], x, False)
    there = recorded.score.only(recorded.held).rebased(model).residual(heavier, False)[0]
    theta = np.eye(choosing.p)[len(recorded.names) + k]
    np.testing.assert_allclose(problem.held_residual + problem.held_jacobian @ theta, there)


def test_what_a_set_of_effects_is_worth(choosing, recorded):
    """Nothing is free of price; where nothing is missing no effect pays, whoever chose it."""
    own = len(recorded.names)
    kept = np.arange(choosing.p) < own
    assert choosing.gain(kept) == 0
    for name in ("point-mass", "extra-support"):
        k = next(k for k, n in enumerate(choosing.names) if n.startswith(name))
        kept[k] = True
        assert choosing.gain(kept) < 0
    assert len(recorded.catalogue.fits) == 2
    choosing.gain(kept)
    assert len(recorded.catalogue.fits) == 2


def test_effects_need_a_case():
    with pytest.raises(ShapeError, match="give case="):
        gym.make("chladni_envs:chladni/ParameterSelection-v0", effects=True)
    env = gym.make("chladni_envs:chladni/ParameterSelection-v0").unwrapped
    with pytest.raises(ShapeError, match="effects=True"):
        env.gain(np.zeros(env.p, bool))


MESH = """import chladni, gymnasium
env = gymnasium.make("chladni_envs:{}", case={})"""
WITH_MODEL = 'chladni.load(mesh, "SI", parts=["steel"])'
WITH_CASE = f"chladni.make_case({WITH_MODEL}.deck, recording, words=dict(units='SI'))"


@pytest.mark.parametrize("id", OF_A_CASE)
def test_a_converted_mesh_is_in_every_environment_in_two_lines(id):
    """A mesh with thickness alone, with a recording of it where the environment needs one."""
    import meshio

    made = folded_panel()
    t = [np.full(len(made.shells), 1e-3)]
    cells = [("quad", made.shells.nodes)]
    mesh = meshio.Mesh(made.points, cells, cell_data={"thickness": t})
    names = {"mesh": mesh, "recording": _recorded(made)}
    exec(MESH.format(id, WITH_MODEL if "Placement" in id else WITH_CASE), names)
    env = names["env"]
    env.reset(seed=0)
    assert env.step(env.action_space.sample())[1] is not None
