"""The learned layout runs, obeys the mask and is compared honestly (extra ``rl``; minutes)."""

import importlib.util
from pathlib import Path

import pytest

SCRIPT = Path(__file__).with_name("train_placement.py")


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")
def test_a_policy_is_trained_and_compared():
    """No method beats effective independence with exchange; a short training is no miracle."""
    pytest.importorskip("sb3_contrib")
    spec = importlib.util.spec_from_file_location("train_placement", SCRIPT)
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    score = script.compare(20_000)
    assert max(score.values()) == pytest.approx(score["EFI and exchange"])
    assert score["MaskablePPO, best of 30"] > score["random, best of 30"] - 2
