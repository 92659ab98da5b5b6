"""Effects concealed, every effect in every structure, through the one pipeline."""

import pytest

from chladni_evidence.blind import answered, blinds
from chladni_evidence.concealed import SPECIMENS, concealable
from chladni_evidence.score import NULLS

pytestmark = pytest.mark.slow

SEED = 41


@pytest.mark.parametrize("specimen", SPECIMENS)
@pytest.mark.parametrize("effect", concealable())
def test_concealed_effect(effect, specimen, tmp_path, evidence):
    """Nothing is named where nothing is missing; what else was called what is in the table."""
    (blind,) = blinds(tmp_path, [SEED], [effect], [specimen])
    row = evidence(*answered(blind))
    assert not row["called"].startswith("error")
    if effect in NULLS:
        assert row["right"]
