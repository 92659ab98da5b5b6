"""The decks that ship: as the table says, fit to compute with, made again bit for bit."""

import hashlib
import re
import runpy
from pathlib import Path

import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.geometry.thickness_mapping import map_thickness
from chladni.io.dyna import read_keyword
from chladni.io.nastran import assembly, read_deck
from chladni.units import units

MESHES = Path(__file__).resolve().parents[2] / "meshes"
LISTED = dict(
    re.findall(r"^\| (\S+) \|.*\| ([0-9a-f]{64}) \|$", (MESHES / "README.md").read_text(), re.M)
)


@pytest.mark.parametrize("name", sorted(LISTED))
def test_checksums(name):
    assert hashlib.sha256((MESHES / name).read_bytes()).hexdigest() == LISTED[name]


def test_every_mesh_is_listed():
    files = {p.relative_to(MESHES).as_posix() for p in MESHES.rglob("*") if p.is_file()}
    made = {f for f in files if f.endswith((".bdf", ".k", ".uff", ".vtu"))}
    assert made <= set(LISTED)
    assert sum((MESHES / f).stat().st_size for f in files) < 15e6


def test_deck_and_formed_thickness_belong_together():
    """Read from the files alone: mass of the tailgate, six rigid modes, -5 to -7 % when formed."""
    deck = assembly(read_deck(MESHES / "tailgate_30mm.bdf"), units("mm-t-s"))
    assert mass_properties(deck)[0] == pytest.approx(10.70, abs=0.05)
    result = map_thickness(deck, read_keyword(MESHES / "tailgate_formed.k"))
    assert {p.part for p in result.parts} >= {"inner", "outer upper", "outer lower"}
    assert min(p.coverage for p in result.parts) > 0.95
    assert -0.07 < result.mass_after / result.mass_before - 1 < -0.05
    f = normal_modes(structure(deck).system, 8, proof=False).frequency
    assert f[5] < 0.01
    assert 23 < f[6] < 31


@pytest.mark.slow
def test_made_again_bit_for_bit(tmp_path):
    script = runpy.run_path(str(MESHES / "make_tailgate.py"))
    script["make"](tmp_path)
    for name in script["FILES"]:
        assert script["checksum"](tmp_path / name) == LISTED[name], name


@pytest.mark.slow
def test_read_deck_has_the_generator_s_modes():
    """What is written and read again vibrates as what was generated."""
    from chladni_specimens.tailgate.design import TailgateDesign
    from chladni_specimens.tailgate.tailgate import tailgate

    read = assembly(read_deck(MESHES / "tailgate_30mm.bdf"), units("mm-t-s"))
    a, b = (
        normal_modes(structure(m).system, 20, proof=False).frequency[6:]
        for m in (read, tailgate(TailgateDesign(size=0.030)))
    )
    np.testing.assert_allclose(a, b, rtol=1e-4)
