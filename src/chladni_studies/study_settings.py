"""Settings of a parameter study: number of samples, sampler, and the results of each sample."""

from dataclasses import dataclass
from math import inf
from typing import Literal, get_args

from chladni.arguments import refuse_fields
from chladni.dynamics.frf import UNIT, Quantity
from chladni.errors import LabelError

Sampler = Literal["sobol", "lhs", "grid", "oat", "saltelli", "morris"]
SAMPLERS: tuple[str, ...] = get_args(Sampler)
MOST_SAMPLES = 10_000_000  # samples; a larger number is taken as a typing error


@dataclass(frozen=True)
class StudySettings:
    """Size of a study, its sampler, and the results of every sample.

    Attributes
    ----------
    samples : at most this many; some samplers need a number of their own and take fewer
    sampler : sobol, lhs (fill the space), grid (full factorial), oat (one at a time), saltelli
              (Sobol' indices), morris (elementary effects)
    seed : of the samplers that draw
    modes : elastic modes of the nominal model that are followed through the samples
    outputs, inputs : labels of the responses; a case with FRFs has its own
    band : (low, high) [Hz] of these responses, on ``lines`` frequencies
    damping : ratio of every mode, where the case gives none
    quantity : receptance, mobility or accelerance
    keep_frf : keep whole responses in addition to their summary
    """

    samples: int = 100
    sampler: str = "sobol"
    seed: int = 0
    modes: int = 10
    outputs: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    band: tuple[float, float] = (1.0, 200.0)
    lines: int = 400
    damping: float = 0.01
    quantity: Quantity = "accelerance"
    keep_frf: bool = False

    def __post_init__(self) -> None:
        refuse_fields(
            self, samples=(1, MOST_SAMPLES), modes=(1, 10_000), lines=(2, 1_000_000),
            seed=(0, 2**32 - 1), damping=(0, inf),
        )  # fmt: skip
        if self.sampler not in SAMPLERS:
            raise LabelError(f"no sampler {self.sampler!r}; there are {', '.join(SAMPLERS)}")
        if self.quantity not in UNIT:
            raise LabelError(f"no quantity {self.quantity!r}; there are {', '.join(UNIT)}")
        if bool(self.outputs) != bool(self.inputs):
            raise LabelError("responses need both ends: at least one output and one input")
