"""Compare test and model without calibration: paired modes, MAC, COMAC, Q."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self, Unpack

import numpy as np

from ..arguments import checked
from ..case import Case
from ..case.make_case import CaseWords, Measured
from ..dynamics.frf import FRF
from ..dynamics.modes import ModalModel, rigid_modes
from ..ema.correlation import Quality, comac, mac, quality
from ..ema.finding import Screening
from ..ema.identification import Identified
from ..ema.identification import identify as identified
from ..ema.mac_significance import CLOSE, Likeness, likeness
from ..ema.mode_pairing import LEAST_CHANNELS, ModePairs, pair
from ..ema.shapes import driven_shapes, mixture, real_shapes, shape_covariance, turned
from ..errors import ChladniError, FileError
from ..fem.modelled import Modelled, modelled
from ..inference.channel_screening import shapes_against_model
from ..inference.pole_data import ABOVE, partners
from ..parallel import one_blas_thread
from ..progress import Progress, silent
from ..results import Result
from ..search.preparation import ZETA_Q, equalised_lines
from ..search.silent_dofs import refuse_silent
from ..search.written_scores import equalised_deviation
from ..view.paired_shapes import PairedShapes
from .axes_check import refuse_turned_axes
from .case_model import DAMPING, REACH, model_frf
from .given_case import Source, given_case
from .output_only import with_natural_frequencies
from .question_of_case import nothing_measured, question_of
from .screening_of_case import screened_by_model
from .sign_of_gain import with_sign_of_gain
from .silent_channels import without_silent
from .unit_check import refuse_other_units

BANDS = 6
NEAR = 1.3  # times the highest line: as far as the partner of an identified mode is looked for
LONG = 100_000  # values of a recording: 210 000 took 190 s on a busy machine
RIGID = 1e-3  # of the highest frequency of the test: modes below are rigid motions


@dataclass(frozen=True, eq=False, repr=False)
class Correlation(Result):
    """Comparison of test and model: paired modes with shapes at the sensors, and Q.

    Attributes
    ----------
    channels, sensors : names of the columns of Q and of COMAC
    test : the identified modes; None if only poles were given
    f_test, f_model : (r_test,), (r_model,) [Hz]
    mac : (r_model, r_test) or None
    pairs : ModePairs
    comac : (n_out,) or None
    quality : Q by channel and band, or None
    model : responses of the model on the lines of the recording, or None
    screening : faults of the recording, found alone and by comparison with the model
    numbers : of the model's modes, the rigid ones counted, as in ``f_model``
    shapes : of the pairs at the sensors, with the model's whole motion; None of frequencies alone
    likeness : significance of the MAC of each pair; empty without a MAC
    cross_orthogonality : (r_model, r_test) or None
        ΦᵀMΨ with the model's mass on the sensors and shapes of unit modal mass (SEREP)
    expanded : (n_points, 3, r_test) or None
        the test's shapes on the whole model, of largest entry 1, basic frame (SEREP)
    """

    channels: tuple[str, ...]
    sensors: tuple[str, ...]
    test: Identified | None
    f_test: np.ndarray
    f_model: np.ndarray
    mac: np.ndarray | None
    pairs: ModePairs
    comac: np.ndarray | None = None
    quality: Quality | None = None
    model: FRF | None = None
    notes: tuple[str, ...] = ()
    screening: Screening | None = None
    numbers: tuple[int, ...] = ()
    shapes: PairedShapes | None = None
    likeness: tuple[Likeness, ...] = ()
    cross_orthogonality: np.ndarray | None = None
    expanded: np.ndarray | None = None


@checked
def correlate(
    source: Source,
    recording: Measured | Sequence[Measured] = (),
    *,
    progress: Progress = silent,
    **words: Unpack[CaseWords],
) -> Correlation:
    """Identify the first recording, pair its modes with the model's, score the responses.

    Parameters
    ----------
    source, recording, progress, words : as in :func:`chladni.diagnose` (SI, Hz)

    Raises
    ------
    FileError
        If the deck's unit system cannot be right, or there is no recording to compare with.
    """
    case = without_silent(given_case(source, recording, words))
    refuse_other_units(case)
    with one_blas_thread():
        found = _correlated(with_natural_frequencies(case), progress)
    return replace(found, origin=case)


def _correlated(case: Case, progress: Progress) -> Correlation:
    test = case.frfs[0] if case.frfs else None
    f_max = _f_max(case, test)
    progress("modes of the model", 0.1)
    model = modelled(case.tested(case.assembly), REACH * f_max)
    case = with_sign_of_gain(case, model)
    test = case.frfs[0] if case.frfs else None
    inside = _elastic(model.modes, f_max, NEAR if test else ABOVE)
    near = model.modes.sel(inside)
    numbers = tuple((inside + 1).tolist())
    if test is None:
        by_shapes = bool(case.recordings) and case.recordings[0].modal is not None
        made = _by_shapes(case, model, near, numbers) if by_shapes else _by_poles(case, near)
        return replace(made, numbers=numbers)
    refuse_silent(model, case.outputs, case.inputs)
    use = case.lines(test.frequency)
    progress(_identifying(len(test.outputs) * len(test.inputs), int(use.sum())), 0.4)
    found = identified(test, case.band, use=use)
    screening = screened_by_model(case, found, model, use)
    q, notes = _quality(case, model, found, _band(case, test))
    found = found.sel(found.firm & found.inside)
    refuse_turned_axes(case, found, model)
    phi, psi = case.outputs.rows(model.structure) @ near.shapes, driven_shapes(found)
    alike = _Alike.of(phi, psi, near.frequency, found.frequency)
    pairs = alike.pairs
    progress("responses", 0.6)
    responses, _ = on_lines_in_use(case, model, test)
    return Correlation(
        tuple(f"{o} from {i}" for o in case.outputs.labels for i in case.inputs.labels),
        case.outputs.labels, found, found.frequency, near.frequency, alike.mac, pairs, alike.comac,
        q, responses, (*screening.notes, *case.said("correlate"), *notes), screening, numbers,
        _paired_shapes(case, model, near, (phi, psi), pairs, found.frequency, numbers),
        () if alike.mac is None or not len(pairs) else _likeness(
            real_shapes(found), shape_covariance(found), phi, near.frequency, pairs),
        *_on_the_model(model, near, phi, psi, f_max),
    )  # fmt: skip


def _elastic(modes: ModalModel, f_max: float, above: float) -> np.ndarray:
    """Positions of the elastic modes up to ``above`` times the highest frequency of the test."""
    f = modes.frequency
    return np.flatnonzero(~rigid_modes(modes) & (f > RIGID * f_max) & (f <= above * f_max))


def on_whole_mesh(
    case: Case, outputs: Sequence[str], psi: np.ndarray, f_max: float
) -> np.ndarray | None:
    """Shapes at some outputs (n, r) on the whole model of a case (n_points, 3, r), basic frame.

    None where the outputs cannot tell the model's modes up to ``f_max`` [Hz] apart.
    """
    model = modelled(case.tested(case.assembly), NEAR * f_max)
    near = model.modes.sel(_elastic(model.modes, f_max, NEAR))
    rows = case.outputs.rows(model.structure) @ near.shapes
    phi = rows[[case.outputs.labels.index(label) for label in outputs]]
    return _on_the_model(model, near, phi, psi, f_max)[1]


@dataclass(frozen=True, eq=False)
class _Alike:
    """Modes of model and test at the sensors: MAC (m, r) or None, pairs, CoMAC or None."""

    mac: np.ndarray | None
    pairs: ModePairs
    comac: np.ndarray | None

    @classmethod
    def of(cls, phi: np.ndarray, psi: np.ndarray, f_model: np.ndarray, f_test: np.ndarray) -> Self:
        """Pair modes; by shape where there are channels enough."""
        M = mac(phi, psi) if len(phi) >= LEAST_CHANNELS else None
        pairs = pair(f_model, f_test, M)
        by_dof = None
        if M is not None and len(pairs):
            by_dof = comac(phi[:, pairs.model], psi[:, pairs.test])
        return cls(M, pairs, by_dof)


def _by_shapes(
    case: Case, model: Modelled, near: ModalModel, numbers: tuple[int, ...]
) -> Correlation:
    """Compare a modal model: frequencies and shapes."""
    modal = case.recordings[0].modal
    assert modal is not None
    used = case.lines(modal.frequency)
    if not used.any():
        raise FileError(f"{case.path}: none of the {len(used)} modes lies in the band")
    modal = modal.sel(np.flatnonzero(used))
    phi, psi = case.outputs.rows(model.structure) @ near.shapes, modal.values
    alike = _Alike.of(phi, psi, near.frequency, modal.frequency)
    likely: tuple[Likeness, ...] = ()
    real, name = turned(psi.T).T.real, case.recordings[0].name
    screening = shapes_against_model(name, real, modal.frequency, model, case.outputs)
    if alike.mac is not None and len(alike.pairs):
        norm = np.maximum(np.linalg.norm(real, axis=0), 1e-300)
        sd = np.zeros(psi.shape) if modal.sd is None else np.nan_to_num(modal.sd / norm)
        covariance = sd.T[:, :, None] ** 2 * np.eye(len(psi))
        likely = _likeness(real / norm, covariance, phi, near.frequency, alike.pairs)
        if modal.sd is None:
            likely = tuple(replace(one, noise_leaves=float("nan")) for one in likely)
    across, whole = _on_the_model(model, near, phi, psi, float(modal.frequency.max()))
    return Correlation(
        (), case.outputs.labels, None, modal.frequency, near.frequency, alike.mac, alike.pairs,
        alike.comac, screening=screening, likeness=likely,
        notes=(*screening.notes, *case.said("correlate")),
        shapes=_paired_shapes(
            case, model, near, (phi, psi), alike.pairs, modal.frequency, numbers
        ),
        cross_orthogonality=across, expanded=whole,
    )  # fmt: skip


def _on_the_model(
    model: Modelled, near: ModalModel, phi: np.ndarray, psi: np.ndarray, f_max: float
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Cross-orthogonality (m, r), and the test's shapes on the whole model (n_points, 3, r).

    Both follow from the best mixture q of the model's modes up to ``f_max``. The model's mass on
    the sensors is Φ_s⁺ᵀ Φ_s⁺ (SEREP; O'Callahan, Avitabile and Riemer 1989, IMAC VII, 29-37).
    None where the sensors cannot tell these modes apart.
    """
    modes = np.flatnonzero(near.frequency <= NEAR * f_max)
    best = mixture(phi[:, modes], psi)
    if best is None:
        return None, None
    q = np.zeros((phi.shape[1], psi.shape[1]), psi.dtype)
    q[modes] = best
    q = turned(q.T).T.real if np.iscomplexobj(q) else q
    q /= np.maximum(np.linalg.norm(q, axis=0), 1e-300)
    s = model.structure
    whole = np.asarray(s.T @ (near.shapes @ q)).reshape(len(s.assembly.points), 6, -1)[:, :3]
    return q, whole / np.maximum(np.abs(whole).max(axis=(0, 1)), 1e-300)


