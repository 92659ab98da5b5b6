"""SIGKILL at random instants to a study and its workers in turn: nothing finished is ever lost."""

import json
import os
import random
import shutil
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import psutil
import pytest

from chladni.io.package_files import mesh_path
from chladni_studies.study_store import BEGUN, ROWS, finished


@dataclass(frozen=True)
class Killed:
    """A study by command, and how it is killed."""

    deck: Path
    vary: tuple[str, ...]
    samples: int
    workers: int
    units: str = "SI"

    def started(self, out, workers=None):
        options = [word for text in self.vary for word in ("--vary", text)]
        return subprocess.Popen(
            [
                *(sys.executable, "-m", "chladni", "study", str(self.deck), "--units", self.units),
                *("--modes", "4", "--samples", str(self.samples), "--sampler", "lhs", *options),
                *("--workers", str(workers or self.workers), "--out", str(out)),
            ],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=os.environ, text=True,
        )  # fmt: skip


def written(out):
    """Bytes of the finished samples, which no kill may change."""
    file = out / ROWS
    data = file.read_bytes() if file.exists() else b""
    return data[: data.rfind(b"\n") + 1]


def workers_of(study):
    """Processes that compute samples; none while there are none yet, or none any more."""
    try:
        children = psutil.Process(study.pid).children(recursive=True)
        return [p for p in children if "spawn_main" in " ".join(p.cmdline())]
    except psutil.NoSuchProcess:
        return []


def lives(process):
    """Whether it is more than a number that nobody has taken down."""
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return False


def gone(processes, patience=30):
    """Whether all end in so many seconds."""
    end = time.monotonic() + patience
    while any(map(lives, processes)) and time.monotonic() < end:
        time.sleep(0.05)
    return not any(map(lives, processes))


def sound(out, before, samples):
    """The store is readable, and holds what it held; a study may be writing to it."""
    data = written(out)
    assert data.startswith(before), "a finished sample was lost or changed"
    numbers = [json.loads(line)["sample"] for line in data.splitlines()]
    assert len(set(numbers)) == len(numbers), "a sample was run twice"
    assert set(numbers) <= set(finished(out / ROWS, samples)[0])
    if (out / BEGUN).exists():
        json.loads((out / BEGUN).read_text())


def killed(one, out, kills, seed):
    """A study and one of its workers killed by turns, started again; (processes, workers) killed.

    Instants are uniform over twice the time a study needs for its first sample: in its start as in
    its samples. One that ends meanwhile is whole, and another begins.
    """
    rng, hit = random.Random(seed), [0, 0]
    begun, study = time.monotonic(), one.started(out)
    try:
        while not written(out) and study.poll() is None:
            time.sleep(0.01)
        longest = 2 * (time.monotonic() - begun)
        for turn in range(1000 * kills):
            if sum(hit) == kills:
                break
            time.sleep(rng.uniform(0, longest))
            before = written(out)
            if study.poll() is not None:
                whole(one, out, study)
                shutil.rmtree(out)
                study = one.started(out)
                continue
            if turn % 2 and one.workers > 1:
                if others := workers_of(study):
                    rng.choice(others).kill()
                    hit[1] += 1
            else:
                ended(study)
                hit[0] += 1
            sound(out, before, one.samples)
            if not turn % 2 or one.workers == 1:
                study = one.started(out)
        whole(one, out, study)
    finally:
        study.kill()
        study.wait()
        study.stdout.close()
    return tuple(hit)


def whole(one, out, study):
    """The study ends by itself with every sample, each once."""
    said, _ = study.communicate()
    assert study.returncode == 0, said
    assert f"{one.samples} of {one.samples} samples" in said
    rows = [json.loads(line) for line in written(out).splitlines()]
    assert sorted(row["sample"] for row in rows) == list(range(one.samples))
    assert {row["status"] for row in rows} == {"done"}


def ended(study):
    """Kill a study: its workers end with it, and it said nothing that is not for users."""
    left = workers_of(study)
    study.kill()
    said, _ = study.communicate()
    assert study.returncode in (-9, 0), said
    assert "Traceback" not in said
    assert gone(left), "workers outlived the study"


def computed_anew(one, out, count):
    """(rows, rows again): some finished samples, taken out and run again in a process alone."""
    lines = written(out).splitlines(keepends=True)
    taken = random.Random(0).sample(lines, count)
    (out / ROWS).write_bytes(b"".join(line for line in lines if line not in taken))
    said, _ = one.started(out, workers=1).communicate()
    again = {row["sample"]: row for row in map(json.loads, written(out).splitlines())}
    assert sorted(again) == list(range(one.samples)), said
    first = [json.loads(line) for line in taken]
    return first, [again[row["sample"]] for row in first]


PLATE = ("t=90%:110%", "E=80%:120%")
TAILGATE = ("t of inner=90%:110%", "E of hem adhesive=50%:200%:log")


@pytest.fixture
def study(request, deck):
    structure, samples, workers = request.param
    if structure == "plate":
        return Killed(deck, PLATE, samples, workers)
    return Killed(mesh_path("tailgate_30mm.bdf"), TAILGATE, samples, workers, "mm-t-s")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("study", "kills", "seed"),
    [
        (("plate", 60, 1), 2, 7),
        (("plate", 600, 2), 25, 8),
        (("plate", 600, 2), 25, 9),
        (("tailgate", 60, 2), 12, 10),
    ],
    indirect=["study"],
)
def test_kill_9_loses_nothing_and_repeats_nothing(study, tmp_path, kills, seed):
    out = tmp_path / "out"
    processes, workers = killed(study, out, kills, seed)
    print(f"killed: {processes} times the study, {workers} times a worker")
    assert processes + workers == kills
    assert (workers > 0) == (study.workers > 1)
    for first, again in zip(*computed_anew(study, out, 8), strict=True):
        names = [name for name in first if name.endswith(("_hz", "_kg"))]
        np.testing.assert_allclose([first[n] for n in names], [again[n] for n in names], rtol=1e-6)
    assert not [p for p in tmp_path.iterdir() if p.name != "out"], "scratch was left"
