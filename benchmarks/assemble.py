"""Reading and assembling 100 000 quads, in processor time of one thread.

    python benchmarks/assemble.py

The plate lies in the axes or is turned out of them: in the axes membrane and bending part, and the
zeros that leaves are taken out of the sum.
"""

import os

os.environ |= dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"), "1")

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from chladni.fem.assemble import structure
from chladni.io.nastran import read_deck, write_assembly
from chladni.units import units
from chladni_specimens.plates import plate
from timing import timed


def main() -> None:
    """Print the table."""
    flat = plate(1.0, 1.0, 317, 316, 1e-3)
    turn, _ = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))
    turned = replace(flat, points=flat.points @ turn)
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "plate.bdf"
        write_assembly(flat, deck, units("SI"))
        rows = [
            ("read the deck", lambda: read_deck(deck)),
            ("assemble, in the axes", lambda: structure(flat)),
            ("assemble, turned", lambda: structure(turned)),
        ]
        print(f"{len(flat.shells)} quads\n\n| step | seconds |\n|---|---|")
        for name, call in rows:
            print(f"| {name} | {timed(call, 3)[0]:.2f} |", flush=True)


if __name__ == "__main__":
    main()
