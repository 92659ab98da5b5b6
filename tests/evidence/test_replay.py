"""Recorded cases are decided again as they were, in no time, and every rule is weighed on them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.decision.tables import row, table

from chladni.decision.decide import RULES, decide
from chladni.errors import FileError
from chladni_evidence.recorded_case import RecordedCase, read_case, write_case
from chladni_evidence.replay import ablated, case_lines, recorded, replayed, rule_lines

RECORDED = sorted((Path(__file__).parent / "recorded").glob("*.npz"))


@pytest.mark.parametrize("path", RECORDED, ids=lambda p: p.stem)
def test_a_recorded_case_is_decided_as_it_was(path):
    case = read_case(path)
    assert replayed(case) == recorded(case)
    assert replayed(case).outcome in ("right", "admitted")


def test_a_case_is_read_as_it_was_written(tmp_path):
    """Every row and its flags, an infinite gain among them, and arrays beside them."""
    (path,) = [p for p in RECORDED if p.stem == "outside-case-1"]
    case = replace(read_case(path), arrays={"r": np.arange(3.0)})
    write_case(case, tmp_path / "again.npz")
    again = read_case(tmp_path / "again.npz")
    assert again.table == case.table
    assert (again.truth, again.names, again.one_of) == (case.truth, case.names, case.one_of)
    assert list(again.arrays["r"]) == [0.0, 1.0, 2.0]


def test_what_was_not_recorded_is_said(tmp_path):
    bad = tmp_path / "x.npz"
    bad.write_bytes(b"not an archive")
    with pytest.raises(FileError, match=r"x\.npz: no recorded case"):
        read_case(bad)
    bare = row("crack", 200.0)
    made = table(replace(bare, p=None), row("point-mass", 10.0))
    case = RecordedCase("bare", {}, made, "missing physics", ("crack",), ())
    assert "needs the test of fit, of crack" in case_lines([case])[1]


def test_a_rule_is_worth_what_it_changes():
    """Without the test of fit what does not fit is named: right where it is what was hidden."""
    made = table(row("crack", 200.0, p=0.001))
    truths = [{"effect": e} for e in ("crack", "point-mass", "nothing")]
    said = decide(made)
    cases = [RecordedCase(t["effect"], t, made, said.verdict, (), said.one_of) for t in truths]
    (worth,) = [w for w in ablated(cases) if w.name == "something_else"]
    assert worth.changed == ("crack", "point-mass", "nothing")
    assert (worth.saves, worth.spoils, worth.open) == ((), ("crack",), ())
    quiet = replace(cases[2], table=table(row("crack", 8.0)))
    (worth,) = [w for w in ablated([quiet]) if w.name == "chance_of_responses"]
    assert worth.changed == worth.saves == ("nothing",)
    assert len(rule_lines(cases)) == 1 + len(vars(RULES))
