"""A virtual test bench: an article, its scatter, sensors and noise; out comes a recording."""

from . import bench_views as bench_views
from .accelerometers import AccelerometerType as AccelerometerType
from .accelerometers import drawn_gains as drawn_gains
from .article_scatter import DAMPING as DAMPING
from .article_scatter import FREQUENCIES as FREQUENCIES
from .article_scatter import WEIGHTS as WEIGHTS
from .article_scatter import drawn_article as drawn_article
from .article_scatter import fitted as fitted
from .bench_article import BenchArticle as BenchArticle
from .bench_recording import BenchRecording as BenchRecording
from .bench_recording import BenchTest as BenchTest
from .bench_recording import Channels as Channels
from .bench_recording import channels_of as channels_of
from .bench_recording import level_for as level_for
from .bench_recording import record as record
from .bench_rig import BenchRig as BenchRig
from .bench_rig import BenchSetup as BenchSetup
from .bench_rig import bench_rig as bench_rig
from .bench_workflow import ABOVE_BAND as ABOVE_BAND
from .bench_workflow import BenchResult as BenchResult
from .bench_workflow import BenchSettings as BenchSettings
from .bench_workflow import virtual_test as virtual_test
from .benched_article import benched as benched
from .benched_article import dissipated as dissipated
from .benched_article import true_places as true_places
from .cords import RUBBER as RUBBER
from .cords import THESIS as THESIS
from .cords import Cord as Cord
from .cords import cord as cord
from .noisy_frf import MeasurementChain as MeasurementChain
from .noisy_frf import recorded as recorded
from .part_scatter import Draw as Draw
from .part_scatter import decades_apart as decades_apart
from .part_scatter import recognisable as recognisable
from .part_scatter import scaled_parts as scaled_parts
from .part_scatter import scattered_parts as scattered_parts
from .pole_model import PoleModel as PoleModel
from .sine_schedule import TABLE_3 as TABLE_3
from .sine_schedule import Stage as Stage
from .sine_schedule import dwells_of as dwells_of
from .sine_schedule import stage_lines as stage_lines
from .sine_schedule import stages_for as stages_for
from .sine_schedule import stepped_sine_time as stepped_sine_time
from .sine_sweep import swept as swept

__all__ = [
    "ABOVE_BAND",
    "DAMPING",
    "FREQUENCIES",
    "RUBBER",
    "TABLE_3",
    "THESIS",
    "WEIGHTS",
    "AccelerometerType",
    "BenchArticle",
    "BenchRecording",
    "BenchResult",
    "BenchRig",
    "BenchSettings",
    "BenchSetup",
    "BenchTest",
    "Channels",
    "Cord",
    "Draw",
    "MeasurementChain",
    "PoleModel",
    "Stage",
    "bench_rig",
    "benched",
    "channels_of",
    "cord",
    "decades_apart",
    "dissipated",
    "drawn_article",
    "drawn_gains",
    "dwells_of",
    "fitted",
    "level_for",
    "recognisable",
    "record",
    "recorded",
    "scaled_parts",
    "scattered_parts",
    "stage_lines",
    "stages_for",
    "stepped_sine_time",
    "swept",
    "true_places",
    "virtual_test",
]
