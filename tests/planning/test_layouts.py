"""Layouts of sensors: identities of the theory, limits, and exhaustive search on small cases."""

from itertools import combinations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from chladni.errors import LabelError, ShapeError
from chladni_planning import (
    Rules,
    best_layout,
    candidates,
    deletion,
    effective_independence,
    exchange,
    expected_posterior,
    greedy,
    independence,
    information_entropy,
    log_det_fisher,
    qr_ranking,
    sensitivity_rows,
    too_near,
    value,
)

phi = np.random.default_rng(7).normal(size=(9, 3))


def correlated(n, seed=3):
    A = np.random.default_rng(seed).normal(size=(n, n))
    return A @ A.T / n + 0.3 * np.eye(n)


def fisher_of(shapes, kept, noise):
    """ΦᵀΣ⁻¹Φ of a layout, by the inverse of the sensors' own covariance: no updates, no tricks."""
    kept = list(kept)
    return shapes[kept].T @ np.linalg.inv(noise[np.ix_(kept, kept)]) @ shapes[kept]


def best_of_all(shapes, m, score):
    return max(score(list(s)) for s in combinations(range(len(shapes)), m))


def plate_pairs(modes):
    pairs = [(a, b) for a in range(1, 7) for b in range(1, 7)]
    return sorted(pairs, key=lambda p: (p[0] ** 2 + p[1] ** 2, p))[:modes]


def simply_supported(n, modes):
    """The first bending modes of a simply supported square plate on an n by n grid."""
    x, y = (g.ravel() for g in np.meshgrid(*2 * [np.linspace(0, 1, n + 2)[1:-1]], indexing="ij"))
    return np.stack(
        [np.sin(a * np.pi * x) * np.sin(b * np.pi * y) for a, b in plate_pairs(modes)], 1
    )


@pytest.mark.parametrize("prior", [None, np.eye(3), np.diag([0.0, 1.0, 2.0])])
@pytest.mark.parametrize("noise", [np.ones(9), np.linspace(0.5, 2, 9), correlated(9)], ids=np.ndim)
def test_deletion_identity(noise, prior):
    """det of what is left = det of all times (1 - E_i); noise is variances or a covariance."""
    dense = noise if noise.ndim == 2 else np.diag(noise)
    F_0 = np.zeros((3, 3)) if prior is None else prior
    log_det = [
        np.linalg.slogdet(F_0 + fisher_of(phi, kept, dense))[1]
        for kept in (range(9), *(np.delete(np.arange(9), i) for i in range(9)))
    ]
    E = independence(phi, noise, prior)
    np.testing.assert_allclose(log_det[0] + np.log(1 - E), log_det[1:])


def test_deletion_identity_over_draws():
    """The mean of log det over the draws falls by log(1 - E), E from the geometric mean."""
    draws = np.random.default_rng(5).normal(size=(4, 9, 3))
    mean = lambda A: np.mean([log_det_fisher(d) for d in A])  # noqa: E731
    left = [mean(np.delete(draws, i, axis=1)) for i in range(9)]
    np.testing.assert_allclose(left, mean(draws) + np.log(1 - independence(draws)))


def test_block_candidates_are_their_rows():
    """A triaxial sensor is three rows that go together: det of what is left, directly."""
    rows = np.random.default_rng(1).normal(size=(7, 3, 4))
    all_rows = rows.reshape(-1, 4)
    E = independence(rows[None])
    for i in range(7):
        left = np.delete(rows, i, axis=0).reshape(-1, 4)
        assert np.isclose(log_det_fisher(left), log_det_fisher(all_rows) + np.log(1 - E[i]))


def test_independence_is_a_projection():
    """In [0, 1], with as many sensors' worth as modes: the trace of a projection is its rank."""
    E = independence(phi)
    assert np.all((E >= 0) & (E <= 1))
    assert np.isclose(E.sum(), 3)


def test_mode_scaling_does_not_matter():
    np.testing.assert_allclose(independence(phi), independence(phi * [1e3, 1, 1e-3]))


def test_downdates_follow_the_definition():
    """Rank-one updates over hundreds of deletions keep the set of the textbook algorithm."""
    shapes = np.random.default_rng(2).normal(size=(150, 8))
    kept = np.arange(150)
    while len(kept) > 10:
        kept = np.delete(kept, independence(shapes[kept]).argmin())
    np.testing.assert_array_equal(effective_independence(shapes, 10), kept)


