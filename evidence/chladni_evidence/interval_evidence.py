"""Coverage of intervals and uniformity of the test of fit: truths drawn from the priors.

If the likelihood is right, the posterior probability below the truth is uniform. So it is for every
combination of values, and so is p of the test of fit. Source: Talts et al. 2018, Validating
Bayesian inference algorithms with simulation-based calibration, arXiv:1804.06788.
Articles whose values scatter less than the priors cannot show that: their intervals hold the truth
too often.
"""

import json
from collections.abc import Callable, Iterable, Sequence
from dataclasses import astuple, dataclass
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from chladni.case import load_case
from chladni.effects.calibration_parameters import (
    PartScale,
    material_of,
    prior_sd,
    thickness_of,
    with_scaled,
)
from chladni.inference.adequacy import adequacy
from chladni.inference.hypothesis_fit import HypothesisFit
from chladni.io.tables.csv_table import csv_text
from chladni.model.assembly import Assembly
from chladni.output import make_folder, write_text
from chladni.search.diagnosis import without_effects
from chladni.search.preparation import prepare
from chladni.search.question import Question
from chladni.workflows.question_of_case import question_of

from .bench_of_structure import SPECIMENS, form_bench, panel_bench
from .made_case import MadeCase, made_case, write_case

Scales = dict[str, dict[str, float]]  # {part: {"E": factor, "t": factor}}
NOISES = ("formulation", "frequencies")  # the last: of a table without FRFs
LISTED, ERROR = 14, 5e-4  # natural frequencies of that table, and sd of their logarithms
STRUCTURES = ("plate", "panel", "bonded plates", "ribbed plate")
MAKERS = ("fine", "calculix")
ELASTIC = 5.0  # Hz: below lie the rigid modes
KNOWN = 0.5  # share of the prior sd below which the data know a combination


@dataclass(frozen=True)
class PosteriorOffset:
    """Posterior of ln of a value, or of a combination of values, against the truth."""

    name: str
    off: float  # (truth - estimate) / sd
    sd: float  # over that of the prior


@dataclass(frozen=True)
class CalibratedArticle:
    """Calibration of one article: p of its test of fit, and its intervals."""

    structure: str
    maker: str
    seed: int
    noise: str  # of the likelihood, as the case word
    p: float
    intervals: tuple[PosteriorOffset, ...]
    residual: float = float("nan")  # rms over the median of what right models leave


def of_prior(assembly: Assembly, rng: np.random.Generator) -> tuple[Assembly, Scales]:
    """An article with E and t of every sheet or tube and rho of its material from the priors.

    The factors by part come with it.
    """
    scales: Scales = {}
    rho: dict[int, float] = {}
    for k, part in enumerate(assembly.parts):
        if not (t := thickness_of(part)):
            continue
        sd = {q: prior_sd(assembly.parts, q, [k]) for q in ("E", "rho", t)}
        drawn = {q: float(np.exp(s * rng.normal())) for q, s in sd.items()}
        drawn["rho"] = rho.setdefault(getattr(material_of(part), "id", 0), drawn["rho"])
        scales[part.name] = drawn
        for quantity, factor in drawn.items():
            assembly = with_scaled(assembly, factor, quantity, [k])
    return assembly, scales


def intervals(null: HypothesisFit, scales: Scales) -> tuple[PosteriorOffset, ...]:
    """Every calibration parameter, and the combinations that the data know better than the prior.

    The combinations are the eigenvectors of the posterior covariance over prior sd.
    """
    fit, chosen, truth, names, prior = null.fit, [], [], [], []
    for effect in fit.effects:
        if isinstance(effect, PartScale):
            chosen.append(fit.slice(effect).start)
            of_parts = [np.log(scales.get(p, {}).get(effect.written, 1.0)) for p in effect.parts]
            truth.append(np.mean(of_parts))
            names.append(effect.written)
            prior.append(effect.parameters[0].sd)
    sd = np.array(prior)
    off = (np.array(truth) - fit.x[chosen]) / sd
    C = fit.covariance[np.ix_(chosen, chosen)] / np.outer(sd, sd)
    share, vectors = np.linalg.eigh(C)
    own = np.sqrt(np.diag(C))
    single = [PosteriorOffset(*row) for row in zip(names, off / own, own, strict=True)]
    return (
        *single,
        *(
            PosteriorOffset("combination", float(v @ off / np.sqrt(s)), float(np.sqrt(s)))
            for s, v in zip(share, vectors.T, strict=True)
            if np.sqrt(s) < KNOWN
        ),
    )


