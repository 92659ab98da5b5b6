"""Commands draw coarsely and identify a recording once: tests read their words and numbers."""

import pytest
from tests.builders.quick_runs import coarse_pictures, identified_once


@pytest.fixture(scope="module", autouse=True)
def _quick():
    with coarse_pictures(), identified_once():
        yield
