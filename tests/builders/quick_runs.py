"""What commands and workflows spend most time on, made short where a test is not about it."""

import pickle
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from chladni.dynamics.frf import FRF
from chladni.ema.identification import Identified, identify
from chladni.progress import Progress, silent
from chladni.search.calibration import CalibrationSettings
from chladni.view import canvas
from chladni.view.camera import Camera
from chladni.view.surface import Surface

CALLERS = (  # names under which modules hold the function that identifies
    "chladni.ema.recording_screening.identify",
    "chladni.search.measured_frequencies.identify",
    "chladni.search.other_recordings.identify",
    "chladni.search.preparation.identify",
    "chladni.workflows.correlate.identified",
    "chladni.workflows.evaluation.identify",
    "chladni.workflows.identify.identified",
    "chladni.workflows.screening_of_case.identify",
)
_KNOWN: dict[bytes, Identified] = {}


@contextmanager
def identified_once() -> Iterator[None]:
    """The same recording with the same arguments is identified once."""

    found: Any = identify

    def once(frf: FRF, *given: Any, progress: Progress = silent, **named: Any) -> Identified:
        key = pickle.dumps((frf, given, sorted(named.items())))
        if key not in _KNOWN:
            _KNOWN[key] = found(frf, *given, progress=progress, **named)
        return _KNOWN[key]

    with pytest.MonkeyPatch.context() as patch:
        for name in CALLERS:
            patch.setattr(name, once)
        yield


@contextmanager
def few_starts() -> Iterator[None]:
    """A calibration begins at two points in place of twelve, which are a third of its work."""
    few = partial(CalibrationSettings, starts=2)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("chladni.workflows.calibrate.CalibrationSettings", few)
        yield


@contextmanager
def coarse_pictures() -> Iterator[None]:
    """Pictures of a quarter of the pixels each way: they are most of the work of a command."""
    photo, save = canvas._photo, Figure.savefig

    def coarse(seen: Surface, camera: Camera, paint: canvas.Paint, width: int) -> np.ndarray:
        return photo(seen, camera, paint, width // 4)

    def small(self: Figure, path: Any, **look: Any) -> None:
        save(self, path, **{**look, "dpi": 40})

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(canvas, "_photo", coarse)
        patch.setattr(Figure, "savefig", small)
        yield
