"""The likelihood with a learned error of the model's form against the plain one, as ratios.

    python benchmarks/discrepancy.py [CASE ...]        # without a case the one that ships

Of each case the calibration without new physics is fitted twice from the same start: taken as right
but for its parameters, and with the error of its form learned beside them (its covariance is
decomposed, its size integrated out of the evidence). One evaluation of the residual and its slopes
is timed as well. Shortest processor time of three runs, one thread.
"""

import os

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import sys

from chladni import load_case
from chladni.inference.hypothesis_fit import fitted
from chladni.io.package_files import mesh_path
from chladni.reduced.reduced_model import evaluate
from chladni.search.preparation import prepare
from chladni.workflows.question_of_case import question_of
from timing import timed


def row(path):
    """One line of the table."""
    problem = prepare(question_of(load_case(path))).problem
    model, base, x = problem.reduced.model, problem.base, problem.mean()
    weighed = problem.mass_measurement
    state = evaluate(model, base, x)
    learned = problem.allowing_errors(state).data
    made = timed(lambda: problem.allowing_errors(state), 1)[0]
    values = [timed(lambda d=d: d.residual(state, True), 3)[0] for d in (problem.data, learned)]
    fits = [
        timed(lambda d=d: fitted(model, base, d, weighed, x), 3)[0] for d in (problem.data, learned)
    ]
    samples = 2 * int(learned.use.sum()) * learned.values.shape[2]
    return (
        f"| {len(model.K0)} | {samples} | {len(x)} | {1e3 * values[0]:.0f} | {1e3 * values[1]:.0f} "
        f"| {values[1] / values[0]:.2f} | {fits[0]:.2f} | {fits[1]:.2f} | {fits[1] / fits[0]:.2f} "
        f"| {made:.2f} |"
    )


if __name__ == "__main__":
    print(
        "| basis | samples | parameters | plain residual [ms] | learned [ms] | ratio "
        "| plain fit [s] | learned fit [s] | ratio | covariance made [s] |"
    )
    print("|" + "---|" * 10)
    for path in sys.argv[1:] or [mesh_path("demo/case.toml").parent]:
        print(row(path), flush=True)
