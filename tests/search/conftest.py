"""A plate made ready, with a recording of a slightly different one."""

from tests.builders.recorded_plate import damped, reduced, responses

__all__ = ["damped", "reduced", "responses"]