def test_deletion_is_recorded():
    """Kept and deleted are all candidates; log det along the way is that of the rows left."""
    course = deletion(phi, 4)
    assert sorted([*course.ranked, *course.deleted]) == list(range(9))
    assert np.all(np.diff(course.log_det) <= 1e-12)
    for k in range(6):
        left = np.setdiff1d(np.arange(9), course.deleted[:k])
        assert np.isclose(course.log_det[k], log_det_fisher(phi[left]))


@pytest.mark.parametrize("prior", [None, np.eye(8)])
def test_a_long_course_stays_exact(prior):
    """Log det summed from hundreds of updates is that of the rows left."""
    shapes = np.random.default_rng(2).normal(size=(300, 8))
    course = deletion(shapes, 9, prior=prior)
    exact = log_det_fisher(shapes[course.ranked], prior=prior)
    assert course.log_det[-1] == pytest.approx(exact, abs=1e-9)


def test_ranking_goes_on_below_the_layout():
    """The last of the ranked is the one a smaller layout does without."""
    large, small = deletion(phi, 6), deletion(phi, 5)
    assert set(large.ranked) - set(small.ranked) == {large.ranked[-1]}
    np.testing.assert_array_equal(large.ranked[:5], small.ranked)


def test_fewer_sensors_than_modes_is_refused():
    with pytest.raises(ShapeError, match="2 sensors cannot distinguish 3 modes"):
        effective_independence(phi, 2)
    with pytest.raises(ShapeError, match="10 sensors cannot distinguish 3 modes among 9"):
        effective_independence(phi, 10)


def test_prior_makes_few_sensors_possible():
    assert len(effective_independence(phi, 2, prior=np.ones(3))) == 2


def test_twin_modes_are_refused():
    with pytest.raises(ShapeError, match="two modes are equal there"):
        effective_independence(phi[:, [0, 1, 1]], 5)


def test_unseen_mode_is_refused():
    with pytest.raises(ShapeError, match="one is invisible"):
        effective_independence(phi * [1, 1, 0], 5)


def test_mirrored_places_are_ties_decided_by_number():
    """Rounding does not decide: noise of 1e-13 on a symmetric plate changes nothing."""
    shapes = simply_supported(8, 6)
    rough = shapes + 1e-13 * np.random.default_rng(0).normal(size=shapes.shape)
    np.testing.assert_array_equal(
        effective_independence(shapes, 9), effective_independence(rough, 9)
    )


def test_exchange_meets_exhaustive_search():
    """80 random instances: within 1 % of the best determinant per mode in at least 95 %."""
    near = []
    for seed in range(80):
        rng = np.random.default_rng(seed)
        p, n = int(rng.integers(2, 5)), int(rng.integers(8, 12))
        m = int(rng.integers(p, 7))
        shapes = rng.normal(size=(n, p))
        best = best_of_all(shapes, m, lambda s, a=shapes: log_det_fisher(a[s]))
        found = log_det_fisher(shapes[best_layout(shapes, m)])
        assert found <= best + 1e-9
        near.append(best - found <= 0.01 * abs(best))
    assert np.mean(near) >= 0.95


@pytest.mark.parametrize("seed", range(6))
def test_better_methods_are_better(seed):
    """Many starts >= exchange >= EFI, and the layout of EFI beats the pivots of QR."""
    shapes = np.random.default_rng(seed).normal(size=(60, 6))
    efi = effective_independence(shapes, 8)
    single = exchange(shapes, efi)
    many = best_layout(shapes, 8, starts=10)
    scores = [log_det_fisher(shapes[k]) for k in (qr_ranking(shapes)[:8], efi, single, many)]
    assert scores == sorted(scores)


@pytest.mark.parametrize("criterion", ["D", "A", "E"])
def test_no_single_exchange_is_left(criterion):
    """The layout of exchange is a local optimum of its criterion, by brute force."""
    shapes = np.random.default_rng(5).normal(size=(14, 3))
    c = candidates(shapes)
    kept = exchange(shapes, [0, 1, 2, 3], criterion=criterion)
    best = value(criterion, c.fisher(kept))
    for i in kept:
        for j in np.setdiff1d(np.arange(14), kept):
            other = np.r_[np.setdiff1d(kept, i), j]
            assert value(criterion, c.fisher(other)) <= best + 1e-8


