"""A diagnosis never opens a truth, and no truth changes an answer."""

import json
import os
from pathlib import Path

import numpy as np
import pytest
from tests.builders.cases import write_case as plate_case

from chladni_evidence.blind_folder import BlindFolder, Seals, hash_of, hash_of_case
from chladni_evidence.blind_run import run

WATCH = """import os, sys
from matplotlib.figure import Figure
Figure.savefig = lambda self, path, **look: open(path, "wb").close()
log = os.open({log!r}, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
def hook(event, args):
    if event in ("open", "os.listdir", "os.scandir", "os.rename"):
        path = args[0] if args else None
        if isinstance(path, (str, bytes, os.PathLike)):
            os.write(log, os.fsencode(os.path.abspath(os.fsdecode(path))) + b"\\n")
sys.addaudithook(hook)
"""


def write_case(folder):
    """A small case in a folder that holds nothing else."""
    folder.mkdir(parents=True)
    plate_case(folder, 4, (2, 4, 7, 18), np.linspace(15, 150, 200), 130.0)
    (folder / "article.bdf").unlink()
    with (folder / "case.toml").open("a") as text:
        text.write('[search]\neffects = ["point-mass"]\n')


@pytest.fixture(scope="module")
def answered(tmp_path_factory):
    """Two cases of the same files and unlike truths, answered with every opening written down."""
    place = BlindFolder(tmp_path_factory.mktemp("blind"))
    names = ("case-1", "case-2")
    write_case(place.case(names[0]))
    place.case(names[1]).mkdir()
    for path in place.case(names[0]).iterdir():
        (place.case(names[1]) / path.name).write_bytes(path.read_bytes())
    place.truth(names[0]).parent.mkdir()
    for name, effect in zip(names, ("point-mass", "suspension"), strict=True):
        place.truth(name).write_text(json.dumps({"effect": effect, "seed": 560}))
    truths = {n: hash_of(place.truth(n)) for n in names}
    files = {n: hash_of_case(place.case(n)) for n in names}
    Seals("tune", "panels", "560-560", "0.1.0", 0, truths, files).write(place.seals)

    watch, log = tmp_path_factory.mktemp("watch"), tmp_path_factory.mktemp("log") / "opened.txt"
    (watch / "sitecustomize.py").write_text(WATCH.format(log=str(log)))
    path = os.pathsep.join([str(watch), *filter(None, [os.environ.get("PYTHONPATH")])])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("PYTHONPATH", path)
        patch.setenv("CHLADNI_GRAPHICS", "matplotlib")
        run(place.out, 2, str, calibrated=False)
    return place, {Path(text) for text in log.read_text(errors="replace").splitlines()}


def test_a_diagnosis_opens_its_own_case_and_nothing_else_of_the_benchmark(answered):
    place, opened = answered
    inside = {p.relative_to(place.out) for p in opened if p.is_relative_to(place.out)}
    assert Path("cases/case-1/case.toml") in inside  # the watch is awake
    assert Path("cases/case-2/frf.npz") in inside
    assert {p.parts[0] for p in inside} == {"cases", "answers"}


def test_truths_change_no_answer(answered):
    """Of the same files the same is said, whatever lies sealed beside them."""
    place, _ = answered
    one, other = (json.loads(place.answer(n).read_text())["diagnose"] for n in ("case-1", "case-2"))
    assert one["code"] == other["code"] == 0
    assert one["result"]["verdict"] == "missing physics"
    assert one["result"] == other["result"]
