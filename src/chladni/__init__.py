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
from .ema.identification import identify as identify
from .planning import effective_independence as effective_independence
from .updating.question import Question as Question
from .updating.preparation import prepare as prepare
from .updating.diagnosis import diagnose as diagnose
from .case import load_case as load_case
