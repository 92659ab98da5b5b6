"""From a structure and a recording to a search: how the recording is read, and why.

With known gain and places the damping-equalised FRFs are compared; where the gain is unknown *and*
places are uncertain, or where no FRF exists, the natural frequencies.  What is held out is chosen
here, before anything is fitted.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ..effects.discretisation import jitter, mesh_error
from ..effects.effect import Effect
from ..effects.ordinary import PartScale, defaults, gain, ordinary, scatter
from ..effects.surroundings import Setup
from ..ema.identification import equalised, identify
from ..ema.recording_noise import equalised_noise
from ..fem.energy import mass_properties
from ..fem.modelled import Modelled, modelled
from .hypothesis_fit import Search
from .likelihood import LN10, Poles, Responses
from .map_fit import fit
from .question import Prepared, Question
from .reduced_problem import Workbench, workbench
from .test_frequencies import band_of, counted, frequencies, widened

ZETA = 0.08  # of the line on which hypotheses are compared: basins wide enough to walk
ZETA_Q = 0.02  # of the line on which Q is reported
SCATTER_T, SCATTER_E = 0.008, 0.010  # prior sd of smooth scatter within a part
POSITION_UNCERTAIN = 5e-3  # [m]
SOLVED = 3.0  # times the highest frequency: modes of the deck, for the basis and for its responses


def prepare(question: Question) -> Prepared:
    """Identify, decide how to compare, choose what is held out, build the workbench."""
    uncertain = bool(
        max(question.outputs.sd.max(initial=0), question.inputs.sd.max(initial=0))
        > POSITION_UNCERTAIN
    )
    if question.frf is None or uncertain:
        return _by_poles(question, uncertain)
    return _by_responses(question)


def _by_responses(question: Question) -> Prepared:
    frf = question.frf
    assert frf is not None
    low, high = band_of(question, frf)
    held_band = question.held_band or _upper_part(question, low, high)
    fit_top = min(high, held_band[0]) if question.held_band is None else high
    reach = (low, max(high, held_band[1]))
    found = identify(frf, widened(frf, reach), use=counted(frf, question.exclude))
    top = reach[1]
    nominal = modelled(question.assembly, SOLVED * top)
    built = nominal.structure
    rows_o, rows_i = question.outputs.rows(built), question.inputs.rows(built)
    bench = workbench(nominal, top, sp.csr_array(sp.vstack([rows_o, rows_i])))
    lines = [_lines(reach, question.exclude, zeta) for zeta in (ZETA, ZETA_Q)]
    held_sensors = _held_sensors(question)
    data = []
    for zeta, f in zip((ZETA, ZETA_Q), lines, strict=True):
        s = 2 * np.pi * f * (zeta + 1j)
        use = _training(f, low, fit_top, held_sensors)
        data.append(
            Responses(equalised(found, s), s, rows_o, rows_i, use, found.quantity).over(bench.model)
        )
    nuisance = nuisances(bench, nominal, top)
    if not question.gain_known:
        nuisance.append(gain(len(question.outputs.labels), 1.0))
    search = searched(question, bench, data[0], nuisance, top)
    swapped = (
        held_sensors if isinstance(question.held_sensors, tuple) else _swapped(search, held_sensors)
    )
    if not np.array_equal(swapped, held_sensors):
        held_sensors = swapped
        data = [
            d.only(_training(f, low, fit_top, swapped)) for d, f in zip(data, lines, strict=True)
        ]
        search = replace(search, data=data[0])
    f = lines[1]
    outside = (f >= held_band[0]) & (f <= held_band[1])
    held = outside[:, None] | (held_sensors[None, :] & ((f >= low) & (f <= reach[1]))[:, None])
    names = [n for n, h in zip(question.outputs.labels, held_sensors, strict=True) if h]
    what = (
        f"{len(names)} sensors ({', '.join(names[:8])}), band {held_band[0]:g}-{held_band[1]:g} Hz"
    )
    notes = [
        f"FRFs were compared: {found.order} modes identified between {found.band[0]:g} and "
        f"{found.band[1]:g} Hz, whitened residual {found.chi:.2f} (1 is the noise)",
        f"both sides were given {ZETA:.0%} damping to search and {ZETA_Q:.0%} to report Q "
        "(damping equalisation): no modes need pairing and damping cannot pose as stiffness",
    ]
    if not question.gain_known:
        notes.append("the gain is unknown: one real factor common to all channels is free")
    notes += _mass_note(question)
    noise = equalised_noise(found, frf, data[1].s, counted(frf, question.exclude))
    return Prepared(search, data[1], held & ~data[1].use, what, tuple(notes), nominal, noise, found)


def _upper_part(question: Question, low: float, high: float) -> tuple[float, float]:
    """The uppermost fifth of the band, held out where the user names none."""
    return high - 0.2 * (high - low), high


def _lines(
    band: tuple[float, float], exclude: Sequence[tuple[float, float]], zeta: float
) -> np.ndarray:
    """Lines three quarters of a half-bandwidth apart, f_{k+1} = f_k (1 + 0.75 ζ), gaps left out."""
    f = np.exp(np.arange(np.log(band[0]), np.log(band[1]), 0.75 * zeta))
    for a, b in exclude:
        f = f[(f < a) | (f > b)]
    return f


def _held_sensors(question: Question) -> np.ndarray:
    """Which outputs are held out: the named ones, or a fixed spread of a fifth of them."""
    labels = question.outputs.labels
    wanted = question.held_sensors
    if isinstance(wanted, tuple):
        return np.array([label in wanted for label in labels])
    driven = np.array([g in set(question.inputs.grids.tolist()) for g in question.outputs.grids])
    count = min(len(labels) // 5 if wanted is None else wanted, max(len(labels) - 2, 0))
    order = np.random.default_rng(20250101).permutation(len(labels))
    chosen = [k for k in order if not driven[k]][:count]
    return np.isin(np.arange(len(labels)), chosen)


def _training(f: np.ndarray, low: float, high: float, held: np.ndarray) -> np.ndarray:
    """Lines and channels that are fitted (n_f, n_out)."""
    return np.asarray(np.outer((f >= low) & (f <= high), ~held))


def _swapped(search: Search, held: np.ndarray) -> np.ndarray:
    """Held-out sensors, but for those whose level stands out: a fault must be fitted to be found.

    Only the choice of what is held out looks at them, by the median level against a model with
    ordinary parameters alone.
    """
    data = search.data
    assert isinstance(data, Responses)
    rough = fit(search.bench.model, search.base, data, search.weighing, search.mean(), max_steps=8)
    lines = data.use.any(axis=1)
    delta = data.deviation(rough.state)[lines].reshape(lines.sum(), len(held), -1)
    level = np.median(delta.real, axis=(0, 2))
    turned = np.median(np.abs(delta.imag), axis=(0, 2)) > np.pi / 2 / LN10
    spread = max(0.02, 1.5 * float(np.median(np.abs(level - np.median(level)))))
    odd = (np.abs(level - np.median(level)) > 4 * spread) | turned
    if not np.any(odd & held):
        return held
    calm = np.flatnonzero(~odd & ~held)[: int((odd & held).sum())]
    out = held & ~odd
    out[calm] = True
    return out


def _by_poles(question: Question, uncertain: bool) -> Prepared:
    frequency, sd, strength, found, notes = frequencies(question, uncertain)
    top = float(frequency[-1]) * 1.15
    highest = top if question.frf is None else max(top, band_of(question, question.frf)[1])
    nominal = modelled(question.assembly, SOLVED * highest)
    built = nominal.structure
    bench = workbench(nominal, top, groups=48)
    held = np.zeros(len(frequency), bool)
    if question.held_band is not None:
        held = (frequency >= question.held_band[0]) & (frequency <= question.held_band[1])
    elif len(frequency) > 5:
        held[-max(1, len(frequency) // 5) :] = True
    rows_o = question.outputs.around(built) if len(question.outputs.labels) else None
    rows_i = question.inputs.around(built) if len(question.inputs.labels) else None
    band = question.band if question.frf is None else band_of(question, question.frf)
    data = Poles(
        frequency, sd / frequency, ~held, strength, band, outputs=rows_o, inputs=rows_i
    ).over(bench.model)
    nuisance = nuisances(bench, nominal, top)
    search = searched(question, bench, data, nuisance, top)
    what = f"the {int(held.sum())} highest of {len(held)} frequencies"
    notes = (*notes, *_mass_note(question))
    return Prepared(search, data, held, what, notes, nominal, None, found, ~held)


def nuisances(bench: Workbench, model: Modelled, top: float) -> list[Effect]:
    """Scatter within parts, mesh error, jitter: what calibration cannot remove."""
    out: list[Effect] = [
        scatter(bench.groups, "t", SCATTER_T), scatter(bench.groups, "E", SCATTER_E)
    ]  # fmt: skip
    if (mesh := mesh_error(model, top)) is not None:
        out.append(mesh)
    return [*out, jitter(model, top, mesh)]


def searched(
    question: Question,
    bench: Workbench,
    data: Responses | Poles,
    nuisance: list[Effect],
    top: float,
) -> Search:
    """What a diagnosis works with: ordinary parameters and nuisances free, the test known."""
    base = [*_ordinary(question, bench), *nuisance]
    weight = mass_properties(question.assembly)[0]
    sensors = tuple(int(g) for g in question.outputs.grids if g > 0)
    setup = Setup(sensors, question.hangers, weight, top)
    return Search(
        bench, data, question.weighing, tuple(base), tuple(nuisance), setup, question.outputs.labels
    )


def _ordinary(question: Question, bench: Workbench) -> list[PartScale]:
    """The parameters the user frees, or E and rho of every material and t of every part."""
    chosen = [
        ordinary(bench.groups, name, [question.assembly.part(p) for p in parts])
        for name, parts in question.parameters
        if name in ("E", "rho", "t")
    ]
    return chosen or defaults(bench.groups)


def _mass_note(question: Question) -> list[str]:
    if question.weighing is None:
        return [
            "no weighed mass was given: E and rho cannot be told apart, both stay near the deck"
        ]
    w = question.weighing
    return [f"the weighed mass, {w.mass:.4g} kg +- {w.sd:.2g} kg, is a datum like any other"]
