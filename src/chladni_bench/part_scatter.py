"""Scatter between articles: E and t of every part, adhesive, every single weld; its size."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from chladni.effects.calibration_parameters import scaled_material
from chladni.model.assembly import Assembly
from chladni.model.properties import (
    BeamSection,
    Part,
    ShellSection,
    SolidSection,
)

PART, ADHESIVE, WELD = 0.01, 0.1, 0.3  # standard deviations of ln E (and of ln t of sheets)
WELDS = "spot welds"  # part in which every solid is a weld of its own
TWICE = 2.0  # least change of responses by an effect, over that by scatter
FULL = 0.15  # scatter beyond which the measure saturates [rms decades]

Scales = dict[str, dict[str, float]]  # {part: {"E": factor, "t": factor}}
Draw = Callable[[Assembly, np.random.Generator], tuple[Assembly, Scales]]


def scattered_parts(assembly: Assembly, rng: np.random.Generator) -> tuple[Assembly, Scales]:
    """Another article of the same drawing, and log-normal factors on E and t of every part.

    E and t of a sheet or tube vary by 1 %, E of adhesive by 10 %, of each weld by 30 %.
    """
    scales: Scales = {}
    for part in assembly.parts:
        drawn = rng.normal(size=2)
        if not isinstance(part.section, SolidSection):
            E, t = np.exp(PART * drawn)
            scales[part.name] = {"E": float(E), "t": float(t)}
        elif part.name != WELDS:
            scales[part.name] = {"E": float(np.exp(ADHESIVE * drawn[0]))}
    return _each_weld(scaled_parts(assembly, scales), rng), scales


def decades_apart(one: np.ndarray, other: np.ndarray) -> float:
    """Root mean square of |log10 (H_1 / H_2)| over all lines and channels, phase included."""
    ratio = np.log(one / other)
    return float(np.sqrt(np.mean(np.abs(ratio) ** 2)) / np.log(10))


def recognisable(scatter: float) -> float:
    """Change of responses from which an effect can be recognised, over that by scatter [decades].

    It is twice the scatter, or twice ``FULL`` where that is less.
    """
    return TWICE * min(scatter, FULL)


def scaled_parts(assembly: Assembly, scales: Scales) -> Assembly:
    """The assembly with E and t (of tubes: the wall) of its parts times these factors."""
    parts = tuple(_scaled(p, scales.get(p.name, {})) for p in assembly.parts)
    t = np.array([scales.get(p.name, {}).get("t", 1.0) for p in assembly.parts])
    shells = assembly.shells
    thicker = shells.thickness * t[shells.part][:, None] if len(shells) else shells.thickness
    return replace(assembly.with_parts(parts), shells=replace(shells, thickness=thicker))


def _scaled(part: Part, scale: dict[str, float]) -> Part:
    section, E, t = part.section, scale.get("E", 1.0), scale.get("t", 1.0)
    if isinstance(section, ShellSection):
        sheet = section.membrane
        assert sheet is not None
        return part.with_section(
            membrane=scaled_material(sheet, "E", E),
            bending=scaled_material(sheet, "E", E),
            thickness=section.thickness * t,
        )
    if isinstance(section, BeamSection):
        sizes = {name: getattr(section, name) * t for name in ("area", "I1", "I2", "I12", "J")}
        return part.with_section(material=scaled_material(section.material, "E", E), **sizes)
    return part.with_section(material=scaled_material(section.material, "E", E))


def _with_parts_of_solids(
    assembly: Assembly, chosen: np.ndarray, parts: list[Part], kind: int
) -> Assembly:
    """Solids ``chosen`` of one family each on a new part of its own; ids follow the last."""
    first = 1 + max(p.id for p in assembly.parts)
    new = [replace(p, id=first + k) for k, p in enumerate(parts)]
    group = assembly.solids[kind]
    part = group.part.copy()
    part[chosen] = len(assembly.parts) + np.arange(len(new))
    solids = list(assembly.solids)
    solids[kind] = replace(group, part=part)
    return replace(assembly, parts=(*assembly.parts, *new), solids=tuple(solids))


def _each_weld(assembly: Assembly, rng: np.random.Generator) -> Assembly:
    """The assembly with a material of its own for every solid of the welds' part."""
    names = [p.name for p in assembly.parts]
    if WELDS not in names:
        return assembly
    p = names.index(WELDS)
    for kind, group in enumerate(assembly.solids):
        mine = np.flatnonzero(group.part == p)
        factors = np.exp(WELD * rng.normal(size=len(mine)))
        parts = [_scaled(assembly.parts[p], {"E": float(f)}) for f in factors]
        assembly = _with_parts_of_solids(assembly, mine, parts, kind)
    return assembly
