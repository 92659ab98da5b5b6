"""Draws docs/rooms.png: every room on its floor, from the imports as they are now."""

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
}
COLOUR = {False: "#f4efe6", True: "#dfe9f2"}  # a room of chladni; a package that builds on it


def room(name: tuple[str, ...]) -> str | None:
    """The room of a module; None for ground and the package's own face."""
    if name[0] != "chladni":
        return name[0]
    return name[1] if len(name) > 2 or (len(name) == 2 and name[1] not in GROUND) else None


def needs() -> dict[str, set[str]]:
    """Which rooms every room imports from."""
    out: dict[str, set[str]] = defaultdict(set)
    for base in (ROOT / "src", ROOT / "envs"):
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


def main() -> None:
    """One box a room, arrows down to what it uses on the next floors."""
    rooms = needs()
    level = floors(rooms)
    by_floor: dict[int, list[str]] = defaultdict(list)
    for name, k in sorted(level.items()):
        by_floor[k].append(name)
    figure, axes = plt.subplots(figsize=(10, 9))
    at = {
        n: ((j + 1) / (len(row) + 1), k) for k, row in by_floor.items() for j, n in enumerate(row)
    }
    for name, below in rooms.items():
        for other in below:
            (x0, y0), (x1, y1) = at[name], at[other]
            axes.plot([x0, x1], [y0 - 0.2, y1 + 0.2], color="0.8", lw=0.7, zorder=0)
    for name, (x, y) in at.items():
        box = {"boxstyle": "round", "fc": COLOUR[name.startswith("chladni_")]}
        axes.text(x, y, name, ha="center", va="center", bbox=box)
    axes.set_axis_off()
    axes.set_ylim(-0.6, max(level.values()) + 0.6)
    figure.savefig(ROOT / "docs" / "rooms.png", dpi=90, bbox_inches="tight")


if __name__ == "__main__":
    main()