def _identifying(channels: int, lines: int) -> str:
    """Return the progress message, with the duration if it is long.

    >>> _identifying(6, 900)
    'modes of the test, 6 channels of 900 lines'
    >>> _identifying(30, 6988)
    'modes of the test, 30 channels of 6988 lines, which takes a minute or more'
    """
    more = ", which takes a minute or more" if channels * lines > LONG else ""
    return f"modes of the test, {channels} channels of {lines} lines{more}"


def _likeness(
    psi: np.ndarray, covariance: np.ndarray, phi: np.ndarray, f_model: np.ndarray, pairs: ModePairs
) -> tuple[Likeness, ...]:
    """Rate the MAC of every pair, with test shapes (n, r) real and of unit norm."""
    near = [np.flatnonzero(np.abs(f_model / f_model[i] - 1) < CLOSE) for i in pairs.model]
    found_of = zip(pairs.model, pairs.test, pairs.mac, near, strict=True)
    return tuple(
        replace(likeness(phi, psi[:, j], covariance[j], int(i), close), mac=float(value))
        for i, j, value, close in found_of
    )


def _paired_shapes(
    case: Case, model: Modelled, near: ModalModel, at_sensors: tuple[np.ndarray, np.ndarray],
    pairs: ModePairs, f_test: np.ndarray, numbers: tuple[int, ...],
) -> PairedShapes:  # fmt: skip
    """Return model shapes of largest entry 1; test shapes made real, scaled to their partners."""
    phi, psi = at_sensors
    scale = np.maximum(np.abs(phi).max(axis=0, initial=0.0), 1e-300)
    phi, power = phi / scale, np.maximum((np.abs(psi) ** 2).sum(axis=0), 1e-300)
    factor = np.exp(-0.5j * np.angle((psi**2).sum(axis=0))) / np.sqrt(power)
    paired = psi[:, pairs.test]
    factor[pairs.test] = (paired.conj() * phi[:, pairs.model]).sum(axis=0) / power[pairs.test]
    s = model.structure
    motion = (s.T @ (near.shapes / scale)).reshape(len(s.assembly.points), 6, -1)[:, :3]
    middle, base = s.assembly.points.mean(axis=0), case.outputs.base[:, None]
    place = np.where(base, middle, case.outputs.points)
    return PairedShapes(
        place, case.outputs.directions, (psi * factor).real, phi, np.asarray(motion), f_test,
        near.frequency, numbers, list(zip(pairs.test.tolist(), pairs.model.tolist(), strict=True)),
        pairs.mac,
    )  # fmt: skip


