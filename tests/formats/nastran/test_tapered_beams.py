"""Stations of PBEAM and PBEAML: what they mean, and what is written of them."""

import numpy as np
import pytest

import chladni
from chladni.io.nastran import assembly
from chladni.io.nastran.export.part_cards import beam_card
from chladni.units import UNITS

from .conftest import PLATE

MM = UNITS["mm-t-s"]


@pytest.mark.parametrize(
    ("card", "due"),
    [
        ("PBEAM,1,5,2.,.5,.25,,,.1\n,NO,1.,1.,.25,,,,.3", (0.5, 0.5, 1.0, 0.3, 0.0)),
        (
            "PBEAM,1,5,2.,.5,.25,,,.1\n,,,,,,,,\n,NO,.5\n,YESA,1.,1.,.25,,,,.3\n,1.,1.\n,,,,,.1,.2,.3",
            (0.5, 0.5, 1.0, 0.3, 0.3e-3),
        ),
        ("PBEAML,1,5,,BAR\n,2.,1.,.1,YES,1.,1.,1.,.3", (0.5, 0.5, 0.125, 0.3, 0.0)),
        ("PBEAML,1,5,,BAR\n,2.,1.,.1,NO,.5,,,,NO,1.,1.,1.,.3", (0.5, 0.5, 0.125, 0.3, 0.0)),
    ],
)
def test_stations_are_relative_to_end_A(bulk, card, due):
    """A, I1, I2 of end B over end A's, NSM and N1; a blank between lies on the line from A to B."""
    text = f"{PLATE}CBEAM,8,1,1,2,0.,0.,1.\n{card}\n"
    section = assembly(bulk(text, fold=False), MM).parts[-1].section
    end = section.stations[-1]
    unit = section.nonstructural / 0.1
    found = (end.area, end.I1, end.I2, end.nonstructural / unit, end.neutral[0])
    assert found == pytest.approx(due)
    if len(section.stations) > 1:
        middle = section.stations[0]
        assert (middle.x, middle.area) == pytest.approx((0.5, 0.75))


def test_a_tapered_beam_is_written_as_it_was_read(bulk):
    """PBEAM of all that a section has, read again."""
    card = (
        "PBEAM,1,5,2.,.5,.25,.1,.3,.1\n,,,,,,,,\n,NO,.4,1.7,.3,.2,.05,.2,.2\n,NO,1.,1.,.25,,,,.3\n"
    )
    text = f"{PLATE}CBEAM,8,1,1,2,0.,0.,1.\n{card},.8,.9,,,.1,.2,,\n,.3,.4,.5,.6,.1,.2,.3,.4\n"
    one = assembly(bulk(text, fold=False), MM).parts[-1].section
    name, values = beam_card(one, 1, 5, MM)
    written = ",".join("" if v is None else str(v) for v in (name, *values))
    other = assembly(bulk(f"{PLATE}CBEAM,8,1,1,2,0.,0.,1.\n{written}\n"), MM).parts[-1].section
    for a, b in zip((one, *one.stations), (other, *other.stations), strict=True):
        a, b = vars(a), vars(b)
        for field in a.keys() - {"material", "kind", "stations"}:
            assert b[field] == pytest.approx(a[field]), field


def test_a_truncated_wedge_has_the_frequencies_of_the_tables(tmp_path):
    """ω L² √(ρA/EI) of a cantilever of half the depth at its tip, width constant.

    3.82379, 18.3173, 47.2648 (Downs, J. Appl. Mech. 44 (1977) 737-742), Euler-Bernoulli.
    """
    n = 8
    depth = 1 - np.arange(n + 1) / (2 * n)
    text = "MAT1,5,2.1+5,,.3,7.85-9\n"
    text += "".join(f"GRID,{k},,{1000 * k / n},0.,0.\n" for k in range(n + 1)[1:])
    text += "GRID,99,,0.,0.,0.\nPARAM,COUPMASS,1\n"
    ends = [99, *range(1, n + 1)]
    for k in range(n):
        middle = (depth[k] + depth[k + 1]) / 2
        text += f"CBEAM,{k + 1},{k + 1},{ends[k]},{ends[k + 1]},0.,1.,0.\nPBEAML,{k + 1},5,,BAR\n"
        text += f",5.,{10 * depth[k]},,NO,.5,5.,{10 * middle},\n,NO,1.,5.,{10 * depth[k + 1]}\n"
    text += "SPC1,1,123456,99\nSPC1,1,345,1,THRU,8\n"
    path = tmp_path / "deck.bdf"
    path.write_text(f"SOL 103\nCEND\nSPC = 1\nBEGIN BULK\n{text}")
    hz = chladni.modes(path, 3, units="mm-t-s").frequency
    scale = np.sqrt(2.1e5 * 10**2 / 12 / 7.85e-9) / 1000**2 / (2 * np.pi)
    np.testing.assert_allclose(hz / scale, [3.82379, 18.3173, 47.2648], rtol=2e-3)
