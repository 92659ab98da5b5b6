"""One sample of a study: a pure function of the values of its parameters."""

import time
from dataclasses import dataclass, field

import numpy as np

from chladni.case import Case
from chladni.dynamics.frf import FRF
from chladni.dynamics.modes import ModalModel
from chladni.ema.correlation import deviation, quality
from chladni.errors import ChladniError
from chladni.fem.energy import mass_properties
from chladni.fem.modelled import Modelled
from chladni.model.assembly import Assembly
from chladni.parallel import one_blas_thread
from chladni.workflows.correlate import on_lines_in_use
from chladni.workflows.frf import superposed
from chladni.workflows.loaded_model import Model

from .followed_modes import FollowedModes
from .study_settings import StudySettings
from .variation import Variation

FAULTS = (  # errors of a sample with impossible values; the other samples continue
    *(ChladniError, ArithmeticError, ValueError, LookupError),
    *(np.linalg.LinAlgError, MemoryError, RuntimeError),
)


@dataclass(frozen=True, eq=False)
class StudyModel:
    """All that a sample needs in addition to its values; every worker receives it once."""

    model: Model  # as the deck has it
    case: Case | None  # every sample is scored against its recording, or None
    varied: tuple[Variation, ...]
    settings: StudySettings
    modes: FollowedModes  # of the nominal model
    reach: float = 0.0  # modes are solved up to this frequency for responses [Hz]; 0: by count

    def assembly(self, values: np.ndarray) -> Assembly:
        """The structure with these values (d,)."""
        made = self.model.assembly
        for variation, value in zip(self.varied, values, strict=True):
            made = variation.applied(made, float(value))
        return made

    @property
    def test(self) -> FRF | None:
        """The recording every sample is scored against."""
        return self.case.frfs[0] if self.case is not None and self.case.frfs else None


@dataclass(frozen=True, eq=False)
class SampleResult:
    """Result of a sample: numbers by the names of their columns, or the reason for failure."""

    number: int
    columns: dict[str, float] = field(default_factory=dict)
    why: str = ""
    seconds: float = 0.0
    frf: FRF | None = None  # where whole responses are kept


def computed(study: StudyModel, number: int, values: np.ndarray) -> SampleResult:
    """The sample with these values (d,), on one BLAS thread; an error becomes its ``why``."""
    begun = time.perf_counter()
    try:
        with one_blas_thread(), np.errstate(all="ignore"):
            columns, frf = _computed(study, values)
    except FAULTS as error:
        why = " ".join(str(error).split()) or type(error).__name__
        return SampleResult(number, {}, why, time.perf_counter() - begun)
    kept = frf if study.settings.keep_frf else None
    return SampleResult(number, columns, "", time.perf_counter() - begun, kept)


def _computed(study: StudyModel, values: np.ndarray) -> tuple[dict[str, float], FRF | None]:
    assembly = study.assembly(values)
    tested = study.case.tested(assembly) if study.case is not None else assembly
    model = Model(study.model.source, tested, study.model.unit, (), study.model.length)
    made = solved(model, study.modes.solved, study.reach)
    f, mac = study.modes.found_in(made.modes)
    columns = {f"f{k + 1}_hz": float(value) for k, value in enumerate(f)}
    columns |= {f"mac{k + 1}": float(value) for k, value in enumerate(mac)}
    columns["mass_kg" if model.unit else "mass"] = float(mass_properties(assembly)[0])
    frf = None
    if study.case is not None and study.test is not None:
        frf, test = on_lines_in_use(study.case, made, study.test)
        columns["Q"] = _deviation(study.case, frf, test)
    if study.settings.inputs:
        frf = wished(study.settings, model, made)
    return columns | (summary(frf) if frf is not None else {}), frf


def _deviation(case: Case, responses: FRF, test: FRF) -> float:
    """Q over the lines in use, with the damping of the sample; nan where it has no logarithm."""
    try:
        delta = deviation(responses, test)
    except ChladniError:
        return np.nan
    if not case.gain_known:
        delta = delta - np.median(delta.real)
    weight = case.lines(test.frequency)[:, None, None].astype(float)
    return quality(delta, test.frequency, weight=weight).Q


def solved(model: Model, count: int, reach: float) -> Modelled:
    """The lowest modes of a model: up to ``reach`` [Hz], or ``count`` modes where that is 0."""
    if reach:
        return model.solved(reach)
    modal: ModalModel = model.normal_modes(count)
    return Modelled(model.structure, modal, float(modal.frequency[-1]))


def wished(settings: StudySettings, model: Model, made: Modelled) -> FRF:
    """The responses that the settings request."""
    f = np.linspace(*settings.band, settings.lines)
    found = superposed(model, made, settings.outputs, settings.inputs, f, settings.damping)
    return found if found.quantity == "transmissibility" else found.to(settings.quantity)


def summary(frf: FRF) -> dict[str, float]:
    """Root mean square over the lines, highest value and its frequency, of every channel."""
    size, out = np.abs(frf.values), {}
    for a, output in enumerate(frf.outputs):
        for b, input in enumerate(frf.inputs):
            one, name = size[:, a, b], f"{output} from {input}"
            top = int(one.argmax())
            out[f"rms {name}"] = float(np.sqrt(np.mean(one**2)))
            out[f"peak {name}"] = float(one[top])
            out[f"peak_hz {name}"] = float(frf.frequency[top])
    return out
