"""``chladni blind``: cases with an effect hidden are made, answered blindly, and scored."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Annotated, TypeVar, cast

import typer

from chladni.cli.console import say
from chladni.cli.run import folder_named
from chladni.errors import LabelError, did_you_mean

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="Folder written by `blind make`.")]
Word = TypeVar("Word", bound=str)
Workers = Annotated[int, typer.Option(help="Processes.", min=1)]


def make(
    set_name: Annotated[
        str,
        typer.Option(
            "--set", help="Kinds of cases: panels, forms, tailgate, outside (of the catalogue)."
        ),
    ],
    seeds: Annotated[str, typer.Option(help="First and last seed, for example 500-504.")],
    out: Annotated[
        Path,
        typer.Option(
            "--out", help="New folder for the results.", metavar="DIR", parser=folder_named
        ),
    ],
    purpose: Annotated[
        str, typer.Option(help="Purpose: tune (seeds below 600) or report (from 600).")
    ] = "tune",
    kinds: Annotated[
        str, typer.Option(help="Hidden effects, separated by commas; default: all.")
    ] = "",
    structures: Annotated[str, typer.Option(help="Names separated by commas; default: all.")] = "",
    recorder: Annotated[
        str,
        typer.Option(
            help="Noise: independent on every line, or from the virtual bench: stepped-sine, "
            "burst-random."
        ),
    ] = "independent noise",
    sizes: Annotated[
        str,
        typer.Option(
            help="Change by the effect, times scatter and mesh, as 0.5,1,2; default: one size."
        ),
    ] = "",
    workers: Workers = 1,
) -> None:
    """Make cases, seal their truths, publish the hashes.

    The hashes of every truth and of the files of every case are in seals.json before any answer.
    The same command continues a stopped run.
    """
    from .benched_recording import RECORDERS
    from .blind_make import make
    from .evidence_sets import PURPOSES, chosen, of_sizes, seed_range

    by, why = _one_of("--recorder", recorder, RECORDERS), _one_of("--purpose", purpose, PURPOSES)
    orders = chosen(set_name, seed_range(seeds), _names(kinds), _names(structures))
    orders = of_sizes(orders, _sizes(sizes))
    with _kept():
        make([replace(o, recorder=by) for o in orders], out, why, set_name, workers, say)


def run(
    out: Folder,
    workers: Workers = 1,
    limit: Annotated[float, typer.Option(help="Time limit of one diagnosis [s].", min=1)] = 3600.0,
    calibrate: Annotated[
        bool,
        typer.Option(help="Calibrate every case too, for comparison with the diagnosis."),
    ] = True,
) -> None:
    """Answer cases from their folders alone.

    Stopped at any instant, it goes on with the same command.
    """
    from .blind_run import run

    with _kept():
        run(out, workers, say, limit, calibrate)


def score(
    outs: Annotated[list[Path], typer.Argument(metavar="DIR...", help="One or more folders.")],
) -> None:
    """Open the truths and score the answers.

    Only once every case is answered: confusion, places, intervals, gain, false alarms.
    Writes score.json and table.txt into the first folder.
    """
    from .blind_score import score

    score(outs, say)


def power(
    outs: Annotated[list[Path], typer.Argument(metavar="DIR...", help="One or more folders.")],
) -> None:
    """Share of effects named over their size, and false alarms.

    Each folder has two curves, named and listed. Cases are made with
    `blind make --sizes`. Opens the truths, as score does; writes power.json,
    power.txt and power.png into the first folder.
    """
    from .blind_power import power

    power(outs, say)


HELP = "Conceal effects in structures, diagnose them blindly, score the answers."
STEPS = (make, run, score, power)


@contextmanager
def _kept() -> Iterator[None]:
    """An interruption that says what becomes of what was done."""
    try:
        yield
    except KeyboardInterrupt:
        raise KeyboardInterrupt(
            "interrupted; finished cases are kept, and the same command continues from there"
        ) from None


def _one_of(option: str, word: str, known: tuple[Word, ...]) -> Word:
    """A word of those there are."""
    if word not in known:
        raise LabelError(
            f"no {option} {word!r}; {did_you_mean(word, known)}there are {', '.join(known)}"
        )
    return known[known.index(cast(Word, word))]


def _sizes(text: str) -> list[float]:
    """Sizes above zero."""
    try:
        found = [float(name) for name in _names(text)]
    except ValueError:
        found = [0.0]
    if not all(0 < size < 100 for size in found):
        raise LabelError(f"--sizes {text!r} is no list of numbers from 0 to 100; write 0.5,1,2")
    return found


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]
