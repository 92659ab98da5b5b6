"""Parameter studies: samples of a model, on this machine or on any Dask cluster."""

from . import study_views as study_views
from .parameter_study import ParameterStudy as ParameterStudy
from .parameter_study import study as study
from .study_settings import StudySettings as StudySettings

__all__ = [
    "ParameterStudy",
    "StudySettings",
    "study",
]
