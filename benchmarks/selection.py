"""Agents against the built-in search on the effects of the catalogue.

    python benchmarks/selection.py [CASE ...]          # without a case the one that ships

Agents play ParameterSelection-v0 with ``effects=True``: they see the case linearised, free what
they like and stop; the set they end with is fitted once. The search of a diagnosis fits its
candidates one by one, follows the best, asks again what is left, drops what does not pay. Beside
each: the effects, the gain of the set in -2 ln evidence less what each effect has to bring (below 0
nothing is named), and processor seconds of one thread, those of the scan apart where agents play.
"""

import os

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import sys
from itertools import combinations

import numpy as np

from chladni.io.package_files import mesh_path
from chladni.search.diagnosis import diagnose
from chladni_envs import agents
from chladni_envs.parameter_selection import ParameterSelectionEnv
from timing import timed

EPISODES = 30  # of the random agent, the best of which counts


def by_score(env: ParameterSelectionEnv) -> np.ndarray:
    """Add what raises the score most, while anything does."""
    kept, best = np.zeros(env.p, bool), 0.0
    while True:
        more = {k: env.score_of(_with(kept, k)) for k in np.flatnonzero(~kept)}
        k = max(more, key=lambda k: more[k])
        if more[k] <= best:
            return kept
        kept, best = _with(kept, k), more[k]


def of_all_pairs(env: ParameterSelectionEnv) -> np.ndarray:
    """The best of all sets of one and two beside the ordinary parameters."""
    base = np.arange(env.p) < env.own
    every = [(k,) for k in range(env.own, env.p)] + list(combinations(range(env.own, env.p), 2))
    return _with(base, max(every, key=lambda chosen: env.score_of(_with(base, chosen))))


def played(env: ParameterSelectionEnv, agent: agents.Agent) -> np.ndarray:
    """What an agent ends with."""
    return agents.play(env, agent)["kept"]


def at_random(env: ParameterSelectionEnv) -> np.ndarray:
    """The best of several random episodes, each stopped by chance."""
    ends = [agents.play(env, agents.at_random(k)) for k in range(EPISODES)]
    return max(ends, key=lambda end: end["score"])["kept"]


def _with(kept: np.ndarray, more: object) -> np.ndarray:
    out = kept.copy()
    out[np.asarray(more)] = True
    return out


def rows(path: str) -> list[str]:
    """The lines of one case."""
    env = ParameterSelectionEnv(case=path, effects=True)
    env.reset()
    ways = {
        f"random, best of {EPISODES}": at_random,
        "largest share of the misfit": lambda env: played(env, agents.held_back()),
        "largest cross-validated score": lambda env: played(env, agents.cross_validated(env)),
        "largest gain of score": by_score,
        "all pairs": of_all_pairs,
    }
    out = []
    for name, way in ways.items():
        seconds, kept = timed(lambda way=way: way(env), 1)
        fitting, gain = timed(lambda kept=kept: env.gain(kept), 1)
        effects = [env.names[k] for k in np.flatnonzero(kept) if k >= env.own]
        said = ", ".join(effects) if len(effects) < 4 else f"{len(effects)} effects"
        out.append(f"| {name} | {said or 'none'} | {gain:.0f} | {seconds + fitting:.1f} |")
    seconds, found = timed(lambda: diagnose(env.catalogue.problem), 1)
    best = found.sets[-1].hypothesis if found.sets else found.hypotheses[0]
    gain = env.catalogue.beyond_price(best)
    names = ", ".join(f"{e.name} {e.location(best.fit.of(e)).text}" for e in best.effects)
    return [
        *out,
        f"| the search of a diagnosis, its scan included | {names} | {gain:.0f} | {seconds:.1f} |",
    ]


def main() -> None:
    """Print the table of every case."""
    shipped = str(mesh_path("demo/case.toml").parent)
    for path in sys.argv[1:] or [shipped]:
        print(f"\n{path}\n\n| agent | effects | gain | CPU [s] |\n|---|---|---|---|")
        print("\n".join(rows(path)), flush=True)


if __name__ == "__main__":
    main()
