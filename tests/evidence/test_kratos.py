"""Kratos against closed forms and our elements; what its articles hide; cases of the set."""

from dataclasses import replace

import numpy as np
import pytest

from chladni.dynamics.eigen import normal_modes
from chladni.errors import FileError, ModelError
from chladni.fem.assemble import structure
from chladni.fem.energy import mass_properties
from chladni.model.assembly import Assembly
from chladni.model.ground_springs import with_ground_bushes, with_springs
from chladni.model.properties import BeamSection, Part
from chladni_evidence.blind_make import made_of, make
from chladni_evidence.evidence_sets import HIDDEN_IN, Order, orders
from chladni_evidence.hidden import Site, with_lumps
from chladni_evidence.kratos import PYTHON, Stretched, _shells, _springs, installed, kratos_modes
from chladni_evidence.kratos_kinds import doubler, rib, seam, soft_clamp, stretched
from chladni_evidence.kratos_structures import ARTICLES, DECKS, STEEL, half_cylinder
from chladni_evidence.made_case import SHIFT, _calibration_parameters
from chladni_evidence.mesh_transfer import Spots
from chladni_evidence.outcome_row import NULLS
from chladni_specimens import plate

kratos = pytest.mark.skipif(not installed(), reason="no Python with KratosMultiphysics")
FREE_SQUARE = (13.468, 19.596, 24.271, 34.801, 34.801, 61.093)  # Leissa 1973, J. Sound Vib. 31, 257
T = 2e-3