def _f_max(case: Case, test: FRF | None) -> float:
    """Return the highest frequency of the test [Hz]."""
    if case.band is not None:
        return case.band[1]
    if test is not None:
        return float(test.frequency[-1])
    poles = [float(r.poles.frequency.max()) for r in case.recordings if r.poles is not None]
    if not poles:
        raise nothing_measured(case)
    return max(poles)


def _by_poles(case: Case, near: ModalModel) -> Correlation:
    tables = [r.poles for r in case.recordings if r.poles is not None]
    if not tables:
        raise nothing_measured(case)
    poles = tables[0]
    f = poles.of(poles.states[0]).frequency
    by_test = np.argsort(f, kind="stable")
    at = partners(f[by_test], near.frequency, case.band or (0.0, np.inf))
    pairs = pairs_of(at, by_test, len(near))
    return Correlation((), (), None, f, near.frequency, None, pairs,
                       notes=tuple(case.said("correlate")))  # fmt: skip


def pairs_of(at: np.ndarray, by_test: np.ndarray, modes: int) -> ModePairs:
    """Return pairs from the partner of each mode of the test, -1 where it has none."""
    known = at >= 0
    model, test = at[known], by_test[known]
    return ModePairs(
        model, test, np.full(len(model), np.nan),
        np.setdiff1d(np.arange(modes), model), np.setdiff1d(by_test, test),
    )  # fmt: skip


