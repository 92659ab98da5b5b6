"""The sign of an unknown gain, which is a real factor of either sign."""

from dataclasses import replace

from ..case import Case
from ..ema.channel_checks import drive_points, driving_share
from ..ema.frf_maps import mapped
from ..fem.modelled import Modelled, modelled
from ..inference.smoothed_responses import Reading
from .case_model import REACH

DECIDED = 0.5  # share of the power at a drive point that goes one way


def with_sign_of_gain(case: Case, model: Modelled | None = None) -> Case:
    """The case with the sign of an unknown gain: that of a passive drive point, else of the model.

    Parameters
    ----------
    model : of the deck as it was tested; default: it is made where it is needed
    """
    if case.gain_known or not case.frfs:
        return case
    frf = case.frfs[0]
    shares = [driving_share(frf, *point) for point in drive_points(frf)]
    if shares and min(map(abs, shares)) > DECIDED:
        said = "at the drive point the force puts power into the structure"
        return case if shares[0] > 0 else _negative(case, said)
    high = case.band[1] if case.band else float(frf.frequency[-1])
    model = model or modelled(case.tested(case.assembly), REACH * high)
    lines = case.lines(frf.frequency)
    seen = Reading(frf, lines, model, case.outputs, case.inputs).smoothed()
    if seen is None:
        return case
    Q = [min(seen.score(sign * H) for H in seen.answers()) for sign in (1, -1)]
    if Q[0] <= Q[1]:
        return case
    why = f"smoothed Q against the model is then {Q[1]:.2g}, as recorded {Q[0]:.2g}"
    return _negative(case, why)


def _negative(case: Case, why: str) -> Case:
    flipped = tuple(
        r if r.frf is None else replace(r, frf=mapped(r.frf, ("factor", "-1")))
        for r in case.recordings
    )
    said = f"the gain is unknown, and so is its sign, which was taken as negative: {why}"
    return replace(case, recordings=flipped, notes=(*case.notes, said))
