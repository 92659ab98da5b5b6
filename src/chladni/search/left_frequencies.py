"""Frequencies that a written deck leaves, against those of careful models, and what they show."""

from collections.abc import Sequence

import numpy as np

from ..effects.element_groups import thickness_split
from ..effects.model_errors import FOLDS
from ..fem import shell
from ..fem.modelled import Modelled
from ..geometry.folds import share_at_folds
from ..inference.adequacy import LEAST_P
from ..inference.result import FrequencyRow

SHELLS, OTHERS = 2.0, 1.0  # rms in per cent that careful models leave: of shells, of bars, solids
STRAINED = 2.0  # prior standard deviations from which a nuisance is a finding


def left_frequencies(rows: Sequence[FrequencyRow], model: Modelled) -> tuple[tuple[str, ...], str]:
    """Sentences on a deck whose frequencies are farther off than those of a careful model.

    The second value names the cause outside the catalogue that they show, "" if they show none.

    Parameters
    ----------
    rows : frequencies of the test and of the deck, as it is written
    model : this deck
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
    """Share of bending of the shells at folds in the strain energy of modes (r,).

    Parameters
    ----------
    frequency : (r,)   of modes of the model; the nearest is taken [Hz]
    """
    at = np.abs(model.modes.frequency[:, None] - frequency).argmin(axis=0)
    phi, built, made = model.modes.shapes[:, at], model.structure, model.assembly
    _, bending = thickness_split(made, shell.geometry(made.points, made.shells))
    u = np.asarray(built.T @ phi).reshape(len(made.points), 6, -1)[made.shells.nodes]
    u = u.reshape(len(bending), -1, len(at))
    energy = np.einsum("eir,eir->er", u, bending @ u)
    own = energy[share_at_folds(made.points, made.shells.nodes) > 0].sum(axis=0)
    return np.asarray(own / np.einsum("nr,nr->r", phi, built.system.K @ phi))
