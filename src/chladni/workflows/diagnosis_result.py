"""The result of a diagnosis or calibration, and its structures (SI).

:mod:`chladni.report.diagnosis_json` writes it as ``diagnosis.json`` and reads it back.
"""

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from ..dynamics.frf import FRF
from ..ema.finding import Screening
from ..ema.level_table import LevelTable
from ..errors import AccuracyError
from ..fem.modelled import Modelled
from ..inference.calibration_result import CalibrationStudy
from ..inference.level_effects import LinearJoint
from ..inference.residual_localisation import ResidualLocalisation
from ..inference.result import (
    Adequacy,
    Agreement,
    Alternative,
    CalibratedParameter,
    FrequencyError,
    FrequencyRow,
    MassComparison,
    NamedEffect,
    NextMeasurement,
    RecordingScore,
    Remainder,
)
from ..io.nastran.edit.changes import Change
from ..io.nastran.text.deck import Deck
from ..results import Result, ShownBriefly
from ..search.earlier_answer import EarlierAnswer
from ..search.measured_modes import MeasuredModes
from ..search.next_measurement import Outlook

Compared = Literal["responses", "frequencies", "modes"]


@dataclass(frozen=True, eq=False)
class ChangedDeck:
    """A deck with changes, and the structure that it then describes.

    ``changes`` are edits of its cards; None if no card can hold them.  ``source`` is the deck that
    is changed, if it is not the given one.
    """

    model: Modelled
    changes: tuple[Change, ...] | None
    source: Deck | None = None


@dataclass(frozen=True, eq=False, repr=False)
class UpdatedModels(ShownBriefly):
    """The three structures of a diagnosis, with their responses and the recording's."""

    nominal: Modelled  # the deck as it was given
    # calibrated, final: without and with the effect; identical if none is named
    calibrated: ChangedDeck
    final: ChangedDeck
    # {"test", "before", "after": FRF}, empty without an FRF
    curves: dict[str, FRF] = field(default_factory=dict)
    held_out: tuple[str, ...] = ()  # labels of outputs that were not fitted
    # the modes of the recording
    test: MeasuredModes = field(default_factory=lambda: MeasuredModes(np.zeros(0)))


@dataclass(frozen=True, eq=False, repr=False)
class DiagnosisResult(Result):
    """Result of a diagnosis: the verdict, its certainty, and the improvement it brings.

    Attributes
    ----------
    verdict : missing physics, calibration only, nothing missing, measurement fault, nonlinear, or
        not in catalogue
    effects : the named effects, the one that gains most first
    alternatives : all others that were tried, best first
    agreement : Q of every deck
    calibrated : E, rho, t, ... that were fitted
    mass : of scales and model
    frequencies : test and decks side by side
    frequency_error : of the paired frequencies
    structured : whether calibration alone leaves more than noise
    adequate : the absolute test of the best explanation
    one_of : groups of explanations that the data cannot separate
    next_measurements : that would separate them, the one that tells most for its cost first
    notes : how the recording was read, what was done and why
    distrust : reasons not to trust the result; the command then exits with 3
    compared : whether responses or natural frequencies were compared
    searched : False where only calibration parameters were fitted
    screening : faults that the recording itself reveals; None without an FRF
    files : {what: name} of the files written with it
    halved : why every shell of the written decks is halved; "" if they have the given mesh
    mesh_error : largest relative error of a natural frequency by the mesh of the deck, where the
        data reject this mesh; 0 where they do not
    models : the structures; None if the result was read from a file
    left_where : residual of the explanation on the mesh; None if frequencies were compared
    recordings : Q of the decks on the recordings that were not fitted
    levels : its modes over levels of excitation, where it was measured at several
    joints : K and GE that linear joints would have at each level, where friction may sit in them
    states : result of each state, if the object was measured in several; this is the first's
    shared : parameters common to the states, fitted to all of them together
    study : what a calibration knows beside its values; None after a diagnosis
    """

    verdict: str = ""
    effects: tuple[NamedEffect, ...] = ()
    alternatives: tuple[Alternative, ...] = ()
    agreement: Agreement | None = None
    calibrated: tuple[CalibratedParameter, ...] = ()
    mass: MassComparison | None = None
    frequencies: tuple[FrequencyRow, ...] = ()
    frequency_error: FrequencyError | None = None
    structured: Remainder | None = None
    adequate: Adequacy | None = None
    one_of: tuple[tuple[str, ...], ...] = ()
    next_measurements: tuple[NextMeasurement, ...] = ()
    notes: tuple[str, ...] = ()
    distrust: tuple[str, ...] = ()
    compared: Compared = "responses"
    searched: bool = True
    screening: Screening | None = None
    files: dict[str, str | None] = field(default_factory=dict)
    halved: str = ""
    mesh_error: float = 0.0
    models: UpdatedModels | None = None
    residual_localisation: ResidualLocalisation | None = None
    outlook: Outlook | None = None
    posterior: EarlierAnswer | None = None
    recordings: tuple[RecordingScore, ...] = ()
    levels: tuple[LevelTable, ...] = ()
    joints: tuple[LinearJoint, ...] = ()
    states: tuple["StateResult", ...] = ()
    shared: tuple[CalibratedParameter, ...] = ()
    study: CalibrationStudy | None = None

    @property
    def deck_changed(self) -> bool:
        """True if the updated deck has other values than the given one."""
        return self.verdict not in ("", "nothing missing")

    def trusted(self) -> "DiagnosisResult":
        """The result itself.

        Raises
        ------
        AccuracyError
            If there is a reason not to trust it.
        """
        if self.distrust:
            raise AccuracyError(*self.distrust)
        return self


@dataclass(frozen=True, eq=False)
class StateResult:
    """One state of an object, and its result."""

    name: str  # of the state, together with all keys of the state's own diagnosis
    result: DiagnosisResult  # of this state
