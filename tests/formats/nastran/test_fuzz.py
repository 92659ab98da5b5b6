"""Damaged decks: a sentence or a successful read, never another exception, never a hang."""

import random
import shutil
import signal
from contextlib import contextmanager

import pytest

from chladni.errors import ChladniError
from chladni.io.nastran import Add, analysis, assembly, write_deck
from chladni.units import UNITS
from chladni_evidence.mutations import injured_text

from .conftest import ANCHORS, needs_decks, read_real

HANGS = 60.0  # of the processor's own time [s]; a deck of this size takes a thousandth of it


def answer(path, data, folder):
    """Read, convert, analyse and write a damaged deck; the sentence where it is refused."""
    for include in path.parent.iterdir():
        if include.suffix in (".blk", ".bdf", ".dat"):
            shutil.copyfile(include, folder / include.name)
    (folder / path.name).write_bytes(data)
    try:
        deck = read_real(folder / path.name)
        write_deck(deck, folder / "out" / "new.bdf", [Add([("CONM2", 1, 1)])])
        assembly(deck, UNITS["mm-t-s"])
        analysis(deck, UNITS["mm-t-s"])
    except ChladniError as error:
        return str(error)
    return ""


@contextmanager
def watched():
    """An error in what hangs, in time that busy neighbours do not count towards."""

    def hangs(signum, frame):
        raise TimeoutError(f"hangs for {HANGS:g} s")

    before = signal.signal(signal.SIGVTALRM, hangs)
    signal.setitimer(signal.ITIMER_VIRTUAL, HANGS)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
        signal.signal(signal.SIGVTALRM, before)


@needs_decks
@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize(
    ("count", "seed"),
    [(120, 20), *(pytest.param(200, 1000 + k, marks=pytest.mark.slow) for k in range(9))],
)
def test_damaged_decks(tmp_path, count, seed):
    """The injuries are neither harmless nor always deadly."""
    rng = random.Random(seed)
    kinds = ("*.bdf", "*.dat", "*.nas", "*.inp")
    every = sorted(p for kind in kinds for p in ANCHORS.glob(f"*/{kind}"))
    files, refused = [p for p in every if p.stat().st_size < 60_000], 0
    for k in range(count):
        path = rng.choice(files)
        data = injured_text(path.read_bytes(), rng)
        try:
            with watched():
                sentence = answer(path, data, tmp_path)
        except Exception as error:
            raise AssertionError(f"seed {seed}, deck {k} ({path.name}): {error!r}") from error
        assert "\n" not in sentence
        refused += bool(sentence)
    assert 0.1 * count < refused < count
