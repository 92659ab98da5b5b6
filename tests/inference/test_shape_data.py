"""Measured shapes as data: their factor, close modes, and slopes of their misfit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.builders.tube_frames import frame_deck, recorded_shapes

from chladni.case import load_case
from chladni.inference.shape_data import ShapeData, shape_slopes
from chladni.reduced.reduced_model import evaluate
from chladni.search.measured_shapes import NOISES, learned_noise
from chladni.search.preparation import prepare
from chladni.search.question import Prepared, Question
from chladni.workflows.question_of_case import question_of

N_OUT, NOISE = 7, 0.02


@pytest.fixture(scope="module")
def question(tmp_path_factory: pytest.TempPathFactory) -> Question:
    """A frame with shapes of ten modes at a few sensors."""
    folder: Path = tmp_path_factory.mktemp("frame")
    recorded_shapes(frame_deck(folder / "frame.bdf"), folder / "shapes.unv", 1, every=9)
    (folder / "case.toml").write_text(
        '[model]\ndeck = "frame.bdf"\nunits = "mm-t-s"\n[test]\nrecordings = ["shapes.unv"]\n'
    )
    return question_of(load_case(folder))


@pytest.fixture(scope="module")
def prepared(question: Question) -> Prepared:
    return prepare(question, fitted=False)


def modes(seed: int = 0, gap: float = 0.3) -> tuple[np.ndarray, np.ndarray]:
    """Shapes (n_out, 4) and λ of four modes, the second and third apart by a relative gap."""
    lam = np.array([1.0, 2.0, 2.0 * (1 + gap), 6.0])
    return np.random.default_rng(seed).normal(size=(N_OUT, 4)), lam


def measured(psi: np.ndarray) -> ShapeData:
    """One shape with isotropic noise."""
    values = (psi / np.linalg.norm(psi))[None]
    return ShapeData(values, np.full(values.shape, NOISE**2 / N_OUT))


def cost(data: ShapeData, phi: np.ndarray, lam: np.ndarray, mode: int, scale: float) -> float:
    at = np.array([mode])
    return float(data.costs(phi, lam, scale, np.array([0]), at)[0])


def test_density_is_that_of_the_stated_covariance() -> None:
    """-2 ln of N(ψ; q φ, C) with q integrated out, against the whole matrix C."""
    (phi, lam), scale, i = modes(), 0.03, 1
    data = measured(phi[:, i] + 0.1 * phi[:, 2] + 0.01 * np.arange(N_OUT))
    C = np.diag(data.variance[0])
    for j in (0, 2, 3):
        c2 = (lam[i] * lam[j] + lam[i] ** 2) / (lam[i] - lam[j]) ** 2
        C += scale**2 * c2 * np.outer(phi[:, j], phi[:, j]) / (phi[:, i] @ phi[:, i])
    psi, y, inverse = data.values[0], phi[:, i], np.linalg.inv(C)
    left = psi @ inverse @ psi - (y @ inverse @ psi) ** 2 / (y @ inverse @ y)
    D = data.variance[0]
    wide = np.linalg.slogdet(C)[1] - np.log(D).sum()
    wide += np.log(y @ inverse @ y) - np.log((y**2 / D).sum())
    assert cost(data, phi, lam, i, scale) == pytest.approx(left + wide, rel=1e-9)
    one, none = np.array([0]), np.zeros((0, N_OUT, 1))
    R, _, det = data.scaled(phi, lam, scale, one, np.array([i]), none)
    assert (R**2).sum() == pytest.approx(left, rel=1e-9)
    assert det == pytest.approx(wide, rel=1e-9)


def test_between_close_modes_the_subspace_counts() -> None:
    """Any mixture of two modes of one frequency fits, and apart it does not."""
    for gap, fits in ((1e-9, True), (0.5, False)):
        phi, lam = modes(gap=gap)
        pure, mixed = measured(phi[:, 1]), measured(phi[:, 1] + phi[:, 2])
        more = cost(mixed, phi, lam, 1, 0.01) - cost(pure, phi, lam, 1, 0.01)
        assert (abs(more) < 1.0) == fits
        turned = phi @ np.array([[1, 0, 0, 0], [0, 0.8, -0.6, 0], [0, 0.6, 0.8, 0], [0, 0, 0, 1]])
        assert fits == (abs(cost(mixed, turned, lam, 1, 0.01) - cost(mixed, phi, lam, 1, 0.01)) < 1)


def test_slopes_of_the_misfit() -> None:
    """Against differences, the partner moved across itself so that C stays."""
    (phi, lam), i = modes(1), 1
    data, one, h = measured(phi @ [0.1, 1.0, 0.2, 0.0]), np.array([0]), 1e-6
    moved = np.random.default_rng(2).normal(size=N_OUT)
    moved -= phi[:, i] * (moved @ phi[:, i]) / (phi[:, i] @ phi[:, i])

    def misfit(step: float) -> np.ndarray:
        there = phi.copy()
        there[:, i] += step * moved
        none = np.zeros((0, N_OUT, 1))
        return data.scaled(there, lam, 0.02, one, np.array([i]), none)[0][0]

    J = data.scaled(phi, lam, 0.02, one, np.array([i]), moved[None, :, None])[1][0, 0]
    np.testing.assert_allclose(J, (misfit(h) - misfit(-h)) / (2 * h), rtol=1e-5, atol=1e-6)


def test_slopes_of_the_shapes(prepared: Prepared) -> None:
    """∂φ against differences of the reduced model, but for the part along φ."""
    problem, data = prepared.problem, prepared.problem.data
    model, base, x = problem.reduced.model, problem.base, problem.mean()
    state = evaluate(model, base, x)
    at, kept = data.at_sensors(state), data.pairs(state)[1][:6]
    slopes, h = shape_slopes(state, at, kept), 1e-5
    for p in range(0, len(x), 6):
        step = h * np.eye(len(x))[p]
        ends = [data.at_sensors(evaluate(model, base, x + way * step, False)) for way in (1, -1)]
        ends = [end * np.sign((end * at).sum(axis=0)) for end in ends]
        due = ((ends[0] - ends[1]) / (2 * h))[:, kept]
        for k, i in enumerate(kept):
            off = due[:, k] - slopes[p, :, k]
            off -= at[:, i] * (off @ at[:, i]) / (at[:, i] @ at[:, i])
            assert np.linalg.norm(off) < 1e-6 * np.linalg.norm(at[:, i]) + 1e-3 * np.linalg.norm(
                due
            )


def test_scale_sign_and_phase_of_a_shape_do_not_count(
    question: Question, prepared: Prepared
) -> None:
    """Every shape has any complex factor, and conjugation is none of a real one."""
    assert question.shapes is not None
    rng = np.random.default_rng(3)
    factor = rng.lognormal(0, 3, 10) * np.exp(2j * np.pi * rng.uniform(size=10))
    other = prepare(replace(question, shapes=question.shapes * factor), fitted=False)
    found = []
    for each in (prepared, other):
        problem = each.problem
        state = evaluate(problem.reduced.model, problem.base, problem.mean(), False)
        found.append(np.abs(problem.data.scaled(state, False)[0]))
    np.testing.assert_allclose(*found, rtol=1e-6, atol=1e-7)


def test_modes_are_paired_by_shape(prepared: Prepared) -> None:
    """Poles that change places go with their shapes; a pole of no mode stays alone."""
    problem, data = prepared.problem, prepared.problem.data
    state = evaluate(problem.reduced.model, problem.base, problem.mean(), False)
    test, model, _ = data.pairs(state)
    assert data.shapes is not None
    order = np.arange(len(data.frequency))
    order[[3, 4]] = 4, 3  # 3 % apart
    values, variance = data.shapes.values[order], data.shapes.variance[order]
    swapped = replace(data, shapes=ShapeData(values, variance))
    there = dict(zip(*swapped.pairs(state)[:2], strict=True))
    here = dict(zip(test, model, strict=True))
    assert (there[3], there[4]) == (here[4], here[3])
    values = values.copy()
    values[2] = np.random.default_rng(0).normal(size=values.shape[1])
    values[2] /= np.linalg.norm(values[2])
    odd = replace(data, shapes=ShapeData(values, variance))
    assert 2 not in odd.pairs(state)[0]


def test_noise_is_learned_or_stated(question: Question) -> None:
    """1 % of noise was added; what is stated is taken as it stands."""
    assert question.shapes is not None
    said = prepare(question, fitted=False).notes[0]
    assert 0.003 < float(said.split("shapes is ")[1].split()[0]) < 0.03
    size = np.sqrt((question.shapes**2).mean(axis=0))
    stated = prepare(replace(question, shape_sd=0.1 * size * np.ones_like(question.shapes)),
                     fitted=False)  # fmt: skip
    assert "stated as 0.1 " in stated.notes[0]
    data = stated.problem.data
    assert data.shapes is not None
    assert (data.shapes.variance.sum(axis=1) > 0.1**2).all()


def test_every_mode_has_its_own_noise() -> None:
    """Shapes of Gaussian noise: a mode of ten times the others' noise tells so, and they do not."""
    rng, n, share = np.random.default_rng(4), 12, np.array([0.02] * 5 + [0.2])
    square = (n - 1) / n * share**2 * rng.chisquare(n - 1, len(share)) / (n - 1)
    v = NOISES[:, None] ** 2 / n
    unlikely = (n - 1) * np.log(v) + square / v
    common, own = learned_noise(np.repeat(unlikely[:, None], 2, axis=1))
    assert 0.015 < common < 0.045
    np.testing.assert_array_less(np.abs(np.log(own / share)), np.log(1.7))