def answered(structure: str, maker: str, seed: int, cache: Path) -> list[CalibratedArticle]:
    """Make an article, calibrate the deck with its recording and test the fit, by each noise."""
    bench = (panel_bench if structure in SPECIMENS else form_bench)(structure, seed)
    made = made_case(bench, "nothing", seed, maker, cache, draw=of_prior)
    with TemporaryDirectory() as folder:
        case = Path(folder, "case")
        write_case(made, case, Path(folder, "truth.json"))
        question = question_of(load_case(case))
        _tabulate(case, made)
        every = [question, question_of(load_case(case))]
        return [_answer(q, made.truth, noise) for q, noise in zip(every, NOISES, strict=True)]


def _tabulate(case: Path, made: MadeCase) -> None:
    """Replace the recording of a case by a table of natural frequencies."""
    f = np.array([f for f in made.truth["frequency_hz"] if f > ELASTIC][:LISTED])
    f *= np.exp(ERROR * np.random.default_rng([made.truth["seed"], 3]).normal(size=len(f)))
    rows = [(k, f"{hz:.4f}") for k, hz in enumerate(f, 1)]
    write_text(case / "modes.csv", csv_text([("mode", "frequency_hz"), *rows]))
    head, rest = (case / "case.toml").read_text(encoding="utf-8").split("[test]")
    mass = [line for line in rest.splitlines() if line.startswith("mass")]
    words = [head + "[test]", 'recordings = ["modes.csv"]', *mass, ""]
    write_text(case / "case.toml", "\n".join(words))


def _answer(question: Question, truth: dict[str, Any], noise: str) -> CalibratedArticle:
    problem, null = without_effects(prepare(question).problem)
    fits = adequacy(null, problem.mass_measurement, problem.labels)
    p = float("nan") if fits is None else fits.p
    left = [] if fits is None else [s for s in fits.statistics if s.name == "misfit"]
    residual = float(np.sqrt(left[0].value / left[0].median)) if left else float("nan")
    names = truth["structure"], truth["mesh"], truth["seed"], noise
    return CalibratedArticle(*names, p, intervals(null, truth["scales"]), residual)


def interval_evidence(
    seeds: Iterable[int], out: Path, say: Callable[[str], object]
) -> list[CalibratedArticle]:
    """CalibratedArticle an article of every structure and maker for each seed, and say the table.

    ``intervals.jsonl`` in ``out`` gets a line as each ends. A further call continues it.
    """
    make_folder(out)
    kept = out / "intervals.jsonl"
    rows = [json.loads(t) for t in kept.read_text("utf-8").splitlines()] if kept.exists() else []
    answers = [
        CalibratedArticle(**r | {"intervals": [PosteriorOffset(*i) for i in r["intervals"]]})
        for r in rows
    ]
    done = {(a.structure, a.maker, a.seed) for a in answers}
    for seed, structure, maker in product(seeds, STRUCTURES, MAKERS):
        if (structure, maker, seed) in done:
            continue
        new = answered(structure, maker, seed, out / "cache")
        answers += new
        with kept.open("a", encoding="utf-8") as file:
            for a in new:
                rows_of = [astuple(i) for i in a.intervals]
                file.write(json.dumps(vars(a) | {"intervals": rows_of}) + "\n")
        say(f"{structure}, {maker}, seed {seed}: " + ", ".join(f"p {a.p:.3f}" for a in new))
    for line in table(answers):
        say(line)
    return answers


def table(answers: Sequence[CalibratedArticle]) -> list[str]:
    """Coverage of 90 % intervals, and Kolmogorov-Smirnov p of uniformity, by noise and value."""
    from scipy.stats import kstest, norm

    lines = [f"{'noise':11} {'value':12} number  inside 90 %  rms off  sd/prior  uniform p"]
    for noise in NOISES:
        mine = [a for a in answers if a.noise == noise]
        by_name: dict[str, list[PosteriorOffset]] = {}
        for i in (i for a in mine for i in a.intervals):
            by_name.setdefault(i.name, []).append(i)
        for name, found in by_name.items():
            off, sd = np.array([(i.off, i.sd) for i in found]).T
            inside, rms = np.mean(np.abs(off) < norm.ppf(0.95)), np.sqrt(np.mean(off**2))
            uniform = kstest(norm.cdf(off), "uniform").pvalue
            lines.append(
                f"{noise:11} {name:12} {len(off):6}  {inside:11.0%}  {rms:7.2f}"
                f"  {np.median(sd):8.2f}  {uniform:9.3f}"
            )
        p = np.array([a.p for a in mine if np.isfinite(a.p)])
        if len(p):
            lines.append(
                f"{noise:11} test of fit {len(p):7}  below 0.05: {np.mean(p < 0.05):.0%}, "
                f"median {np.median(p):.2f}, uniform p {kstest(p, 'uniform').pvalue:.3f}"
            )
        ln = np.log([a.residual for a in mine if np.isfinite(a.residual)])
        if len(ln):
            lines.append(
                f"{noise:11} residual {len(ln):10}  {np.exp(np.median(ln)):.2f} of the median of "
                f"right models, sd of ln {np.std(ln):.2f}"
            )
    return lines
