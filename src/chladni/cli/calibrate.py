"""``chladni calibrate``: calibration parameters alone, no new physics."""

from ..workflows.calibrate import calibrate
from .run import CaseFolder, Out, diagnosed


def run(
    source: CaseFolder,
    out: Out = None,
) -> None:
    """Fit E, rho and t of the parts, or the case's parameters; write the updated deck and a page.

    Choose modes by their frequency: [band] fit and exclude in case.toml.
    """
    diagnosed("calibrate", source, out, calibrate)
