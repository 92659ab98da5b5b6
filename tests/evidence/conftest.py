"""What every case of the evidence was called, in one table at the end of the run."""

import pytest
from tests.builders.quick_runs import quick_runs

from chladni.report.diagnosis_json import diagnosis_json
from chladni_evidence.blind_diagnosis import Answer
from chladni_evidence.outcome_row import line, row
from chladni_evidence.outcome_table import confusion, overall, table

ROWS = pytest.StashKey()
UNKNOWN = {  # of articles others made
    "mesh": "as built", "values": {}, "part_mass_kg": {}, "mass_kg": float("nan"),
    "unweighed_kg": 0.0,
}  # fmt: skip


@pytest.fixture(scope="module", autouse=True)
def _quick():
    with quick_runs():
        yield


@pytest.fixture
def evidence(request):
    """Score a result against its truth and keep the row for the table."""

    def keep(found, truth):
        scored = row(Answer(0, 0.0, 0.0, "", diagnosis_json(found)), {**UNKNOWN, **truth})
        request.config.stash.setdefault(ROWS, []).append(scored)
        return scored

    return keep


def pytest_terminal_summary(terminalreporter, config):
    """One line a case, rates by effect, the confusion matrix."""
    if rows := config.stash.get(ROWS, []):
        terminalreporter.section("evidence")
        text = [*map(line, rows), "", table(rows), "", confusion(rows), "", overall(rows)]
        terminalreporter.write_line("\n".join(text))
