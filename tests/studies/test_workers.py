"""The same study on this process, on local processes and on clusters that lose their workers."""

import os
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from functools import partial
from operator import call
from types import SimpleNamespace

import numpy as np
import psutil
import pytest
from distributed import Client

import chladni
from chladni.errors import FileError
from chladni_studies import StudySettings
from chladni_studies.study_store import ROWS
from chladni_studies.workers import _AHEAD, ENDED, NO_WORKER, results

RANGES = ["t=90%:110%", "E=80%:120%"]
SETTINGS = StudySettings(samples=40, modes=3)


@pytest.fixture(scope="module")
def straight(model):
    """In this process."""
    return chladni.study(model, RANGES, SETTINGS)


def started(deck, out, *more):
    command = [
        *(sys.executable, "-m", "chladni", "study", str(deck), "--units", "SI", "--modes", "3"),
        *("--vary", RANGES[0], "--vary", RANGES[1], "--samples", "40", "--out", str(out), *more),
    ]
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=os.environ
    )


def wait_for(out, lines, process):
    file = out / ROWS
    while process.poll() is None and not (
        file.exists() and file.read_bytes().count(b"\n") >= lines
    ):
        time.sleep(0.02)


def agrees(out, straight):
    table = np.genfromtxt(out / "samples.csv", delimiter=",", names=True, dtype=None)
    assert (table["status"] == "done").all()
    np.testing.assert_array_equal(table["sample"], np.arange(40))
    for name in ("t", "E", "f1_hz", "f3_hz", "mass_kg"):
        np.testing.assert_allclose(table[name], straight.column(name), rtol=1e-9)


@pytest.mark.slow
def test_a_worker_killed_costs_no_other_sample(deck, straight, tmp_path):
    """Of two local workers one is killed; the rows are those of a study nobody disturbed."""
    study = started(deck, tmp_path / "out", "--workers", "2")
    wait_for(tmp_path / "out", 3, study)
    children = psutil.Process(study.pid).children(recursive=True)
    workers = [p for p in children if "spawn_main" in " ".join(p.cmdline())]
    assert len(workers) >= 2
    workers[-1].kill()
    said, _ = study.communicate()
    assert study.returncode == 0, said
    assert "Traceback" not in said
    agrees(tmp_path / "out", straight)
    psutil.wait_procs(children, timeout=20)
    assert not [p for p in children if p.is_running()], "workers outlived the study"


@pytest.mark.slow
def test_workers_that_cannot_start_are_one_sentence(deck):
    """A script without a guard starts itself anew in each worker."""
    script = f"import chladni; model = chladni.load({str(deck)!r}, 'SI')\n"
    script += "chladni.study(model, ['t=90%:110%'], workers=2)"
    file = deck.parent / "without_guard.py"
    file.write_text(script)
    ran = subprocess.run([sys.executable, str(file)], capture_output=True, text=True)
    last = ran.stderr.splitlines()[-1]
    assert "2 local workers could not be started in 3 tries" in last
    assert 'needs if __name__ == "__main__":' in last


