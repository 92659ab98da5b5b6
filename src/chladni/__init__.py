"""Find where a finite element model and a recording differ, and name the missing physics.

The names a script starts from; everything else is one import further down.

A diagnosis in three lines::

    found = chladni.diagnose("deck.bdf", "test.uff", units="mm-t-s", mass=2.1)
    print(found.summary())
    found.save("runs/first")

``diagnose``, ``calibrate``, ``correlate`` and ``check`` take a deck with its recordings, or a
case (a folder, or what ``load_case`` returns). A recording is a path, an ``FRF`` of arrays whose
channels are placed by ``Sensor``, a ``PoleTable`` or a ``Recording``. ``CaseWords`` lists the other
arguments. The command of the same name takes the same road, so that numbers are equal.

``modes``, ``frf``, ``plan`` and ``study`` need a model alone, ``identify`` and
``evaluate_recordings`` a recording alone. Whatever takes a deck takes its path with ``units=``, a
loaded model, or an ``Assembly`` in SI. ``load`` gives a model with ``.modes(count)``,
``.frf(output, input, frequency)``, ``.show(mode)``, ``.variant(t=0.8e-3)``, ``.write(path)`` and
``.mesh`` for pyvista. It takes models and meshes of other programs as well.

Every result has ``summary()``, ``plot(name)`` and ``save(folder)``, and shows itself in a notebook.

``chladni.exchange`` holds what goes to and comes from other packages: xarray, SDynPy, pyFBS,
python-control, universal files, CSV, NPZ, ParaView.

Data: ``Assembly`` (the structure), ``ModalModel``, ``FRF``; all in SI, frequencies in Hz, labels
as ``412:+Z`` or ``412:n``. An input that is wrong raises a ``ChladniError`` of one sentence.
"""

import typing as _typing
from importlib import import_module as _import_module
from importlib.util import find_spec as _find_spec

from . import address_space as address_space  # first: NumPy does not start below its limit
from .errors import ChladniError as ChladniError
from .results import show_later as _show_later

_LATER = {  # public name: module that holds it, loaded at the first use
    "Assembly": ".model.assembly",
    "BenchSettings": "chladni_bench",
    "Case": ".case",
    "CaseWords": ".case.schema",
    "EstimateSettings": ".ema.frf_estimate",
    "FRF": ".dynamics.frf",
    "ModalModel": ".dynamics.modes",
    "PlanSettings": "chladni_planning",
    "PoleChoice": ".workflows.identify",
    "PoleTable": ".ema.setup",
    "Recording": ".ema.setup",
    "Sensor": ".ema.setup",
    "StudySettings": "chladni_studies",
    "WorkingModel": ".workflows.working_model",
    "calibrate": ".workflows.calibrate",
    "check": ".workflows.case_check",
    "check_effect": "chladni_contract",
    "correlate": ".workflows.correlate",
    "diagnose": ".workflows.diagnose",
    "evaluate_recordings": ".workflows.evaluation",
    "exchange": ".io.other_packages",
    "frf": ".workflows.frf",
    "from_xarray": ".io.other_packages",
    "identify": ".workflows.identify",
    "load": ".workflows.working_model",
    "load_case": ".case",
    "load_recordings": ".workflows.recordings_of",
    "mac": ".ema.correlation",
    "make_case": ".case.make_case",
    "map_formed": ".workflows.map",
    "modes": ".workflows.modes",
    "other_modes": ".workflows.other_modes",
    "plan": "chladni_planning",
    "read_deck": ".io.nastran",
    "read_diagnosis": ".report.diagnosis_json",
    "study": "chladni_studies",
    "synthesise": ".dynamics.frf",
    "to_xarray": ".io.other_packages",
    "virtual_test": "chladni_bench",
    "write_deck": ".io.nastran",
}
if _typing.TYPE_CHECKING:
    from .model.assembly import Assembly as Assembly
    from .dynamics.frf import FRF as FRF
    from .dynamics.frf import synthesise as synthesise
    from .dynamics.modes import ModalModel as ModalModel
    from .io.nastran import read_deck as read_deck
    from .io.nastran import write_deck as write_deck
    from .io import other_packages as exchange
    from .io.other_packages import from_xarray as from_xarray
    from .io.other_packages import to_xarray as to_xarray
    from .ema.correlation import mac as mac
    from .ema.frf_estimate import EstimateSettings as EstimateSettings
    from .ema.setup import PoleTable as PoleTable
    from .ema.setup import Recording as Recording
    from .ema.setup import Sensor as Sensor
    from .case import Case as Case
    from .case import load_case as load_case
    from .case.schema import CaseWords as CaseWords
    from .case.make_case import make_case as make_case
    from .workflows.working_model import WorkingModel as WorkingModel
    from .workflows.working_model import load as load
    from .workflows.recordings_of import load_recordings as load_recordings
    from .workflows.map import map_formed as map_formed
    from .workflows.modes import modes as modes
    from .workflows.frf import frf as frf
    from .workflows.case_check import check as check
    from .workflows.evaluation import evaluate_recordings as evaluate_recordings
    from .workflows.identify import PoleChoice as PoleChoice
    from .workflows.identify import identify as identify
    from .workflows.correlate import correlate as correlate
    from .workflows.other_modes import other_modes as other_modes
    from .workflows.calibrate import calibrate as calibrate
    from .workflows.diagnose import diagnose as diagnose
    from .report.diagnosis_json import read_diagnosis as read_diagnosis
    from .report import result_views as _result_views  # noqa: F401  loaded by _show_later
    from chladni_bench import BenchSettings as BenchSettings
    from chladni_bench import virtual_test as virtual_test
    from chladni_contract import check_effect as check_effect
    from chladni_planning import PlanSettings as PlanSettings
    from chladni_planning import plan as plan
    from chladni_studies import StudySettings as StudySettings
    from chladni_studies import study as study
else:

    def __getattr__(name: str) -> object:
        """Load a name of ``_LATER``, or a room of this package, and keep it."""
        if name in _LATER:
            module = _import_module(_LATER[name], __name__)
            found = module if name == "exchange" else getattr(module, name)
        elif not name.startswith("_") and _find_spec(f"{__name__}.{name}"):
            found = _import_module(f".{name}", __name__)
        else:
            raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
        return globals().setdefault(name, found)

    def __dir__() -> list[str]:
        """Return all names, also those of ``_LATER``."""
        return sorted({*globals(), *_LATER})


_show_later("chladni.report.result_views")

__all__ = [
    "FRF",
    "Assembly",
    "BenchSettings",
    "Case",
    "CaseWords",
    "ChladniError",
    "EstimateSettings",
    "ModalModel",
    "PlanSettings",
    "PoleChoice",
    "PoleTable",
    "Recording",
    "Sensor",
    "StudySettings",
    "WorkingModel",
    "calibrate",
    "check",
    "check_effect",
    "correlate",
    "diagnose",
    "evaluate_recordings",
    "exchange",
    "frf",
    "from_xarray",
    "identify",
    "load",
    "load_case",
    "load_recordings",
    "mac",
    "make_case",
    "map_formed",
    "modes",
    "other_modes",
    "plan",
    "read_deck",
    "read_diagnosis",
    "study",
    "synthesise",
    "to_xarray",
    "virtual_test",
    "write_deck",
]
