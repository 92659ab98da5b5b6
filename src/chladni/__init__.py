"""Find where a finite element model and a recording differ, and name the missing physics.

The names a script starts from, floor by floor; everything else is one import further down.
"""

from .model.assembly import Assembly as Assembly
from .dynamics.eigen import normal_modes as normal_modes
from .dynamics.frf import FRF as FRF
from .dynamics.frf import synthesise as synthesise
from .dynamics.modes import ModalModel as ModalModel
from .io.nastran import read_deck as read_deck
from .io.nastran import write_deck as write_deck
from .fem.assemble import structure as structure
from .ema.correlation import mac as mac
from .planning import effective_independence as effective_independence
from .case import load_case as load_case
from .workflows.loaded_model import load_model as load_model
from .workflows.recordings_of import load_recordings as load_recordings
from .workflows.modes import modes as modes
from .workflows.frf import frf as frf
from .workflows.case_check import check as check
from .workflows.plan import plan as plan
from .workflows.virtual_test import virtual_test as virtual_test
from .workflows.evaluation import evaluate_recordings as evaluate_recordings
from .workflows.identify import identify as identify
from .workflows.correlate import correlate as correlate
from .workflows.calibrate import calibrate as calibrate
from .workflows.diagnose import diagnose as diagnose
from .studies.parameter_study import study as study
