"""Commands render no pictures and identify a recording once: tests read words and numbers."""

import pytest
from tests.builders.quick_runs import quick_runs


@pytest.fixture(scope="module", autouse=True)
def _quick():
    with quick_runs():
        yield
