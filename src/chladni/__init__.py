"""Find where a finite element model and a recording differ, and name the missing physics.

The names a script starts from; everything else is one import further down.

A model alone: ``load(deck, units)`` has ``.modes(count)``, ``.frf(output, input, frequency)``,
``.show(mode)``, ``.variant(t=0.8e-3)`` and ``.write(path)``.

A model and a recording: pass ``load_case(folder)`` to ``check``, ``correlate``, ``calibrate``,
``diagnose``, ``plan``, ``frf``, ``modes`` and ``study``, one function for each command.
``identify`` and ``evaluate_recordings`` need a recording alone (``load_recordings``).

Data: ``Assembly`` (the structure), ``ModalModel``, ``FRF``; all in SI, frequencies in Hz, labels
as ``412:+Z`` or ``412:n``. Decks come in by ``read_deck`` and go out changed by ``write_deck``,
an ``FRF`` to and from xarray by ``to_xarray`` and ``from_xarray``.
A ``chladni.errors.ChladniError`` states in one sentence the error in an input.
"""

from . import address_space as address_space  # first: NumPy does not start below its limit
from .model.assembly import Assembly as Assembly
from .dynamics.eigen import normal_modes as normal_modes
from .dynamics.frf import FRF as FRF
from .dynamics.frf import synthesise as synthesise
from .dynamics.modes import ModalModel as ModalModel
from .io.nastran import read_deck as read_deck
from .io.nastran import write_deck as write_deck
from .io.labelled_arrays import from_xarray as from_xarray
from .io.labelled_arrays import to_xarray as to_xarray
from .fem.assemble import structure as structure
from .ema.correlation import mac as mac
from .planning import effective_independence as effective_independence
from .case import load_case as load_case
from .workflows.loaded_model import load_model as load_model
from .workflows.working_model import WorkingModel as WorkingModel
from .workflows.working_model import load as load
from .workflows.recordings_of import load_recordings as load_recordings
from .workflows.map import map_formed as map_formed
from .workflows.modes import modes as modes
from .workflows.frf import frf as frf
from .workflows.case_check import check as check
from .workflows.plan import plan as plan
from .workflows.virtual_test import virtual_test as virtual_test
from .workflows.evaluation import evaluate_recordings as evaluate_recordings
from .workflows.identify import identify as identify
from .workflows.correlate import correlate as correlate
from .workflows.other_modes import other_modes as other_modes
from .workflows.calibrate import calibrate as calibrate
from .workflows.diagnose import diagnose as diagnose
from .studies.parameter_study import study as study
from .report.notebook import shown_in_notebooks as _shown_in_notebooks

_shown_in_notebooks()

__all__ = [
    "FRF",
    "Assembly",
    "ModalModel",
    "WorkingModel",
    "calibrate",
    "check",
    "correlate",
    "diagnose",
    "effective_independence",
    "evaluate_recordings",
    "frf",
    "from_xarray",
    "identify",
    "load",
    "load_case",
    "load_model",
    "load_recordings",
    "mac",
    "map_formed",
    "modes",
    "normal_modes",
    "other_modes",
    "plan",
    "read_deck",
    "structure",
    "study",
    "synthesise",
    "to_xarray",
    "virtual_test",
    "write_deck",
]
