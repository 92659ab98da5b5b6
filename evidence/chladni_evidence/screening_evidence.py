"""Recordings without a fault, of articles on other meshes, to test the screening.

Noise is 0.5 to 3 % of every line, damping 0.2 to 3 %. Each structure has another article of another
mesh, and the model is the deck as given. Seeds below 600 tune, seeds from 600 on report.
"""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from chladni.dynamics.frf import FRF
from chladni.ema.finding import Screening
from chladni.ema.identification import identify
from chladni.ema.recording_screening import screened
from chladni.ema.screening_lines import screening_lines
from chladni.ema.setup import Recording
from chladni.fem.measured_dofs import MeasuredDofs
from chladni.fem.modelled import Modelled, modelled
from chladni.inference.channel_screening import against_model
from chladni.inference.smoothed_responses import Reading
from chladni_bench import MeasurementChain, recorded, scattered_parts
from chladni_planning import even_lines

from .article_modes import ArticleModes, article_modes
from .bench_of_structure import Bench, form_bench, glue_candidates, panel_bench
from .mesh_transfer import MeshTransfer, Spots, mesh_transfer
from .response_of_article import accelerance, seen

STRUCTURES = ("plate", "panel", "ribbed plate", "curved shell", "lidded box", "bonded plates")
DAMPING, NOISE = (0.002, 0.03), (0.005, 0.03)
PER_HALF_BANDWIDTH = 2.0
TIMES = 20  # lines of a long recording over those of a usual one


@dataclass(frozen=True, eq=False)
class Sound:
    """A recording without a fault, its article, and the model it is screened against."""

    bench: Bench
    frf: FRF
    clean: np.ndarray
    chain: MeasurementChain
    modes: ArticleModes
    phi_in: np.ndarray
    zeta: np.ndarray
    foot: MeshTransfer
    model: Modelled
    outputs: Spots
    elsewhere: np.ndarray  # (k, r) shapes at other places, along the direction of the sheet
    places: np.ndarray  # (k, 3) [m], of these

    def foot_of(self, i: int) -> MeshTransfer:
        """Footing of one output."""
        return MeshTransfer(self.foot.rows[[i]], self.foot.weights[[i]])

    def measured(self, values: np.ndarray, rng: np.random.Generator) -> FRF:
        """Noiseless accelerances as the front end records them, with noise."""
        f = self.frf
        return recorded(values, f.frequency, self.chain, rng, f.outputs, f.inputs)

    def accelerance(self, phi_out: np.ndarray) -> np.ndarray:
        """Accelerance of the article at places of other shapes (k, r)."""
        return accelerance(self.modes, phi_out, self.phi_in, self.zeta, self.frf.frequency)


def sound(structure: str, seed: int, long: bool = False) -> Sound:
    """A recording of this seed, ``long`` of ``TIMES`` the lines."""
    bench, model, article = _article(structure, seed)
    rng = np.random.default_rng([seed, 11, *structure.encode()])
    zeta0, noise = (np.exp(rng.uniform(*np.log(span))) for span in (DAMPING, NOISE))
    zeta = zeta0 * np.exp(0.3 * rng.normal(size=2000))
    low, high = 0.7 * bench.first, bench.held[1]
    lines = even_lines(low, high, max(zeta0, 0.004), PER_HALF_BANDWIDTH * (TIMES if long else 1))
    spots = bench.outputs
    if rng.integers(2):  # the drive point is measured, too
        spots = _joined(bench.outputs, bench.drive)
    out, drive = mesh_transfer(article, spots), mesh_transfer(article, bench.drive)
    free = _places(bench, spots, rng)
    other = mesh_transfer(article, free)
    rows = np.concatenate([out.rows.ravel(), other.rows.ravel()])
    modes = article_modes(article, rows, drive.rows.ravel(), float(lines[-1]))
    phi_o, phi_i = seen(modes, out, spots.directions), seen(modes, drive, bench.drive.directions)
    zeta = zeta[np.minimum(np.arange(phi_o.shape[1]), len(zeta) - 1)]
    H = accelerance(modes, phi_o, phi_i, zeta, lines)
    chain = MeasurementChain(float(noise), 0.001)
    frf = recorded(H, lines, chain, rng, spots.labels, bench.drive.labels)
    if rng.integers(2):  # half of the recordings bring no variance
        frf = replace(frf, variance=None)
    others = seen(modes, other, free.directions)
    return Sound(bench, frf, H, chain, modes, phi_i, zeta, out, model, spots, others, free.points)


def _places(bench: Bench, spots: Spots, rng: np.random.Generator) -> Spots:
    """Thirty places where a sensor can be glued but none is."""
    every = glue_candidates(bench.deck)
    unused = np.flatnonzero(~np.isin(every.grids, spots.grids))
    return every.only(rng.choice(unused, min(30, len(unused)), replace=False))


@cache
def _article(structure: str, seed: int):  # type: ignore[no-untyped-def]
    bench = (
        panel_bench(structure, seed)
        if structure in ("plate", "panel")
        else form_bench(structure, seed)
    )
    mesh = "calculix" if structure in ("plate", "panel") else "fine"
    article, _ = scattered_parts(bench.meshes[mesh](), np.random.default_rng([seed, 5]))
    return bench, modelled(bench.deck, 1.4 * bench.held[1]), article


def _joined(a: Spots, b: Spots) -> Spots:
    if b.labels[0] in a.labels:
        return a
    return Spots(
        (*a.labels, *b.labels),
        np.append(a.grids, b.grids),
        np.concatenate([a.points, b.points]),
        np.concatenate([a.directions, b.directions]),
        (*a.parts, *b.parts),
    )


def measured_at(spots: Spots) -> MeasuredDofs:
    """Measured dofs of places, as a case resolves them."""
    n = len(spots)
    return MeasuredDofs(
        spots.labels, spots.grids, spots.points, spots.directions, np.zeros(n), np.zeros(n)
    )


def screening_of(made: Sound, frf: FRF) -> Screening:
    """Screening of a recording with the model, as in ``chladni check``."""
    use = screening_lines(frf)
    found = identify(frf, use=use)
    outputs, inputs = measured_at(made.outputs), measured_at(made.bench.drive)
    places = dict(zip(outputs.labels, outputs.points, strict=True))
    alone = screened(Recording("recording", frf), found, (), places, use)
    return against_model(alone, Reading(frf, use, made.model, outputs, inputs), found)
