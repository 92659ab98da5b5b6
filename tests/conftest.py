"""What all tests share: the recordings beside the checkout, counted work in place of seconds."""

import gc
import os
import sys
from pathlib import Path

import pytest
from hypothesis import settings
from tests.builders.shared_results import RUN, folder_of_run

settings.register_profile("unhurried", deadline=None)  # a busy machine is no counterexample
settings.load_profile("unhurried")


@pytest.fixture(scope="session", autouse=True)
def shared(tmp_path_factory) -> Path:
    """The folder of what all processes of this run share."""
    RUN[:] = [folder_of_run(tmp_path_factory)]
    if os.environ.pop("PYTHONDONTWRITEBYTECODE", ""):  # its children compile the modules once
        os.environ["PYTHONPYCACHEPREFIX"] = str(RUN[0] / "bytecode")
    return RUN[0]


@pytest.fixture(scope="session")
def recordings() -> Path:
    folder = Path(__file__).resolve().parents[1] / "../shared/recordings"
    if not folder.is_dir():
        pytest.skip("the folder of real recordings is not beside the checkout")
    return folder


@pytest.fixture
def work():
    """Calls of Python functions that an action takes: its speed, on any machine however busy.

    What other tests left behind is not finalised meanwhile: it would be counted.
    """

    def counted(action):
        calls = [0]

        def see(frame, event, argument):
            calls[0] += event == "call"

        before = sys.getprofile()
        gc.collect()
        gc.disable()
        sys.setprofile(see)
        try:
            action()
        finally:
            sys.setprofile(before)
            gc.enable()
        return calls[0]

    return counted
