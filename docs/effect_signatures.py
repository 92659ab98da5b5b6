"""The signature of every effect: how it moves a response and the frequencies of a small structure.

One function serves all effects: it puts each into the article by the function that the virtual
bench conceals it with, and compares the article before and after.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

SEED = 5
TOP, LINES, DAMPING = 300.0, 900, 0.01  # Hz; of the response; of critical
RIGID = 5.0  # Hz, below which a free structure moves as a whole
ALIKE = 0.5  # MAC from which two modes are a pair


@dataclass(frozen=True, eq=False)
class Signature:
    """Responses and frequencies without and with an effect.

    Attributes
    ----------
    channel : label of the output at which the response changes most
    frequency, before, after : (n,) Hz, accelerance [m/s²/N]
    modes, shifts : (r,) frequency without the effect [Hz], change of it [%]; nan: no pair
    truth : what was put in, by the names that the effect reports
    """

    channel: str
    frequency: np.ndarray
    before: np.ndarray
    after: np.ndarray
    modes: np.ndarray
    shifts: np.ndarray
    truth: Mapping[str, float]


def signature(family: Any, article: Any) -> Signature:
    """Put an effect into an article as the virtual bench does, and compare both."""
    from chladni.workflows.frf import frf
    from chladni.workflows.loaded_model import Model

    given = family.conceal(article, np.random.default_rng(SEED))
    without, with_it = (Model(Path(family.name), one.assembly) for one in (article, given))
    labels = [f"{grid}:+Z" for grid in article.grids_at(article.outputs)]
    (driven,) = article.grids_at(np.array([article.drive[0]]))
    f = np.linspace(TOP / LINES, TOP, LINES)
    before, after = (
        frf(model, labels, [f"{driven}:+Z"], f, DAMPING).frfs[0].to("accelerance").values[:, :, 0]
        for model in (without, with_it)
    )
    before, after = before * article.gains, after * given.gains
    k = int(np.abs(np.log(np.maximum(np.abs(after / before), 1e-300))).mean(axis=0).argmax())
    modes, shifts = _shifts(without, with_it)
    label = f"{article.outputs[k]}:+Z"  # by the deck, which the page shows
    return Signature(label, f, before[:, k], after[:, k], modes, shifts, given.truth["parameters"])


def _shifts(without: Any, with_it: Any) -> tuple[np.ndarray, np.ndarray]:
    """Elastic frequencies [Hz] and how far each moves [%], by the MAC over common grids."""
    both = [(m, m.solved(TOP).modes) for m in (without, with_it)]
    ids = np.intersect1d(*(m.assembly.ids for m, _ in both))
    (f, phi), (g, psi) = (
        (modes.frequency, m.motion(modes.shapes)[m.assembly.rows(ids)].reshape(-1, len(modes)))
        for m, modes in both
    )
    phi, psi = (x / np.linalg.norm(x, axis=0) for x in (phi, psi))
    mac = (phi.T @ psi) ** 2
    rows, columns = linear_sum_assignment(-mac)
    partner = np.full(len(f), np.nan)
    good = mac[rows, columns] > ALIKE
    partner[rows[good]] = g[columns[good]]
    elastic = (f > RIGID) & (f <= TOP)
    return f[elastic], 100 * (partner[elastic] / f[elastic] - 1)


def draw(path: Path, one: Signature) -> Path:
    """Plot the response without and with the effect, and the shift of every frequency."""
    from matplotlib.figure import Figure

    from chladni.view.paper import AFTER, LEGEND, TEST

    figure = Figure(figsize=(8.2, 2.7))
    left, right = figure.subplots(
        1, 2, width_ratios=(1.7, 1),
        gridspec_kw={"left": 0.08, "right": 0.99, "bottom": 0.22, "top": 0.9, "wspace": 0.14},
    )  # fmt: skip
    left.semilogy(one.frequency, np.abs(one.before), color=TEST, lw=1.0, label="without")
    left.semilogy(one.frequency, np.abs(one.after), color=AFTER, lw=1.3, label="with the effect")
    left.set(xlabel="frequency [Hz]", ylabel="|H| [m/s²/N]", xlim=(0, TOP))
    left.set_title(f"response at {one.channel}", loc="left", fontsize=9)
    left.legend(**LEGEND)
    place = np.arange(len(one.modes))
    right.bar(place, np.nan_to_num(one.shifts), color=AFTER, width=0.7)
    for k in place[~np.isfinite(one.shifts)]:
        right.text(k, 0, "×", ha="center", va="center", color=TEST)
    right.axhline(0, color=TEST, lw=0.8)
    right.set_xticks(place, [f"{f:.0f}" for f in one.modes], rotation=60, fontsize=7)
    most = max(0.1, float(np.nanmax(np.abs(one.shifts), initial=0.0)))
    right.set(ylim=(-1.15 * most, 1.15 * most), xlabel="mode [Hz]")
    right.set_title("shift of its frequency [%]", loc="left", fontsize=9)
    for ax in (left, right):
        ax.grid(lw=0.3, alpha=0.5)
        ax.tick_params(labelsize=8)
        ax.minorticks_off()
    figure.savefig(path, dpi=110)
    return path
