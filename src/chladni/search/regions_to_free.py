"""Parts that a next calibration could free: where the modes that still deviate store their energy.

With the share s_pr of part p in the strain energy of mode r, d ln f_r = ½ Σ_p s_pr d ln K_p
(Rayleigh).  Deviations e_r = ln(f_model / f_test) in proportion to the shares of a part vanish with
d ln K_p = -2 s·e / s·s.  This removes the share (s·e)² / (s·s e·e) of Σ e²: one over the number of
modes, for a direction at random.
"""

from collections.abc import Sequence, Set

import numpy as np

from ..effects.effect import Effect
from ..fem.energy import part_energies
from ..fem.modelled import Modelled
from ..inference.calibration_result import (
    CalibrationStudy,
    RegionShare,
    RegionsToFree,
    WorstMode,
)
from ..inference.map_fit import Fit
from ..inference.result import FrequencyRow
from ..model.properties import Isotropic, Part, ShellSection

WORST = 4  # of so many modes one is called worst, by its frequency and again by its MAC
ELSE = "springs and bushes"
ROUNDING = 1e-9  # of a share


def regions_to_free(
    rows: Sequence[FrequencyRow], model: Modelled, found: Fit, study: CalibrationStudy
) -> RegionsToFree | None:
    """Compare the strain energy of the worst modes by part with that of the others.

    Parameters
    ----------
    rows : frequencies of the test and of the calibrated deck, with MAC
    model, found : this deck and its fit
    study : with the names of the parameters that were frozen

    Returns
    -------
    None with fewer than three paired modes.
    """
    paired = [r for r in rows if r.test_hz and r.after_hz]
    if len(paired) < 3:
        return None
    away = np.log([(r.after_hz or 0.0) / r.test_hz for r in paired])
    mac = np.array([1.0 if r.mac_after is None else r.mac_after for r in paired])
    worst = worst_modes(away, mac)
    share = energy_shares(model, np.array([r.after_hz for r in paired], dtype=float))
    change, removed = stiffness_for(share, away)
    parts = model.assembly.parts
    frozen = study.identifiability.frozen
    freed = [(e, _quantities(e)) for e in found.effects if e.kind == "calibration"]
    free, thick = ({name for e, of in freed if q in of for name in e.parts} for q in ("E", "t"))
    regions = [
        RegionShare(
            part.name if part else ELSE, float(share[k, worst].mean()),
            float(share[k, ~worst].mean()), float(np.exp(change[k])), float(removed[k]),
            _state(part.name if part else "", free, thick, frozen),
            "K" if part is None else "E" if _isotropic(part) else "E1",
        )
        for k, part in enumerate([*parts, None])
        if share[k].max() > ROUNDING
    ]  # fmt: skip
    return RegionsToFree(
        tuple(WorstMode(r.test_hz, r.after_hz or 0.0, r.mac_after)
              for r, w in zip(paired, worst, strict=True) if w),
        tuple(WorstMode(r.test_hz, r.after_hz or 0.0, r.mac_after)
              for r, w in zip(paired, worst, strict=True) if not w),
        tuple(sorted(regions, key=lambda one: -one.removed)),
    )  # fmt: skip


def energy_shares(model: Modelled, frequency: np.ndarray) -> np.ndarray:
    """Share of every part, and of all else as ``ELSE``, in the strain energy (parts + 1, r).

    Parameters
    ----------
    frequency : (r,)   of modes of the model; the nearest is taken [Hz]
    """
    at = np.abs(model.modes.frequency[:, None] - frequency).argmin(axis=0)
    share = part_energies(model.structure, model.modes.shapes[:, at])
    return np.vstack([share, np.clip(1 - share.sum(axis=0), 0.0, 1.0)])


def worst_modes(away: np.ndarray, mac: np.ndarray) -> np.ndarray:
    """Modes with the largest |deviation| or the lowest MAC, a quarter by each (r,) bool."""
    count = -(-len(away) // WORST)
    off, unlike = np.argsort(-np.abs(away))[:count], np.argsort(mac)[:count]
    unlike = unlike[mac[unlike] < np.median(mac)]
    return np.isin(np.arange(len(away)), [*off, *unlike])


def stiffness_for(share: np.ndarray, away: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """D ln K of each part that fits the deviations best alone, and its share of Σ e² (parts,).

    Parameters
    ----------
    share : (parts, r)   of strain energy
    away : (r,)          ln(f_model / f_test)
    """
    along, own = share @ away, (share**2).sum(axis=1)
    change = np.divide(-2 * along, own, out=np.zeros_like(along), where=own > 0)
    total = own * float(away @ away)
    return change, np.divide(along**2, total, out=np.zeros_like(along), where=total > 0)


def _isotropic(part: Part) -> bool:
    section = part.section
    if isinstance(section, ShellSection):
        return isinstance(section.membrane or section.bending, Isotropic)
    return isinstance(section.material, Isotropic)


def _state(part: str, free: Set[str], thick: Set[str], frozen: Sequence[str]) -> str:
    """State of a part's stiffness; with E frozen its thickness may carry it."""
    held = f"E of {part}" in frozen
    return "free" if part in free or (held and part in thick) else "frozen" if held else ""


def _quantities(effect: Effect) -> list[str]:
    return [p.name for p in effect.parameters]
