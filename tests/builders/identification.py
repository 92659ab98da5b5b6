"""Recordings that many tests prepare, identified once."""

import pickle
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from chladni.dynamics.frf import FRF
from chladni.ema.identification import Identified, identify
from chladni.progress import Progress
from chladni.search import other_recordings, preparation


@contextmanager
def identified_once() -> Iterator[None]:
    """Searches find the same poles again wherever recording, band and lines are the same."""
    known: dict[bytes, Identified] = {}

    def once(
        frf: FRF, band: tuple[float, float], *, use: np.ndarray | None, progress: Progress
    ) -> Identified:
        key = pickle.dumps((frf, band, use))
        if key not in known:
            known[key] = identify(frf, band, use=use, progress=progress)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        for module in (preparation, other_recordings):
            patch.setattr(module, "identify", once)
        yield
