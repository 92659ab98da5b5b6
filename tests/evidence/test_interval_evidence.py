"""Coverage and uniformity of answers to articles that are drawn from the priors."""

import re
from types import SimpleNamespace

import numpy as np
import pytest

from chladni.effects.calibration_parameters import calibration_parameter, prior_sd
from chladni.effects.element_groups import element_groups
from chladni.fem.assemble import structure
from chladni_evidence.interval_evidence import (
    CalibratedArticle,
    PosteriorOffset,
    intervals,
    of_prior,
    table,
)
from chladni_specimens import folded_panel


def test_articles_scatter_as_the_priors_say():
    panel = folded_panel(h=0.05)
    drawn = [of_prior(panel, np.random.default_rng(k))[1] for k in range(400)]
    for quantity in ("E", "rho", "t"):
        logs = np.log([scales["panel"][quantity] for scales in drawn])
        assert np.std(logs) == pytest.approx(prior_sd(panel.parts, quantity, [0]), rel=0.15)
    assert all(s["panel"]["rho"] == s["flanges"]["rho"] for s in drawn)  # one material
    assert any(s["panel"]["E"] != s["flanges"]["E"] for s in drawn)


def test_an_article_has_the_values_that_its_factors_say():
    panel = folded_panel(h=0.05)
    article, scales = of_prior(panel, np.random.default_rng(1))
    was, made = (a.parts[0].section.membrane for a in (panel, article))
    assert made.E / was.E == pytest.approx(scales["panel"]["E"])
    assert made.rho / was.rho == pytest.approx(scales["panel"]["rho"])
    ratio = article.shells.thickness / panel.shells.thickness
    assert ratio[panel.shells.part == 0] == pytest.approx(scales["panel"]["t"])


def test_a_posterior_draws_its_own_truth_within_unit_variance():
    """Values and combinations of draws from the posterior are off by one sd in the mean square."""
    model = structure(folded_panel(h=0.05))
    groups = element_groups(model)
    effects = tuple(calibration_parameter(groups, q, [0]) for q in ("E", "rho", "t"))
    sd = np.array([e.parameters[0].sd for e in effects])
    known = np.diag(sd) @ np.array([[1, 0.9, 0.1], [0.9, 0.9, 0], [0.1, 0, 0.8]]) @ np.diag(sd)
    rng, off = np.random.default_rng(2), {"E": [], "combination": []}
    for _ in range(500):
        x = rng.multivariate_normal(np.zeros(3), known)
        scales = {"panel": {e.written: float(np.exp(v)) for e, v in zip(effects, x, strict=True)}}
        fit = SimpleNamespace(
            effects=effects,
            x=np.zeros(3),
            covariance=known,
            slice=lambda e: slice(effects.index(e), 0),
        )
        for row in intervals(SimpleNamespace(fit=fit), scales):
            off.setdefault(row.name, []).append(row.off)
            assert row.name != "combination" or row.sd < 0.5
    for name in ("E", "rho", "t", "combination"):
        assert np.mean(np.square(off[name])) == pytest.approx(1, rel=0.2)


def answers(width):
    """Answers whose intervals are ``width`` times as wide as the errors call for."""
    rng = np.random.default_rng(3)
    return [
        CalibratedArticle(
            "plate", "fine", k, "formulation", float(p), (PosteriorOffset("E", off / width, 0.5),)
        )
        for k, (off, p) in enumerate(zip(rng.normal(size=400), rng.uniform(size=400), strict=True))
    ]


@pytest.mark.parametrize("width", [1.0, 3.0])
def test_wide_intervals_are_not_uniform(width):
    values, fits = table(answers(width))[1:]
    inside, uniform = values.split()[3], float(values.split()[-1])
    assert (int(inside.strip("%")) > 98) == (width > 1)
    assert (uniform < 1e-6) == (width > 1)
    assert float(fits.split()[-1]) > 0.01


def test_residuals_of_articles_are_compared_with_those_of_right_models():
    """Twice as large as in the draws, with a scatter of 0.3 between articles."""
    size = 2 * np.exp(0.3 * np.random.default_rng(4).normal(size=2000))
    every = [CalibratedArticle("plate", "fine", 1, "formulation", 0.5, (), float(r)) for r in size]
    (said,) = (line for line in table(every) if "residual" in line)
    assert re.search(r" (1.9|2.0)\d of", said)
    assert re.search(r"sd of ln 0.(29|3)", said)
