"""Where the real recordings lie, beside the checkout."""

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def recordings() -> Path:
    folder = Path(__file__).resolve().parents[1] / "../shared/recordings"
    if not folder.is_dir():
        pytest.skip("the folder of real recordings is not beside the checkout")
    return folder
