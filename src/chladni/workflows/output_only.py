"""A case whose recordings hold responses and no force: natural frequencies are taken from them."""

from dataclasses import replace

import numpy as np

from ..case import Case
from ..ema.identification import Identified
from ..ema.identification import identify as identified
from ..ema.response_correlations import free_decays, one_sided, responses
from ..ema.setup import PoleTable, Recording
from ..errors import FileError
from .identify import clear

HIGHEST = 0.8  # of the highest frequency a record holds: above it filters fall off


def with_natural_frequencies(case: Case) -> Case:
    """The case with a table of poles where it holds neither FRFs nor poles but responses.

    A case that holds anything else is returned as it is.
    """
    if any(r.frf is not None or r.poles is not None for r in case.recordings):
        return case
    usable = [r for r in case.recordings if responses(r.functions)]
    if not usable:
        return case
    first = usable[0]
    known, note = _identified(case, first)
    r = known.order
    table = PoleTable(
        known.frequency, known.frequency_sd, np.full(r, np.nan), np.arange(1, r + 1), ("",) * r
    )
    others = [other for other in case.recordings if other is not first]
    return replace(
        case, recordings=(replace(first, poles=table), *others), notes=(*case.notes, note)
    )


def _identified(case: Case, recording: Recording) -> tuple[Identified, str]:
    used = responses(recording.functions)
    low, high = case.band or (0.0, np.inf)
    frf, sigma = one_sided(used, (low, high))
    low = max(low, float(frf.frequency[1]) * 4)
    high = min(high, HIGHEST * float(frf.frequency[-1]))
    found = identified(frf, (low, high), use=case.lines(frf.frequency))
    free = found.poles + sigma  # without what the window adds
    found = replace(found, poles=free)
    known = found.sel(found.inside & found.firm & (free.real < 0) & clear(found))
    if not known.order:
        raise FileError(
            f"{recording.name}: no natural frequency is above the noise of its {len(used)} "
            f"records of responses ({used[0].kind}) between {low:.4g} and {high:.4g} Hz, and no "
            "force was measured"
        )
    how = "from their free decay," if free_decays(used) else "assuming a white force"
    note = (
        f"{recording.name}: the force was not measured, so {known.order} natural frequencies come "
        f"from {len(used)} records of responses ({used[0].kind}), {how} between {low:.4g} and "
        f"{high:.4g} Hz; damping and levels are not used"
    )
    return known, note
