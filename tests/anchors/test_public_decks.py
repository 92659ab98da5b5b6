"""Decks of strangers: what was read is read with the same numbers, the rest is refused at once."""

import json
from pathlib import Path

import numpy as np
import pytest

import chladni
from chladni.errors import ChladniError, FileError
from chladni.io.nastran import read_deck

DECKS = Path(__file__).resolve().parents[2] / "../shared/public_decks"
TABLE = json.loads((DECKS / "decks.json").read_text()) if DECKS.exists() else {}
READ = [name for name in TABLE if name.startswith("read/")]
REFUSED = [name for name in TABLE if name.startswith("refused/")]
READ_NOW = {  # of those refused before, linear structure of known elements: kg of the deck
    "cpmopt.bdf": 282.06007,
    "cqrcc128a.bdf": 3.4858335,  # CQUAD8, CTRIA6
    "dofm12.bdf": 16.32,  # CTRIA6
    "r4_conn_exa.bdf": 3.0998678e-5,  # CWELD
    "static.bdf": 3.325e-4,  # a CHEXA of 20 nodes, 2660 kg/m³ times 2.5 x 5 x 10 mm³
    "laminate_elstrn_fiber_center.bdf": 0.0015098776,
    "v12902.bdf": 20.0,  # CGAP, closed
    "random_test_bar_plus_tri.bdf": 25.900053,
}

MOVED = {  # bars that turn about the normal of a shell: K6ROT is 100 where a deck is silent
    "v10112.bdf": [0.1091, 0.2269, 0.2876, 1.9022, 4.3429, 5.4087, 6.0748, 9.8228],
    "superelement.bdf": [5.4561, 9.3712, 31.9231, 39.4506, 54.9863, 76.7869, 99.1216, 181.5644],
    "unit_plate.bdf": [0, 0, 0, 0, 0, 0, 0.2512, 0.2606],
}

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not TABLE, reason="the public decks are not at hand"),
]


@pytest.mark.parametrize("name", READ)
def test_what_is_read_stays_as_it_is(name):
    """Mass and frequencies as the table has them: four decimals, and none of zero."""
    found, due = chladni.modes(DECKS / name, 10), TABLE[name]
    assert found.mass == pytest.approx(due["mass"], rel=1e-6)
    hz = np.array(MOVED.get(Path(name).name, due["hz"]))
    assert np.allclose(found.frequency[: len(hz)], hz, rtol=1e-4, atol=1e-3 * hz.max())


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_is_refused_for_all_its_reasons(name):
    """Once what the sentence names is allowed, nothing else of the text stands in the way."""
    path = DECKS / name
    try:
        read_deck(path)
    except FileError as error:
        said = str(error)
        assert "\n" not in said
        if allow := [word.strip() for word in said.split("--allow ")[1:]]:
            read_deck(path, allow)
        else:
            assert "has no bulk data" in said
        return
    if mass := READ_NOW.get(path.name):
        assert chladni.modes(path, 4).mass == pytest.approx(mass)
        return
    with pytest.raises(ChladniError) as caught:
        chladni.modes(path, 4)
    assert "\n" not in str(caught.value)
