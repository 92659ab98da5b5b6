"""Parameter studies: samples of a model, on this machine or on any Dask cluster."""

from .study_settings import StudySettings as StudySettings
