"""Every form, whatever is drawn, is one free structure on any mesh."""

from functools import cache

import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.io.nastran import assembly, read_deck, write_assembly
from chladni.units import units
from chladni_specimens.forms import FORMS

SEEDS = (0, 7)
every = pytest.mark.parametrize(("name", "seed"), [(n, s) for n in FORMS for s in SEEDS])


def frequencies(made):
    return normal_modes(structure(made).system, 16).frequency


@cache
def drawn(name, seed):
    """A form and its frequencies."""
    made = FORMS[name].made(seed)
    return made, frequencies(made)


@every
def test_is_one_free_piece(name, seed):
    """Six rigid modes and no seventh: no part is loose, none is held."""
    _, f = drawn(name, seed)
    assert (f[:6] < 0.02 * f[6]).all()
    assert f[6] > 5.0


@pytest.mark.parametrize(
    ("name", "seed"),
    [pytest.param(n, s, marks=[pytest.mark.slow] * (s != SEEDS[-1])) for n in FORMS for s in SEEDS],
)
def test_the_mesh_changes_neither_mass_nor_modes_much(name, seed):
    """A finer mesh weighs the same; ten modes stay within 12 % (bolts hold what shell is near)."""
    (deck, f), article = drawn(name, seed), FORMS[name].made(seed, 1.4)
    assert mass_properties(article)[0] == pytest.approx(mass_properties(deck)[0], rel=2e-3)
    np.testing.assert_allclose(frequencies(article)[6:], f[6:], rtol=0.12)


@pytest.mark.parametrize("name", FORMS)
def test_a_written_deck_is_the_form(name, tmp_path):
    """The modes of the deck as it is read again are those of the form."""
    made, f = drawn(name, 7)
    write_assembly(made, tmp_path / "deck.bdf", units("mm-t-s"))
    read = assembly(read_deck(tmp_path / "deck.bdf"), units("mm-t-s"))
    assert [p.name for p in read.parts] == [p.name for p in made.parts]
    np.testing.assert_allclose(frequencies(read)[6:], f[6:], rtol=1e-5)


def test_seeds_draw_dimensions():
    """The same seed gives the same structure on every mesh, another seed another."""
    form = FORMS["lidded box"]
    assert form.dimensions(4) == form.dimensions(4)
    assert form.dimensions(4) != form.dimensions(5)
    low, high = form.ranges["length"]
    assert all(low <= form.dimensions(s)["length"] <= high for s in range(20))