def frequencies(a: Assembly, top: float, triangles: bool = False) -> np.ndarray:
    """Elastic frequencies by Kratos [Hz]."""
    f = kratos_modes(a, np.arange(3), np.array([len(a.points) // 2]), top, triangles)[0]
    return f[f > 0]


@pytest.fixture(scope="module")
def square() -> Assembly:
    return plate(0.5, 0.5, 20, 20, T)


@kratos
@pytest.mark.parametrize("triangles", [False, True], ids=["quadrilaterals", "triangles"])
def test_free_square_plate(square, triangles):
    """Leissa's λ = ω a² √(ρ t / D), and our elements, within 1 %."""
    f = frequencies(square, 150.0, triangles)[:6]
    D = STEEL.E * T**3 / 12 / (1 - STEEL.nu**2)
    factor = 2 * np.pi * 0.25 * np.sqrt(STEEL.rho * T / D)
    np.testing.assert_allclose(f * factor, FREE_SQUARE, rtol=0.01)
    ours = normal_modes(structure(square).system, 12).frequency[6:]
    np.testing.assert_allclose(f, ours, rtol=0.01)


@kratos
@pytest.mark.parametrize("strain", [-1e-5, 5e-5])
def test_stretched_plate(strain):
    """ω² = (D k⁴ + N k²)/(ρ t) of a simply supported plate under an even force."""
    square = plate(0.5, 0.5, 30, 30, T)
    x, y = square.points[:, :2].T
    edge = np.flatnonzero((np.abs(x - 0.25) > 0.2499) | (np.abs(y - 0.25) > 0.2499))
    held = replace(square, supports=np.array([(r, c) for r in edge for c in (1, 2, 3)]))
    state = Stretched(**vars(held), moved=strain * square.points)
    D = STEEL.E * T**3 / 12 / (1 - STEEL.nu**2)
    k2 = np.sort([(m**2 + n**2) * (np.pi / 0.5) ** 2 for m in (1, 2, 3) for n in (1, 2, 3)])[:5]
    N = STEEL.E * T / (1 - STEEL.nu) * strain
    due = np.sqrt((D * k2**2 + N * k2) / (STEEL.rho * T)) / (2 * np.pi)
    np.testing.assert_allclose(frequencies(state, 250.0)[:5], due, rtol=0.01)


@kratos
def test_half_cylinder_is_ours_on_a_fine_mesh():
    a = half_cylinder({"length": 0.4, "radius": 0.15, "t": 1.5e-3}, 0.016)
    ours = normal_modes(structure(a).system, 14).frequency[6:]
    np.testing.assert_allclose(frequencies(a, 1.1 * ours[-1])[:8], ours, rtol=0.01)


@kratos
def test_springs_and_masses_at_points(square):
    """A rigid plate on four soft springs with a lump: f = √(4 k / m) / 2π across; m exact."""
    corners = np.flatnonzero(np.abs(square.points[:, :2] - 0.25).min(axis=1) > 0.2499)
    heavy = with_lumps(square, corners, 5.0)
    up = np.tile([0.0, 0.0, 1.0], (4, 1))
    f = frequencies(with_ground_bushes(heavy, corners, up, 100.0), 30.0)
    m = mass_properties(heavy)[0]
    assert np.abs(f - np.sqrt(4 * 100.0 / m) / (2 * np.pi)).min() < 1e-3 * f[0]


@kratos
def test_beams():
    """A round cantilever: λ = 1.8751 in both planes, and λ for torsion by our own bars."""
    x = np.linspace(0, 0.5, 21)
    rows = np.column_stack([np.arange(20), np.arange(1, 21)])
    R = 5e-3
    I = np.pi * R**4 / 4
    section = BeamSection(STEEL, np.pi * R**2, I, I, 0.0, 2 * I)
    empty = plate(1.0, 1.0, 1, 1, T)
    a = Assembly(
        np.arange(1, 22), np.column_stack([x, 0 * x, 0 * x]), (Part(1, "rod", section),),
        beams=type(empty.beams)(
            np.arange(1, 21), rows, np.zeros(20, int), np.tile([0, 0, 1.0], (20, 1)),
            np.zeros((20, 2, 3)), np.zeros((20, 2, 6), bool),
        ),
        supports=np.array([(0, c) for c in range(1, 7)]),
    )  # fmt: skip
    due = 1.8751**2 / 0.25 * np.sqrt(STEEL.E * I / (STEEL.rho * np.pi * R**2)) / (2 * np.pi)
    np.testing.assert_allclose(frequencies(a, 5 * due)[:2], due, rtol=0.005)


def site_of(name: str) -> Site:
    """A coarse article of a structure, with two of its points as sensors."""
    a = ARTICLES[name].made(500, 1.3)
    parts = tuple(p.name for p in a.parts if p.name != "spots")
    on = np.unique(a.shells.nodes[a.shells.part == 0])[[40, 90]]
    spots = Spots(("1", "2"), a.ids[on], a.points[on], np.eye(3)[[2, 2]], parts[:1] * 2)
    mass = mass_properties(a)[0]
    return Site(a, spots, a.points[on], spots, mass, 50.0, 400.0, parts, np.eye(3)[0], parts)


def rng() -> np.random.Generator:
    return np.random.default_rng(3)


@pytest.mark.parametrize("name", ["cut-out plate", "half cylinder", "curved blade"])
def test_a_seam_parts_the_sheet_between_its_tips(name):
    """Edges of shells along it are doubled: two free ones for each, and no other is."""
    a = site_of(name).article
    hidden = seam(site_of(name), rng(), 1.0)
    b, added = hidden.article, len(hidden.article.points) - len(a.points)
    assert added >= 3
    assert len(free_edges(b)) - len(free_edges(a)) == 2 * (added + 1)
    assert mass_properties(b)[0] == pytest.approx(mass_properties(a)[0])
    steps = np.linalg.norm(np.diff(b.points[-added:], axis=0), axis=1)
    assert hidden.truth["length_m"] == pytest.approx(steps.mean() * (added + 1), rel=0.35)


def free_edges(a: Assembly) -> set[tuple[int, ...]]:
    """Edges of one shell alone, as sorted pairs of points."""
    n = a.shells.nodes
    sides = np.sort(np.concatenate([n[:, [k, (k + 1) % 4]] for k in range(4)]), axis=1)
    pairs, count = np.unique(sides, axis=0, return_counts=True)
    return set(map(tuple, pairs[count == 1].tolist()))


def test_a_rib_stands_on_the_sheet():
    """Its mass is rho t h L, and it stands across the sheet by its height."""
    site = site_of("half cylinder")
    hidden = rib(site, rng(), 1.0)
    a, h = hidden.article, hidden.truth["height_m"]
    new = a.points[len(site.article.points) :]
    np.testing.assert_allclose(np.hypot(*new[:, 1:].T) - a.points[:5, 1:].max(), h, atol=1e-3)
    L = np.linalg.norm(np.diff(new, axis=0), axis=1).sum()
    added = mass_properties(a)[0] - site.mass
    assert added == pytest.approx(STEEL.rho * float(a.thickness()[-1]) * h * L, rel=0.03)


@pytest.mark.parametrize("name", ["held plate", "cantilever", "curved blade"])
def test_a_soft_clamp_is_one_stiffness_per_length(name):
    """Springs of the soft points sum up to that of their length; the others stay held."""
    site = site_of(name)
    a = (hidden := soft_clamp(site, rng(), 1.0)).article
    soft = a.bushes.nodes[:, 0]
    held = np.unique(site.article.supports[:, 0])
    assert set(soft) | set(a.supports[:, 0]) == set(held)
    assert not set(soft) & set(a.supports[:, 0])
    width = a.bushes.stiffness[:, 3] / hidden.truth["rotation N m/rad per m"]
    of_all = 0.0
    for edge in free_edges(site.article):
        if set(edge) <= set(held):
            of_all += np.linalg.norm(np.diff(a.points[list(edge)], axis=0))
    share = hidden.truth["share of the line"]
    assert width.sum() == pytest.approx(share * of_all, rel=0.1)


def test_a_doubler_and_a_state_of_stress():
    site = site_of("held plate")
    thick = doubler(site, rng(), 1.0)
    ratio = thick.article.thickness() / site.article.thickness()
    assert set(np.round(ratio, 6)) == {1.0, round(thick.truth["thicker"], 6)}
    tight = stretched(site, rng(), 2.0)
    assert isinstance(tight.article, Stretched)
    u, x = tight.article.moved, site.article.points
    strain = np.ptp(u[:, 0]) / np.ptp(x[:, 0])
    t = float(site.article.thickness()[0])
    assert abs(tight.truth["value"]) == pytest.approx(STEEL.E * t / 0.7 * strain)


def test_what_has_no_counterpart_is_refused(square):
    with pytest.raises(ModelError, match="plain isotropic sheet"):
        _shells(square.with_parts((square.parts[0].with_section(bending_ratio=0.5),)), False)
    with pytest.raises(ModelError, match="springs from points to ground"):
        _springs(with_springs(square, [1], np.eye(3)[[2]], 1.0))


def test_without_kratos_nothing_is_made(tmp_path, monkeypatch):
    """The sentence says how to name a Python that has it; no folder is left."""
    monkeypatch.setenv(PYTHON, "/no/python")
    installed.cache_clear()
    with pytest.raises(FileError, match="set CHLADNI_KRATOS to a Python that has both"):
        make(
            [Order("cantilever", "nothing", 503, "kratos")],
            tmp_path / "a",
            "tune",
            "kratos",
            1,
            str,
        )
    installed.cache_clear()
    assert not (tmp_path / "a").exists()


def test_a_report_has_twelve_effects_and_six_nulls():
    """Every seed does, and eight structures have each a null within three."""
    for seed in (500, 600):
        made = orders("kratos", [seed])
        assert sum(o.kind in NULLS for o in made) == 6
        assert {o.kind for o in made} - set(NULLS) == set(HIDDEN_IN)
    nulls = {o.structure for o in orders("kratos", [500, 501, 502]) if o.kind in NULLS}
    assert nulls == set(DECKS)


def test_values_of_stringers_that_the_deck_has_as_bars():
    """Their weight is that of the bars; E of a bar is not that of a sheet of another thickness."""
    deck, article = (forms["stringer plate"].made(500) for forms in (DECKS, ARTICLES))
    known = _calibration_parameters(deck, article)
    bars = mass_properties(deck)[0] - known["part_mass_kg"]["skin"]
    assert known["part_mass_kg"]["stringers"] == pytest.approx(bars, rel=1e-6)
    assert set(known["values"]["E"]) == {"skin"}
    assert set(known["values"]["rho"]) == {"skin", "stringers"}


@kratos
def test_a_case_is_kratos_alone(tmp_path):
    """The largest change of a frequency is 1 to 6 %."""
    made = made_of(Order("cantilever", "point-mass", 503, "kratos"), tmp_path)
    assert made.truth["solver"] == "kratos"
    before = made.truth["frequency_without_hz"]
    n = (before < made.bench.fit[1]).sum()
    moved = np.abs(made.truth["frequency_hz"][:n] / before[:n] - 1).max()
    assert SHIFT[0] * 0.9 < moved < SHIFT[1] * 1.1