@pytest.mark.parametrize("starts", [0, 20])
def test_correlated_noise_against_an_independent_implementation(starts):
    """Exchange under full covariance: a local optimum of log det ΦᵀΣ⁻¹Φ, inverse by inverse."""
    shapes, noise = np.random.default_rng(8).normal(size=(12, 3)), correlated(12)

    def score(kept):
        return np.linalg.slogdet(fisher_of(shapes, kept, noise))[1]

    kept = best_layout(shapes, 5, noise=noise, starts=starts)
    for i in kept:
        for j in np.setdiff1d(np.arange(12), kept):
            assert score(np.r_[np.setdiff1d(kept, i), j]) <= score(kept) + 1e-8
    if starts:
        assert np.isclose(score(kept), best_of_all(shapes, 5, score), atol=0.05)


def test_correlated_deletion_against_an_independent_implementation():
    shapes, noise = np.random.default_rng(9).normal(size=(12, 3)), correlated(12)
    kept = list(range(12))
    while len(kept) > 5:
        kept.remove(
            max(
                kept,
                key=lambda i: np.linalg.slogdet(
                    fisher_of(shapes, [k for k in kept if k != i], noise)
                )[1],
            )
        )
    np.testing.assert_array_equal(effective_independence(shapes, 5, noise=noise), kept)


def test_a_noisy_place_is_avoided():
    noisy = np.ones(9)
    noisy[effective_independence(phi, 3)] = 1e6
    assert not set(effective_independence(phi, 3)) & set(
        effective_independence(phi, 3, noise=noisy)
    )


def test_fully_correlated_twins_are_refused():
    with pytest.raises(ShapeError, match="not positive definite"):
        effective_independence(phi, 4, noise=np.ones((9, 9)))


def test_ensemble_of_one_is_the_model():
    np.testing.assert_array_equal(best_layout(np.stack([phi] * 3), 5), best_layout(phi, 5))


def test_robust_layout_serves_all_draws():
    """Over draws the mean log det of the robust layout is not beaten by any draw's own layout."""
    rng = np.random.default_rng(12)
    draws = rng.normal(size=(1, 30, 4)) + 0.7 * rng.normal(size=(5, 30, 4))
    mean = lambda k: np.mean([log_det_fisher(d[k]) for d in draws])  # noqa: E731
    robust = mean(best_layout(draws, 6, starts=20))
    assert all(mean(best_layout(d, 6)) <= robust + 1e-9 for d in draws)
    small = draws[:, :9]
    best = best_of_all(small[0], 5, lambda s: np.mean([log_det_fisher(d[s]) for d in small]))
    found = np.mean([log_det_fisher(d[best_layout(small, 5, starts=20)]) for d in small])
    assert np.isclose(found, best)


def test_layout_for_parameters():
    """Blocks of FRF sensitivities: the information of a layout is Σ Re JᴴJ, and D-optimal."""
    rng = np.random.default_rng(3)
    J = rng.normal(size=(20, 8, 3)) + 1j * rng.normal(size=(20, 8, 3))
    c = candidates(sensitivity_rows(J, 0.1))
    kept = np.array([1, 4])
    direct = sum(np.real(J[:, i].conj().T @ J[:, i]) for i in kept) / 0.01
    np.testing.assert_allclose(c.fisher(kept)[0], direct)
    best = best_of_all(J[0], 2, lambda s: value("D", c.fisher(np.array(s))))
    assert np.isclose(value("D", c.fisher(best_layout(c, 2))), best)
    np.testing.assert_allclose(expected_posterior(c, kept), np.sqrt(np.diag(np.linalg.inv(direct))))


def test_greedy_starts_as_pivoted_qr():
    """The first p of forward selection are the pivots of QR of the modes at equal energy."""
    shapes = np.random.default_rng(10).normal(size=(40, 5)) * [1, 10, 0.1, 1, 1]
    equal = shapes / np.linalg.norm(shapes, axis=0)
    np.testing.assert_array_equal(greedy(shapes, 9)[:5], qr_ranking(equal)[:5])
    np.testing.assert_array_equal(greedy(shapes, 9), greedy(equal, 9))