@contextmanager
def clustered(port=0, late=False):
    """(address, scheduler, workers, join): two workers as a user starts them, each a process.

    Where they are ``late`` they start when ``join`` is called.
    """
    dask = [sys.executable, "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE, "text": True}
    scheduler = subprocess.Popen(
        [*dask, "scheduler", "--host", "127.0.0.1", "--port", str(port), "--no-dashboard"], **quiet
    )
    address = next(
        word for line in scheduler.stderr for word in line.split() if word.startswith("tcp://")
    )
    options = ["--nthreads", "1", "--no-nanny", "--no-dashboard"]
    quiet["stderr"] = subprocess.DEVNULL
    command, workers = [*dask, "worker", address, *options], []

    def join():
        workers.extend(subprocess.Popen(command, **quiet) for _ in range(2))

    try:
        if not late:
            join()
        yield address, scheduler, workers, join
    finally:
        for process in (*workers, scheduler):
            process.kill()
            process.wait()
        scheduler.stderr.close()


@pytest.fixture
def cluster():
    with clustered() as started:
        yield started


FOUND = """[str(t.key) for s in __import__("distributed").Scheduler._instances
            for t in s.transition_log if t.finish == "memory"]"""


@pytest.mark.slow
def test_a_cluster_of_others_that_gets_workers_and_loses_one(deck, straight, tmp_path):
    """Without any it is said once, and waited for; one that is lost costs what it had not handed
    over, and few samples are on the cluster at a time."""
    with clustered(late=True) as (address, _, workers, join):
        study = started(deck, tmp_path / "out", "--scheduler", address)
        enough = threading.Timer(120, study.kill)
        enough.start()
        assert f"{NO_WORKER}\n" in study.stdout  # reads up to that line
        enough.cancel()
        join()
        wait_for(tmp_path / "out", 3, study)
        workers[0].kill()
        said, _ = study.communicate()
        assert study.returncode == 0, said
        assert NO_WORKER not in said.splitlines()
        agrees(tmp_path / "out", straight)
        with Client(address, timeout=20) as client:
            solved = [key for key in client.run_on_scheduler(eval, FOUND) if "_on_worker" in key]
    assert 40 <= len(solved) <= 40 + _AHEAD * len(workers)


@pytest.mark.slow
@pytest.mark.parametrize("again", ["--workers", "--scheduler"])
def test_a_scheduler_that_is_lost_costs_nothing_that_was_finished(
    deck, straight, tmp_path, cluster, again
):
    """The same command goes on here, or on a scheduler that was started again at its address."""
    address, scheduler, *_ = cluster
    out = tmp_path / "out"
    study = started(deck, out, "--scheduler", address)
    wait_for(out, 3, study)
    scheduler.kill()
    said, _ = study.communicate()
    assert study.returncode == 2, said
    assert said.splitlines()[-1].startswith("chladni: the connection to the scheduler was lost; ")
    assert "Traceback" not in said
    scheduler.wait()
    before = (out / ROWS).read_bytes()
    assert 3 <= before.count(b"\n") < 40
    if again == "--workers":
        study = started(deck, out, "--workers", "1")
        said, _ = study.communicate()
    else:
        with clustered(address.rpartition(":")[2]) as (same, *_):
            assert same == address
            study = started(deck, out, "--scheduler", address)
            said, _ = study.communicate()
    assert study.returncode == 0, said
    assert (out / ROWS).read_bytes().startswith(before)
    agrees(out, straight)


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense", "ftp://x:1", ""])
def test_no_scheduler_is_one_sentence_and_leaves_nothing(model, address, monkeypatch, tmp_path):
    monkeypatch.setattr("chladni_studies.workers.PATIENCE", 1)
    with pytest.raises(FileError, match="no Dask scheduler answers at"):
        chladni.study(model, RANGES, SETTINGS, scheduler=address, out=tmp_path / "out")
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # its open pipes
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_jobs_of_a_batch_system(deck, straight, tmp_path):
    """dask-jobqueue as on SLURM, its jobs shells of this machine."""
    jobqueue = pytest.importorskip("dask_jobqueue.local")
    with jobqueue.LocalCluster(cores=1, processes=1, memory="2GB") as jobs:
        jobs.scale(jobs=2)
        study = started(deck, tmp_path / "out", "--scheduler", jobs.scheduler_address)
        said, _ = study.communicate()
    assert study.returncode == 0, said
    agrees(tmp_path / "out", straight)


@pytest.mark.slow
def test_a_sample_that_ends_every_worker_has_failed_and_costs_no_other():
    """Each time the sample that waited behind it goes to the next worker."""
    study = SimpleNamespace(assembly=call)  # a sample of which does what its values say
    X = [partial(int, "no number")] * 8
    X[3] = partial(os._exit, 1)
    found = {r.number: r.why for r in results(study, X, range(8), 2)}
    assert found.pop(3) == ENDED
    assert sorted(found) == [0, 1, 2, 4, 5, 6, 7]
    assert all("no number" in why for why in found.values())


def test_a_sample_is_tried_again_and_a_fault_of_the_program_ends_the_study(capfd, tmp_path):
    """The first try ends its worker, as a kill does; the second is a fault of the program."""
    study, mark = SimpleNamespace(assembly=call), tmp_path / "tried"
    code = f"import os, pathlib; mark = pathlib.Path({str(mark)!r}); tried = mark.exists()\n"
    code += "int(None) if tried else (mark.touch(), os._exit(1))"
    with pytest.raises(FileError, match=r"could not run a sample \(TypeError"):
        list(results(study, [partial(exec, code)], range(1), 2))
    assert "Traceback" not in capfd.readouterr().err
