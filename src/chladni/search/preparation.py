"""Preparation of an updating problem from a structure and a recording.

With known gain and places the damping-equalised FRFs are compared.  Natural frequencies are
compared where the gain is unknown *and* places are uncertain, or where no FRF exists.  The held-out
data are chosen here, before anything is fitted.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..effects.channels import channel_gain
from ..effects.effect import Effect
from ..effects.joint_stiffness import joint_nuisances
from ..effects.registry import catalogue
from ..effects.unknown_cords import unknown_cords
from ..ema.identification import equalised, identify
from ..ema.level_modes import AtLevel
from ..ema.level_study import level_study
from ..ema.level_words import level_notes
from ..ema.recording_noise import equalised_noise, sample_noise
from ..ema.recording_screening import strong_modes
from ..ema.response_variance import noise_source
from ..errors import FileError
from ..fem.modelled import Modelled, modelled
from ..inference.complex_modes import mode_coupling
from ..inference.damping_scatter import modal_damping
from ..inference.hypothesis_fit import UpdatingProblem
from ..inference.identifiability import effective_number
from ..inference.least_data import NUMBERS, TAKEN, numbers, too_little
from ..inference.likelihood import Responses, rms_over_lines
from ..inference.map_fit import APART, unknowns
from ..inference.pole_data import Poles
from ..inference.sensor_errors import gauge_errors, sensor_errors
from ..progress import Progress, silent, within
from ..reduced.pole_assignment import SPURIOUS_LISTED, share_spurious
from ..reduced.reduced_model import evaluate
from ..reduced.reduced_problem import ReducedProblem, reduced_problem
from .base_effects import freed_by, mesh_hidden, nuisances, setup_of
from .held_out_data import HeldOutChoice, held_out_sensors, of_poles, upper_part
from .measured_frequencies import (
    band_of,
    frequencies,
    kept,
    listed,
    significant,
    suspended_below,
    suspension_note,
    widened,
)
from .measured_shapes import shape_data
from .other_recordings import levels, measured_spread, others_identified, spread_note
from .question import Prepared, Question
from .silent_dofs import refuse_silent

ZETA = 0.08  # equalised damping for comparing hypotheses: it widens the basins of convergence
ZETA_Q = 0.02  # equalised damping for the reported Q
POSITION_UNCERTAIN = 5e-3  # [m]
SOLVED = 3.0  # times the highest frequency: modes of the deck, for the basis and for its responses
FAR = 6.0  # reach of the basis for poles: material may be several times softer than the deck's


def prepare(
    question: Question, progress: Progress = silent, lines: np.ndarray | None = None,
    fitted: bool = True,
) -> Prepared:  # fmt: skip
    """Identify, decide how to compare, choose the held-out data, build the reduced problem.

    Modes are identified from some ``lines`` (n_f,) bool of the recording, default all. Without a
    fit the error of the mesh is left out: it refuses nothing and takes the most time.
    """
    uncertain = _place_sd(question) > POSITION_UNCERTAIN
    if question.frf is None or uncertain:
        return _by_poles(question, uncertain, progress, fitted)
    return _by_responses(question, progress, lines, fitted)


def _place_sd(question: Question) -> float:
    """Largest standard deviation of the place of a sensor or shaker [m]."""
    return max(float(p.sd.max(initial=0.0)) for p in (question.outputs, question.inputs))


def _by_responses(
    question: Question, progress: Progress, lines_used: np.ndarray | None, fitted: bool
) -> Prepared:
    frf = question.frf
    assert frf is not None
    low, high = band_of(question, frf)
    held_band = question.held_band or upper_part(low, high)
    fit_max = min(high, held_band[0]) if question.held_band is None else high
    reach = (low, max(high, held_band[1]))
    use, f_max = kept(frf.frequency, question.exclude), reach[1]
    use = use if lines_used is None else use & lines_used
    found = identify(frf, widened(frf, reach), use=use, progress=within(progress, 0.0, 0.3))
    if question.held_band is None and not significant(found, low, fit_max).any():
        held_band, fit_max = (high, high), high  # all modes lie in the band that was to be held out
    seen = int(significant(found, low, fit_max).sum())
    if not seen:
        raise FileError(
            f"no mode is above the noise of the recording between {low:g} and {fit_max:g} Hz, so "
            "a model cannot be fitted"
        )
    lines = [equalised_lines(reach, question.exclude, zeta) for zeta in (ZETA, ZETA_Q)]
    if not ((lines[0] >= low) & (lines[0] <= fit_max)).any():
        raise FileError(
            f"[band] exclude leaves no line between {low:g} and {fit_max:g} Hz to compare with the "
            f"model (its lines lie {75 * ZETA:.0f} % apart); exclude less, or widen the band"
        )
    progress("modes of the deck", 0.3)
    nominal = modelled(question.searched(question.assembly), SOLVED * f_max)
    built = nominal.structure
    slow = strong_modes(found).frequency
    above = suspended_below(question, nominal, slow, fit_max)
    asked, question = question, replace(question, exclude=(*question.exclude, (0.0, above)))
    lines, low = [f[f > above] for f in lines], max(low, above)
    refuse_silent(nominal, question.outputs, question.inputs)
    rows_o, rows_i = question.outputs.rows(built), question.inputs.rows(built)
    test = question.outputs, question.inputs, built, question.accuracy
    wrong = sensor_errors(*test)
    progress("the error of its mesh", 0.5)
    mesh = mesh_hidden(nominal, f_max, question.rows) if fitted else []
    progress("the reduced model", 0.8)
    reduced = ready_for_responses(question, nominal, f_max)
    left_out = HeldOutChoice(held_out_sensors(question), held_band, (low, fit_max), reach)
    others, said = others_identified(question, reach, within(progress, 0.8, 1.0))
    data = []
    for zeta, f in zip((ZETA, ZETA_Q), lines, strict=True):
        s, use = 2 * np.pi * f * (zeta + 1j), left_out.training(f)
        H = equalised(found, s)
        noise, spread = sample_noise(found, frf, s), measured_spread(H, others, s)
        read = Responses(
            H, s, rows_o, rows_i, use, found.quantity,
            noise=noise if spread is None else np.maximum(noise, spread), spread=spread,
            level=rms_over_lines(H[use.any(axis=1)]),
            direct=question.outputs.moved_with_base(question.inputs), sensors=wrong,
        )  # fmt: skip
        data.append(read.rebased(reduced.model))
    nuisance = [*nuisances(reduced, nominal, mesh), *gauge_errors(*test)]
    both = np.concatenate([question.outputs.directions, question.inputs.directions])
    nuisance += unknown_cords(built, slow[slow < above], both)
    if not question.gain_known:
        nuisance.append(channel_gain(len(question.outputs.labels), 1.0))
    problem = updating_problem(question, reduced, data[0], nuisance)
    if not isinstance(question.held_sensors, tuple):
        left_out = left_out.without_faults(problem)
        data = [d.only(left_out.training(f)) for d, f in zip(data, lines, strict=True)]
        problem = replace(problem, data=data[0])
    unseen, held = (left_out.samples(d) for d in data)
    firm = int((found.firm & (found.frequency >= low) & (found.frequency <= f_max)).sum())
    notes = [
        f"FRFs were compared: {firm} modes identified between {low:g} and {f_max:g} Hz, "
        f"whitened residual {found.chi:.2f} (1 is the noise)",
        f"model and test were given {100 * ZETA:.0f} % damping for the search and "
        f"{100 * ZETA_Q:.0f} % for Q (damping equalisation): modes need no pairing, and damping "
        "cannot appear as stiffness",
        f"the noise of the recording: {noise_source(frf)}",
    ]
    if question.base is not None:
        notes.append(
            f"the input is the motion of the base ({', '.join(question.inputs.labels)}): "
            "responses are transmissibilities, of unit 1, and the supports of the deck move "
            "together; parts held to ground are held to the base"
        )
    if not question.gain_known:
        notes.append("the gain is unknown: one real factor common to all channels is free")
    what, chosen_on = (left_out.in_words(question.outputs.labels, r) for r in (True, False))
    if unseen.choosing.any():
        notes.append(f"held out to choose a name, and not to report its gain: {chosen_on}")
    notes.append(_sensor_note(question))
    notes += [*_mass_note(question, problem), *suspension_note(above)]
    known, coupling = modal_damping(found, low, fit_max), mode_coupling(found, low, fit_max)
    setup = replace(problem.setup, damping=known)
    problem = replace(problem, damping=known, coupling=coupling, setup=setup)
    own = AtLevel(question.level, frf, found, question.control)
    studied = level_study([own, *levels(others)])
    notes += [*said, *spread_note(data[1], others), *level_notes(studied)]
    floor = equalised_noise(found, frf, data[1].s, kept(frf.frequency, question.exclude))
    if (spread := data[1].spread) is not None:
        floor = np.maximum(floor, spread**2)
    supporting = min(seen, _own_modes(nominal, low, fit_max))  # poles of the rig support no effect
    size = supporting, int(data[0].use.any(axis=0).sum())
    return Prepared(
        asked, problem, data[1], held, unseen, what, tuple(notes), nominal, floor, found,
        *_few(problem, *size), others=tuple(others), levels=studied, above=above,
    )  # fmt: skip


NEAR_BAND = 1.3  # factor on the band within which a mode of the deck may be a measured one


def _own_modes(nominal: Modelled, low: float, high: float) -> int:
    """Number of flexible modes of the deck that may have been measured between two frequencies."""
    f = nominal.modes.frequency
    return int(((f > max(low / NEAR_BAND, 1e-3 * high)) & (f < NEAR_BAND * high)).sum())


def equalised_lines(
    band: tuple[float, float], exclude: Sequence[tuple[float, float]], zeta: float
) -> np.ndarray:
    """Lines three quarters of a half-bandwidth apart, f_{k+1} = f_k (1 + 0.75 ζ), gaps left out."""
    f = band[0] * np.exp(np.arange(0.0, np.log(band[1] / band[0]), 0.75 * zeta))
    return f[kept(f, exclude)]


def _by_poles(question: Question, uncertain: bool, progress: Progress, fitted: bool) -> Prepared:
    frequency, sd, strength, found, notes = frequencies(question, uncertain, progress)
    f_max = float(frequency[-1]) * 1.15
    highest = f_max if question.frf is None else max(f_max, band_of(question, question.frf)[1])
    nominal = modelled(question.searched(question.assembly), max(FAR * f_max, SOLVED * highest))
    above = suspended_below(question, nominal, frequency, float(frequency[-1]))
    frequency, sd, strength = (v[frequency > above] for v in (frequency, sd, strength))
    if question.frf is not None:
        refuse_silent(nominal, question.outputs, question.inputs)
    built, shapes, damping = nominal.structure, None, None
    if question.frf is None:
        at = listed(question, above)
        damping = None if question.damping is None else question.damping[at]
        shapes, said = shape_data(question, at, nominal)
        notes = (*notes, *said)
    seen = None if shapes is None else question.rows
    mesh = mesh_hidden(nominal, f_max, seen) if fitted else []
    reduced = reduced_problem(nominal, f_max, groups=48, reach=FAR)
    reduced = carrying(reduced, freed_by(question, reduced))
    held = np.zeros(len(frequency), bool)
    if question.held_band is not None:
        held = (frequency >= question.held_band[0]) & (frequency <= question.held_band[1])
    elif len(frequency) > 5:
        held[-max(1, len(frequency) // 5) :] = True
    rows_o = question.outputs.around(built) if len(question.outputs.labels) else None
    rows_i = question.driven_around(built) if len(question.inputs.labels) else None
    band = question.band if question.frf is None else band_of(question, question.frf)
    band = max(band[0], above), band[1]
    data = Poles(
        frequency, sd / frequency, ~held, strength, band, outputs=rows_o, inputs=rows_i,
        spurious=SPURIOUS_LISTED if question.frf is None else share_spurious(strength),
        shapes=shapes,
    ).rebased(reduced.model)  # fmt: skip
    nuisance = nuisances(reduced, nominal, mesh, f_max)
    problem = updating_problem(question, reduced, data, nuisance)
    left_out = of_poles(held)
    n = int(left_out.reporting.sum())
    what = f"{n} of {len(held)} frequencies" if n else "nothing"
    if question.others:
        names = ", ".join(f"{other.name} ({other.relation})" for other in question.others)
        notes = (*notes, f"not used, because natural frequencies are compared: {names}")
    notes = (*notes, *_mass_note(question, problem), *suspension_note(above))
    few = _few(problem, len(frequency), 0 if shapes is None else shapes.values.shape[1] - 1)
    return Prepared(
        question, problem, data, left_out, left_out, what, notes, nominal, None, found, *few,
        damping=damping,
    )  # fmt: skip


def _few(problem: UpdatingProblem, modes: int, channels: int) -> tuple[str, float]:
    """Reason why the data support no name as a rule, or "", and numbers that calibration leaves.

    Many numbers need no count of the parameters, which takes the slopes of the whole problem.
    """
    given = numbers(modes, channels)
    countable = isinstance(problem.data, Poles) or given < NUMBERS
    taken = effective_number(problem) if countable else TAKEN
    return too_little(modes, channels, taken), given - taken


def updating_problem(
    question: Question, reduced: ReducedProblem, data: Responses | Poles, nuisance: list[Effect]
) -> UpdatingProblem:
    """The updating problem: calibration parameters, and the nuisances that they do not replace."""
    own = freed_by(question, reduced)
    gone = {name for e in own for name in e.replaces}
    base = [*own, *(e for e in nuisance if e.text not in gone)]
    return UpdatingProblem(
        reduced, data, question.weighed_with_sensors, tuple(base), tuple(nuisance),
        setup_of(question, reduced.f_max), question.outputs.labels,
        families=catalogue(question.effects),
    )  # fmt: skip


def ready_for_responses(question: Question, nominal: Modelled, f_max: float) -> ReducedProblem:
    """The reduced problem over a basis for measured dofs, free parameters and all joints."""
    built = nominal.structure
    reduced = reduced_problem(nominal, f_max, question.rows(built), base=question.base)
    return carrying(reduced, [*freed_by(question, reduced), *joint_nuisances(built)])


def carrying(reduced: ReducedProblem, effects: Sequence[Effect]) -> ReducedProblem:
    """The reduced problem over a basis that also represents these effects."""
    for effect in effects:
        x = np.array([p.mean for p in effect.parameters])
        model = reduced.model_for(effect, x)
        reduced = reduced if model is reduced.model else replace(reduced, model=model)
    return reduced


def _sensor_note(question: Question) -> str:
    """Sentence on the errors of sensors and gauges that the model need not explain."""
    known, sd = question.accuracy, _place_sd(question)
    stated = f", at most {1e3 * sd:.2g} mm where the table of sensors states it" if sd else ""
    return (
        f"sensors and force gauges may be off by {known.gain:.2g} of their gain, "
        f"{np.degrees(known.direction):.2g}° in direction, {1e3 * known.position:.2g} mm in "
        f"place{stated} (standard deviations); above {1e3 * POSITION_UNCERTAIN:g} mm natural "
        "frequencies are compared instead"
    )


NOT_WEIGHED = (
    "no weighed mass was given: E and rho cannot be distinguished, so both stay near the deck's "
    "values"
)
ANOTHER_MASS = "check that the article is the one of the deck, without trim and sensors"


def _mass_note(question: Question, problem: UpdatingProblem) -> list[str]:
    w = question.mass_measurement
    if w is None:
        return [NOT_WEIGHED]
    said = f"the weighed mass, {w.mass:.4g} kg ± {w.sd:.2g} kg, is fitted with the other data"
    off = off_the_scales(problem)
    return [said, f"{off}: {ANOTHER_MASS}"] if off else [said]


def off_the_scales(problem: UpdatingProblem) -> str:
    """Sentence where deck and weighed mass differ by more than both allow; "" elsewhere.

    The deck's mass has the variance Σ (∂m/∂x_k σ_k)² of the calibration parameters.
    """
    weighed = problem.mass_measurement
    if weighed is None:
        return ""
    state = evaluate(problem.reduced.model, problem.base, problem.mean())
    sd = np.array([p.sd for p in unknowns(problem.base)])
    known = float(np.linalg.norm(state.dweight * sd))
    off = weighed.mass - state.weight
    if abs(off) <= APART * np.hypot(known, weighed.sd):
        return ""
    return (
        f"the article weighs {abs(off):.2g} kg {'more' if off > 0 else 'less'} than the deck, "
        f"whose densities and thicknesses allow {APART * known:.2g} kg"
    )