def test_entropy_is_that_of_the_normal():
    F = np.diag([4.0, 0.25])
    assert np.isclose(
        information_entropy(F), np.log(2 * np.pi * np.e) - np.log(np.linalg.det(F)) / 2
    )


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 10_000), st.integers(3, 7), st.booleans())
def test_rules_are_obeyed(seed, m, by_region):
    """Fixed, forbidden, distance, regions: in every layout of every method."""
    rng = np.random.default_rng(seed)
    points, shapes = rng.uniform(size=(25, 2)), rng.normal(size=(25, 3))
    region = (points[:, 0] > 0.5).astype(int) if by_region else None
    limits = {"most": {0: 4}, "least": {1: 1}} if by_region else {}
    rules = Rules([3], [5, 6], too_near(points, 0.12), region, **limits)
    try:
        layouts = [
            effective_independence(shapes, m, rules=rules),
            greedy(shapes, m, rules=rules),
            best_layout(shapes, m, rules=rules, starts=20),
        ]
    except ShapeError:  # these rules leave no room: refused, which other tests look at
        return
    for kept in layouts:
        assert 3 in kept
        assert not {5, 6} & set(kept)
        assert len(np.unique(kept)) == m
        apart = np.linalg.norm(points[kept][:, None] - points[kept], axis=-1)
        assert apart[np.triu_indices(m, 1)].min() >= 0.12
        if by_region:
            assert (region[kept] == 0).sum() <= 4
            assert (region[kept] == 1).sum() >= 1


def test_rules_meet_exhaustive_search():
    """With distances and regions, exchange finds the best allowed layout of a small case."""
    hits = 0
    for seed in range(20):
        rng = np.random.default_rng(seed)
        points, shapes = rng.uniform(size=(11, 2)), rng.normal(size=(11, 2))
        near = too_near(points, 0.15)
        region = np.arange(11) % 2
        rules = Rules([2], [7], near, region, {0: 3}, {1: 1})
        allowed = [
            s
            for s in map(list, combinations(range(11), 4))
            if 2 in s
            and 7 not in s
            and not near[np.ix_(s, s)].any()
            and (region[s] == 0).sum() <= 3
            and (region[s] == 1).sum() >= 1
        ]
        best = max(log_det_fisher(shapes[s]) for s in allowed)
        hits += np.isclose(
            log_det_fisher(shapes[best_layout(shapes, 4, rules=rules, starts=20)]), best
        )
    assert hits >= 18


@pytest.mark.parametrize("seed", range(10))
def test_deletion_respects_tight_regions(seed):
    """One half may hold a single sensor, the other must hold five: deletion alone obeys."""
    shapes = np.random.default_rng(seed).normal(size=(20, 3)) * np.linspace(4, 1, 20)[:, None]
    region = (np.arange(20) >= 10).astype(int)
    rules = Rules(region=region, most={0: 1})
    kept = effective_independence(shapes, 6, rules=rules)
    assert (region[kept] == 0).sum() <= 1
    kept = effective_independence(shapes, 6, rules=Rules(region=region, least={1: 5}))
    assert (region[kept] == 1).sum() >= 5


@pytest.mark.parametrize(
    ("rules", "error", "words"),
    [
        (Rules([3], [3]), LabelError, "fixed"),
        (Rules([99]), LabelError, "numbered 0 to 8"),
        (Rules([0, 1, 2, 3, 4, 5]), ShapeError, "6 are fixed"),
        (Rules(forbidden=np.arange(6)), ShapeError, "3 of the 9 candidates are allowed"),
        (
            Rules(near=~np.eye(9, dtype=bool)),
            ShapeError,
            "do not fit at the requested minimum distance",
        ),
        (Rules([0, 1], near=~np.eye(9, dtype=bool)), ShapeError, "0 and 1 are too near"),
        (Rules(region=np.arange(9) // 5, most={0: 0, 1: 2}), ShapeError, "room for 2"),
        (Rules(region=np.arange(9) // 5, least={4: 1}), LabelError, "no candidate is in region 4"),
        (Rules(region=np.arange(9) // 5, least={0: 3, 1: 3}), ShapeError, "require 6 sensors"),
    ],
)
def test_impossible_requests_say_why(rules, error, words):
    with pytest.raises(error, match=words):
        effective_independence(phi, 5, rules=rules)


def test_exchange_refuses_a_layout_outside_the_rules():
    with pytest.raises(ShapeError, match="fixed and forbidden"):
        exchange(phi, [0, 1, 2, 3], rules=Rules([8]))
