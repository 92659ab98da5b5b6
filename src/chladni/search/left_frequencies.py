"""Reading of the frequencies of a written deck: parts to free, their damping, soft folds.

With the share s_pr of part p in the strain energy of mode r, d ln f_r = ½ Σ_p s_pr d ln K_p
(Rayleigh).  Deviations e_r = ln(f_model / f_test) in proportion to the shares of a part vanish with
d ln K_p = -2 s·e / s·s.  This removes the share (s·e)² / (s·s e·e) of Σ e²: one over the number of
modes, for a direction at random.  Such a mode has 2 ζ_r = Σ_p s_pr η_p (Ungar and Kerwin 1962,
J. Acoust. Soc. Am. 34, 954-957).
"""

from collections.abc import Sequence, Set
from itertools import compress

import numpy as np

from ..effects.element_groups import thickness_split
from ..effects.identified_damping import SCATTER
from ..effects.model_errors import FOLDS
from ..fem import shell
from ..fem.energy import part_energies
from ..fem.modelled import Modelled
from ..geometry.folds import share_at_folds
from ..inference.adequacy import LEAST_P
from ..inference.calibration_result import (
    CalibrationStudy,
    PartDamping,
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
LEAST = 0.01  # share of strain energy in its best mode below which a part has no loss factor
SHELLS, OTHERS = 2.0, 1.0  # rms in per cent that careful models leave: of shells, of bars, solids
STRAINED = 2.0  # prior standard deviations from which a nuisance is a finding


def regions_to_free(
    rows: Sequence[FrequencyRow], model: Modelled, found: Fit, study: CalibrationStudy
) -> RegionsToFree | None:
    """Strain energy of the worst modes by part, and that of the others; None of fewer than three.

    ``model`` is the calibrated deck of the rows, ``found`` its fit.
    """
    paired = [r for r in rows if r.test_hz and r.after_hz]
    modes = [WorstMode(r.test_hz, r.after_hz or 0.0, r.mac_after) for r in paired]
    if len(modes) < 3:
        return None
    away = np.log([m.model_hz / m.test_hz for m in modes])
    worst = worst_modes(away, np.array([1.0 if m.mac is None else m.mac for m in modes]))
    share = energy_shares(model, np.array([m.model_hz for m in modes]))
    change, removed = stiffness_for(share, away)
    frozen = study.identifiability.frozen
    freed = [(e, [p.name for p in e.parameters]) for e in found.effects if e.kind == "calibration"]
    free, thick = ({name for e, of in freed if q in of for name in e.parts} for q in ("E", "t"))
    regions = [
        RegionShare(
            part.name if part else ELSE, float(share[k, worst].mean()),
            float(share[k, ~worst].mean()), float(np.exp(change[k])), float(removed[k]),
            _state(part.name if part else "", free, thick, frozen),
            "K" if part is None else "E" if _isotropic(part) else "E1",
        )
        for k, part in enumerate([*model.assembly.parts, None])
        if share[k].max() > ROUNDING
    ]  # fmt: skip
    bad, good = (tuple(compress(modes, some)) for some in (worst, ~worst))
    return RegionsToFree(bad, good, tuple(sorted(regions, key=lambda one: -one.removed)))


def worst_modes(away: np.ndarray, mac: np.ndarray) -> np.ndarray:
    """Modes with the largest |deviation| or the lowest MAC, a quarter by each (r,) bool."""
    count = -(-len(away) // WORST)
    off, unlike = np.argsort(-np.abs(away))[:count], np.argsort(mac)[:count]
    unlike = unlike[mac[unlike] < np.median(mac)]
    return np.isin(np.arange(len(away)), [*off, *unlike])


def stiffness_for(share: np.ndarray, away: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """D ln K of each part that fits deviations (r,) best alone, and its share of Σ e² (parts,)."""
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


def damping_by_part(rows: Sequence[FrequencyRow], model: Modelled) -> tuple[PartDamping, ...]:
    """Loss factors by the damping of the paired modes; nothing of fewer modes than parts."""
    paired = [(r.after_hz, r.damping) for r in rows if r.after_hz and r.damping and r.damping > 0]
    if not paired:
        return ()
    f, zeta = np.array(paired, dtype=float).T
    share = energy_shares(model, f)
    names = [*(part.name for part in model.assembly.parts), ELSE]
    kept = np.flatnonzero(share.max(axis=1) > LEAST)
    if len(kept) > len(f):
        return ()
    eta, sd = loss_factors(share[kept], zeta)
    return tuple(
        PartDamping(names[k], float(e), max(0.0, float(e - 1.96 * s)), float(e + 1.96 * s))
        for k, e, s in zip(kept, eta, sd, strict=True)
    )


def loss_factors(share: np.ndarray, zeta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Loss factors η (parts,) ≥ 0 of damping ratios (r,), and their standard deviations.

    The least squares are weighted by the scatter of damping among the modes of one structure.
    """
    from scipy.optimize import nnls

    J = (share / (2 * zeta)).T / SCATTER
    eta, _ = nnls(J, np.full(len(zeta), 1 / SCATTER))
    return eta, np.sqrt(np.diag(np.linalg.pinv(J.T @ J)))


def energy_shares(model: Modelled, frequency: np.ndarray) -> np.ndarray:
    """Share of every part, and of all ``ELSE``, in the strain energy of modes (parts + 1, r)."""
    share = part_energies(model.structure, _nearest(model, frequency))
    return np.vstack([share, np.clip(1 - share.sum(axis=0), 0.0, 1.0)])


def _nearest(model: Modelled, frequency: np.ndarray) -> np.ndarray:
    """Shapes (n, r) of the modes of a model that are nearest to frequencies (r,) [Hz]."""
    at = np.abs(model.modes.frequency[:, None] - frequency).argmin(axis=0)
    return model.modes.shapes[:, at]


def left_frequencies(rows: Sequence[FrequencyRow], model: Modelled) -> tuple[tuple[str, ...], str]:
    """Sentences on a deck whose frequencies are farther off than those of a careful model.

    The second value names the cause outside the catalogue that they show, "" if they show none.
    ``model`` is the deck of the rows, as it is written.
    """
    paired = [(r.after_hz, r.test_hz) for r in rows if r.after_hz]
    if not paired:
        return (), ""
    f, test = np.array(paired, dtype=float).T
    off = 100 * np.log(f / test)
    rms, most = float(np.sqrt(np.mean(off**2))), SHELLS if len(model.assembly.shells) else OTHERS
    if rms <= most:
        return (), ""
    worst = int(np.abs(off).argmax())
    alone = len(rows) - len(paired)
    far = (
        f"the frequencies of the deck are {rms:.2g} % (rms) from those of the test over "
        f"{len(paired)} modes{f' (without a partner: {alone})' * bool(alone)}; the one at "
        f"{test[worst]:.4g} Hz is {100 * (f[worst] / test[worst] - 1):+.2g} % off; a careful model "
        f"of {'shells' if most == SHELLS else 'bars or solids'} leaves {most:g} % at most, so "
        "physics is missing, or modes are paired wrongly"
    )
    kappa, removed = folds(f, test, model) if len(model.assembly.shells) else (1.0, 0.0)
    away = abs(np.log(kappa)) / FOLDS
    if away <= STRAINED:
        return (far,), ""
    cause = f"{'softer' if kappa < 1 else 'stiffer'} folds"
    said = (
        f"the deviations show {cause} than the deck has: shells along them with about "
        f"{kappa:.2g} of their bending stiffness remove {100 * removed:.0f} % of the squared "
        f"deviations; that is {away:.2g} standard deviations of the differences between meshes; "
        "look at the joints along the folds"
    )
    return (far, said), cause


def folds(f: np.ndarray, test: np.ndarray, model: Modelled) -> tuple[float, float]:
    """κ of the folds where the deviations are in proportion to theirs, and the share it removes.

    A fold is in series with the sheet. If it is κ times as stiff as in the deck, (f / f_test)² =
    C (1 + s (1/κ - 1)). Here s is the share of bending at folds in the strain energy. All modes
    have the same C.
    """
    from scipy.stats import f as fisher

    share = fold_shares(model, f)
    if len(f) < 4 or np.ptp(share) == 0:
        return 1.0, 0.0
    y, A = (f / test) ** 2, np.stack([np.ones(len(f)), share], axis=1)
    (common, slope), *_ = np.linalg.lstsq(A, y)
    left, plain = np.sum((y - A @ [common, slope]) ** 2), np.sum((y - y.mean()) ** 2)
    p = fisher.sf((plain - left) / left * (len(f) - 2), 1, len(f) - 2)
    if 1 + slope / common <= 0 or p > LEAST_P:
        return 1.0, 0.0
    return float(1 / (1 + slope / common)), float(1 - left / plain)


def fold_shares(model: Modelled, frequency: np.ndarray) -> np.ndarray:
    """Share of bending of the shells at folds in the strain energy of modes (r,)."""
    phi, built, made = _nearest(model, frequency), model.structure, model.assembly
    _, bending = thickness_split(made, shell.geometry(made.points, made.shells))
    u = np.asarray(built.T @ phi).reshape(len(made.points), 6, -1)[made.shells.nodes]
    u = u.reshape(len(bending), -1, phi.shape[1])
    energy = np.einsum("eir,eir->er", u, bending @ u)
    own = energy[share_at_folds(made.points, made.shells.nodes) > 0].sum(axis=0)
    return np.asarray(own / np.einsum("nr,nr->r", phi, built.system.K @ phi))
