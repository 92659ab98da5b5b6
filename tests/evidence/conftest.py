"""What every case of the evidence was called, in one table at the end of the run."""

import pytest

from chladni_evidence.blind import line
from chladni_evidence.score import confusion, scored, summary

ROWS = pytest.StashKey()


@pytest.fixture
def evidence(request):
    """Score a result against its truth and keep the row for the table."""

    def keep(found, truth):
        row = scored(found, truth)
        request.config.stash.setdefault(ROWS, []).append(row)
        return row

    return keep


def pytest_terminal_summary(terminalreporter, config):
    """One line a case, the confusion matrix, rates by effect."""
    if rows := config.stash.get(ROWS, []):
        terminalreporter.section("evidence")
        text = [*map(line, rows), "", confusion(rows), "", summary(rows)]
        terminalreporter.write_line("\n".join(text))
