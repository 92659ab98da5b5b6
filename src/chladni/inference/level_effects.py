"""Friction and clearance named from levels of excitation, and their likely place in the deck."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..effects.estimate import Estimate, Location
from ..ema.level_study import EFFECT, LevelStudy, ModeStudy
from ..ema.level_table import level_tables
from ..fem.energy import part_energies
from ..fem.modelled import Modelled
from .result import NamedEffect

CLAIM = {
    "joint-friction": "a joint slips as it moves: less stiffness and more damping at higher levels",
    "rattle": "two parts touch when they move far enough: a clearance closes",
}
NEAR_LN_F = 0.2  # of ln f: a mode of the deck farther away is not the one that was measured
HOLDS = 0.05  # of the strain energy: parts with less are not named
JOINTS = "springs and bushes"
NOWHERE = "levels alone do not show where"


def level_effects(study: LevelStudy, model: Modelled) -> tuple[NamedEffect, ...]:
    """Friction or clearance, one effect for all modes that show it; none for other signatures.

    Modes of the calibrated deck give the strain energy of each part.
    """
    out = []
    for name in dict.fromkeys(EFFECT.get(m.signature, "") for m in study.moving):
        modes = [m for m in study.moving if EFFECT.get(m.signature) == name]
        if name:
            out.append(NamedEffect(name, CLAIM[name], None, _where(modes, model), _numbers(modes)))
    return tuple(out)


def _numbers(modes: Sequence[ModeStudy]) -> tuple[Estimate, ...]:
    """The parameters of the nonlinear element that explains each mode."""
    known = level_tables(LevelStudy(tuple(modes)))
    return tuple(
        Estimate(f"{n.name}, {t.rows[0].frequency_hz:.4g} Hz", n.value, n.unit, n.low, n.high)
        for t in known
        if t.explained
        for n in t.elements[0].numbers
    )


def _where(modes: Sequence[ModeStudy], model: Modelled) -> Location:
    """Parts and joints that hold the strain energy of these modes, from the deck's own modes."""
    f = [float(m.mode.frequency[0]) for m in modes]
    said, parts = [], []
    for hertz, shares in zip(f, energy_shares(model, f), strict=True):
        kept = {name: x for name, x in shares.items() if x >= HOLDS}
        if kept:
            each = ", ".join(f"{100 * x:.0f} % in {name}" for name, x in kept.items())
            said.append(f"the mode at {hertz:.4g} Hz has its strain energy {each}")
            parts += [name for name in kept if name != JOINTS]
    low = min(float(m.mode.frequency.min()) for m in modes)
    high = max(float(m.mode.frequency.max()) for m in modes)
    text = "; ".join([NOWHERE, *said])
    return Location(text, tuple(dict.fromkeys(parts)), band_hz=(low, high))


@dataclass(frozen=True)
class LinearJoint:
    """K and GE, common to all springs and bushes, that reproduce a mode at one level."""

    # mode_hz, level: frequency at the lowest level [Hz], and the level [N] or [m/s²]
    mode_hz: float
    level: float
    stiffness: float  # factor on K of the deck, which is that of the level that was fitted
    loss: float  # GE of the joints; other losses stay in the damping of the mode
    share: float  # share of the mode's strain energy in springs and bushes


def linear_joints(
    study: LevelStudy, model: Modelled, fitted: float | None
) -> tuple[LinearJoint, ...]:
    """K and GE of springs and bushes at each level, where friction or clearance may sit in them.

    The element's κ is a share of the mode's stiffness.  Joints that hold the share e of the mode's
    strain energy produce κ with K (1 + κ'/e) and GE = κ''/(e + κ'), to first order.  K is that of
    the deck at the level ``fitted``.
    """
    known = [
        t for one, t in zip(study.modes, level_tables(study), strict=True)
        if one in study.moving and one.signature in EFFECT and one.explained is not None
    ]  # fmt: skip
    f = [t.rows[0].frequency_hz for t in known]
    out: list[LinearJoint] = []
    for t, hertz, shares in zip(known, f, energy_shares(model, f), strict=True):
        e = shares.get(JOINTS, 0.0)
        kappa = [(r.level, e + (r.stiffness or 0.0), r.loss or 0.0) for r in t.rows]
        if e < HOLDS or min(real for _, real, _ in kappa) <= 0:
            continue
        base = next((real for level, real, _ in kappa if level == fitted), kappa[0][1])
        out += [LinearJoint(hertz, level, real / base, loss / real, e)
                for level, real, loss in kappa]  # fmt: skip
    return tuple(out)


def joint_comment(joints: Sequence[LinearJoint]) -> str:
    """The linear joints as comments of a deck."""
    lines = ["Joints over levels of excitation: values of every spring and bush in a linear deck."]
    for j in joints:
        lines.append(
            f"mode near {j.mode_hz:.5g} Hz, level {j.level:g}: K times {j.stiffness:.4f}, "
            f"GE {j.loss:.4f}"
        )
    return "\n".join(lines)


def energy_shares(model: Modelled, frequency: Sequence[float]) -> list[dict[str, float]]:
    """Shares of the strain energy of the deck's modes nearest to frequencies (k,) [Hz].

    They are in order, the largest first; none if no mode is near.
    """
    if not len(frequency):
        return []
    away = np.abs(np.log(np.maximum(model.modes.frequency, 1e-9)[:, None] / frequency))
    nearest, near = away.argmin(axis=0), away.min(axis=0) <= NEAR_LN_F
    share = part_energies(model.structure, model.modes.shapes[:, nearest]).T
    known = near & np.isfinite(share).all(axis=1)
    return [_named(model, one) if t else {} for one, t in zip(share, known, strict=True)]


def _named(model: Modelled, share: np.ndarray) -> dict[str, float]:
    named = {p.name: float(x) for p, x in zip(model.assembly.parts, share, strict=True)}
    named[JOINTS] = 1.0 - float(share.sum())
    return dict(sorted(named.items(), key=lambda pair: -pair[1]))