def on_lines_in_use(case: Case, model: Modelled, test: FRF) -> tuple[FRF, FRF]:
    """Return responses of the model with its own damping, and the test, on the lines in use."""
    low, high = _band(case, test)
    seen = test.sel(band=(max(low, 1e-9), high))
    return model_frf(case, model, case.damping or DAMPING, seen), seen


def _band(case: Case, test: FRF) -> tuple[float, float]:
    """Return the first and the last line in use [Hz]."""
    use = case.lines(test.frequency) if case.band or case.exclude else test.frequency > 0
    low, high = test.frequency[use][[0, -1]].tolist()
    return low, high


def _quality(
    case: Case, model: Modelled, found: Identified, band: tuple[float, float]
) -> tuple[Quality | None, tuple[str, ...]]:
    """Return Q as a diagnosis has it, by channel and band, and notes."""
    ends = np.linspace(*band, BANDS + 1)
    bands = tuple(zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True))
    try:
        f = equalised_lines(band, case.exclude, ZETA_Q)
        s = 2 * np.pi * f * (ZETA_Q + 1j)
        delta = equalised_deviation(question_of(case), found, model, s)
    except ChladniError as error:
        return None, (f"Q could not be calculated: {error}.",)
    note = (
        f"Q compares responses with {100 * ZETA_Q:.0f} % damping on both sides, as in a diagnosis. "
        "Here it is of all channels; a diagnosis has it of fitted and of held-out data."
    )
    if case.gain_known:
        return quality(delta, f, bands), (note,)
    more = "The gain is unknown, so Q was calculated after one common factor was removed."
    return quality(delta, f, bands), (note, more)
