"""Damaged decks: a sentence or a successful read, never another exception, never a hang."""

import random
import signal
from contextlib import contextmanager

import pytest

from chladni.errors import ChladniError
from chladni.io.nastran import Add, analysis, assembly, read_deck, write_deck
from chladni.units import UNITS

from .conftest import ANCHORS, real_files

WORDS = (
    b"0 -1 1.5-3 NAN 99999999 THRU 1.+308 ABC 123456 -5. 1e400 0. * = , ' =3 *1 == "
    b"7777777777777777 \xfc "
).split(b" ")  # the last one is blank


def damaged(data, rng):
    """One to four random injuries to a deck's bytes."""
    lines = data.splitlines(keepends=True)
    for _ in range(rng.randint(1, 4)):
        kind, k = rng.randrange(8), rng.randrange(len(lines))
        line = lines[k]
        if kind == 0 and len(lines) > 2:
            del lines[k : k + rng.choice([1, 1, 2, 9])]
        elif kind == 1:
            lines.insert(rng.randrange(len(lines)), line)
        elif kind == 2 and line:
            at = rng.randrange(len(line))
            lines[k] = line[:at] + bytes([rng.randrange(256)]) + line[at + 1 :]
        elif kind == 3:  # another field's text
            at = 8 * rng.randrange(10)
            lines[k] = line[:at] + rng.choice(WORDS).rjust(8) + line[at + 8 :]
        elif kind == 4:  # two fields change places
            a, b = 8 * rng.randrange(1, 9), 8 * rng.randrange(1, 9)
            fields = [line[i : i + 8] for i in range(0, 80, 8)]
            fields[a // 8], fields[b // 8] = fields[b // 8], fields[a // 8]
            lines[k] = b"".join(fields).rstrip() + b"\n"
        elif kind == 5:
            lines = lines[: max(k, 1)]
        elif kind == 6:
            lines[k] = line[: rng.randrange(len(line) + 1)] + b"\n"
        else:
            tokens = line.split(b",")
            tokens[rng.randrange(len(tokens))] = rng.choice(WORDS)
            lines[k] = b",".join(tokens)
        lines = lines or [b"\n"]
    return b"".join(lines)


def survives(path, data, folder):
    """Read, convert, analyse and write a damaged deck; the sentence where it is refused."""
    victim = folder / path.name
    victim.write_bytes(data)
    for include in path.parent.iterdir():
        if include.suffix in (".blk", ".bdf", ".dat") and include.name != path.name:
            (folder / include.name).write_bytes(include.read_bytes())
    try:
        deck = read_deck(victim, allow=("GENEL", "CTRPLT1"))
        write_deck(deck, folder / "out" / "new.bdf", [Add([("CONM2", 1, 1)])])
        assembly(deck, UNITS["mm-t-s"])
        analysis(deck, UNITS["mm-t-s"])
    except ChladniError as error:
        return str(error)
    return ""


HANGS = 60.0  # of the processor's own time [s]; a deck of this size takes a thousandth of it


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


def run(count, seed, folder):
    """How many of so many damaged decks are refused; one that hangs is stopped and named."""
    rng = random.Random(seed)
    files = [p for p in real_files() if p.stat().st_size < 60_000]
    refused = 0
    for k in range(count):
        path = rng.choice(files)
        data = damaged(path.read_bytes(), rng)
        try:
            with watched():
                sentence = survives(path, data, folder)
        except Exception as error:
            (folder / f"broke_{k}.bdf").write_bytes(data)
            raise AssertionError(f"seed {seed}, deck {k} ({path.name}): {error!r}") from error
        assert "\n" not in sentence
        refused += bool(sentence)
    return refused


needs_decks = pytest.mark.skipif(not ANCHORS.exists(), reason="reference decks are not at hand")


@needs_decks
@pytest.mark.filterwarnings("error")
def test_two_hundred_damaged_decks(tmp_path):
    refused = run(200, 20, tmp_path)
    assert 40 < refused < 200  # the injuries are neither harmless nor always deadly


@needs_decks
@pytest.mark.slow
@pytest.mark.parametrize("seed", range(9))
def test_two_thousand_damaged_decks(tmp_path, seed):
    run(200, 1000 + seed, tmp_path)
