"""Commands render no pictures and identify a recording once: tests read their words and numbers."""

import pytest
from tests.builders.quick_runs import identified_once, unrendered_pictures


@pytest.fixture(scope="module", autouse=True)
def _quick():
    with unrendered_pictures(), identified_once():
        yield
