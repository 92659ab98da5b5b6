"""Results that are made once in a run of the tests, however many processes take part in it."""

import hashlib
import os
import pickle
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

RUN: list[Path] = []  # the folder of this run, as its conftest says


def folder_of_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The temporary folder that all processes of this run share."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if "PYTEST_XDIST_WORKER" in os.environ else base


def shared_folder(run: Path, name: str, write: Callable[[Path], object]) -> Path:
    """A folder of a name that the first process writes; the others wait for it."""
    place = run / f"shared-{name}"
    with _alone(run, name):
        if not place.exists():
            part = run / f"part-{name}"
            part.mkdir(exist_ok=True)  # it is there where the making failed before
            write(part)
            part.rename(place)
    return place


def made_once(make: Callable[..., Any], *given: Any) -> Any:
    """``make(*given)`` of the first process that asks; the key is the content of what is given."""
    (run,) = RUN
    key = hashlib.sha256(pickle.dumps(given)).hexdigest()[:24]
    return shared_result(run, f"{make.__name__}-{key}", lambda: make(*given))


def shared_result(run: Path, name: str, make: Callable[[], Any]) -> Any:
    """What the first process makes; every process reads the copy that it kept."""

    def write(folder: Path) -> None:
        (folder / "result").write_bytes(pickle.dumps(make()))

    return pickle.loads((shared_folder(run, name, write) / "result").read_bytes())


@contextmanager
def _alone(run: Path, name: str) -> Iterator[None]:
    """One process at a time; where files cannot be locked, there is no second."""
    try:
        import fcntl
    except ImportError:
        yield
        return
    with (run / f"lock-{name}").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
