"""The tailgate's decks and its formed thickness, bit for bit, with their checksums.

Run from the checkout: ``python meshes/make_tailgate.py [FOLDER]``; it writes the three files into
``meshes/`` (or FOLDER) and prints the lines of ``README.md``'s table.
"""

import hashlib
import sys
from dataclasses import replace
from pathlib import Path

from chladni.io.dyna import write_keyword
from chladni.io.nastran import write_assembly
from chladni.units import units
from chladni_specimens.tailgate.design import TailgateDesign
from chladni_specimens.tailgate.formed_thickness import forming_mesh
from chladni_specimens.tailgate.skin import Skin
from chladni_specimens.tailgate.tailgate import tailgate

ORIGIN = "`meshes/make_tailgate.py`"
FILES = {
    "tailgate_30mm.bdf": "nominal tailgate, coarse (30 mm)",
    "tailgate_20mm.bdf": "nominal tailgate, middle (20 mm)",
    "tailgate_formed.k": "thickness after forming on a mesh of its own, LS-DYNA keywords",
}


def make(folder: Path) -> None:
    """Write the three files."""
    for size in (30, 20):
        made = tailgate(TailgateDesign(size=size * 1e-3))
        rounded = replace(made, points=made.points.round(7))  # past a processor's last bits
        write_assembly(rounded, folder / f"tailgate_{size}mm.bdf", units("mm-t-s"))
    write_keyword(folder / "tailgate_formed.k", forming_mesh(Skin.of(TailgateDesign())), "mm-t-s")


def checksum(path: Path) -> str:
    """The file's SHA-256."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


if __name__ == "__main__":
    place = Path(sys.argv[1] if len(sys.argv) > 1 else Path(__file__).parent)
    make(place)
    for name, what in FILES.items():
        row = f"| {name} | {ORIGIN}, {what} | MIT | {checksum(place / name)} |"
        sys.stdout.write(row + "\n")
