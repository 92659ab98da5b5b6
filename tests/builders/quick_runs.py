"""What commands and workflows spend most time on, made short where a test is not about it."""

import hashlib
import pickle
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image
from tests.builders.shared_results import made_once

from chladni.dynamics.frf import FRF
from chladni.ema.identification import Identified, identify
from chladni.progress import Progress, silent
from chladni.search.calibration import CalibrationSettings
from chladni.view import canvas, paper
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
_PHOTO, _SAVE, _WORDS = canvas._photo, Figure.savefig, paper._no_formulas


@contextmanager
def identified_once() -> Iterator[None]:
    """The same recording with the same arguments is identified once, by one process."""

    found: Any = identify

    def identified(frf: FRF, given: Any, named: Any) -> Identified:
        return found(frf, *given, **dict(named))

    def once(frf: FRF, *given: Any, progress: Progress = silent, **named: Any) -> Identified:
        asked = frf, given, sorted(named.items())
        key = pickle.dumps(asked)
        if key not in _KNOWN:
            _KNOWN[key] = made_once(identified, *asked)
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
def quick_runs() -> Iterator[None]:
    """What the tests of commands and workflows need: their words, numbers and files."""
    with unrendered_pictures(), identified_once(), few_starts():
        yield


@contextmanager
def coarse_pictures() -> Iterator[None]:
    """Pictures of a quarter of the pixels each way, for tests that look at them."""

    def coarse(seen: Surface, camera: Camera, paint: canvas.Paint, width: int) -> np.ndarray:
        return _PHOTO(seen, camera, paint, width // 4)

    def small(self: Figure, path: Any, **look: Any) -> None:
        _SAVE(self, path, **{**look, "dpi": 40})

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(canvas, "_photo", coarse)
        patch.setattr(Figure, "savefig", small)
        patch.setattr(paper, "_no_formulas", _WORDS)
        yield


@contextmanager
def unrendered_pictures() -> Iterator[None]:
    """Figures are made as always; of each, the file has one colour, which follows its content.

    To render them is most of the work of a command. Equal content gives equal bytes.
    """

    def photo(seen: Surface, camera: Camera, paint: canvas.Paint, width: int) -> np.ndarray:
        colour = _colour(seen.points, seen.faces, paint.values, paint.limits, camera.toward)
        return np.full((8, 8, 4), (*colour, 255), np.uint8)

    def plain(self: Figure, path: Any, **look: Any) -> None:
        if Path(path).suffix != ".png":
            _SAVE(self, path, **look)
            return
        size = tuple(int(40 * inches) for inches in self.get_size_inches())
        Image.new("RGB", size, _colour(*_content(self))).save(path)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(canvas, "_photo", photo)
        patch.setattr(Figure, "savefig", plain)
        patch.setattr(paper, "_no_formulas", lambda figure: None)
        yield


def _content(figure: Figure) -> Iterator[Any]:
    """What the axes of a figure show: lines, images, points, words."""
    for ax in figure.axes:
        yield from (ax.get_title(), ax.get_xlabel(), ax.get_ylabel(), ax.get_xlim(), ax.get_ylim())
        yield from (line.get_xydata() for line in ax.lines)
        yield from (image.get_array() for image in ax.images)
        yield from (points.get_offsets() for points in ax.collections)
        yield from (text.get_text() for text in ax.texts)


def _colour(*content: Any) -> tuple[int, int, int]:
    digest = hashlib.sha256()
    for one in content:
        digest.update(repr(one).encode() if isinstance(one, str) else np.asarray(one).tobytes())
    red, green, blue = digest.digest()[:3]
    return red, green, blue
