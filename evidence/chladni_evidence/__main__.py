"""``python -m chladni_evidence``: make, diagnose and score cases with concealed effects."""

import argparse
import math
import sys
from dataclasses import replace
from pathlib import Path

from chladni.errors import ChladniError, LabelError
from chladni.progress import terminal

from .benched_recording import PLAIN, RECORDERS
from .blind_make import make
from .blind_run import run
from .blind_score import score
from .evidence_sets import MEANT, SETS, chosen, purpose, seed_range
from .fuzz import DUE, fuzz, until
from .fuzz_inputs import KINDS, fuzz_inputs
from .identification_evidence import KINDS as NOISES
from .identification_evidence import table
from .interval_evidence import interval_evidence
from .next_evidence import next_evidence
from .recovery import recovery
from .screening_evidence import TIMES
from .screening_faults import FAULTS, tally
from .thesis import SIZE, regenerate


def main(words: list[str] | None = None) -> int:
    """Entry point; 0 (done), 1 (an injured input ended wrongly), 2 (bad input: one sentence)."""
    options = _parser().parse_args(words)
    try:
        return COMMANDS[options.command](options)
    except ChladniError as error:
        sys.stderr.write(f"chladni_evidence: {error}\n")
        return 2


def _run(options: argparse.Namespace) -> int:
    """Make, diagnose and score cases: the three steps of ``chladni blind``."""
    seeds = seed_range(options.seeds)
    kinds, structures = (t.split(",") if t else [] for t in (options.kinds, options.structures))
    orders = [
        replace(o, recorder=options.recorder) for o in chosen(options.set, seeds, kinds, structures)
    ]
    make(orders, options.out, purpose(seeds), options.set, options.workers, _say)
    run(options.out, options.workers, _say, options.limit)
    score([options.out], _say)
    return 0


def _screened(options: argparse.Namespace) -> int:
    """Print the table of the screening: outcomes by fault."""
    kinds = [k for k in FAULTS if not options.faults or k in options.faults.split(",")]
    for name, count in tally(_seeds(options), kinds, _say, options.long).items():
        _say(f"{name:24} " + ", ".join(f"{said} {n}" for said, n in sorted(count.items())))
    return 0


def _fuzzed(options: argparse.Namespace) -> int:
    """Run injured inputs; return 1 where any ended wrongly."""
    kinds = options.kinds.split(",") if options.kinds else KINDS
    if unknown := [k for k in kinds if k not in KINDS]:
        raise LabelError(f"no kind {unknown[0]}; there are {', '.join(KINDS)}")
    inputs = fuzz_inputs(options.inputs, options.seed, kinds, options.decks)
    found = fuzz(until(inputs, options.minutes), options.out, _say)
    return int(any(name not in DUE for count in found.values() for name in count))


def _identified(options: argparse.Namespace) -> int:
    """Print errors, coverage and invented poles of identification, by kind of noise."""
    table(_seeds(options), options.noise.split(";") if options.noise else list(NOISES), _say)
    return 0


def _thesis(options: argparse.Namespace) -> int:
    """Tell the whole thesis: plan, test, corrections, calibration."""
    with terminal() as progress:
        effects = tuple(options.effects.split(",")) if options.effects else ()
        regenerate(options.out, options.seed, _say, progress, 1e-3 * options.size, effects)
    return 0


def _recovered(asked: argparse.Namespace) -> int:
    """Calibrate articles of known values; print the coverage of the intervals."""
    asked.out.mkdir(parents=True, exist_ok=True)
    recovery(_seeds(asked), asked.out, _say)
    return 0


def _covered(options: argparse.Namespace) -> int:
    """Calibrate articles drawn from the priors; print coverage and uniformity."""
    interval_evidence(_seeds(options), options.out, _say)
    return 0


def _advised(options: argparse.Namespace) -> int:
    """Follow tied articles through further measurements; print the shares that were settled."""
    next_evidence(_seeds(options), _say)
    return 0


COMMANDS = {
    "run": _run, "screen": _screened, "fuzz": _fuzzed, "identify": _identified, "thesis": _thesis,
    "recovery": _recovered, "intervals": _covered, "next": _advised,
}  # fmt: skip


def _seeds(options: argparse.Namespace) -> range:
    """The seeds; their purpose is printed on the terminal."""
    seeds = seed_range(options.seeds)
    _say(MEANT[purpose(seeds)])
    return seeds


def _parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog="chladni_evidence", description=__doc__)
    commands = top.add_subparsers(required=True, dest="command")
    screen = commands.add_parser("screen", help="rates of named faults and of false alarms")
    screen.add_argument("--seeds", required=True, help="first and last, as 600-649")
    screen.add_argument("--faults", default="", help="only these, with commas")
    screen.add_argument("--long", action="store_true", help=f"{TIMES} times as many lines")
    fuzzed = commands.add_parser(
        "fuzz", help="damaged inputs: each must give a sentence or a result"
    )
    fuzzed.add_argument("--inputs", type=int, default=10_000)
    fuzzed.add_argument("--minutes", type=float, default=math.inf, help="time limit")
    fuzzed.add_argument("--seed", type=int, default=1)
    fuzzed.add_argument("--kinds", default="", help="only these, with commas")
    fuzzed.add_argument("--decks", type=Path, help="a folder of further decks to damage")
    fuzzed.add_argument("--out", type=Path, required=True)
    found = commands.add_parser(
        "identify", help="poles, damping and intervals compared with known ones"
    )
    found.add_argument("--seeds", required=True, help="first and last, as 600-649")
    found.add_argument(
        "--noise", default="", help=f"only these, with semicolons: {'; '.join(NOISES)}"
    )
    tested = commands.add_parser("thesis", help="retell the thesis: its tables next to ours")
    tested.add_argument("--seed", type=int, default=1)
    tested.add_argument("--size", type=float, default=1e3 * SIZE, help="element size [mm]")
    tested.add_argument("--effects", default="", help="search only these at the end, with commas")
    tested.add_argument("--out", type=Path, required=True)
    known = commands.add_parser("recovery", help="calibrate to known values: coverage of intervals")
    known.add_argument("--seeds", required=True, help="first and last, as 600-619")
    known.add_argument("--out", type=Path, required=True)
    covered = commands.add_parser(
        "intervals", help="coverage of intervals and of the test of fit, truths from the priors"
    )
    covered.add_argument("--seeds", required=True, help="first and last, as 600-607")
    covered.add_argument("--out", type=Path, required=True)
    ahead = commands.add_parser("next", help="further measurements of tied articles, by agent")
    ahead.add_argument("--seeds", required=True, help="first and last, as 600-603")
    command = commands.add_parser("run", help="make, diagnose, score")
    command.add_argument("--set", choices=SETS, required=True)
    command.add_argument("--seeds", required=True, help="first and last, as 600-604")
    command.add_argument("--workers", type=int, default=1)
    command.add_argument("--kinds", default="", help="only these, with commas")
    command.add_argument("--structures", default="", help="only these, with commas")
    command.add_argument("--limit", type=float, default=3600.0, help="seconds a diagnosis may take")
    command.add_argument(
        "--recorder", choices=RECORDERS, default=PLAIN,
        help="source of recordings: noise on every line, or a test on the virtual bench",
    )  # fmt: skip
    command.add_argument("--out", type=Path, required=True)
    return top


def _say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
