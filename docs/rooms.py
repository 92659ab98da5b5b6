"""Draws docs/rooms.png: every room on its floor, from the imports as they are now.

A line is left out where other lines lead from the one room to the other.
"""

import ast
from collections import defaultdict
from pathlib import Path

import matplotlib.pyplot as plt

ROOT = Path(__file__).parents[1]
GROUND = {
    "address_space",
    "errors",
    "arrays",
    "dofs",
    "units",
    "output",
    "progress",
    "parallel",
    "results",
    "extensions",
    "arguments",
    "own_folder",
}
ROOM, PACKAGE, PROOF = "#f4efe6", "#dfe9f2", "#e2f0dc"  # in chladni; on it; not in the wheel


def room(name: tuple[str, ...]) -> str | None:
    """The room of a module; None for ground and the package's own face."""
    if name[0] != "chladni":
        return name[0]
    return name[1] if len(name) > 2 or (len(name) == 2 and name[1] not in GROUND) else None


def needs() -> dict[str, set[str]]:
    """Which rooms every room imports from."""
    out: dict[str, set[str]] = defaultdict(set)
    for base in (ROOT / "src", ROOT / "envs", ROOT / "evidence"):
        for path in base.rglob("*.py"):
            own = path.relative_to(base).with_suffix("").parts
            here = room(own)
            if here is None or own[1] in ("__init__", "__main__", *GROUND):
                continue
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if not isinstance(node, ast.ImportFrom) or node.module is None:
                    continue
                up = own[: len(own) - node.level] if node.level else ()
                there = room((*up, *node.module.split(".")))
                ours = there and (ROOT / "src/chladni" / there).is_dir()
                if there and there != here and (ours or there.startswith("chladni_")):
                    out[here].add(there)
    return out


def floors(rooms: dict[str, set[str]]) -> dict[str, int]:
    """The longest way down from every room."""
    everyone = set(rooms) | {r for below in rooms.values() for r in below}
    level = dict.fromkeys(everyone, 0)
    for _ in everyone:
        level = {r: 1 + max((level[b] for b in rooms.get(r, ())), default=-1) for r in everyone}
    return level


def below(room: str, rooms: dict[str, set[str]]) -> set[str]:
    """Every room that a room uses, itself or through another."""
    used = rooms.get(room, set())
    return used.union(*(below(r, rooms) for r in used))


def colour(room: str) -> str:
    """The colour of a box."""
    if room == "chladni_evidence":
        return PROOF
    return PACKAGE if room.startswith("chladni_") else ROOM


def main() -> None:
    """One box a room, lines down to what it uses."""
    rooms = needs()
    level = floors(rooms)
    by_floor: dict[int, list[str]] = defaultdict(list)
    for name, k in sorted(level.items()):
        by_floor[k].append(name)
    figure, axes = plt.subplots(figsize=(10, 9))
    at = {
        n: ((j + 1) / (len(row) + 1) + 0.05 * (k % 3 - 1), k)
        for k, row in by_floor.items()
        for j, n in enumerate(row)
    }
    for name, used in rooms.items():
        for other in used - set().union(*(below(r, rooms) for r in used)):
            (x0, y0), (x1, y1) = at[name], at[other]
            axes.plot([x0, x1], [y0 - 0.2, y1 + 0.2], color="0.6", lw=0.9, zorder=0)
    for name, (x, y) in at.items():
        box = {"boxstyle": "round", "fc": colour(name)}
        axes.text(x, y, name, ha="center", va="center", bbox=box)
    axes.set_axis_off()
    axes.set_ylim(-0.6, max(level.values()) + 0.6)
    figure.savefig(ROOT / "docs" / "rooms.png", dpi=90, bbox_inches="tight")


if __name__ == "__main__":
    main()
